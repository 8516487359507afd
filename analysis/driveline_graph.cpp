#include "analysis/driveline_graph.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <deque>
#include <map>

#include "plant/connectors.h"

namespace shiftrig::analysis {

namespace {

using Kind = DrivelineGraph::Kind;

std::string digits(double value) {
    char text[32];
    std::snprintf(text, sizeof text, value < 1000 ? "%.4g" : "%.0f", value);
    return text;
}

// How a connector is drawn: its symbol, and the figure that stands at it.
struct Look {
    Kind kind;
    std::string figure;
};
Look look_of(const plant::Shaft& s) {
    return {Kind::shaft, digits(s.stiffness) + " Nm/rad"};
}
Look look_of(const plant::Backlash& b) {
    return {Kind::backlash, digits(1e3 * b.gap) + " mrad"};
}
Look look_of(const plant::Damper& d) {
    return {Kind::damper, digits(d.damping) + " Nm s/rad"};
}
Look look_of(const plant::Clutch& c) {
    return {c.b.empty() ? Kind::brake : c.radius > 0 ? Kind::tyre : Kind::clutch, ""};
}
Look look_of(const plant::Freewheel& f) {
    return {f.b.empty() ? Kind::sprag : Kind::freewheel, digits(f.rated_torque) + " Nm"};
}
Look look_of(const plant::Gear& g) {
    return {Kind::gear, "u " + digits(g.ratio)};
}
Look look_of(const plant::Planetary& p) {
    return {Kind::planetary, "u " + digits(p.ratio)};
}
Look look_of(const plant::BrixiusTyre& t) {
    return {Kind::tyre, "r " + digits(t.radius) + " m"};
}
Look look_of(const plant::TorqueConverter&) {
    return {Kind::converter, ""};
}
Look look_of(const plant::Engine&) {
    return {Kind::engine, ""};
}
Look look_of(const plant::TorqueSource&) {
    return {Kind::source, ""};
}
Look look_of(const plant::Road&) {
    return {Kind::road, ""};
}
Look look_of(const plant::Plough&) {
    return {Kind::plough, ""};
}

class Builder {
  public:
    explicit Builder(const plant::Description& machine) : machine_(machine) {}

    DrivelineGraph build() {
        for (const auto& mass : machine_.masses) {
            masses_[mass.name] = static_cast<int>(graph_.nodes.size());
            const bool rotating = mass.motion == plant::Motion::rotating;
            graph_.nodes.push_back(
                {Kind::mass, mass.name, digits(mass.inertia) + (rotating ? " kg m²" : " kg")});
        }
        plant::for_each_connector(machine_, [&](const auto& connector) {
            const Look look = look_of(connector);
            device(look.kind, connector.name, look.figure, plant::ends(connector));
        });

        place_in_columns();
        order_columns();
        hang();
        return std::move(graph_);
    }

  private:
    // A link to the housing has an empty name and is not drawn as an edge.
    template <std::size_t links>
    void device(Kind kind, const std::string& name, const std::string& figure,
                const std::array<plant::End, links>& ends) {
        const int node = static_cast<int>(graph_.nodes.size());
        graph_.nodes.push_back({kind, name, figure});
        for (const plant::End& end : ends)
            if (const auto found = masses_.find(end.mass); found != masses_.end())
                graph_.edges.push_back({found->second, node, end.role});
    }

    DrivelineGraph::Node& node(int index) { return graph_.nodes[static_cast<std::size_t>(index)]; }

    std::vector<int> neighbours(int of) const {
        std::vector<int> result;
        for (const auto& edge : graph_.edges) {
            if (edge.mass == of) result.push_back(edge.device);
            if (edge.device == of) result.push_back(edge.mass);
        }
        return result;
    }

    // Breadth first from the input; what does not hang together with it starts again at the left.
    void place_in_columns() {
        std::vector<bool> placed(graph_.nodes.size(), false);
        const auto spread = [&](int from) {
            std::deque<int> waiting{from};
            placed[static_cast<std::size_t>(from)] = true;
            while (!waiting.empty()) {
                const int here = waiting.front();
                waiting.pop_front();
                for (const int next : neighbours(here)) {
                    if (placed[static_cast<std::size_t>(next)]) continue;
                    placed[static_cast<std::size_t>(next)] = true;
                    node(next).column = node(here).column + 1;
                    waiting.push_back(next);
                }
            }
        };
        if (const auto input = masses_.find(machine_.input_mass); input != masses_.end())
            spread(input->second);
        for (const auto& mass : machine_.masses)
            if (!placed[static_cast<std::size_t>(masses_[mass.name])]) spread(masses_[mass.name]);
        for (const auto& placed_node : graph_.nodes)
            if (!DrivelineGraph::hangs_on_one_mass(placed_node.kind))
                graph_.columns = std::max(graph_.columns, placed_node.column + 1);
    }

    // Each column sorted by the mean row of its neighbours, swept to and fro: few crossings, straight runs.
    void order_columns() {
        std::vector<std::vector<int>> columns(static_cast<std::size_t>(graph_.columns));
        for (int i = 0; i < static_cast<int>(graph_.nodes.size()); ++i)
            if (!DrivelineGraph::hangs_on_one_mass(node(i).kind))
                columns[static_cast<std::size_t>(node(i).column)].push_back(i);
        const auto spread_out = [&](const std::vector<int>& column) {
            for (std::size_t k = 0; k < column.size(); ++k)
                node(column[k]).row = static_cast<double>(k) - 0.5 * static_cast<double>(column.size() - 1);
        };
        for (const auto& column : columns) {
            spread_out(column);
            graph_.rows = std::max(graph_.rows, static_cast<double>(column.size()));
        }
        constexpr int sweeps = 8;
        for (int sweep = 0; sweep < sweeps; ++sweep) {
            if (sweep % 2 == 1) std::reverse(columns.begin(), columns.end());
            for (auto& column : columns) {
                std::map<int, double> wanted;
                for (const int i : column) {
                    double sum = 0;
                    const auto around = neighbours(i);
                    for (const int other : around) sum += node(other).row;
                    wanted[i] = around.empty() ? 0 : sum / static_cast<double>(around.size());
                }
                std::stable_sort(column.begin(), column.end(),
                                 [&](int a, int b) { return wanted[a] < wanted[b]; });
                spread_out(column);
            }
            if (sweep % 2 == 1) std::reverse(columns.begin(), columns.end());
        }
    }

    void hang() {
        for (const auto& edge : graph_.edges) {
            auto& hanging = node(edge.device);
            if (!DrivelineGraph::hangs_on_one_mass(hanging.kind)) continue;
            hanging.column = node(edge.mass).column;
            hanging.row = node(edge.mass).row;
        }
    }

    const plant::Description& machine_;
    DrivelineGraph graph_;
    std::map<std::string, int> masses_;
};

}  // namespace

DrivelineGraph driveline_graph(const plant::Description& machine) {
    return Builder(machine).build();
}

}  // namespace shiftrig::analysis
