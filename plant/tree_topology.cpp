#include <algorithm>

#include "plant/model_data.h"
#include "plant/tree.h"

namespace shiftrig::plant::detail {
namespace {

// Two-link devices as edges between masses, springs also to the housing (b = −1).
struct Connection {
    int a = -1, b = -1;
    double factor_a = 1, factor_b = -1;
    int rigid = -1, shaft = -1;
    double stiffness = 0, damping = 0;
    const std::string* name = nullptr;
};

std::vector<Connection> connections_of(const Structure& s) {
    std::vector<Connection> list;
    for (std::size_t k = 0; k < s.pairs.size(); ++k) {
        const auto& [a, b] = s.pairs[k].links;
        if (b.mass >= 0)
            list.push_back(
                {a.mass, b.mass, a.factor, b.factor, static_cast<int>(k), -1, 0, 0, &s.pairs[k].name});
    }
    for (std::size_t k = 0; k < s.meshes.size(); ++k) {
        const Mesh& mesh = s.meshes[k];
        list.push_back({mesh.first, mesh.second, 1, -mesh.ratio, static_cast<int>(s.pairs.size() + k), -1, 0,
                        0, &mesh.name});
    }
    for (std::size_t e = 0; e < s.shafts.size(); ++e) {
        const Elastic& shaft = s.shafts[e];
        list.push_back({shaft.links[0].mass, shaft.links[1].mass, 1, -1, -1, static_cast<int>(e),
                        shaft.stiffness, shaft.damping, &shaft.name});
    }
    for (const Elastic& damper : s.dampers) {
        if (damper.links[1].mass < 0) continue;
        const auto beside = [&](const Connection& c) {
            return c.rigid < 0 && ((c.a == damper.links[0].mass && c.b == damper.links[1].mass) ||
                                   (c.b == damper.links[0].mass && c.a == damper.links[1].mass));
        };
        const auto shaft = std::find_if(list.begin(), list.end(), beside);
        if (shaft != list.end()) {
            shaft->damping += damper.damping;
        } else {
            list.push_back(
                {damper.links[0].mass, damper.links[1].mass, 1, -1, -1, -1, 0, damper.damping, &damper.name});
        }
    }
    return list;
}

struct Neighbour {
    int mass;
    std::size_t connection;
};

class Builder {
  public:
    explicit Builder(const ModelData& m) : model_(m), connections_(connections_of(m.structure)) {
        near_.resize(m.structure.inertia.size());
    }

    bool is_forest(std::string& reason) {
        std::vector<int> root(near_.size());
        for (std::size_t j = 0; j < root.size(); ++j) root[j] = static_cast<int>(j);
        const auto find = [&](int j) {
            while (root[static_cast<std::size_t>(j)] != j) j = root[static_cast<std::size_t>(j)];
            return j;
        };
        for (const Mesh& mesh : model_.structure.meshes) {
            if (mesh.planetary) {
                reason = "row \"" + mesh.name + "\" joins three masses";
                return false;
            }
        }
        for (std::size_t c = 0; c < connections_.size(); ++c) {
            const Connection& connection = connections_[c];
            if (connection.b < 0) continue;
            const int a = find(connection.a), b = find(connection.b);
            if (a == b) {
                reason = "\"" + *connection.name + "\" closes a loop";
                return false;
            }
            root[static_cast<std::size_t>(a)] = b;
            near_[static_cast<std::size_t>(connection.a)].push_back({connection.b, c});
            near_[static_cast<std::size_t>(connection.b)].push_back({connection.a, c});
        }
        return true;
    }

    std::unique_ptr<TreeTopology> build() {
        auto t = std::make_unique<TreeTopology>();
        const std::size_t n = near_.size();
        t->position.assign(n, -1);
        for (std::size_t j = 0; j < n; ++j) {
            if (t->position[j] < 0) place_component(*t, end_of_component(static_cast<int>(j)));
        }
        place_anchors(*t);
        const Structure& s = model_.structure;
        t->ground_damping.assign(t->edges.size(), 0.);
        for (const Elastic& damper : s.dampers) {
            if (damper.links[1].mass < 0) {
                t->ground_damping[static_cast<std::size_t>(
                    t->position[static_cast<std::size_t>(damper.links[0].mass)])] += damper.damping;
            }
        }
        double heaviest = 1;
        for (std::size_t k = 0; k < s.pairs.size(); ++k) {
            const auto& links = s.pairs[k].links;
            if (links[1].mass < 0) {
                t->grounds.push_back({t->position[static_cast<std::size_t>(links[0].mass)],
                                      static_cast<int>(k), links[0].factor});
            }
            t->weight.push_back(s.pairs[k].nominal_capacity);
            heaviest = std::max(heaviest, s.pairs[k].nominal_capacity);
        }
        t->weight.resize(s.pairs.size() + 2 * s.meshes.size(),
                         1e3 * heaviest);  // sharing is for friction pairs
        for (const Mesh& mesh : s.meshes) t->lossy = t->lossy || mesh.lossy();
        t->kernel = choose_tree_kernel(model_.kernel.kind);
        return t;
    }

