#include "io/recording/writer.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

#include "io/lcm/channels.h"
#include "io/recording/event_log.h"
#include "io/recording/records.h"
#include "io/recording/tick_queue.h"

namespace shiftrig::io {

namespace {

constexpr std::size_t write_size = 1u << 20;  // buffered before a write, if the queue is long

bool same_bits(const double* a, const double* b, std::size_t count) {
    return std::memcmp(a, b, count * sizeof(double)) == 0;
}

std::int64_t now_utime() {
    return std::chrono::duration_cast<std::chrono::microseconds>(
               std::chrono::system_clock::now().time_since_epoch())
        .count();
}

}  // namespace

struct RecordingWriter::Implementation {
    Implementation(const std::string& path, const RecordingOptions& chosen) : options(chosen), sink(path) {}

    RecordingOptions options;
    LogSink sink;
    bool wall_clock = false;

    std::optional<TickQueue> queue;
    int ticks_to_keyframe = 0;  // the loop's
    std::atomic<std::int64_t> lost{0};

    std::thread thread;
    std::mutex mutex;
    std::condition_variable log_wakes, room_made;
    bool stop = false, hurry = false;  // under mutex
    std::atomic<bool> failed{false};

    // The log thread's.
    std::optional<RecordEncoder> encoder;
    std::vector<std::byte> buffer;
    std::vector<double> last[3];  // what the log holds so far
    std::int64_t kept = 0, last_tick = -1, last_sim_time_ns = 0;

    std::string outcome;

