#include "apps/shiftrig/loop_report.h"

namespace shiftrig::cli {

nlohmann::json to_json(const rt::Histogram& histogram) {
    return {{"count", histogram.count()},
            {"min", histogram.minimum()},
            {"mean", histogram.mean()},
            {"p50", histogram.percentile(50)},
            {"p90", histogram.percentile(90)},
            {"p99", histogram.percentile(99)},
            {"p99_9", histogram.percentile(99.9)},
            {"max", histogram.maximum()}};
}

nlohmann::json to_json(const rt::LoopReport& report) {
    return {{"outcome", rt::name(report.outcome)},
            {"executed", report.executed},
            {"skipped", report.skipped},
            {"late", report.late},
            {"late_after_ns", report.late_after},
            {"late_wake_ups", report.wake_up.count_above(report.late_after)},
            {"longest_late_run", report.longest_late_run},
            {"late_runs", report.late_runs},
            {"overruns", report.overruns},
            {"unanswered", report.unanswered},
            {"clock_reversals", report.clock_reversals},
            {"anchors", report.anchors},
            {"wall_time_s", static_cast<double>(report.ended - report.began) * 1e-9},
            {"wake_up_ns", to_json(report.wake_up)},
            {"lateness_ns", to_json(report.lateness)},
            {"step_ns", to_json(report.step)},
            {"response_ns", to_json(report.response)}};
}

nlohmann::json to_json(const rt::Refusals& refusals) {
    nlohmann::json list = nlohmann::json::array();
    for (const rt::Refusal& refusal : refusals)
        list.push_back({{"what", refusal.what}, {"remedy", refusal.remedy}});
    return list;
}

std::string describe(const rt::LoopReport& report) {
    std::string text = "ticks     " + std::to_string(report.executed) + " executed, " +
                       std::to_string(report.skipped) + " skipped, " + std::to_string(report.late) +
                       " late (at most " + std::to_string(report.longest_late_run) + " in a row), " +
                       std::to_string(report.overruns) + " overruns";
    if (report.unanswered) text += ", " + std::to_string(report.unanswered) + " unanswered";
    if (report.clock_reversals)
        text += ", clock went back " + std::to_string(report.clock_reversals) + " times";
    if (report.outcome != rt::Outcome::completed) text += "; " + std::string(rt::name(report.outcome));
    text += "\n";
    const auto line = [&text](const char* label, const rt::Histogram& histogram) {
        if (histogram.count()) text += label + histogram.percentiles() + "\n";
    };
    line("wake-up   ", report.wake_up);
    line("lateness  ", report.lateness);
    line("step      ", report.step);
    line("response  ", report.response);
    return text;
}

std::string gave_up(const rt::LoopReport& report) {
    if (report.outcome == rt::Outcome::completed || report.outcome == rt::Outcome::stopped) return "";
    return "the loop gave up after " + std::to_string(report.executed) +
           " ticks: " + rt::name(report.outcome);
}

}  // namespace shiftrig::cli
