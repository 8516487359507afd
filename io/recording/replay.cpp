#include "io/recording/replay.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include "io/recording/csv.h"
#include "io/recording/event_names.h"

namespace shiftrig::io {

namespace {

bool same_bits(double a, double b) {
    return std::memcmp(&a, &b, sizeof a) == 0;
}

bool agree(double recorded, double replayed, double tolerance) {
    if (tolerance <= 0) return same_bits(recorded, replayed);
    if (std::isnan(recorded) || std::isnan(replayed)) return std::isnan(recorded) && std::isnan(replayed);
    return recorded == replayed ||
           std::abs(replayed - recorded) <= tolerance * std::max(1.0, std::abs(recorded));
}

std::string digits(double value) {
    char text[32];
    return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

// How often a cached operator was found depends on what ran before the recording began, not on the machine.
bool is_bookkeeping(const std::string& name) {
    return name == "certificate.mode_lookups" || name == "certificate.mode_misses";
}

std::string words(const std::vector<std::string>& devices, const plant::Event& e) {
    return std::string(name(e.kind)) +
           (e.device < 0 ? "" : " of " + devices.at(static_cast<std::size_t>(e.device))) + " at " +
           digits(e.time) + " s, torque " + digits(e.torque) + ", capacity " + digits(e.capacity) +
           ", slip " + digits(e.slip) + (e.value == 0 ? "" : ", value " + digits(e.value));
}

bool same_event(const plant::Event& a, const plant::Event& b) {
    return a.kind == b.kind && a.device == b.device && same_bits(a.time, b.time) &&
           same_bits(a.torque, b.torque) && same_bits(a.capacity, b.capacity) && same_bits(a.slip, b.slip) &&
           same_bits(a.value, b.value) && a.members == b.members;
}

// The plant under the recorded inputs.
class Replayer {
  public:
    Replayer(const Manifest& manifest, const plant::Model& model)
        : manifest_(manifest),
          model_(model),
          operators_(model),
          state_(model),
          inputs_(model),
          outputs_(model),
          scratch_(model) {
        if (!state_.restore(model, manifest.initial_state))
            throw RecordingError("starts from a state of " + std::to_string(manifest.initial_state.size()) +
                                 " bytes that does not fit the model's " +
                                 std::to_string(model.state_size()) + ": the machine has another structure");
        for (const auto& signal : manifest.inputs) input_index_.push_back(model.input(signal.name));
        for (const auto& signal : manifest.outputs) output_index_.push_back(model.output(signal.name));
    }

    void step(const std::vector<double>& recorded_inputs) {
        for (std::size_t i = 0; i < input_index_.size(); ++i)
            if (input_index_[i] >= 0)
                inputs_.value[static_cast<std::size_t>(input_index_[i])] = recorded_inputs[i];
        events_.clear();
        for (int substep = 0; substep < manifest_.substeps; ++substep) {
            plant::step(model_, operators_, state_, inputs_, outputs_, scratch_);
            const auto count = std::min(outputs_.event_count, plant::Outputs::event_capacity);
            events_.insert(events_.end(), outputs_.events.begin(), outputs_.events.begin() + count);
        }
        // As much as a tick of the recording keeps.
        events_.resize(std::min(events_.size(), static_cast<std::size_t>(plant::Outputs::event_capacity)));
    }
    bool restore(const std::vector<std::byte>& state) { return state_.restore(model_, state); }

    bool has_output(std::size_t recorded) const { return output_index_[recorded] >= 0; }
    double output(std::size_t recorded) const {
        return outputs_.value[static_cast<std::size_t>(output_index_[recorded])];
    }
    const std::vector<plant::Event>& events() const { return events_; }
    std::span<const std::byte> state() const { return state_.bytes(); }

  private:
    const Manifest& manifest_;
    const plant::Model& model_;
    plant::Operators operators_;
    plant::State state_;
    plant::Inputs inputs_;
    plant::Outputs outputs_;
    plant::Scratch scratch_;
    std::vector<int> input_index_, output_index_;
    std::vector<plant::Event> events_;
};

}  // namespace

ReplayResult replay(RecordingReader& reader, const plant::Model& model, const ReplayOptions& options) {
    const Manifest& manifest = reader.manifest();
    Replayer plant(manifest, model);
    ReplayResult result;
    for (const auto& signal : manifest.outputs) {
        Deviation deviation;
        deviation.signal = signal;
        result.deviations.push_back(deviation);
    }

    RecordedTick tick;
    const auto differ = [&](const std::string& signal, const std::string& recorded,
                            const std::string& replayed, bool damaged) {
        if (!result.first)
            result.first = Difference{
                tick.tick, 1e-9 * static_cast<double>(tick.sim_time_ns), signal, recorded, replayed, damaged};
    };
    bool known = true;  // the plant is where the recorded run was
    while ((!options.stop_at_first || !result.first) && reader.next(tick)) {
        ++result.ticks;
        result.lost += tick.lost_before;
        for (const auto& damage : tick.damages)
            differ(column_name(reader.signal(damage.table, damage.signal)), digits(damage.found),
                   digits(damage.written), true);
        if (tick.lost_before > 0) known = false;
        if (!known) {  // go on from the next state there is
            known = !tick.state.empty() && plant.restore(tick.state);
            continue;
        }
        plant.step(tick.inputs);
        ++result.compared;

        for (std::size_t i = 0; i < tick.outputs.size(); ++i) {
            if (!plant.has_output(i)) continue;
            const double recorded = tick.outputs[i], replayed = plant.output(i);
            Deviation& deviation = result.deviations[i];
            const double apart = std::abs(replayed - recorded);
            ++deviation.count;
            deviation.sum_of_squares += apart * apart;
            if (deviation.worst_tick < 0 || apart > deviation.worst) {
                deviation.worst = apart;
                deviation.worst_tick = tick.tick;
                deviation.recorded = recorded;
                deviation.replayed = replayed;
            }
            if (!agree(recorded, replayed, options.tolerance) && !is_bookkeeping(deviation.signal.name))
                differ(column_name(deviation.signal), digits(recorded), digits(replayed), false);
        }
        if (options.tolerance > 0) continue;
        const auto& events = plant.events();
        for (std::size_t i = 0; i < std::max(events.size(), tick.events.size()); ++i) {
            if (i < events.size() && i < tick.events.size() && same_event(events[i], tick.events[i]))
                continue;
            const auto say = [&](const std::vector<plant::Event>& list) {
                return i < list.size() ? words(manifest.devices, list[i]) : std::string("none");
            };
            differ("event", say(tick.events), say(events), false);
        }
        if (tick.state.empty()) continue;
        const auto state = plant.state();
        const auto apart = std::mismatch(state.begin(), state.end(), tick.state.begin(), tick.state.end());
        if (apart.first != state.end()) {
            const auto at = static_cast<std::size_t>(apart.first - state.begin()) / sizeof(double);
            double replayed = 0, recorded = 0;
            std::memcpy(&replayed, state.data() + at * sizeof(double), sizeof(double));
            std::memcpy(&recorded, tick.state.data() + at * sizeof(double), sizeof(double));
            differ("state[" + std::to_string(at) + "]", digits(recorded), digits(replayed), false);
        }
    }
    result.lost += reader.lost_at_end();
    return result;
}

}  // namespace shiftrig::io
