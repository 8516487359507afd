// A machine as a graph to be drawn: masses and devices are nodes, links are edges. Nodes stand in columns
// by their distance from the input mass, so that power runs from left to right.
#pragma once

#include <string>
#include <vector>

#include "plant/description.h"

namespace shiftrig::analysis {

struct DrivelineGraph {
    enum class Kind {
        mass,
        clutch,
        freewheel,
        shaft,
        backlash,
        damper,
        gear,
        planetary,
        tyre,
        converter,
        brake,  // hangs on one mass
        sprag,  // a freewheel to the housing
        engine,
        source,
        road,
        plough,  // act on one mass
    };
    struct Node {
        Kind kind{};
        std::string name;
        std::string figure;  // "2.6 kg m²", "41:30"
        int column = 0;
        double row = 0;  // centred: 0 is the middle line
    };
    struct Edge {
        int mass = 0, device = 0;  // nodes
        std::string role;          // "sun"; empty where it goes without saying
    };
    std::vector<Node> nodes;
    std::vector<Edge> edges;
    int columns = 0;
    double rows = 1;  // of the fullest column

    static bool hangs_on_one_mass(Kind kind) { return kind >= Kind::brake; }
};

// Also lays it out. Devices on one mass keep that mass's column and row.
DrivelineGraph driveline_graph(const plant::Description& machine);

}  // namespace shiftrig::analysis
