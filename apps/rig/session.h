// A rig under the loop: who calls tick(), at what pace, and what is done beside it.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "apps/rig/certificate.h"
#include "apps/rig/collector.h"
#include "apps/rig/rig.h"
#include "io/recording/writer.h"
#include "rt/loop.h"
#include "rt/thread.h"
#include "rt/trace.h"

namespace shiftrig::rig {

struct SessionOptions {
    rt::LoopSettings loop;                     // period and number of slots are the rig's and the scenario's
    io::RecordingWriter* recording = nullptr;  // begun by the session, and told its outcome; not ended
    Collector* collector = nullptr;
    rt::Trace* trace = nullptr;
    std::map<std::string, std::string> facts;  // said in the recording besides those of manifest_of
    // In the loop, before and after every tick. Whoever sets them keeps the loop's promise: no waiting, no allocation.
    std::function<void(Rig&, const rt::Tick&)> before, after;
};

class Session {
  public:
    Session(Rig& rig, SessionOptions options);

    rt::LoopControl& control() noexcept {
        return loop_.control();
    }  // stop, pause, single step, speed: any thread
    // The whole run, in the calling thread.
    const rt::LoopReport& run();
    const rt::LoopReport& report() const noexcept { return loop_.report(); }  // whole when run() has returned
    // How long the rig's tick took, of the loop's step: receive, decide, step, send, without recording and showing.
    const rt::Histogram& rig_time() const noexcept { return rig_time_; }
    // From the arrival of a command on a real wire to the sending of the first frame that reflects it: of all commands
    // that one tick took, the oldest. Nothing on the in-process bus, which lives in simulated time.
    const rt::Histogram& command_to_signal() const noexcept { return command_to_signal_; }
    // Of all ticks so far; from the loop's thread, or when run() has returned.
    const RunCertificate& certificate() const noexcept { return certificate_; }

  private:
    void tick(const rt::Tick& tick) SHIFTRIG_REALTIME;
    void record(const rt::Tick& tick, std::int64_t began) SHIFTRIG_REALTIME;

    Rig& rig_;
    SessionOptions options_;
    rt::Loop<> loop_;
    rt::SteadyClock clock_;
    rt::Histogram rig_time_, command_to_signal_;
    RunCertificate certificate_;
    rt::Trace::Name span_tick_ = 0, span_record_ = 0;
    std::int64_t compute_ns_ = 0, started_ns_ = 0;
};

// What a recording says of the run before its first tick.
io::Manifest manifest_of(const Rig& rig, const rt::LoopSettings& loop);

}  // namespace shiftrig::rig
