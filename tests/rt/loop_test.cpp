// The loop against a clock that the test scripts: every count below is worked out by hand from the
// deadlines n·T. The last two tests stop a real process.
#include "rt/loop.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <stdexcept>
#include <thread>
#include <vector>

namespace shiftrig::rt {
namespace {

constexpr std::int64_t ms = 1'000'000;

struct Script {
    std::int64_t time = 0;                           // [ns]
    std::map<std::int64_t, std::int64_t> wake_late;  // deadline → how much later the sleep ends
    std::map<std::int64_t, std::int64_t> jump;       // deadline → shift of the clock in that sleep (once)
    std::map<std::int64_t, std::int64_t> step_time;  // slot → duration of its step
    std::vector<std::int64_t> sleeps;                // what was asked for
};

struct ScriptedClock {
    Script* script;
    std::int64_t now() noexcept { return script->time; }
    void sleep_until(std::int64_t time) noexcept {
        script->sleeps.push_back(time);
        if (const auto jump = script->jump.find(time); jump != script->jump.end()) {
            script->time += jump->second;
            script->jump.erase(jump);
            return;
        }
        const auto late = script->wake_late.find(time);
        script->time = std::max(script->time, time + (late == script->wake_late.end() ? 0 : late->second));
    }
};

struct Played {
    LoopReport report;
    std::vector<Tick> ticks;
    std::vector<std::int64_t> slots() const {
        std::vector<std::int64_t> result;
        for (const Tick& tick : ticks) result.push_back(tick.slot);
        return result;
    }
    std::vector<std::int64_t> late_slots() const {
        std::vector<std::int64_t> result;
        for (const Tick& tick : ticks)
            if (tick.late) result.push_back(tick.slot);
        return result;
    }
};

using Slots = std::vector<std::int64_t>;

LoopSettings ten_slots() {
    LoopSettings settings;
    settings.period = ms;
    settings.slots = 10;
    return settings;
}

Played play(Script& script, const LoopSettings& settings,
            const std::function<void(const Tick&)>& extra = {}) {
    Loop<ScriptedClock> loop(settings, ScriptedClock{&script});
    Played played;
    loop.run([&](const Tick& tick) {
        played.ticks.push_back(tick);
        if (const auto step = script.step_time.find(tick.slot); step != script.step_time.end())
            script.time += step->second;
        if (extra) extra(tick);
    });
    played.report = loop.report();
    EXPECT_EQ(played.report.executed, static_cast<std::int64_t>(played.ticks.size()));
    if (settings.pace == Pace::wall) {
        EXPECT_EQ(played.report.lateness.count(), played.report.executed + played.report.skipped);
    }
    EXPECT_EQ(played.report.step.count(), played.report.executed);
    return played;
}

TEST(Loop, SleepsUntilMultiplesOfThePeriodAfterItsStart) {
    Script script;
    script.time = 123;
    const Played played = play(script, ten_slots());
    Slots expected;
    for (std::int64_t n = 1; n < 10; ++n) expected.push_back(123 + n * ms);
    EXPECT_EQ(script.sleeps, expected);
    EXPECT_EQ(played.report.executed, 10);
    EXPECT_EQ(played.report.skipped, 0);
    EXPECT_EQ(played.report.late, 0);
    EXPECT_EQ(played.report.overruns, 0);
    EXPECT_EQ(played.report.outcome, Outcome::completed);
}

TEST(Loop, LateByLessThanAPeriodShiftsNoLaterDeadline) {
    Script script;
    script.wake_late[3 * ms] = 700'000;
    const Played played = play(script, ten_slots());
    EXPECT_EQ(played.report.executed, 10);
    EXPECT_EQ(played.late_slots(), Slots{3});
    EXPECT_EQ(played.report.late, 1);
    EXPECT_EQ(played.report.skipped, 0);
    EXPECT_EQ(script.sleeps.back(), 9 * ms);
    EXPECT_EQ(script.time, 9 * ms);
    EXPECT_EQ(played.report.wake_up.maximum(), 700'000);
}

TEST(Loop, WakeUpBelowTheThresholdIsNotLate) {
    Script script;
    script.wake_late[3 * ms] = 499'999;
    script.wake_late[5 * ms] = 500'000;
    EXPECT_EQ(play(script, ten_slots()).late_slots(), Slots{5});
}

TEST(Loop, LateByMoreThanAPeriodCatchesUpWithoutLosingASlot) {
    Script script;
    script.wake_late[3 * ms] = 2'700'000;  // wakes at 5.7 ms: slots 3 (2.7 late), 4 (1.7), 5 (0.7) at once
    const Played played = play(script, ten_slots());
    EXPECT_EQ(played.slots(), (Slots{0, 1, 2, 3, 4, 5, 6, 7, 8, 9}));
    EXPECT_EQ(played.late_slots(), (Slots{3, 4, 5}));
    EXPECT_EQ(played.report.longest_late_run, 3);
    EXPECT_EQ(played.report.skipped, 0);
    EXPECT_EQ(played.report.overruns, 2);         // 3 and 4 ended when 4 and 5 were already due
    EXPECT_EQ(played.report.wake_up.count(), 7);  // 0 did not sleep, nor 4 and 5
    EXPECT_EQ(script.time, 9 * ms);
}

TEST(Loop, SlowStepIsCountedAsOverrunAndCaughtUp) {
    Script script;
    script.step_time[2] = 3'600'000;  // from 2.0 to 5.6 ms: 3 starts 2.6 late, 4 1.6, 5 0.6
    const Played played = play(script, ten_slots());
    EXPECT_EQ(played.report.executed, 10);
    EXPECT_EQ(played.late_slots(), (Slots{3, 4, 5}));
    EXPECT_EQ(played.report.overruns, 3);
    EXPECT_EQ(played.report.step.maximum(), 3'600'000);
    EXPECT_EQ(played.report.response.maximum(), 3'600'000);
}

TEST(Loop, BeyondTheBoundItSkipsToTheNewestDueSlotAndAccountsForEachSkippedOne) {
    Script script;
    LoopSettings settings = ten_slots();
    settings.catch_up = 2;
    script.wake_late[3 * ms] = 3'200'000;  // at 6.2 ms: due 3, 4, 5, 6; three behind > 2
    const Played played = play(script, settings);
    EXPECT_EQ(played.slots(), (Slots{0, 1, 2, 6, 7, 8, 9}));
    EXPECT_EQ(played.report.skipped, 3);
    EXPECT_EQ(played.report.executed + played.report.skipped, 10);
    EXPECT_EQ(played.ticks[3].skipped, 3);
    EXPECT_EQ(played.ticks[3].executed, 3);
    EXPECT_FALSE(played.ticks[3].late);  // 0.2 ms after its own deadline
    EXPECT_EQ(played.report.late, 3);    // 3, 4, 5
    EXPECT_EQ(played.report.lateness.maximum(), 3'200'000);
    EXPECT_EQ(played.report.lateness.count_above(1'000'000), 3);  // 3.2, 2.2, 1.2 ms
}

TEST(Loop, ExactlyAtTheBoundNothingIsSkipped) {
    Script script;
    LoopSettings settings = ten_slots();
    settings.catch_up = 3;
    script.wake_late[3 * ms] = 3'200'000;
    const Played played = play(script, settings);
    EXPECT_EQ(played.report.executed, 10);
    EXPECT_EQ(played.report.skipped, 0);
}

TEST(Loop, BeyondTheBoundItGivesUpWhereThatIsConfigured) {
    Script script;
    LoopSettings settings = ten_slots();
    settings.catch_up = 2;
    settings.beyond_bound = BeyondBound::abort;
    script.wake_late[3 * ms] = 3'000'000;
    Loop<ScriptedClock> loop(settings, ScriptedClock{&script});
    std::vector<std::int64_t> slots;
    loop.run([&](const Tick& tick) { slots.push_back(tick.slot); });
    EXPECT_EQ(loop.report().outcome, Outcome::too_far_behind);
    EXPECT_EQ(slots, (Slots{0, 1, 2}));
    EXPECT_EQ(loop.report().late, 1);
}

TEST(Loop, SkippingNeverPassesTheEndOfTheRun) {
    Script script;
    LoopSettings settings = ten_slots();
    settings.catch_up = 0;
    script.wake_late[7 * ms] = 3'600'000'000'000;  // an hour
    const Played played = play(script, settings);
    EXPECT_EQ(played.slots(), (Slots{0, 1, 2, 3, 4, 5, 6, 9}));
    EXPECT_EQ(played.report.executed + played.report.skipped, 10);
    EXPECT_EQ(played.report.late, 3);  // 7, 8, 9
}

TEST(Loop, AlwaysTooSlowStepNeverFallsFurtherBehindThanTheBound) {
    Script script;
    LoopSettings settings = ten_slots();
    settings.slots = 1000;
    settings.catch_up = 5;
    std::int64_t worst = 0;
    const Played played = play(script, settings, [&](const Tick& tick) {
        worst = std::max(worst, tick.start - tick.deadline);
        script.time += 3 * ms / 2;
    });
    EXPECT_EQ(played.report.executed + played.report.skipped, 1000);
    EXPECT_LT(worst, 6 * ms);
    // The machine has time for two ticks in every three slots (and some catching up at the end).
    EXPECT_NEAR(static_cast<double>(played.report.executed), 2.0 / 3.0 * 1000, 5);
}

TEST(Loop, ClockThatJumpsAheadIsCaughtUpSlotBySlot) {
    Script script;
    script.jump[4 * ms] = 2 * ms + 500'000;  // asleep from 3 ms, finds 5.5 ms
    const Played played = play(script, ten_slots());
    EXPECT_EQ(played.report.executed, 10);
    EXPECT_EQ(played.late_slots(), (Slots{4, 5}));
    EXPECT_EQ(played.report.clock_reversals, 0);
}

TEST(Loop, ClockThatJumpsBackIsCountedAndTheGridStays) {
    Script script;
    script.jump[4 * ms] = -2 * ms;
    const Played played = play(script, ten_slots());
    EXPECT_EQ(played.report.executed, 10);
    EXPECT_EQ(played.report.clock_reversals, 1);
    EXPECT_EQ(played.report.late, 0);
    EXPECT_EQ(played.ticks[4].deadline, 4 * ms);
    EXPECT_EQ(played.report.anchors, 0);
}

TEST(Loop, SleepThatEndsEarlyIsTakenUpAgain) {
    Script script;
    script.jump[4 * ms] = 100'000;  // a signal after 0.1 ms
    const Played played = play(script, ten_slots());
    EXPECT_EQ(played.ticks[4].start, 4 * ms);
    EXPECT_EQ(script.sleeps.size(), 10u);
}

TEST(Loop, LateRunReachingItsLimitStopsTheLoop) {
    Script script;
    LoopSettings settings = ten_slots();
    settings.late_run_limit = 3;
    settings.late_run = LateRun::abort;
    for (std::int64_t n : {2, 3, 5, 6, 7})
        script.wake_late[n * ms] = 600'000;  // a run of two, then one of three
    Loop<ScriptedClock> loop(settings, ScriptedClock{&script});
    loop.run([](const Tick&) {});
    EXPECT_EQ(loop.report().outcome, Outcome::late_too_often);
    EXPECT_EQ(loop.report().executed, 7);  // slots 0…6; the third late one in a row is not run
    EXPECT_EQ(loop.report().late, 5);
    EXPECT_EQ(loop.report().late_runs, 1);
}

TEST(Loop, LateRunReachingItsLimitIsOnlyBookedWhereThatIsConfigured) {
    Script script;
    LoopSettings settings = ten_slots();
    settings.late_run_limit = 2;
    for (std::int64_t n = 1; n < 8; ++n) script.wake_late[n * ms] = 600'000;  // seven in a row
    const Played played = play(script, settings);
    EXPECT_EQ(played.report.executed, 10);
    EXPECT_EQ(played.report.longest_late_run, 7);
    EXPECT_EQ(played.report.late_runs, 3);  // after 2, 4, 6
}

TEST(Loop, LateRunReachingItsLimitSkipsWhereThatIsConfigured) {
    Script script;
    LoopSettings settings = ten_slots();
    settings.late_run_limit = 2;
    settings.late_run = LateRun::skip;
    script.wake_late[2 * ms] = 5'100'000;  // at 7.1 ms: 2 is run late, 3 is the second late one → skip to 7
    const Played played = play(script, settings);
    EXPECT_EQ(played.slots(), (Slots{0, 1, 2, 7, 8, 9}));
    EXPECT_EQ(played.report.skipped, 4);
    EXPECT_EQ(played.report.late, 5);  // 2…6
    EXPECT_EQ(played.report.late_runs, 1);
}

TEST(Loop, FactorStretchesTheGridWithoutAccumulatingRounding) {
    Script script;
    LoopSettings settings = ten_slots();
    settings.slots = 3'000'001;
    settings.factor = 3;  // wall period 333333.33… ns
    Loop<ScriptedClock> loop(settings, ScriptedClock{&script});
    loop.run([](const Tick&) {});
    EXPECT_EQ(script.sleeps.back(), 1'000'000'000'000);  // 3·10⁶ periods of 1 ms at thrice the speed
    EXPECT_EQ(loop.report().late, 0);
}

TEST(Loop, ChangeOfFactorContinuesTheGridAndIsCounted) {
    Script script;
    Loop<ScriptedClock> loop(ten_slots(), ScriptedClock{&script});
    std::vector<std::int64_t> deadlines;
    loop.run([&](const Tick& tick) {
        deadlines.push_back(tick.deadline);
        if (tick.slot == 4) loop.control().set_factor(0.5);
    });
    // Slot 5 is still due one old period after 4; from there on slots are 2 ms apart.
    EXPECT_EQ(deadlines, (Slots{0, ms, 2 * ms, 3 * ms, 4 * ms, 5 * ms, 7 * ms, 9 * ms, 11 * ms, 13 * ms}));
    EXPECT_EQ(loop.report().anchors, 1);
}

TEST(Loop, PausedLoopRunsSingleStepsAndResumesWithoutArrears) {
    Script script;
    Loop<ScriptedClock> loop(ten_slots(), ScriptedClock{&script});
    LoopControl& control = loop.control();
    std::vector<std::int64_t> starts;
    loop.run([&](const Tick& tick) {
        starts.push_back(tick.start);
        if (tick.slot == 3) {
            control.pause();
            control.single_step();
            control.single_step();
        }
        if (tick.slot == 5) control.resume();
    });
    EXPECT_EQ(loop.report().executed, 10);
    EXPECT_EQ(loop.report().late, 0);
    EXPECT_EQ(starts[9] - starts[5], 4 * ms);
}

TEST(Loop, StopEndsTheRunBeforeTheNextSlot) {
    Script script;
    Loop<ScriptedClock> loop(ten_slots(), ScriptedClock{&script});
    loop.run([&](const Tick& tick) {
        if (tick.slot == 4) loop.control().stop();
    });
    EXPECT_EQ(loop.report().outcome, Outcome::stopped);
    EXPECT_EQ(loop.report().executed, 5);
}

TEST(Loop, ReportsOfStretchesAddUp) {
    Script script;
    script.step_time[3] = 5 * ms;
    LoopSettings settings = ten_slots();
    settings.slots = 6;
    LoopReport sum = play(script, settings).report;
    const std::int64_t began = sum.began, late = sum.late;
    EXPECT_GT(late, 0);
    settings.slots = 4;
    const LoopReport second = play(script, settings).report;
    sum.add(second);
    EXPECT_EQ(sum.executed, 10);
    EXPECT_EQ(sum.late, late + second.late);
    EXPECT_EQ(sum.step.count(), 10);
    EXPECT_EQ(sum.step.maximum(), 5 * ms);
    EXPECT_EQ(sum.began, began);
    EXPECT_EQ(sum.ended, second.ended);
    EXPECT_EQ(sum.outcome, Outcome::completed);
}

TEST(Loop, FreePaceNeverSleeps) {
    Script script;
    LoopSettings settings = ten_slots();
    settings.pace = Pace::free;
    script.step_time[3] = 50 * ms;
    const Played played = play(script, settings);
    EXPECT_TRUE(script.sleeps.empty());
    EXPECT_EQ(played.report.executed, 10);
    EXPECT_EQ(played.report.late, 0);
    EXPECT_EQ(played.report.overruns, 0);
}

TEST(Loop, LockstepAsksForTheAnswerToEverySlotAndCountsTheMissing) {
    Script script;
    LoopSettings settings = ten_slots();
    settings.pace = Pace::lockstep;
    settings.answer_timeout = 20 * ms;
    Loop<ScriptedClock> loop(settings, ScriptedClock{&script});
    std::int64_t ticks = 0, asked = 0;
    std::vector<bool> answered;
    loop.run(
        [&](const Tick& tick) {
            ++ticks;
            answered.push_back(tick.answered);
        },
        [&](std::int64_t timeout) {
            EXPECT_EQ(timeout, 20 * ms);
            EXPECT_EQ(ticks, asked + 1);  // the slot before has been run
            return ++asked != 4;
        });
    EXPECT_EQ(asked, 9);
    EXPECT_EQ(ticks, 10);
    EXPECT_EQ(loop.report().unanswered, 1);
    EXPECT_FALSE(answered[4]);
    EXPECT_TRUE(answered[5]);
}

TEST(Loop, FactorThatIsNoneIsRefused) {
    Script script;
    for (const double factor : {std::nan(""), std::numeric_limits<double>::infinity(), 0., -1.}) {
        LoopSettings settings = ten_slots();
        settings.factor = factor;
        EXPECT_THROW(Loop<ScriptedClock>(settings, ScriptedClock{&script}), std::invalid_argument) << factor;
    }
}

TEST(Loop, SleepsLongWaitsInPiecesSoThatItHearsAStop) {
    Script script;
    LoopSettings settings = ten_slots();
    settings.period = 600 * ms;
    settings.slots = 3;
    const Played played = play(script, settings);
    EXPECT_EQ(script.sleeps, (Slots{250 * ms, 500 * ms, 600 * ms, 850 * ms, 1100 * ms, 1200 * ms}));
    EXPECT_EQ(played.report.executed, 3);
    EXPECT_EQ(played.report.wake_up.count(), 2);  // a wait is one, however many pieces it took
    EXPECT_EQ(played.report.late, 0);
}

TEST(Loop, LongWaitsForAnAnswerArePiecesTooAndEndWithAStop) {
    Script script;
    LoopSettings settings = ten_slots();
    settings.pace = Pace::lockstep;
    settings.answer_timeout = 3'600'000 * ms;
    Loop<ScriptedClock> loop(settings, ScriptedClock{&script});
    std::int64_t asked = 0;
    loop.run([](const Tick&) {},
             [&](std::int64_t timeout) {
                 EXPECT_EQ(timeout, 250 * ms);
                 script.time += timeout;
                 if (++asked == 5) loop.control().stop();
                 return false;
             });
    EXPECT_EQ(asked, 5);
    EXPECT_EQ(loop.report().outcome, Outcome::stopped);
    EXPECT_EQ(loop.report().executed, 1);
    EXPECT_EQ(loop.report().unanswered, 0);
}

TEST(Loop, StopEndsTheCountingOfSkippedSlots) {
    Script script;
    LoopSettings settings = ten_slots();
    settings.slots = std::numeric_limits<std::int64_t>::max();
    settings.factor = 1e4;
    script.step_time[0] = 86'400'000 * ms;  // a day: 10¹² slots
    Loop<ScriptedClock> loop(settings, ScriptedClock{&script});
    std::thread stopper([&] {
        usleep(50'000);
        loop.control().stop();
    });
    loop.run([&](const Tick& tick) { script.time += script.step_time[tick.slot]; });
    stopper.join();
    EXPECT_EQ(loop.report().outcome, Outcome::stopped);
    EXPECT_EQ(loop.report().executed, 1);
    EXPECT_LT(loop.report().skipped, 864'000'000'000);
}

TEST(Loop, WhoeverHasNobodyToWaitForIsAskedOnce) {
    Script script;
    LoopSettings settings = ten_slots();
    settings.pace = Pace::lockstep;
    settings.answer_timeout = 3'600'000 * ms;
    Loop<ScriptedClock> loop(settings, ScriptedClock{&script});
    std::int64_t asked = 0;
    loop.run([](const Tick&) {}, [&](std::int64_t) { return ++asked < 0; });
    EXPECT_EQ(asked, 9);
    EXPECT_EQ(loop.report().unanswered, 9);
}

// ---- a real process, really stopped ------------------------------------------------------------------

struct Counts {
    std::int64_t executed, skipped, late, slots_seen_twice_or_lost;
};

// Runs `slots` slots of 1 ms in a child that stops itself in slot 50 (inside its step, or asleep before
// it), and wakes it again after at least 150 ms.
Counts run_stopped_child(std::int64_t catch_up, bool while_asleep) {
    int channel[2];
    EXPECT_EQ(pipe(channel), 0);
    const pid_t child = fork();
    if (child == 0) {
        struct StoppingClock : SteadyClock {
            bool armed = false;
            int sleeps = 0;
            void sleep_until(std::int64_t time) noexcept {
                if (armed && ++sleeps == 50) raise(SIGSTOP);
                SteadyClock::sleep_until(time);
            }
        } clock;
        clock.armed = while_asleep;
        LoopSettings settings;
        settings.slots = 400;
        settings.catch_up = catch_up;
        auto loop = std::make_unique<Loop<StoppingClock>>(settings, clock);
        std::int64_t expected = 0, wrong = 0;
        loop->run([&](const Tick& tick) {
            wrong += tick.slot != expected + tick.skipped || tick.executed + tick.skipped > tick.slot;
            expected = tick.slot + 1;
            if (!while_asleep && tick.executed == 50) raise(SIGSTOP);
        });
        const LoopReport& report = loop->report();
        const Counts counts{report.executed, report.skipped, report.late, wrong};
        const bool written = write(channel[1], &counts, sizeof counts) == sizeof counts;
        _exit(written ? 0 : 1);
    }
    int status = 0;
    EXPECT_EQ(waitpid(child, &status, WUNTRACED), child);
    EXPECT_TRUE(WIFSTOPPED(status));
    usleep(150'000);
    kill(child, SIGCONT);
    EXPECT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    Counts counts{};
    EXPECT_EQ(read(channel[0], &counts, sizeof counts), static_cast<ssize_t>(sizeof counts));
    close(channel[0]);
    close(channel[1]);
    return counts;
}

TEST(Loop, StoppedProcessCatchesUpEverySlotAfterItsContinuation) {
    for (const bool while_asleep : {false, true}) {
        const Counts counts = run_stopped_child(100'000, while_asleep);
        EXPECT_EQ(counts.executed, 400);
        EXPECT_EQ(counts.skipped, 0);
        EXPECT_GE(counts.late, 149);  // 150 ms without a processor, whatever the machine does besides
        EXPECT_EQ(counts.slots_seen_twice_or_lost, 0);
    }
}

TEST(Loop, StoppedProcessBeyondTheBoundAccountsForEverySkippedSlot) {
    for (const bool while_asleep : {false, true}) {
        const Counts counts = run_stopped_child(20, while_asleep);
        EXPECT_EQ(counts.executed + counts.skipped, 400);
        EXPECT_GE(counts.skipped, 148);
        EXPECT_EQ(counts.slots_seen_twice_or_lost, 0);
    }
}

}  // namespace
}  // namespace shiftrig::rt
