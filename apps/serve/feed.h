// What viewers are told, as server-sent events: the newest sample (a slow viewer skips samples, it never
// holds anybody up) and the changes since it last asked (bounded; a viewer too slow for those loses the
// oldest). Plain mutex: only the feeding thread and the HTTP threads meet here, never the loop.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>

namespace shiftrig::serve {

class Feed {
  public:
    static constexpr std::size_t kept_changes = 256;

    // What one viewer has seen.
    struct Cursor {
        std::uint64_t sample = 0;
        std::uint64_t change = 0;
    };

    // A viewer that joins sees the next sample and the changes kept so far.
    Cursor join() const { return {}; }

    void sample(std::string json) {
        const std::lock_guard lock(mutex_);
        sample_ = std::move(json);
        ++samples_;
        arrived_.notify_all();
    }

    // kind: the event's name on the wire ("change", "shift").
    void change(const std::string& kind, const std::string& json) {
        const std::lock_guard lock(mutex_);
        changes_.push_back(wire(kind, json));
        ++last_change_;
        if (changes_.size() > kept_changes) changes_.pop_front();
        arrived_.notify_all();
    }

    void close() {
        const std::lock_guard lock(mutex_);
        closed_ = true;
        arrived_.notify_all();
    }

    // Waits until there is something new; fills `text` with events ready for the wire. A comment line keeps
    // an idle connection alive (and finds the dead ones). False: the feed has ended.
    bool wait(Cursor& cursor, std::string& text, std::chrono::milliseconds patience) {
        std::unique_lock lock(mutex_);
        arrived_.wait_for(lock, patience, [&] {
            return closed_ || cursor.sample != samples_ || cursor.change != last_change_;
        });
        if (closed_) return false;
        text.clear();
        const std::uint64_t first = last_change_ - changes_.size();  // changes before it are forgotten
        for (std::uint64_t i = std::max(cursor.change, first); i < last_change_; ++i)
            text += changes_[i - first];
        cursor.change = last_change_;
        if (cursor.sample != samples_) text += wire("sample", sample_);
        cursor.sample = samples_;
        if (text.empty()) text = ": still here\n\n";
        return true;
    }

  private:
    static std::string wire(const std::string& kind, const std::string& json) {
        return "event: " + kind + "\ndata: " + json + "\n\n";
    }

    std::mutex mutex_;
    std::condition_variable arrived_;
    std::string sample_;
    std::uint64_t samples_ = 0, last_change_ = 0;
    std::deque<std::string> changes_;
    bool closed_ = false;
};

}  // namespace shiftrig::serve
