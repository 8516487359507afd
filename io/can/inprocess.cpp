#include "io/can/inprocess.h"

#include <stdexcept>

namespace shiftrig::io::can {

namespace {

// Who wins arbitration: bits are compared from the front and 0 is dominant. After the eleven base bits a
// standard frame sends RTR and a dominant IDE, an extended one two recessive bits, then its lower 18 bits.
std::uint64_t arbitration_key(const Frame& frame) noexcept {
    const std::uint64_t rtr = frame.remote ? 1 : 0;
    if (!frame.extended) return (std::uint64_t{frame.id} << 21) | (rtr << 20);
    return (std::uint64_t{frame.id >> 18} << 21) | (std::uint64_t{3} << 19) |
           (std::uint64_t{frame.id & 0x3FFFF} << 1) | rtr;
}

}  // namespace

class InProcessBus::End final : public CanPort {
  public:
    End(InProcessBus& bus, std::size_t capacity) : inbox(capacity), outbox(capacity), bus_(bus) {}

    bool send(std::int64_t now_ns, const Frame& frame) SHIFTRIG_REALTIME override {
        bus_.run_to(now_ns);
        Frame stamped = frame;
        stamped.timestamp_ns = now_ns;
        if (bus_.options_.bit_rate <= 0) {
            bus_.deliver(*this, stamped);
        } else if (!outbox.push(stamped)) {
            ++count.send_dropped;
            return false;
        }
        ++count.sent;
        return true;
    }

    std::size_t receive(std::int64_t now_ns, std::span<Frame> frames) SHIFTRIG_REALTIME override {
        bus_.run_to(now_ns);
        std::size_t taken = 0;
        for (; taken < frames.size() && !inbox.empty(); ++taken) {
            frames[taken] = inbox.front();
            inbox.pop();
        }
        count.received += taken;
        return taken;
    }

    PortState state() const SHIFTRIG_REALTIME override { return PortState::up; }
    PortCounters counters() const SHIFTRIG_REALTIME override { return count; }
    const std::string& description() const noexcept override { return name_; }

    Ring<Frame> inbox, outbox;
    PortCounters count;

  private:
    InProcessBus& bus_;
    std::string name_ = "inprocess";
};

InProcessBus::InProcessBus(int ends, const InProcessOptions& options) : options_(options) {
    if (ends < 2) throw std::invalid_argument("an in-process bus has at least two ends");
    if (options_.data_bit_rate <= 0) options_.data_bit_rate = options_.bit_rate;
    for (int i = 0; i < ends; ++i) ends_.push_back(std::make_unique<End>(*this, options_.queue_frames));
}

InProcessBus::~InProcessBus() = default;

CanPort& InProcessBus::end(int index) {
    return *ends_.at(static_cast<std::size_t>(index));
}

void InProcessBus::deliver(const End& from, const Frame& frame) SHIFTRIG_REALTIME {
    for (const auto& end : ends_)
        if (end.get() != &from && !end->inbox.push(frame)) ++end->count.receive_dropped;
}

// Transmits every frame that is through by now. A frame handed over at `now` itself is not started yet:
// others of the same instant may still come and win.
void InProcessBus::run_to(std::int64_t now_ns) SHIFTRIG_REALTIME {
    if (options_.bit_rate <= 0) return;
    for (;;) {
        // The bus starts again when it is free and somebody has something to say.
        std::int64_t start_ns = INT64_MAX;
        for (const auto& end : ends_)
            if (!end->outbox.empty()) start_ns = std::min(start_ns, end->outbox.front().timestamp_ns);
        start_ns = std::max(start_ns, free_at_ns_);
        if (start_ns >= now_ns) return;

        End* winner = nullptr;
        for (const auto& end : ends_) {
            if (end->outbox.empty() || end->outbox.front().timestamp_ns > start_ns) continue;
            if (!winner || arbitration_key(end->outbox.front()) < arbitration_key(winner->outbox.front()))
                winner = end.get();
        }
        Frame frame = winner->outbox.front();
        const std::int64_t length_ns = duration_ns(frame, options_.bit_rate, options_.data_bit_rate);
        if (start_ns + length_ns > now_ns) return;
        winner->outbox.pop();
        free_at_ns_ = start_ns + length_ns;
        busy_ns_ += length_ns;
        frame.timestamp_ns = free_at_ns_;
        deliver(*winner, frame);
    }
}

void InProcessBus::archive(Archive& a) {
    for (const auto& end : ends_) {
        end->inbox.archive(a);
        end->outbox.archive(a);
        a(end->count);
    }
    a(free_at_ns_, busy_ns_);
}

}  // namespace shiftrig::io::can
