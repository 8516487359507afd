#include "apps/rig/collector.h"

#include <algorithm>

#include "io/recording/event_json.h"
#include "io/recording/event_names.h"

namespace shiftrig::rig {

namespace {

// What a shift is judged by (docs/shift-quality.md).
bool matters_for_shifts(std::string_view name) {
    for (const char* prefix :
         {"clutch.", "driver.", "mass.", "body.", "shaft.", "engine.", "controller.", "rig.safe_command"})
        if (name.starts_with(prefix)) return true;
    return false;
}

// Within the reserve nothing is allocated.
SHIFTRIG_TRUSTED_BEGIN
template <class Event>
bool keep(std::vector<Event>& kept, const Event& event) SHIFTRIG_REALTIME {
    if (kept.size() == kept.capacity()) return false;
    kept.push_back(event);
    return true;
}
SHIFTRIG_TRUSTED_END

constexpr std::size_t batch = 64;  // ticks that stay in the cache while they are turned over

}  // namespace

Collector::Collector(const Rig& rig, std::int64_t ticks, const CollectorOptions& options) {
    const auto& table = rig.signals();
    const auto fits = [&](std::size_t signals) {
        return static_cast<std::size_t>(ticks) * (signals + 1) * sizeof(double) <= options.most_bytes;
    };
    const auto wanted = [&](const std::string& name) {
        return options.only.empty() ||
               std::find(options.only.begin(), options.only.end(), name) != options.only.end();
    };
    for (int i = 0; i < table.size(); ++i)
        if (wanted(table.signal(i).name)) signals_.push_back(i);
    if (!fits(signals_.size()))
        std::erase_if(signals_, [&](int i) { return !matters_for_shifts(table.signal(i).name); });
    capacity_ = static_cast<std::size_t>(ticks);
    if (!fits(signals_.size())) capacity_ = options.most_bytes / sizeof(double) / (signals_.size() + 1);

    row_room_ = options.by_the_clock ? capacity_ : std::min(batch, capacity_);
    rows_ = std::make_unique<double[]>(row_room_ * (signals_.size() + 1));
    for (const int signal : signals_) run_.columns.push_back({rig.signals().signal(signal), {}});
    if (!options.by_the_clock) make_room(capacity_);
    plant_events_.reserve(options.most_events);
    rig_events_.reserve(options.most_events);
}

void Collector::take(const Rig& rig) SHIFTRIG_REALTIME {
    if (count_ < capacity_) {
        if (row_count_ == row_room_) turn_over();
        double* row = &rows_[row_count_++ * (signals_.size() + 1)];
        *row++ = rig.sim_time();
        for (const int signal : signals_) *row++ = rig.value(signal);
        ++count_;
    } else {
        ++left_out_;
    }
    events_left_out_ += rig.plant_events_not_kept() + rig.rig_events_not_kept();
    for (const auto& event : rig.plant_events()) events_left_out_ += !keep(plant_events_, event);
    for (const auto& event : rig.rig_events()) events_left_out_ += !keep(rig_events_, event);
}

void Collector::make_room(std::size_t ticks) {
    run_.time.reserve(ticks);
    for (auto& column : run_.columns) column.value.reserve(ticks);
}

SHIFTRIG_TRUSTED_BEGIN  // the columns have their room
    void
    Collector::turn_over() SHIFTRIG_REALTIME {
    const std::size_t width = signals_.size() + 1;
    for (std::size_t first = 0; first < row_count_; first += batch) {
        const std::size_t end = std::min(first + batch, row_count_);
        for (std::size_t i = first; i < end; ++i) run_.time.push_back(rows_[i * width]);
        for (std::size_t c = 0; c < run_.columns.size(); ++c)
            for (std::size_t i = first; i < end; ++i)
                run_.columns[c].value.push_back(rows_[i * width + c + 1]);
    }
    row_count_ = 0;
}
SHIFTRIG_TRUSTED_END

analysis::Run Collector::finish(const Rig& rig) {
    make_room(count_);
    turn_over();
    rows_.reset();
    analysis::Run run = std::move(run_);
    const auto& devices = rig.model().device_names();
    for (const auto& event : plant_events_)
        run.changes.push_back({event,
                               event.device >= 0 ? devices[static_cast<std::size_t>(event.device)] : "",
                               plant::explain(rig.model(), event), std::string(io::name(event.kind)),
                               io::loop_members(event, devices)});
    for (const auto& event : rig_events_) {
        analysis::Change change;
        change.event.time = event.time;
        change.text = explain(rig.signals(), event);
        change.kind = name(event.kind);
        run.changes.push_back(std::move(change));
    }
    std::stable_sort(run.changes.begin(), run.changes.end(),
                     [](const auto& a, const auto& b) { return a.event.time < b.event.time; });
    const auto& setup = rig.setup();
    run.machine = setup.model.description;
    run.model_text = setup.model.text;
    if (setup.scenario) run.identity.emplace_back("scenario", setup.scenario->name);
    run.identity.emplace_back("model", run.machine.name);
    run.identity.emplace_back("kernel", std::string(rig.model().kernel()));
    return run;
}

}  // namespace shiftrig::rig