    void run();
    void drain();
    void encode(const TickQueue::View& view);
    void write_buffer();
};

// ---- the loop's side ------------------------------------------------------------------------------------

RecordingWriter::RecordingWriter(const std::string& path, const RecordingOptions& options)
    : implementation_(std::make_unique<Implementation>(path, options)) {}

RecordingWriter::~RecordingWriter() {
    end();
}

void RecordingWriter::begin(const Manifest& original) {
    auto& self = *implementation_;
    if (self.queue) throw std::logic_error("a recording is begun once");
    Manifest manifest = original;
    if (manifest.start_utime == 0) manifest.start_utime = now_utime();
    self.wall_clock = manifest.wall_clock;
    self.queue.emplace(manifest.inputs.size(), manifest.outputs.size(), manifest.rig.size(),
                       manifest.initial_state.size(), self.options.queue_bytes);
    const std::vector<plant::Signal>* tables[3] = {&manifest.inputs, &manifest.outputs, &manifest.rig};
    for (int t = 0; t < 3; ++t) self.last[t].assign(block_count(tables[t]->size()) * signals_per_block, 0.0);
    self.ticks_to_keyframe = self.options.keyframe_interval;
    self.buffer.reserve(2 * write_size);
    self.encoder.emplace(manifest.start_utime);
    self.last_tick = manifest.first_tick - 1;
    self.last_sim_time_ns = manifest.first_tick * manifest.tick_ns;

    const auto append = [&](ChunkKind kind, const auto& content) {
        self.encoder->append_chunks(self.buffer, kind, std::as_bytes(std::span(content)), self.last_tick,
                                    self.last_sim_time_ns);
    };
    append(ChunkKind::manifest, manifest.to_json());
    append(ChunkKind::model, manifest.model_text);
    append(ChunkKind::scenario, manifest.scenario_text);
    if (!manifest.assembly.empty()) {
        append(ChunkKind::assembly, manifest.assembly);
        append(ChunkKind::history, manifest.history);
    }
    append(ChunkKind::state, manifest.initial_state);
    self.write_buffer();
    if (self.failed) throw RecordingError(self.sink.error());
    self.thread = std::thread([&self] { self.run(); });
}

bool RecordingWriter::tick(const TickRecord& record) SHIFTRIG_REALTIME {
    auto& self = *implementation_;
    if (self.failed.load(std::memory_order_relaxed)) return false;
    // A whole state once in a while, and after a loss, so that a replay can begin again there.
    const bool keyframe = --self.ticks_to_keyframe <= 0 || self.queue->lost_pending() > 0;
    if (!self.queue->push(record, keyframe)) {
        self.lost.fetch_add(1, std::memory_order_relaxed);
        return false;
    }
    if (keyframe) self.ticks_to_keyframe = self.options.keyframe_interval;
    return true;
}

void RecordingWriter::wait_for_room() {
    auto& self = *implementation_;
    if (!self.queue || self.failed) return;
    const std::size_t room = self.queue->free_slots();
    if (room > self.queue->slots() / 2) return;
    std::unique_lock lock(self.mutex);
    self.hurry = true;
    self.log_wakes.notify_one();
    if (room > 0) return;  // the log thread works while the loop goes on
    self.room_made.wait(lock, [&] { return self.queue->free_slots() > 0 || self.failed; });
}

std::int64_t RecordingWriter::lost() const noexcept {
    return implementation_->lost;
}

void RecordingWriter::came_to(const std::string& outcome) {
    implementation_->outcome = outcome;
}

RecordingSummary RecordingWriter::end() {
    auto& self = *implementation_;
    if (self.thread.joinable()) {
        {
            const std::lock_guard lock(self.mutex);
            self.stop = true;
        }
        self.log_wakes.notify_one();
        self.thread.join();
        if (!self.outcome.empty())
            self.encoder->append_chunks(self.buffer, ChunkKind::outcome,
                                        std::as_bytes(std::span(self.outcome)), self.last_tick,
                                        self.last_sim_time_ns);
        record_end_t end{};
        end.ticks = self.kept;
        end.lost = self.lost;
        self.encoder->append(self.buffer, channel::record_end, end, self.last_tick, self.last_sim_time_ns);
        self.write_buffer();
    }
    self.sink.close();
    return {self.kept, self.lost, self.sink.bytes(), self.sink.error()};
}

// ---- the log thread -------------------------------------------------------------------------------------

void RecordingWriter::Implementation::run() {
    bool last_round = false;
    while (!last_round) {
        {
            std::unique_lock lock(mutex);
            log_wakes.wait_for(lock, options.flush_interval, [&] { return stop || hurry; });
            last_round = stop;
            hurry = false;
        }
        drain();
    }
}

void RecordingWriter::Implementation::drain() {
    TickQueue::View view;
    while (queue->front(view)) {
        if (!failed) encode(view);
        queue->pop();
        if (buffer.size() >= write_size) write_buffer();
    }
    write_buffer();
}

void RecordingWriter::Implementation::encode(const TickQueue::View& view) {
    const TickSlot& slot = view.slot;
    const auto append = [&](const char* channel, auto& record) {
        encoder->append(buffer, channel, record, slot.tick, slot.sim_time_ns);
    };
    if (slot.lost_before > 0) {
        record_gap_t gap{};
        gap.lost = slot.lost_before;
        append(channel::record_gap, gap);
    }

    record_tick_t tick{};
    const auto& tables = view.tables;
    for (std::size_t t = 0; t < 3; ++t) {
        for (std::size_t begin = 0; begin < tables[t].size(); begin += signals_per_block) {
            const std::size_t count = std::min(signals_per_block, tables[t].size() - begin);
            double* known = last[t].data() + begin;
            const bool first = kept == 0;
            if (!first && !slot.has_state && same_bits(known, tables[t].data() + begin, count)) continue;
            std::memcpy(known, tables[t].data() + begin, count * sizeof(double));
            record_signals_t signals{};
            signals.table = static_cast<std::int16_t>(t);
            signals.block = static_cast<std::int16_t>(begin / signals_per_block);
            std::memcpy(signals.value, known, sizeof signals.value);
            append(channel::record_signals, signals);
            ++tick.blocks;
        }
    }
    for (int i = 0; i < slot.event_count; ++i) {
        const plant::Event& happened = view.events[i];
        record_event_t event{};
        event.time_s = happened.time;
        event.kind = static_cast<std::int32_t>(happened.kind);
        event.device = happened.device;
        event.torque_nm = happened.torque;
        event.capacity_nm = happened.capacity;
        event.slip_rad_s = happened.slip;
        event.value = happened.value;
        event.members = std::bit_cast<std::int64_t>(happened.members);
        append(channel::record_event, event);
    }
    if (wall_clock) {
        record_timing_t timing{};
        timing.wall_ns = slot.wall_ns;
        timing.lateness_ns = slot.lateness_ns;
        timing.compute_ns = slot.compute_ns;
        append(channel::record_timing, timing);
    }
    if (slot.has_state)
        encoder->append_chunks(buffer, ChunkKind::state, view.state, slot.tick, slot.sim_time_ns);

    tick.events = slot.event_count;
    tick.events_not_kept = slot.events_not_kept;
    tick.overruns = slot.overruns;
    tick.messages_lost = slot.messages_lost;
    tick.torque_residual = slot.certificate.torque_residual;
    tick.constraint_violation = slot.certificate.constraint_violation;
    tick.energy_defect_j = slot.certificate.energy_defect;
    tick.plant_events = slot.certificate.events;
    tick.fall_backs = slot.certificate.fall_backs;
    tick.flags = slot.certificate.flags;
    append(channel::record_tick, tick);
    ++kept;
    last_tick = slot.tick;
    last_sim_time_ns = slot.sim_time_ns;
}

void RecordingWriter::Implementation::write_buffer() {
    if (!buffer.empty() && !sink.write(buffer)) failed = true;
    buffer.clear();
    const std::lock_guard lock(mutex);
    room_made.notify_one();
}

}  // namespace shiftrig::io
