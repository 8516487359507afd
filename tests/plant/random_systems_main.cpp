// shiftrig_random_systems: thousands of random machines on plant::step and on the reference solver.
// Exit 0 only if every comparable system agrees, no invariant breaks and at most 1 % are not comparable.
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "io/number.h"
#include "tests/plant/comparison.h"
#include "tests/plant/random_forests.h"
#include "tests/plant/random_pistons.h"
#include "tests/plant/random_vehicles.h"

namespace {

using namespace shiftrig;

// Those of ark3_test, which counts them from 1001.
RandomSystem forest(std::uint64_t seed, bool losses) {
    RandomSystem system;
    system.description = plant::Forest(seed + 1000).build(losses);
    system.traits = "n=" + std::to_string(system.description.masses.size());
    return system;
}
RandomSystem random_forest(std::uint64_t seed, double) {
    return forest(seed, false);
}
RandomSystem random_lossy_forest(std::uint64_t seed, double) {
    return forest(seed, true);
}

using Maker = RandomSystem (*)(std::uint64_t seed, double seconds);
const std::map<std::string, Maker> kinds = {
    {"plain", random_system},
    {"freewheels", random_system_with_freewheels},
    {"backlashes", random_system_with_backlashes},
    {"tables", random_system_with_friction_tables},
    {"brakes", random_system_of_brakes},
    {"forests", random_forest},
    {"lossy_forests", random_lossy_forest},
    {"vehicles", random_vehicle},
    {"wet_vehicles", random_vehicle_with_wet_clutches},
    {"pistons", random_machine_with_pistons},
};

struct Arguments {
    long count = 100, jobs = 1;
    std::uint64_t seed = 1;
    std::vector<std::uint64_t> seeds;  // instead of count and seed
    ComparisonOptions options;
    Maker make = random_system;
    plant::Method method = plant::Method::automatic;
    bool mounts = false, verbose = false;
};

const char usage[] =
    "usage: shiftrig_random_systems [--count N] [--seed S | --seeds A,B,…] [--seconds T] [--jobs J] "
    "[--substeps K] "
    "[--kind plain|freewheels|backlashes|tables|brakes|forests|lossy_forests|vehicles|wet_vehicles|pistons] "
    "[--mounts] [--quick] [--method etd3|ark3] [--verbose]\n"
    "  systems S … S+N−1, or those named, each simulated for T seconds at 1 ms / K; --mounts hangs masses on "
    "springs to the housing; --quick asks only where runs differ whether a machine is sensitive; --verbose "
    "prints each that does not agree\n";

std::vector<std::uint64_t> numbers(const char* list) {
    std::vector<std::uint64_t> found;
    for (char* end; *list; list = *end ? end + 1 : end) found.push_back(std::strtoull(list, &end, 10));
    return found;
}

bool parse(int argc, char** argv, Arguments& a) {
    for (int i = 1; i < argc; ++i) {
        const std::string key = argv[i];
        if (key == "--verbose" || key == "--mounts" || key == "--quick") {
            (key == "--mounts" ? a.mounts : key == "--quick" ? a.options.quick : a.verbose) = true;
            continue;
        }
        if (i + 1 >= argc) return false;
        const char* value = argv[++i];
        if (key == "--count")
            a.count = std::atol(value);
        else if (key == "--seed")
            a.seed = std::strtoull(value, nullptr, 10);
        else if (key == "--seeds")
            a.seeds = numbers(value);
        else if (key == "--seconds")
            a.options.seconds = io::finite_number(value).value_or(0);
        else if (key == "--substeps")
            a.options.steps_per_sample = std::atoi(value);
        else if (key == "--jobs")
            a.jobs = std::atol(value);
        else if (key == "--method" && value == std::string("etd3"))
            a.method = plant::Method::etd3;
        else if (key == "--method" && value == std::string("ark3"))
            a.method = plant::Method::ark3;
        else if (key == "--kind" && kinds.contains(value))
            a.make = kinds.at(value);
        else
            return false;
    }
    if (!a.seeds.empty()) a.count = static_cast<long>(a.seeds.size());
    return a.count > 0 && a.jobs > 0 && a.jobs <= 1024 && a.options.seconds > 0.01 &&
           a.options.seconds <= 1e6 && a.options.steps_per_sample > 0 && a.options.steps_per_sample <= 1000;
}

}  // namespace

