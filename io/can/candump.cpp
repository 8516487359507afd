#include "io/can/candump.h"

#include <readerwriterqueue/readerwriterqueue.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "io/input_error.h"
#include "io/text_file.h"

namespace shiftrig::io::can {

namespace {

constexpr std::uint32_t kErrorBit = 0x20000000;  // in candump's identifiers
constexpr std::int64_t kOneYearNs = 365LL * 86400 * 1'000'000'000;

int hex(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return -1;
}

std::string_view next_word(std::string_view& rest) {
    const auto begin = rest.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) return rest = {};
    const auto end = std::min(rest.find_first_of(" \t\r", begin), rest.size());
    const auto word = rest.substr(begin, end - begin);
    rest.remove_prefix(end);
    return word;
}

}  // namespace

std::optional<LogEntry> parse_candump_line(std::string_view line, const std::string& file, int number) {
    std::string_view rest = line;
    const std::string_view time = next_word(rest), interface = next_word(rest), text = next_word(rest),
                           direction = next_word(rest);
    if (time.empty() || time.front() == '#') return std::nullopt;
    const auto fail = [&](const std::string& what) {
        throw InputError(file, number, 0, what + "; a line is (seconds.micros) interface ID#DATA");
    };

    LogEntry entry;
    entry.interface = interface;
    // Digits after the point are micro- or nanoseconds, or whatever was written.
    if (time.size() < 3 || time.front() != '(' || time.back() != ')') fail("no time stamp");
    const std::string_view clock = time.substr(1, time.size() - 2);
    const auto point = std::min(clock.find('.'), clock.size());
    std::int64_t seconds = 0, fraction = 0;
    const auto whole = std::from_chars(clock.data(), clock.data() + point, seconds);
    bool good = whole.ec == std::errc{} && whole.ptr == clock.data() + point && seconds >= 0 &&
                seconds < 4'000'000'000;
    std::int64_t weight = 100'000'000;
    for (const char digit : clock.substr(std::min(point + 1, clock.size()))) {
        good = good && digit >= '0' && digit <= '9';
        fraction += (digit - '0') * weight;
        weight /= 10;
    }
    if (!good) fail("time stamp \"" + std::string(time) + "\" is not a time");
    entry.frame.timestamp_ns = seconds * 1'000'000'000 + fraction;

    const auto mark = text.find('#');
    std::uint32_t id = 0;
    if (mark == std::string_view::npos) fail("no frame");
    const auto parsed = std::from_chars(text.data(), text.data() + mark, id, 16);
    if (parsed.ec != std::errc{} || parsed.ptr != text.data() + mark || (mark != 3 && mark != 8))
        fail("\"" + std::string(text.substr(0, mark)) +
             "\" is not an identifier of 3 or 8 hexadecimal digits");
    Frame& frame = entry.frame;
    frame.extended = mark == 8;
    frame.error = frame.extended && (id & kErrorBit) != 0;
    frame.id = id & 0x1FFFFFFF;
    if (id > (frame.extended ? 0x3FFFFFFFU : 0x7FFU))
        fail("identifier \"" + std::string(text.substr(0, mark)) + "\" is too large");

    std::string_view data = text.substr(mark + 1);
    if (data.starts_with('#')) {
        const int flags = data.size() > 1 ? hex(data[1]) : -1;
        if (flags < 0) fail("a CAN FD frame needs one digit of flags after ##");
        frame.fd = true;
        frame.bit_rate_switch = (flags & 1) != 0;
        data.remove_prefix(2);
    }
    if (data.starts_with('R')) {
        frame.remote = true;
        frame.length = data.size() > 1 && hex(data[1]) >= 0
                           ? static_cast<std::uint8_t>(std::min(hex(data[1]), 8))
                           : std::uint8_t{0};
    } else {
        std::size_t length = 0;
        while (!data.empty() && data.front() != '_') {  // _X: the raw DLC of an 8-byte frame
            if (data.front() == '.') {
                data.remove_prefix(1);
                continue;
            }
            if (data.size() < 2 || hex(data[0]) < 0 || hex(data[1]) < 0)
                fail("data \"" + std::string(data) + "\" are not pairs of hexadecimal digits");
            if (length >= (frame.fd ? 64U : 8U)) fail(frame.fd ? "more than 64 bytes" : "more than 8 bytes");
            frame.data[length++] = static_cast<std::uint8_t>(16 * hex(data[0]) + hex(data[1]));
            data.remove_prefix(2);
        }
        if (frame.fd && fd_length(static_cast<unsigned>(length)) != length)
            fail(std::to_string(length) + " bytes is no length of CAN FD");
        frame.length = static_cast<std::uint8_t>(length);
    }
    if (direction == "R" || direction == "Rx") entry.direction = Direction::received;
    if (direction == "T" || direction == "Tx") entry.direction = Direction::transmitted;
    return entry;
}

