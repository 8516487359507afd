// A machine as a graph to be drawn: masses and devices are nodes, links are edges. Nodes stand in columns
// by their distance from the input mass, so that power runs from left to right.
#pragma once

#include <string>
#include <vector>

#include "analysis/driveline_symbols.h"
#include "plant/description.h"

namespace shiftrig::analysis {

struct DrivelineGraph {
    struct Node {
        Symbol symbol;  // of a device
        bool is_mass = false;
        std::string name;
        std::string figure;  // "2.6 kg m²", "41:30"
        int column = 0;
        double row = 0;  // centred: 0 is the middle line
        bool is_on_one_mass() const { return symbol.place != Place::between; }
    };
    struct Edge {
        int mass = 0, device = 0;  // nodes
        std::string role;          // "sun"; empty where it goes without saying
    };
    std::vector<Node> nodes;
    std::vector<Edge> edges;
    int columns = 0;
    double rows = 1;  // of the fullest column
};

// Also lays it out. Devices on one mass keep that mass's column and row.
DrivelineGraph driveline_graph(const plant::Description& machine);

}  // namespace shiftrig::analysis
