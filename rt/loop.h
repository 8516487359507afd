// The fixed-rate loop, on one page. Slot n of the simulation is due at
//
//     deadline(n) = t0 + (n − n0)·T / f          integer ns; T period, f time factor, (t0, n0) the anchor
//
// The anchor is set at the start and moves only when somebody asks for it (factor changed, resumed from
// a pause), which is counted: lateness never shifts the grid, so nothing drifts and nothing is forgotten.
// A loop that is late runs the due slots one after the other (catches up) as long as it is at most
// `catch_up` slots behind; beyond that it skips to the newest due slot, or gives up. Every slot of the
// grid ends up in the report as executed or skipped (the one at which the loop gives up: as neither):
//
//     report.executed + report.skipped = slots passed
//
//     Loop loop(settings);
//     loop.run([&](const Tick& tick) SHIFTRIG_REALTIME { … });
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>

#include "rt/clock.h"
#include "rt/histogram.h"
#include "rt/realtime.h"

namespace shiftrig::rt {

enum class Pace {
    wall,      // slots at their deadlines
    lockstep,  // a slot as soon as the answer to the one before has come (or its time-out has passed)
    free,      // one slot after the other
};
enum class BeyondBound { skip, abort };      // more than `catch_up` slots behind
enum class LateRun { record, skip, abort };  // `late_run_limit` late ticks in a row

struct LoopSettings {
    std::int64_t period = 1'000'000;                                // T [ns], > 0
    std::int64_t slots = std::numeric_limits<std::int64_t>::max();  // how many to pass
    Pace pace = Pace::wall;
    double factor = 1;            // f: simulated time per wall time, finite and > 0
    std::int64_t catch_up = 100;  // [slots], ≥ 0
    BeyondBound beyond_bound = BeyondBound::skip;
    std::int64_t late_after =
        0;  // a tick is late if it starts this long after its deadline [ns]; 0: half a wall period
    std::int64_t late_run_limit = 0;  // [ticks]; 0: none
    LateRun late_run = LateRun::record;
    std::int64_t answer_timeout = nanoseconds_per_second;  // lockstep [ns]
};

struct Tick {
    std::int64_t slot = 0;      // on the grid, from 0; simulated time of the slot is slot·T
    std::int64_t executed = 0;  // ticks run before this one: lower than `slot` by those skipped
    std::int64_t skipped = 0;   // slots left out just before this one
    std::int64_t deadline = 0;  // [ns] of the clock; in free and lockstep pace the start itself
    std::int64_t start = 0;     // [ns] of the clock
    bool late = false;
    bool answered = true;  // lockstep: the answer to the slot before came in time
};

enum class Outcome { completed, stopped, too_far_behind, late_too_often };
const char* name(Outcome outcome) noexcept;  // "completed", as written here

struct LoopReport {
    Outcome outcome = Outcome::completed;
    std::int64_t executed = 0;          // ticks run
    std::int64_t skipped = 0;           // slots left out
    std::int64_t late = 0;              // slots that started late, those skipped included
    std::int64_t longest_late_run = 0;  // [slots]
    std::int64_t late_runs = 0;         // how often the limit was reached
    std::int64_t overruns = 0;          // ticks that ended after the next slot was due
    std::int64_t unanswered = 0;        // lockstep time-outs
    std::int64_t clock_reversals = 0;   // times the clock was seen to go back
    std::int64_t anchors = 0;           // times the grid was moved on request
    std::int64_t began = 0, ended = 0;  // [ns] of the clock
    std::int64_t late_after = 0;        // what counted as late in the end [ns]
    Histogram wake_up;                  // how long after the asked time a sleep ended (what cyclictest shows)
    Histogram lateness;  // wall pace: start − deadline of every slot, slept for or not, executed or skipped
    Histogram step;      // duration of the callable
    Histogram response;  // end of the callable − deadline

