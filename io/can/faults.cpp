#include "io/can/faults.h"

#include <algorithm>
#include <cmath>

#include "io/can/link_data.h"
#include "io/can/mapping.h"

namespace shiftrig::io::can {

namespace {

constexpr std::size_t kMostWaiting = 4096;

// SplitMix64: small, seeded, the same everywhere.
struct Random {
    std::uint64_t state;
    std::uint64_t next() SHIFTRIG_REALTIME {
        state += 0x9E3779B97F4A7C15;
        std::uint64_t z = state;
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
        return z ^ (z >> 31);
    }
    double unit() SHIFTRIG_REALTIME { return static_cast<double>(next() >> 11) * 0x1p-53; }  // [0, 1)
};

}  // namespace

struct FaultyPort::Active {
    BusFault fault;
    Random random;
    // The message meant, matched as a receiver would (by PGN where it is J1939).
    bool any = true;
    Filter filter;
    std::optional<SignalCodec> signal, counter;
    std::optional<ChecksumField> checksum;

    bool running = false, frozen = false;
    std::uint64_t frames = 0, frozen_raw = 0;
    std::int64_t next_babble_ns = 0;
    std::optional<Frame> held[2];  // reorder, by Way

    bool concerns(const Frame& frame, Way way) const SHIFTRIG_REALTIME {
        return running && (way == Way::received ? fault.on_received : fault.on_sent) &&
               (any || filter.passes(frame));
    }
    void seal(Frame& frame) const SHIFTRIG_REALTIME {
        if (checksum) checksum->codec.put(frame.data.data(), checksum->compute(frame));
    }
    // Holds `codec` at the value it had in the first frame.
    void hold(Frame& frame, const SignalCodec& codec) SHIFTRIG_REALTIME {
        if (!frozen) frozen_raw = codec.raw(frame.data.data());
        frozen = true;
        codec.put(frame.data.data(), frozen_raw);
        seal(frame);
    }
};

FaultyPort::FaultyPort(CanPort& port, const FaultPlan& plan, const Mapping& mapping)
    : port_(port), plan_(plan) {
    for (std::size_t i = 0; i < plan_.faults.size(); ++i) {
        Active active{};
        active.fault = plan_.faults[i];
        active.random.state = plan_.seed * 0xD1342543DE82EF95 + i;
        const dbc::Message* layout = mapping.database.find(active.fault.message);
        if (layout) {
            active.any = false;
            active.filter = {layout->id, layout->extended ? 0x1FFFFFFFU : 0x7FFU, layout->extended};
            if (mapping.is_j1939(*layout))
                active.filter.mask = is_pdu1(layout->id) ? 0x03FF0000U : 0x03FFFF00U;
            if (const dbc::Signal* signal = layout->find(active.fault.signal))
                active.signal = SignalCodec(*signal, false);
            if (const MessageMap* map = mapping.find(layout->name)) {
                if (!map->counter.empty()) active.counter = SignalCodec(*layout->find(map->counter), false);
                if (!map->checksum.empty())
                    active.checksum = ChecksumField{SignalCodec(*layout->find(map->checksum), false),
                                                    map->formula, active.counter};
            }
        }
        faults_.push_back(std::move(active));
    }
    for (auto& heap : waiting_) heap.reserve(kMostWaiting);
}

FaultyPort::~FaultyPort() = default;

// Begins and ends faults, lets the babbler speak, sends what was delayed.
void FaultyPort::advance(std::int64_t now_ns) SHIFTRIG_REALTIME {
    off_ = false;
    for (std::size_t i = 0; i < faults_.size(); ++i) {
        Active& active = faults_[i];
        const bool running = now_ns >= active.fault.from_ns && now_ns < active.fault.until_ns;
        if (running != active.running) {
            active.running = running;
            active.frozen = false;
            active.next_babble_ns = now_ns;
            events_.push({now_ns, static_cast<int>(i), running, active.frames});
            if (running && active.fault.kind == FaultKind::bus_off) ++bus_offs_;
            for (const Way way : {Way::received, Way::sent}) {
                auto& held = active.held[static_cast<std::size_t>(way)];
                if (held) enqueue(*held, now_ns, way);
                held.reset();
            }
        }
        if (!running) continue;
        if (active.fault.kind == FaultKind::bus_off) off_ = true;
        if (active.fault.kind != FaultKind::babble) continue;
        const auto gap_ns = static_cast<std::int64_t>(1e9 / active.fault.rate_hz);
        for (; active.next_babble_ns <= now_ns; active.next_babble_ns += gap_ns) {
            Frame frame;
            frame.id = active.fault.id;
            frame.extended = true;
            frame.length = 8;
            for (auto& byte : frame.data) byte = static_cast<std::uint8_t>(active.random.next());
            ++active.frames;
            enqueue(frame, now_ns, Way::received);  // heard by us …
            port_.send(now_ns, frame);              // … and by everybody else
        }
    }
    Frame frame;
    while (take(now_ns, Way::sent, frame)) off_ ? void(++dropped_sending_) : void(port_.send(now_ns, frame));
    // What arrives while nobody listens is lost, however long it was under way.
    while (off_ && take(now_ns, Way::received, frame)) ++dropped_receiving_;
}

SHIFTRIG_TRUSTED_BEGIN
void FaultyPort::enqueue(const Frame& frame, std::int64_t due_ns, Way way) SHIFTRIG_REALTIME {
    auto& heap = waiting_[static_cast<std::size_t>(way)];
    if (heap.size() == kMostWaiting) {
        ++(way == Way::sent ? dropped_sending_ : dropped_receiving_);
        return;
    }
    heap.push_back({due_ns, order_++, frame});  // within the reserved capacity
    std::push_heap(heap.begin(), heap.end());
}
SHIFTRIG_TRUSTED_END

bool FaultyPort::take(std::int64_t now_ns, Way way, Frame& frame) SHIFTRIG_REALTIME {
    auto& heap = waiting_[static_cast<std::size_t>(way)];
    if (heap.empty() || heap.front().due_ns > now_ns) return false;
    frame = heap.front().frame;
    std::pop_heap(heap.begin(), heap.end());
    heap.pop_back();
    return true;
}

void FaultyPort::pass(const Frame& original, std::int64_t now_ns, Way way) SHIFTRIG_REALTIME {
    Frame frame = original;
    std::int64_t due_ns = now_ns;
    int copies = 1;
    Active* holder = nullptr;
    for (Active& active : faults_) {
        if (!active.concerns(frame, way)) continue;
        if (active.fault.probability < 1 && active.random.unit() >= active.fault.probability) continue;
        ++active.frames;
        switch (active.fault.kind) {
            case FaultKind::drop:
                return;
            case FaultKind::delay:
                due_ns += active.fault.by_ns;
                break;
            case FaultKind::jitter:
                due_ns +=
                    static_cast<std::int64_t>(active.random.unit() * static_cast<double>(active.fault.by_ns));
                break;
            case FaultKind::duplicate:
                ++copies;
                break;
            case FaultKind::reorder:
                holder = &active;
                break;
            case FaultKind::corrupt:
                for (int i = 0; i < active.fault.bits && frame.length > 0; ++i) {
                    const std::uint64_t bit = active.random.next() % (8U * frame.length);
                    frame.data[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
                }
                break;
            case FaultKind::freeze:
                if (active.signal) active.hold(frame, *active.signal);
                break;
            case FaultKind::wrong_counter:
                if (active.counter) active.hold(frame, *active.counter);
                break;
            case FaultKind::wrong_checksum:
                if (active.checksum) {
                    std::uint8_t* data = frame.data.data();
                    active.checksum->codec.put(data, active.checksum->codec.raw(data) ^ 1U);
                }
                break;
            case FaultKind::babble:
            case FaultKind::bus_off:
                break;
        }
    }
    if (holder) {
        auto& held = holder->held[static_cast<std::size_t>(way)];
        if (!held) {
            held = frame;
            return;
        }
    }
    for (int i = 0; i < copies; ++i) enqueue(frame, due_ns, way);
    for (Active& active : faults_) {  // whoever was held back follows now
        auto& held = active.held[static_cast<std::size_t>(way)];
        if (held) enqueue(*held, due_ns, way);
        held.reset();
    }
}

bool FaultyPort::send(std::int64_t now_ns, const Frame& frame) SHIFTRIG_REALTIME {
    advance(now_ns);
    if (off_) {
        ++dropped_sending_;
        return false;
    }
    pass(frame, now_ns, Way::sent);
    Frame due;
    bool taken = true;
    while (take(now_ns, Way::sent, due)) taken = port_.send(now_ns, due) && taken;
    return taken;
}

std::size_t FaultyPort::receive(std::int64_t now_ns, std::span<Frame> frames) SHIFTRIG_REALTIME {
    advance(now_ns);
    for (std::size_t count = buffer_.size(); count == buffer_.size();) {
        count = port_.receive(now_ns, buffer_);
        for (std::size_t i = 0; i < count; ++i)
            if (off_)
                ++dropped_receiving_;
            else
                pass(buffer_[i], now_ns, Way::received);
    }
    std::size_t taken = 0;
    while (taken < frames.size() && take(now_ns, Way::received, frames[taken])) ++taken;
    return taken;
}

void FaultyPort::archive(Archive& a) {
    for (Active& active : faults_)
        a(active.random, active.running, active.frozen, active.frames, active.frozen_raw,
          active.next_babble_ns, active.held);
    for (auto& heap : waiting_) {
        std::size_t count = heap.size();
        a(count);
        heap.resize(std::min(count, kMostWaiting));
        for (Waiting& entry : heap) a(entry);
    }
    a(order_, dropped_sending_, dropped_receiving_, off_, bus_offs_);
    events_.archive(a);
}

PortState FaultyPort::state() const SHIFTRIG_REALTIME {
    return off_ ? PortState::bus_off : port_.state();
}

PortCounters FaultyPort::counters() const SHIFTRIG_REALTIME {
    PortCounters counters = port_.counters();
    counters.send_dropped += dropped_sending_;
    counters.receive_dropped += dropped_receiving_;
    counters.bus_off_events += bus_offs_;
    return counters;
}

bool FaultyPort::next_event(FaultEvent& event) SHIFTRIG_REALTIME {
    if (events_.empty()) return false;
    event = events_.front();
    events_.pop();
    return true;
}

}  // namespace shiftrig::io::can
