#include "analysis/driveline_graph.h"

#include <algorithm>
#include <array>
#include <deque>
#include <map>

namespace shiftrig::analysis {

namespace {

class Builder {
  public:
    explicit Builder(const plant::Description& machine) : machine_(machine) {}

    DrivelineGraph build() {
        for (const auto& mass : machine_.masses) {
            masses_[mass.name] = static_cast<int>(graph_.nodes.size());
            const bool rotating = mass.motion == plant::Motion::rotating;
            graph_.nodes.push_back(
                {{}, true, mass.name, digits(mass.inertia) + (rotating ? " kg m²" : " kg")});
        }
        plant::for_each_connector(machine_, [&](const auto& connector) {
            device(look_of(connector), connector.name, plant::ends(connector));
        });

        place_in_columns();
        order_columns();
        hang();
        return std::move(graph_);
    }

  private:
    // A link to the housing has an empty name and is not drawn as an edge.
    template <std::size_t links>
    void device(const Look& look, const std::string& name, const std::array<plant::End, links>& ends) {
        const int node = static_cast<int>(graph_.nodes.size());
        graph_.nodes.push_back({look.symbol, false, name, look.figure});
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
            if (!placed_node.is_on_one_mass())
                graph_.columns = std::max(graph_.columns, placed_node.column + 1);
    }

    // Each column sorted by the mean row of its neighbours, swept to and fro: few crossings, straight runs.
    void order_columns() {
        std::vector<std::vector<int>> columns(static_cast<std::size_t>(graph_.columns));
        for (int i = 0; i < static_cast<int>(graph_.nodes.size()); ++i)
            if (!node(i).is_on_one_mass()) columns[static_cast<std::size_t>(node(i).column)].push_back(i);
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
            if (!hanging.is_on_one_mass()) continue;
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
