#include "analysis/scorecard.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace shiftrig::analysis {

namespace {

Verdict judge(double value, const Limit* limit) {
    if (limit == nullptr) return Verdict::told;
    if (std::isnan(value) || value > limit->reject) return Verdict::reject;
    return value <= limit->good ? Verdict::good : Verdict::acceptable;
}

Verdict worse(Verdict a, Verdict b) {
    if (b == Verdict::told) return a;
    return std::max(a, b);
}

std::string number(double value) {
    char text[32];
    const double size = std::abs(value);
    const int decimals = size >= 1000 ? 0 : size >= 100 ? 1 : size >= 1 ? 2 : 3;
    std::snprintf(text, sizeof text, "%.*f", decimals, value);
    return text;
}

}  // namespace

std::string_view name(Verdict verdict) {
    switch (verdict) {
        case Verdict::good:
            return "good";
        case Verdict::acceptable:
            return "acceptable";
        case Verdict::reject:
            return "reject";
        case Verdict::told:
            return "told";
    }
    return "";
}

const Metric* ShiftScore::find(std::string_view full_name) const noexcept {
    const auto dot = full_name.find('.');
    const std::string_view metric = full_name.substr(0, dot);
    const std::string_view clutch =
        dot == std::string_view::npos ? std::string_view() : full_name.substr(dot + 1);
    for (const Metric& candidate : metrics) {
        if (candidate.name == metric && candidate.clutch == clutch) return &candidate;
    }
    return nullptr;
}

Scorecard score(const Run& run, const Limits& limits) {
    Scorecard card;
    std::vector<Shift> shifts = find_shifts(run, limits.rules);
    if (shifts.empty()) return card;
    const std::vector<Gear> gears = gears_of(run.machine);
    for (Shift& shift : shifts) {
        ShiftScore result;
        result.metrics = measure(run, gears, shift);
        for (Metric& metric : result.metrics) {
            if (metric.value) metric.verdict = judge(*metric.value, limits.find(metric.name, shift.kind));
            result.verdict = worse(result.verdict, metric.verdict);
        }
        if (!shift.completed()) result.verdict = Verdict::reject;
        result.shift = std::move(shift);
        card.verdict = worse(card.verdict, result.verdict);
        card.shifts.push_back(std::move(result));
    }
    return card;
}

nlohmann::json to_json(const Scorecard& scorecard) {
    nlohmann::json list = nlohmann::json::array();
    for (const ShiftScore& score : scorecard.shifts) {
        const Shift& shift = score.shift;
        nlohmann::json entry{{"from", shift.from},
                             {"to", shift.to},
                             {"kind", name(shift.kind)},
                             {"completed", shift.completed()},
                             {"end", name(shift.end)},
                             {"asked_s", shift.asked_at},
                             {"ended_s", shift.ended_at},
                             {"verdict", name(score.verdict)},
                             {"verdicts", nlohmann::json::object()}};
        for (const Metric& metric : score.metrics) {
            nlohmann::json& place =
                metric.clutch.empty() ? entry[metric.name] : entry[metric.name][metric.clutch];
            if (metric.value) place = *metric.value;
            if (metric.verdict != Verdict::told) entry["verdicts"][metric.full_name()] = name(metric.verdict);
        }
        list.push_back(std::move(entry));
    }
    return list;
}

std::string to_text(const Scorecard& scorecard) {
    if (scorecard.shifts.empty()) return "no shift\n";
    std::string text;
    for (const ShiftScore& score : scorecard.shifts) {
        const Shift& shift = score.shift;
        char head[160];
        std::snprintf(head, sizeof head, "%s -> %s  at %.3f s  %s, %s: %s\n", shift.from.c_str(),
                      shift.to.c_str(), shift.asked_at, std::string(name(shift.kind)).c_str(),
                      std::string(name(shift.end)).c_str(), std::string(name(score.verdict)).c_str());
        text += head;
        for (const Metric& metric : score.metrics) {
            if (!metric.value) continue;
            char line[160];
            std::snprintf(line, sizeof line, "    %-34s %12s  %s\n", metric.full_name().c_str(),
                          number(*metric.value).c_str(),
                          metric.verdict == Verdict::told ? "" : std::string(name(metric.verdict)).c_str());
            text += line;
        }
    }
    return text;
}

}  // namespace shiftrig::analysis
