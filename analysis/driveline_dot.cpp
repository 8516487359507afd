#include "analysis/driveline_dot.h"

#include "analysis/driveline_graph.h"

namespace shiftrig::analysis {

namespace {

using Kind = DrivelineGraph::Kind;

std::string quoted(const std::string& text) {
    std::string result = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') result += '\\';
        result += c;
    }
    return result + "\"";
}

const char* shape(Kind kind) {
    switch (kind) {
        case Kind::mass:
            return "box";
        case Kind::clutch:
        case Kind::freewheel:
        case Kind::brake:
        case Kind::sprag:
            return "parallelogram";
        case Kind::gear:
            return "circle";
        case Kind::planetary:
            return "doublecircle";
        case Kind::tyre:
        case Kind::converter:
            return "ellipse";
        case Kind::shaft:
        case Kind::backlash:
        case Kind::damper:
            return "plain";
        case Kind::engine:
        case Kind::source:
        case Kind::road:
        case Kind::plough:
            return "cds";
    }
    return "box";
}

}  // namespace

std::string driveline_dot(const plant::Description& machine) {
    const DrivelineGraph graph = driveline_graph(machine);
    std::string dot = "graph " + quoted(machine.name) +
                      " {\n  rankdir=LR;\n  node [fontname=\"sans-serif\", fontsize=10];\n";
    for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
        const auto& node = graph.nodes[i];
        const std::string label = node.figure.empty() ? node.name : node.name + "\n" + node.figure;
        std::string escaped;
        for (const char c : quoted(label)) escaped += c == '\n' ? std::string("\\n") : std::string(1, c);
        dot += "  n" + std::to_string(i) + " [shape=" + shape(node.kind) + ", label=" + escaped + "];\n";
    }
    for (const auto& edge : graph.edges) {
        dot += "  n" + std::to_string(edge.mass) + " -- n" + std::to_string(edge.device);
        if (!edge.role.empty()) dot += " [label=" + quoted(edge.role) + "]";
        dot += ";\n";
    }
    return dot + "}\n";
}

}  // namespace shiftrig::analysis
