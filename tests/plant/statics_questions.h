// Questions to the statics, and its answers by name.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "plant/plant.h"
#include "plant/statics.h"
#include "tests/plant/machines.h"

namespace shiftrig::plant {

inline std::map<std::string, double> torques(const StaticsResult& result) {
    std::map<std::string, double> by_name;
    for (const auto& link : result.links) by_name[link.name] = link.torque;
    return by_name;
}

inline StaticsProblem problem(std::vector<std::string> closed, std::string node, double torque,
                              bool ideal = false) {
    StaticsProblem p;
    p.closed = std::move(closed);
    p.inputs = {{std::move(node), torque}};
    p.ideal = ideal;
    return p;
}

inline std::string error_of(const Description& d, const StaticsProblem& p) {
    try {
        solve_statics(d, p);
    } catch (const ModelError& error) {
        return error.what();
    }
    return "no error";
}

inline Description one_row() {
    Description d;
    d.name = "one_row";
    d.masses = {machines::mass("sun", 1), machines::mass("ring", 1), machines::mass("carrier", 1)};
    d.planetaries = {machines::row("D", "sun", "ring", "carrier", -2, 0.97)};
    d.clutches = {machines::clutch("B", "ring", "")};
    return d;
}

}  // namespace shiftrig::plant
