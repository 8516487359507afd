#include "analysis/driveline_dot.h"

#include "analysis/driveline_graph.h"

namespace shiftrig::analysis {

namespace {

std::string quoted(const std::string& text) {
    std::string result = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') result += '\\';
        result += c;
    }
    return result + "\"";
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
        dot += "  n" + std::to_string(i) + " [shape=" + node.symbol.shape + ", label=" + escaped + "];\n";
    }
    for (const auto& edge : graph.edges) {
        dot += "  n" + std::to_string(edge.mass) + " -- n" + std::to_string(edge.device);
        if (!edge.role.empty()) dot += " [label=" + quoted(edge.role) + "]";
        dot += ";\n";
    }
    return dot + "}\n";
}

}  // namespace shiftrig::analysis
