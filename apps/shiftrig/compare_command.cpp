// shiftrig compare: two recordings or result sets, and which shift got worse.
#include <algorithm>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "analysis/compare.h"
#include "analysis/result_set.h"
#include "apps/shiftrig/arguments.h"
#include "apps/shiftrig/command.h"

namespace shiftrig::cli {

namespace {

using analysis::Difference;

struct Options {
    std::string before, after, limits;
    double tolerance_percent = 2;
    bool json = false;
};

const char* word(Difference::Kind kind) {
    switch (kind) {
        case Difference::Kind::worse:
            return "worse";
        case Difference::Kind::better:
            return "better";
        case Difference::Kind::missing:
            return "missing";
        case Difference::Kind::added:
            return "added";
    }
    return "";
}

int run(const Options& options) {
    const analysis::Limits limits =
        options.limits.empty() ? analysis::default_limits() : analysis::read_limits(options.limits);
    const analysis::ResultSet before = analysis::read_results(options.before, limits);
    const analysis::ResultSet after = analysis::read_results(options.after, limits);
    std::map<std::string, std::string> left_out = before.not_whole;
    left_out.insert(after.not_whole.begin(), after.not_whole.end());
    for (const auto* set : {&before, &after}) {
        for (const auto& [run_name, why] : set->not_whole) tell(why);
        for (const auto& remark : set->remarks) tell(remark);
    }
    const std::vector<Difference> differences =
        analysis::compare(before.runs, after.runs, limits, {.relative = options.tolerance_percent / 100});
    const auto worse = std::count_if(differences.begin(), differences.end(), [](const Difference& d) {
        return d.kind == Difference::Kind::worse || d.kind == Difference::Kind::missing;
    });
    if (options.json) {
        nlohmann::json list = nlohmann::json::array();
        for (const Difference& d : differences) {
            list.push_back({{"kind", word(d.kind)},
                            {"run", d.run},
                            {"shift", d.shift},
                            {"metric", d.metric},
                            {"before", d.before},
                            {"after", d.after}});
        }
        nlohmann::json not_compared = nlohmann::json::array();
        for (const auto& [run_name, why] : left_out)
            not_compared.push_back({{"run", run_name}, {"why", why}});
        const nlohmann::json result{{"worse", worse}, {"differences", list}, {"not_compared", not_compared}};
        std::cout << result.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
    } else {
        for (const Difference& d : differences) std::cout << d.text() << '\n';
        std::size_t shifts = 0;
        for (auto one = before.runs.begin(); one != before.runs.end(); ++one)
            if (left_out.count(one.key()) == 0) shifts += one->size();
        std::cout << shifts << " shifts compared, " << worse << " differences for the worse";
        if (!left_out.empty()) std::cout << "; runs not compared: " << left_out.size();
        std::cout << '\n';
    }
    return !left_out.empty() ? bad_input : worse > 0 ? failed : good;
}

Command::Run declare(CLI::App& app) {
    auto options = std::make_shared<Options>();
    app.add_option("BEFORE", options->before,
                   "a recording, a result of run --json or test --json, or a folder of them")
        ->required();
    app.add_option("AFTER", options->after, "the same runs, later")->required();
    app.add_option("--limits", options->limits, "limits (default: those of config/limits.yaml)");
    add_number(app, "--tolerance", options->tolerance_percent, {0, 1e6},
               "changes up to this many percent are none")
        ->capture_default_str();
    app.add_flag("--json", options->json, "for programs");
    app.footer(
        "Exit code 1 if anything got worse or a shift is missing, 2 if a run is not whole and could not "
        "be compared.");
    return [options] { return run(*options); };
}

const Command compare("compare", "two recordings or result sets: what got worse", declare);

}  // namespace

}  // namespace shiftrig::cli
