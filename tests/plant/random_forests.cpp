#include "tests/plant/random_forests.h"

#include <cmath>
#include <string>

#include "tests/plant/parts.h"

namespace shiftrig::plant {

Description Forest::build(bool losses) {
    Description d;
    d.name = "forest";
    const int n = 3 + below(12);
    for (int j = 0; j < n; ++j) {
        d.masses.push_back(mass("m" + std::to_string(j), std::pow(10, real(-1, 1)), 0));
        if (j == 0) continue;
        const int parent = real(0, 1) < 0.6 ? j - 1 : below(j);
        const std::string a = "m" + std::to_string(parent), b = "m" + std::to_string(j), name = "d" + b;
        const bool turned = below(2) == 1;
        const std::string &first = turned ? b : a, &second = turned ? a : b;
        const double kind = real(0, 1);
        if (kind < 0.4) {
            d.shafts.push_back({name, first, second, real(100, 3000), real(0, 5), 0});
            if (below(4) == 0) d.dampers.push_back({name + "d", second, first, real(0.1, 2)});
        } else if (kind < 0.7) {
            const double f = real(0.3, 1.5), phase = real(0, 1);
            const double static_ratio = 1 + below(2) * 0.15, capacity = real(20, 200);
            d.clutches.push_back(clutch(name, first, second, capacity, static_ratio,
                                        ActuationDirect{sine(1, f, -1e300, 1e300, phase), 0}));
        } else if (kind < 0.95) {
            const double efficiency = losses ? real(0.6, 1) : 1;
            const double bearing = losses && below(3) == 0 ? real(0.1, 2) : 0;
            const double sign = below(3) == 0 ? -1 : 1, ratio = sign * real(0.4, 2.5);
            d.gears.push_back(lossy_gear(name, first, second, ratio, efficiency, bearing));
        } else {
            d.dampers.push_back({name, first, second, real(0.5, 5)});
        }
    }
    for (int j = 0; j < n; ++j) {
        const std::string name = "m" + std::to_string(j);
        if (below(4) == 0) {
            const double phase = real(0, 1), f = real(0.3, 1.5), capacity = real(20, 100);
            d.clutches.push_back(clutch("b" + name, name, "", capacity, 1.1,
                                        ActuationDirect{sine(1, f, -1e300, 1e300, phase), 0}));
        }
        if (below(3) == 0) {
            const double phase = real(0, 1), f = real(0.5, 4), amplitude = real(20, 150);
            d.sources.push_back(source(name, sine(amplitude, f, -1e300, 1e300, phase)));
        }
        if (below(6) == 0) d.dampers.push_back({"g" + name, name, "", real(0.01, 1)});
    }
    if (d.sources.empty()) d.sources.push_back(source("m0", sine(100, 2)));
    return d;
}

void add_mounts(Description& machine, std::uint64_t seed) {
    Forest draw(seed);
    for (const Mass& mass : machine.masses) {
        if (draw.below(3) != 0) continue;
        const double omega = draw.real(10, 300), damping_ratio = draw.real(0, 0.3),
                     twist = draw.real(-0.1, 0.1) / omega;
        machine.shafts.push_back({"mount_" + mass.name, mass.name, "", mass.inertia * omega * omega,
                                  2 * damping_ratio * mass.inertia * omega, twist});
    }
}

}  // namespace shiftrig::plant