    // Of a loop that went on where this one stopped: its outcome, sums of what both counted.
    void add(const LoopReport& later);
};

// What other threads (and signal handlers) may ask of a running loop. It obeys within `longest_wait` and one tick, whatever
// it waits for: a signal ends the sleep of the thread that takes it, which need not be the loop's.
inline constexpr std::int64_t longest_wait = 250'000'000;  // [ns]
class LoopControl {
  public:
    void stop() noexcept { stop_.store(true, std::memory_order_relaxed); }
    bool stopping() const noexcept { return stop_.load(std::memory_order_relaxed); }
    void pause() noexcept { paused_.store(true, std::memory_order_relaxed); }
    void resume() noexcept { paused_.store(false, std::memory_order_relaxed); }
    bool paused() const noexcept { return paused_.load(std::memory_order_relaxed); }
    void single_step() noexcept { single_steps_.fetch_add(1, std::memory_order_relaxed); }  // while paused
    void set_factor(double factor) noexcept { factor_.store(factor, std::memory_order_relaxed); }
    double factor() const noexcept { return factor_.load(std::memory_order_relaxed); }
    bool take_single_step() noexcept {
        int waiting = single_steps_.load(std::memory_order_relaxed);
        while (waiting > 0 && !single_steps_.compare_exchange_weak(waiting, waiting - 1)) {
        }
        return waiting > 0;
    }

  private:
    std::atomic<bool> stop_{false}, paused_{false};
    std::atomic<int> single_steps_{0};
    std::atomic<double> factor_{1};
};

template <Clock C = SteadyClock>
class Loop {
  public:
    explicit Loop(const LoopSettings& settings, C clock = {})
        : settings_(settings), clock_(std::move(clock)) {
        if (!(settings.factor > 0 && std::isfinite(settings.factor)))
            throw std::invalid_argument("the loop's time factor must be a finite number > 0");
        control_.set_factor(settings.factor);
    }

    LoopControl& control() noexcept { return control_; }
    const LoopReport& report() const noexcept { return report_; }  // whole only when run() has returned

    // `step(tick)` once per executed slot. `answer(timeout_ns) → bool` blocks until the other side has
    // answered the last slot, or the time is over; asked for in lockstep before every slot but the first.
    template <class Step>
    const LoopReport& run(Step&& step) {
        return run(std::forward<Step>(step), [](std::int64_t) { return true; });
    }

    template <class Step, class Answer>
    const LoopReport& run(Step&& step, Answer&& answer) {
        report_ = LoopReport{};
        report_.began = last_now_ = clock_.now();
        place_anchor(report_.began, 0);
        late_run_ = late_since_limit_ = 0;
        for (std::int64_t slot = 0; slot < settings_.slots; ++slot) {
            Tick tick{.slot = slot, .executed = report_.executed};
            if (!wait_while_paused(slot)) return end(Outcome::stopped);
            if (settings_.pace == Pace::wall) {
                follow_factor(slot);
                tick.deadline = deadline(slot);
                wait_for(tick.deadline);
            } else if (settings_.pace == Pace::lockstep && slot > 0 && !answered(answer)) {
                tick.answered = false;
                ++report_.unanswered;
            }
            if (control_.stopping()) return end(Outcome::stopped);
            tick.start = now();
            if (settings_.pace == Pace::wall) {
                const std::int64_t behind = newest_due(slot, tick.start) - slot;
                tick.late = count_start(tick.start - tick.deadline);
                const bool too_far = behind > settings_.catch_up;
                const bool too_often =
                    settings_.late_run_limit > 0 && late_since_limit_ >= settings_.late_run_limit;
                if (too_often) ++report_.late_runs, late_since_limit_ = 0;
                if (too_far && settings_.beyond_bound == BeyondBound::abort)
                    return end(Outcome::too_far_behind);
                if (too_often && settings_.late_run == LateRun::abort) return end(Outcome::late_too_often);
                if (too_far || (too_often && settings_.late_run == LateRun::skip)) {
                    for (; tick.skipped < behind && !control_.stopping(); ++tick.skipped) {
                        tick.late = count_start(tick.start - deadline(++slot));
                    }
                    report_.skipped += tick.skipped;
                    if (control_.stopping()) return end(Outcome::stopped);
                    tick.slot = slot;
                    tick.deadline = deadline(slot);
                }
            } else {
                tick.deadline = tick.start;
            }

            step(std::as_const(tick));

            const std::int64_t finish = now();
            ++report_.executed;
            report_.step.record(finish - tick.start);
            report_.response.record(finish - tick.deadline);
            if (settings_.pace == Pace::wall && finish >= deadline(slot + 1)) ++report_.overruns;
        }
        return end(Outcome::completed);
    }

