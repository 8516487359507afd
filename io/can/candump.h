// Logs as candump -L writes them and canplayer, python-can and others read them:
//
//     (1763805483.004000) can0 18FF1003#E803000000000720 R      classic; R received, T transmitted, or no token
//     (1763805483.005000) can0 18FF1003##1E80300…               CAN FD, one digit of flags (1: bit rate switch)
//
// CandumpLogger writes what passes a port; CandumpReplay plays a log as if its frames came from a bus.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/can/open_port.h"
#include "io/can/port.h"

namespace shiftrig::io::can {

enum class Direction : char { unknown = ' ', received = 'R', transmitted = 'T' };

struct LogEntry {
    Frame frame;  // timestamp_ns: the log's
    std::string interface;
    Direction direction = Direction::unknown;
};

// One line without its end; nothing for an empty line or a comment (#). Throws InputError naming the line.
std::optional<LogEntry> parse_candump_line(std::string_view line, const std::string& file, int number);
std::vector<LogEntry> read_candump(const std::string& path);
// Appends one line, with its end, to `out`.
void append_candump_line(std::string& out, const Frame& frame, std::int64_t time_ns,
                         std::string_view interface, Direction direction);

// A port that writes everything sent and received through it to a file, with the caller's time as time stamp (the
// rig's simulated time) and with direction tokens. The file is written by a thread of its own.
class CandumpLogger final : public CanPort {
  public:
    // `port` must outlive it. Throws InputError if the file cannot be written. What was in the file stays there until the first
    // frame comes, or finish().
    CandumpLogger(CanPort& port, const std::string& path, std::string interface = "can0");
    ~CandumpLogger() override;
    bool send(std::int64_t now_ns, const Frame& frame) SHIFTRIG_REALTIME override;
    std::size_t receive(std::int64_t now_ns, std::span<Frame> frames) SHIFTRIG_REALTIME override;
    PortState state() const SHIFTRIG_REALTIME override;
    PortCounters counters() const SHIFTRIG_REALTIME override;
    bool wait(std::int64_t timeout_ns) noexcept override;
    const std::string& description() const noexcept override;
    // Writes what is left and closes the file: from then on error() and lost() tell whether all of it is there, and nothing more
    // is logged.
    void finish();
    // One line that begins with the path; empty: everything could be written so far.
    std::string error() const;
    // Entries that found the writer's queue full.
    std::uint64_t lost() const noexcept;

  private:
    struct Data;
    std::unique_ptr<Data> data_;
};

// A port on which a log's frames arrive at their own times. Logs in simulated time (as the rig writes them) keep
// their times, logs in wall time begin with their first frame. Frames that no filter passes are left out (none
// given: all arrive), so that a rig does not hear its own frames. Sending and further receiving go to `port`.
class CandumpReplay final : public CanPort {
  public:
    CandumpReplay(const std::string& path, std::span<const Filter> filters, CanPort* port = nullptr);
    bool send(std::int64_t now_ns, const Frame& frame) SHIFTRIG_REALTIME override;
    std::size_t receive(std::int64_t now_ns, std::span<Frame> frames) SHIFTRIG_REALTIME override;
    PortState state() const SHIFTRIG_REALTIME override;
    PortCounters counters() const SHIFTRIG_REALTIME override;
    const std::string& description() const noexcept override { return name_; }
    std::size_t frames() const noexcept { return entries_.size(); }
    bool finished() const noexcept { return next_ == entries_.size(); }
    // When the next frame comes; not to be asked when finished.
    std::int64_t next_ns() const noexcept { return entries_[next_].timestamp_ns; }

  private:
    std::string name_;
    std::vector<Frame> entries_;  // by time
    std::size_t next_ = 0;
    CanPort* port_;
    PortCounters own_;
};

}  // namespace shiftrig::io::can