std::vector<LogEntry> read_candump(const std::string& path) {
    std::istringstream in(read_text(path));
    std::vector<LogEntry> entries;
    std::string line;
    for (int number = 1; std::getline(in, line); ++number)
        if (auto entry = parse_candump_line(line, path, number)) entries.push_back(std::move(*entry));
    if (entries.empty()) throw InputError(path, 0, 0, "has no frames");
    return entries;
}

void append_candump_line(std::string& out, const Frame& frame, std::int64_t time_ns,
                         std::string_view interface, Direction direction) {
    char head[96];
    std::snprintf(head, sizeof head, "(%010lld.%06lld) %.*s %0*X#",
                  static_cast<long long>(time_ns / 1'000'000'000),
                  static_cast<long long>(time_ns / 1000 % 1'000'000),
                  static_cast<int>(std::min<std::size_t>(interface.size(), 32)), interface.data(),
                  frame.extended ? 8 : 3, frame.id | (frame.error ? kErrorBit : 0));
    out += head;
    if (frame.fd) {
        out += '#';
        out += frame.bit_rate_switch ? '1' : '0';
    }
    if (frame.remote) {
        out += 'R';
        if (frame.length > 0) out += static_cast<char>('0' + frame.length);
    } else {
        for (std::size_t i = 0; i < frame.length; ++i) {
            constexpr const char* kDigits = "0123456789ABCDEF";
            out += kDigits[frame.data[i] >> 4];
            out += kDigits[frame.data[i] & 15];
        }
    }
    if (direction != Direction::unknown) {
        out += ' ';
        out += static_cast<char>(direction);
    }
    out += '\n';
}

// ---- logging -------------------------------------------------------------------------------------------------

struct CandumpLogger::Data {
    struct Item {
        Frame frame;
        std::int64_t time_ns;
        Direction direction;
    };
    Data(CanPort& a_port, const std::string& a_path, std::string an_interface)
        : port(a_port),
          path(a_path),
          interface(std::move(an_interface)),
          out(path, std::ios::binary | std::ios::app) {
        if (!out) throw InputError(path, 0, 0, "cannot be written");
        writer = std::thread([this] { write(); });
    }
    ~Data() { end(); }
    void finish() {
        end();
        if (!begun) empty_file();
    }
    void end() {
        if (!writer.joinable()) return;
        stop = true;
        writer.join();
        errno = 0;
        out.close();
        check();
    }
    // What the disk refused once leaves a hole: nothing is written behind it.
    void check() {
        if (!out && failure == 0) failure = errno != 0 ? errno : EIO;
    }
    void empty_file() {
        std::error_code nothing_to_empty;  // a pipe, a device
        std::filesystem::resize_file(path, 0, nothing_to_empty);
        begun = true;
    }
    SHIFTRIG_TRUSTED_BEGIN  // try_enqueue never allocates
        void
        note(std::int64_t now_ns, const Frame& frame, Direction direction) SHIFTRIG_REALTIME {
        // What comes before time 0 (address claims) is logged as of then.
        if (!queue.try_enqueue({frame, std::max<std::int64_t>(0, now_ns), direction}))
            lost.fetch_add(1, std::memory_order_relaxed);
    }
    SHIFTRIG_TRUSTED_END
    // Polls: the loop must not be burdened with waking somebody for a log.
    void write() {
        std::string text;
        Item item;
        for (bool last = false; !last;) {
            last = stop;  // read before the queue is emptied: nothing noted before the stop is left behind
            while (queue.try_dequeue(item))
                append_candump_line(text, item.frame, item.time_ns, interface, item.direction);
            if (!begun && !text.empty()) empty_file();
            errno = 0;
            out << text;  // into a stream that has failed: nowhere
            out.flush();
            check();
            text.clear();
            if (!last) std::this_thread::sleep_for(std::chrono::milliseconds(20));
        }
    }

    CanPort& port;
    std::string path, interface;
    std::ofstream out;
    bool begun = false;           // the writer's, while there is one
    std::atomic<int> failure{0};  // errno of the first write that went wrong
    moodycamel::ReaderWriterQueue<Item> queue{1 << 16};
    std::atomic<std::uint64_t> lost{0};
    std::atomic<bool> stop{false};
    std::thread writer;
};

CandumpLogger::CandumpLogger(CanPort& port, const std::string& path, std::string interface)
    : data_(std::make_unique<Data>(port, path, std::move(interface))) {}
CandumpLogger::~CandumpLogger() = default;

bool CandumpLogger::send(std::int64_t now_ns, const Frame& frame) SHIFTRIG_REALTIME {
    if (!data_->port.send(now_ns, frame)) return false;
    data_->note(now_ns, frame, Direction::transmitted);
    return true;
}
std::size_t CandumpLogger::receive(std::int64_t now_ns, std::span<Frame> frames) SHIFTRIG_REALTIME {
    const std::size_t count = data_->port.receive(now_ns, frames);
    for (std::size_t i = 0; i < count; ++i) data_->note(now_ns, frames[i], Direction::received);
    return count;
}
PortState CandumpLogger::state() const SHIFTRIG_REALTIME {
    return data_->port.state();
}
PortCounters CandumpLogger::counters() const SHIFTRIG_REALTIME {
    return data_->port.counters();
}
bool CandumpLogger::wait(std::int64_t timeout_ns) noexcept {
    return data_->port.wait(timeout_ns);
}
const std::string& CandumpLogger::description() const noexcept {
    return data_->port.description();
}
void CandumpLogger::finish() {
    data_->finish();
}
std::string CandumpLogger::error() const {
    const int failure = data_->failure;
    return failure == 0 ? "" : data_->path + ": cannot be written: " + std::strerror(failure);
}
std::uint64_t CandumpLogger::lost() const noexcept {
    return data_->lost;
}

// ---- replay --------------------------------------------------------------------------------------------------

CandumpReplay::CandumpReplay(const std::string& path, std::span<const Filter> filters, CanPort* port)
    : name_(path), port_(port) {
    auto log = read_candump(path);
    std::stable_sort(log.begin(), log.end(), [](const auto& a, const auto& b) {
        return a.frame.timestamp_ns < b.frame.timestamp_ns;
    });
    const std::int64_t start_ns =
        !log.empty() && log.front().frame.timestamp_ns > kOneYearNs ? log.front().frame.timestamp_ns : 0;
    for (auto& entry : log) {
        const auto passes = [&entry](const Filter& filter) { return filter.passes(entry.frame); };
        if (!filters.empty() && std::none_of(filters.begin(), filters.end(), passes)) continue;
        entry.frame.timestamp_ns -= start_ns;
        entries_.push_back(entry.frame);
    }
}

bool CandumpReplay::send(std::int64_t now_ns, const Frame& frame) SHIFTRIG_REALTIME {
    if (port_) return port_->send(now_ns, frame);
    ++own_.sent;
    return true;
}

std::size_t CandumpReplay::receive(std::int64_t now_ns, std::span<Frame> frames) SHIFTRIG_REALTIME {
    std::size_t count = 0;
    while (count < frames.size() && next_ < entries_.size() && entries_[next_].timestamp_ns <= now_ns)
        frames[count++] = entries_[next_++];
    own_.received += count;
    if (port_ && count < frames.size()) count += port_->receive(now_ns, frames.subspan(count));
    return count;
}

PortState CandumpReplay::state() const SHIFTRIG_REALTIME {
    return port_ ? port_->state() : PortState::up;
}

PortCounters CandumpReplay::counters() const SHIFTRIG_REALTIME {
    PortCounters sum = port_ ? port_->counters() : PortCounters{};
    sum.sent += own_.sent;
    sum.received += own_.received;
    return sum;
}

}  // namespace shiftrig::io::can