  private:
    std::int64_t deadline(std::int64_t slot) const noexcept {
        const std::int64_t simulated = (slot - anchor_slot_) * settings_.period;
        return anchor_time_ +
               (factor_ == 1 ? simulated : std::llround(static_cast<double>(simulated) / factor_));
    }
    // The last slot with deadline ≤ time, at least `slot` and at most the last one of the run.
    std::int64_t newest_due(std::int64_t slot, std::int64_t time) const noexcept {
        if (time < deadline(slot + 1)) return slot;
        const double passed =
            static_cast<double>(time - anchor_time_) * factor_ / static_cast<double>(settings_.period);
        std::int64_t due = anchor_slot_ + static_cast<std::int64_t>(passed);
        // Rounding is worth one slot. No search: it would not hear that the run is to stop.
        if (deadline(due) > time)
            --due;
        else if (deadline(due + 1) <= time)
            ++due;
        return std::clamp(due, slot, settings_.slots - 1);
    }
    void place_anchor(std::int64_t time, std::int64_t slot) noexcept {
        anchor_time_ = time;
        anchor_slot_ = slot;
        factor_ = control_.factor();
        const auto wall_period = static_cast<double>(settings_.period) / factor_;
        late_after_ = settings_.late_after > 0 ? settings_.late_after : std::llround(wall_period / 2);
    }
    void follow_factor(std::int64_t slot) noexcept {
        if (control_.factor() == factor_) return;
        place_anchor(deadline(slot), slot);
        ++report_.anchors;
    }
    bool wait_while_paused(std::int64_t slot) noexcept {
        bool waited = false;
        while (!control_.stopping() && control_.paused() && !control_.take_single_step()) {
            clock_.sleep_until(now() + 5'000'000);
            waited = true;
        }
        if (waited) {
            place_anchor(now(), slot);
            ++report_.anchors;
        }
        return !control_.stopping();
    }
    void wait_for(std::int64_t time) noexcept {
        std::int64_t present = now();
        if (present >= time) return;
        while (present < time && !control_.stopping()) {
            clock_.sleep_until(std::min(time, present + longest_wait));
            present = now();
        }
        if (present >= time) report_.wake_up.record(present - time);
    }
    template <class Answer>
    bool answered(Answer& answer) {
        for (std::int64_t left = settings_.answer_timeout; !control_.stopping();) {
            const std::int64_t piece = std::min(left, longest_wait), asked = now();
            if (answer(piece)) return true;
            left -= piece;
            // Who comes back at once has nobody to wait for.
            if (left == 0 || now() - asked < piece / 2) return false;
        }
        return true;
    }
    // Books the start of one slot, executed or not; true if it is late.
    bool count_start(std::int64_t lateness) noexcept {
        report_.lateness.record(lateness);
        const bool late = lateness >= late_after_;
        late_run_ = late ? late_run_ + 1 : 0;
        late_since_limit_ = late ? late_since_limit_ + 1 : 0;
        if (late) ++report_.late;
        if (late_run_ > report_.longest_late_run) report_.longest_late_run = late_run_;
        return late;
    }
    std::int64_t now() noexcept {
        const std::int64_t time = clock_.now();
        if (time < last_now_) ++report_.clock_reversals;
        return last_now_ = time;
    }
    const LoopReport& end(Outcome outcome) noexcept {
        report_.outcome = outcome;
        report_.late_after = late_after_;
        report_.ended = now();
        return report_;
    }

    LoopSettings settings_;
    C clock_;
    LoopControl control_;
    LoopReport report_;
    std::int64_t anchor_time_ = 0, anchor_slot_ = 0, last_now_ = 0, late_after_ = 0;
    std::int64_t late_run_ = 0,
                 late_since_limit_ = 0;  // late slots in a row; those since the limit was last reached
    double factor_ = 1;
};

}  // namespace shiftrig::rt
