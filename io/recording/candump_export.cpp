#include <cerrno>
#include <cstdio>
#include <cstring>

#include "io/can/candump.h"
#include "io/can/link.h"
#include "io/model_file.h"
#include "io/recording/candump.h"
#include "io/recording/output_file.h"

namespace shiftrig::io {

namespace {

// A port whose frames go to a file.
class LogPort final : public can::CanPort {
  public:
    LogPort(std::FILE* file, can::Direction direction) : file_(file), direction_(direction) {}
    bool send(std::int64_t now_ns, const can::Frame& frame) SHIFTRIG_REALTIME override {
        write(now_ns, frame);
        return true;
    }
    std::size_t receive(std::int64_t, std::span<can::Frame>) SHIFTRIG_REALTIME override { return 0; }
    can::PortState state() const SHIFTRIG_REALTIME override { return can::PortState::up; }
    can::PortCounters counters() const SHIFTRIG_REALTIME override { return {}; }
    const std::string& description() const noexcept override { return name_; }

  private:
    SHIFTRIG_TRUSTED_BEGIN  // not in the loop: a recording is exported
        void
        write(std::int64_t now_ns, const can::Frame& frame) SHIFTRIG_REALTIME {
        line_.clear();
        can::append_candump_line(line_, frame, now_ns, "can0", direction_);
        std::fwrite(line_.data(), 1, line_.size(), file_);
    }
    SHIFTRIG_TRUSTED_END
    std::FILE* file_;
    can::Direction direction_;
    std::string line_, name_ = "candump";
};

SignalTable table_of(const Manifest& manifest) {
    SignalTable table;
    for (const auto* part : {&manifest.inputs, &manifest.outputs, &manifest.rig})
        for (const auto& signal : *part) table.add(signal);
    return table;
}

}  // namespace

std::int64_t export_candump(RecordingReader& reader, const std::string& path) {
    const Manifest& manifest = reader.manifest();
    const ModelFile model = parse_model(manifest.model_text, manifest.model_path);
    if (!model.can.IsDefined())
        throw InputError(manifest.model_path, 0, 0, "has no stanza `can:`, which says what the frames mean");
    const can::Mapping mapping = can::parse_mapping(model.can, model.path);

    std::FILE* file = open_output(path);
    if (!file) throw RecordingError(path + ": cannot be written: " + std::strerror(errno));
    LogPort by_rig(file, can::Direction::transmitted), by_controller(file, can::Direction::received);
    SignalTable table = table_of(manifest);
    can::LinkOptions options{.address_claim = can::AddressClaim::off, .tick_ns = manifest.tick_ns};
    can::CanLink rig(mapping, by_rig, table, options);
    options.role = can::Role::controller;
    can::CanLink controller(mapping, by_controller, table, options);

    std::int64_t ticks = 0;
    for (RecordedTick tick; reader.next(tick); ++ticks) {
        auto at = table.value.begin();
        for (const auto* part : {&tick.inputs, &tick.outputs, &tick.rig})
            at = std::copy(part->begin(), part->end(), at);
        controller.send(tick.sim_time_ns, table);
        rig.send(tick.sim_time_ns, table);
    }
    const bool failed =
        std::ferror(file) != 0 || (file == stdout ? std::fflush(file) : std::fclose(file)) != 0;
    if (failed) throw RecordingError(path + ": cannot be written: " + std::strerror(errno));
    return ticks;
}

}  // namespace shiftrig::io