  private:
    // An end of the longest path through the component of `start`: a chain is then one run.
    int end_of_component(int start) const {
        std::vector<int> from(near_.size());
        const auto farthest = [&](int source) {
            std::vector<int> queue{source};
            std::fill(from.begin(), from.end(), -2);
            from[static_cast<std::size_t>(source)] = -1;
            for (std::size_t i = 0; i < queue.size(); ++i) {
                for (const Neighbour& next : near_[static_cast<std::size_t>(queue[i])]) {
                    if (from[static_cast<std::size_t>(next.mass)] != -2) continue;
                    from[static_cast<std::size_t>(next.mass)] = queue[i];
                    queue.push_back(next.mass);
                }
            }
            return queue.back();
        };
        return farthest(farthest(start));
    }

    void place_component(TreeTopology& t, int root) {
        // Sizes of subtrees, from a breadth-first order read backwards.
        std::vector<int> order{root};
        std::vector<int> up(near_.size(), -1);
        for (std::size_t i = 0; i < order.size(); ++i) {
            for (const Neighbour& next : near_[static_cast<std::size_t>(order[i])]) {
                if (next.mass == up[static_cast<std::size_t>(order[i])]) continue;
                up[static_cast<std::size_t>(next.mass)] = order[i];
                order.push_back(next.mass);
            }
        }
        std::vector<int> size(near_.size(), 1);
        for (std::size_t i = order.size(); i-- > 1;)
            size[static_cast<std::size_t>(up[static_cast<std::size_t>(order[i])])] +=
                size[static_cast<std::size_t>(order[i])];

        struct Visit {
            int mass, parent;
            std::size_t connection;
        };
        std::vector<Visit> stack{{root, -1, 0}};
        while (!stack.empty()) {
            const Visit visit = stack.back();
            stack.pop_back();
            const auto position = static_cast<int>(t.mass.size());
            t.mass.push_back(visit.mass);
            t.position[static_cast<std::size_t>(visit.mass)] = position;
            t.edges.push_back(edge_to_parent(t, visit.mass, visit.parent, visit.connection));
            std::vector<Neighbour> children;
            for (const Neighbour& next : near_[static_cast<std::size_t>(visit.mass)]) {
                if (next.mass != visit.parent) children.push_back(next);
            }
            std::stable_sort(children.begin(), children.end(), [&](const Neighbour& a, const Neighbour& b) {
                return size[static_cast<std::size_t>(a.mass)] < size[static_cast<std::size_t>(b.mass)];
            });
            for (const Neighbour& child : children)
                stack.push_back({child.mass, visit.mass, child.connection});
        }
    }

    void place_anchors(TreeTopology& t) const {
        for (std::size_t c = 0; c < connections_.size(); ++c) {
            if (connections_[c].b >= 0) continue;
            t.mass.push_back(connections_[c].a);
            t.edges.push_back(edge_to_parent(t, -1, connections_[c].a, c));
        }
    }

    TreeTopology::Edge edge_to_parent(const TreeTopology& t, int mass, int parent,
                                      std::size_t connection) const {
        TreeTopology::Edge edge;
        if (parent < 0) return edge;
        const Connection& c = connections_[connection];
        const bool first = c.a == mass;
        edge.parent = t.position[static_cast<std::size_t>(parent)];
        edge.rigid = c.rigid;
        edge.shaft = c.shaft;
        edge.own = first ? c.factor_a : c.factor_b;
        edge.up = first ? c.factor_b : c.factor_a;
        edge.stiffness = c.stiffness;
        edge.damping = c.damping;
        edge.sign = first ? 1 : -1;
        return edge;
    }

    const ModelData& model_;
    std::vector<Connection> connections_;
    std::vector<std::vector<Neighbour>> near_;
};

}  // namespace

std::unique_ptr<TreeTopology> build_topology(const ModelData& model, std::string& reason) {
    if (!model.backlashes.empty()) {
        const auto shaft = static_cast<std::size_t>(model.backlashes.front().shaft);
        reason = "backlash \"" + model.structure.shafts[shaft].name + "\" changes its stiffness";
        return nullptr;
    }
    Builder builder(model);
    if (!builder.is_forest(reason)) return nullptr;
    return builder.build();
}

}  // namespace shiftrig::plant::detail
