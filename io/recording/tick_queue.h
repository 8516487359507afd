// The queue between the loop and the log thread: one producer, one consumer, slots of equal size sized
// once. Pushing never waits; a tick that finds no slot is counted and announced with the next that does.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "io/recording/writer.h"

namespace shiftrig::io {

struct TickSlot {
    std::int64_t tick, sim_time_ns, overruns, messages_lost, wall_ns, lateness_ns, compute_ns;
    std::int64_t lost_before;  // ticks that found no slot just before this one
    plant::Certificate certificate;
    int event_count, events_not_kept;
    bool has_state;
};

class TickQueue {
  public:
    TickQueue(std::size_t inputs, std::size_t outputs, std::size_t rig, std::size_t state_bytes,
              std::size_t bytes)
        : values_{inputs, outputs, rig},
          state_bytes_(state_bytes),
          slot_bytes_(aligned(sizeof(TickSlot)) + sizeof(double) * (inputs + outputs + rig) +
                      sizeof(plant::Event) * plant::Outputs::event_capacity + aligned(state_bytes)),
          slots_(std::max<std::size_t>(4, bytes / slot_bytes_)),
          memory_(slots_ * slot_bytes_) {}

    std::size_t free_slots() const noexcept {
        return slots_ - (head_.load(std::memory_order_relaxed) - tail_.load(std::memory_order_acquire));
    }
    std::size_t slots() const noexcept { return slots_; }

    // Spans of another size than the queue was made for are taken as far as they fit.
    bool push(const TickRecord& r, bool with_state) SHIFTRIG_REALTIME {
        if (free_slots() == 0) {
            ++lost_pending_;
            return false;
        }
        std::byte* at = memory_.data() + (head_.load(std::memory_order_relaxed) % slots_) * slot_bytes_;
        const auto events = r.events.first(
            std::min(r.events.size(), static_cast<std::size_t>(plant::Outputs::event_capacity)));
        const TickSlot slot{r.tick,
                            r.sim_time_ns,
                            r.overruns,
                            r.messages_lost,
                            r.wall_ns,
                            r.lateness_ns,
                            r.compute_ns,
                            lost_pending_,
                            r.certificate,
                            static_cast<int>(events.size()),
                            r.events_not_kept + static_cast<int>(r.events.size() - events.size()),
                            with_state};
        std::memcpy(at, &slot, sizeof slot);
        at += aligned(sizeof slot);
        const std::span<const double> tables[3] = {r.inputs, r.outputs, r.rig};
        for (int t = 0; t < 3; ++t) {
            copy(at, tables[t].data(), sizeof(double) * std::min(values_[t], tables[t].size()));
            at += sizeof(double) * values_[t];
        }
        copy(at, events.data(), events.size_bytes());
        at += sizeof(plant::Event) * plant::Outputs::event_capacity;
        if (with_state) copy(at, r.state.data(), std::min(state_bytes_, r.state.size()));
        lost_pending_ = 0;
        head_.fetch_add(1, std::memory_order_release);
        return true;
    }

    struct View {
        TickSlot slot;
        std::span<const double> tables[3];  // inputs, outputs, the rig's own
        const plant::Event* events;
        std::span<const std::byte> state;
    };
    // The oldest slot, valid until pop(); false if there is none.
    bool front(View& view) const noexcept {
        const std::size_t tail = tail_.load(std::memory_order_relaxed);
        if (tail == head_.load(std::memory_order_acquire)) return false;
        const std::byte* at = memory_.data() + (tail % slots_) * slot_bytes_;
        std::memcpy(&view.slot, at, sizeof view.slot);
        at += aligned(sizeof view.slot);
        for (int t = 0; t < 3; ++t) {
            view.tables[t] = {reinterpret_cast<const double*>(at), values_[t]};
            at += sizeof(double) * values_[t];
        }
        view.events = reinterpret_cast<const plant::Event*>(at);
        at += sizeof(plant::Event) * plant::Outputs::event_capacity;
        view.state = {at, view.slot.has_state ? state_bytes_ : 0};
        return true;
    }
    void pop() noexcept { tail_.fetch_add(1, std::memory_order_release); }

    std::int64_t lost_pending() const noexcept { return lost_pending_; }

  private:
    static constexpr std::size_t aligned(std::size_t size) { return (size + 15) / 16 * 16; }
    static void copy(std::byte* to, const void* from, std::size_t size) noexcept {
        if (size > 0) std::memcpy(to, from, size);
    }

    std::size_t values_[3];
    std::size_t state_bytes_, slot_bytes_, slots_;
    std::vector<std::byte> memory_;
    std::int64_t lost_pending_ = 0;  // producer's
    std::atomic<std::size_t> head_{0}, tail_{0};
};

}  // namespace shiftrig::io
