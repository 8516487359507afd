// The rig behind its dashboard. The loop hands over, once per tick and without waiting, what viewers and the
// scorecard need; a thread of its own turns that into samples, words and judged shifts at 25 Hz.
//
// What a viewer asks for takes one of two ways: values of inputs go to the rig at its next tick, and whatever
// needs more than a tick's time (recording on or off, a parameter of the machine) is done between two
// stretches of the loop, in the main thread: run() is that main thread. Each stretch that is recorded has a
// recording of its own: a recording holds one machine and one loop, so that it can be replayed.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "analysis/run.h"
#include "apps/rig/rig.h"
#include "apps/rig/session.h"
#include "apps/serve/feed.h"
#include "apps/serve/http.h"
#include "rt/latest_value.h"
#include "rt/queue.h"

namespace shiftrig::serve {

struct DashboardOptions {
    HttpOptions http;
    rt::LoopSettings loop;
    std::string record_path;  // where recordings begun from the page go; later ones get a number
    bool record_at_once = false;
};

class Dashboard {
  public:
    // Throws RecordingError if it is to record at once and the file cannot be created.
    Dashboard(rig::Rig& rig, DashboardOptions options);
    ~Dashboard();

    std::string url() const { return http_->url(); }
    // Runs the loop until stop() is called, its slots are over or it gives up; reports on all stretches.
    rt::LoopReport run();
    void stop();  // from any thread, not from a signal handler
    // To those who look at the page and to standard error; from any thread.
    void tell_trouble(const std::string& text);
    // When run() has returned: everything that was to be recorded was, and the plant's state was always finite.
    bool sound() const noexcept { return sound_; }

  private:
    static constexpr std::size_t most_signals = 1024, most_judged = 160;

    struct Frame {
        double time = 0;
        std::int64_t ticks = 0, overruns = 0;
        bool limp = false;  // the controller says so
        std::uint32_t count = 0;
        std::array<double, most_signals> value;
    };
    struct Row {
        double time;
        std::array<double, most_judged> value;
    };
    struct Happening {
        bool of_the_rig;
        plant::Event plant;
        rig::RigEvent own;
    };

    // In the loop.
    void take(const rig::Rig& rig) SHIFTRIG_REALTIME;

    // In the feeding thread.
    void feed();
    std::string sample_json(const Frame& frame) const;
    void tell_events();
    void judge_shifts();

    // In HTTP threads.
    std::string command(std::string_view verb, const std::string& body);
    std::string refusal(const std::string& parameter, double value) const;
    std::string model_json() const;
    std::unique_ptr<std::istream> recording() const;
    void between_stretches(std::function<void()> what);
    void tell(const std::string& text);

    // In the main thread.
    rt::LoopReport run_stretch(std::int64_t slots);
    const std::string& next_recording();
    void begin_recording();
    void end_recording();
    void set_parameter(const std::string& name, double value);

    rig::Rig& rig_;
    DashboardOptions options_;
    Feed feed_;
    std::unique_ptr<HttpServer> http_;

    rt::LatestValue<Frame> frames_;
    rt::Queue<Row> rows_{8192};
    rt::Queue<Happening> happenings_{4096};
    Frame filling_;
    int limp_ = -1;            // signal, where the bus carries it
    std::vector<int> judged_;  // signals in a Row
    analysis::Run recent_;     // the last minute, for the scorecard
    double told_until_ = 0;    // end of the last shift told [s]

    std::thread feeder_;
    std::atomic<bool> ending_{false}, stopping_{false};

    mutable std::mutex mutex_;  // of what follows: HTTP threads and the main thread
    std::vector<std::function<void()>> waiting_;
    rt::LoopControl* control_ = nullptr;  // of the stretch that is running
    bool paused_ = false;
    double factor_ = 1;
    bool to_record_ = false;  // the next stretch
    std::unique_ptr<io::RecordingWriter> recording_;
    std::string recorded_to_;
    int recordings_ = 0;
    bool sound_ = true;
};

}  // namespace shiftrig::serve