int main(int argc, char** argv) {
    Arguments arguments;
    if (!parse(argc, argv, arguments)) {
        std::fputs(usage, stderr);
        return 2;
    }
    std::atomic<long> next = 0;
    std::mutex lock;
    std::map<Outcome, long> tally;
    double worst_agreeing = 0, worst_defect = 0, reference_seconds = 0;
    long fall_backs = 0, events = 0;
    const auto work = [&] {
        for (long i; (i = next++) < arguments.count;) {
            const std::uint64_t seed = arguments.seeds.empty()
                                           ? arguments.seed + static_cast<std::uint64_t>(i)
                                           : arguments.seeds[static_cast<std::size_t>(i)];
            RandomSystem system = arguments.make(seed, arguments.options.seconds);
            system.description.method = arguments.method;
            if (arguments.mounts) system = with_mounts(std::move(system), seed);
            Comparison c;
            try {
                c = compare(system, seed, arguments.options);
            } catch (const std::exception& error) {
                c.outcome = Outcome::broken;
                c.broken.push_back(error.what());
            }
            const std::lock_guard guard(lock);
            ++tally[c.outcome];
            fall_backs += c.fall_backs;
            events += c.events;
            reference_seconds += c.seconds_reference;
            worst_defect = std::max(worst_defect, c.energy_defect);
            if (c.outcome == Outcome::agrees) {
                worst_agreeing = std::max(worst_agreeing, c.worst);
                continue;
            }
            if (c.outcome == Outcome::sensitive && !arguments.verbose) continue;
            std::printf(
                "%llu %s: %.3g tolerances (speeds %.3g) on %s at %.3f s (%.9g, not %.9g), %d fall-backs, %d "
                "coarse, %d lost; "
                "%s\n",
                static_cast<unsigned long long>(seed), name(c.outcome), c.worst, c.worst_speed,
                c.worst_signal.c_str(), c.worst_time, c.worst_value, c.worst_truth, c.fall_backs, c.coarse,
                c.lost, system.traits.c_str());
            for (const auto& line : c.broken) std::printf("    %s\n", line.c_str());
            if (arguments.verbose) {
                std::fputs(describe(system.description).c_str(), stdout);
                std::fputs(timelines(system, arguments.options, c.worst_time + 2e-3).c_str(), stdout);
            }
            std::fflush(stdout);
        }
    };
    std::vector<std::thread> threads;
    for (long j = 0; j < arguments.jobs; ++j) threads.emplace_back(work);
    for (auto& t : threads) t.join();
    std::printf("%ld systems of %g s:", arguments.count, arguments.options.seconds);
    for (const auto& [outcome, number] : tally) std::printf(" %ld %s;", number, name(outcome));
    std::printf(
        "\nlargest difference where they agree %.2g tolerances (1e-4 of the signal's range); %ld events, %ld "
        "fall-backs;\n"
        "worst ledger defect %.1e of the energy moved; reference %.3f s per system\n",
        worst_agreeing, events, fall_backs, worst_defect,
        reference_seconds / static_cast<double>(arguments.count));
    const long incomparable =
        tally[Outcome::sensitive] + tally[Outcome::ambiguous] + tally[Outcome::reference_failed];
    const bool good = tally[Outcome::disagrees] == 0 && tally[Outcome::broken] == 0 &&
                      100 * incomparable <= arguments.count;
    return good ? 0 : 1;
}
