#include "plant/piece.h"

#include <algorithm>

#include "plant/devices.h"
#include "plant/rest_problem.h"

namespace shiftrig::plant::detail {
namespace {

int first_place(const ModelData& m, int device) {
    const int mass = device < m.pairs ? m.structure.pairs[static_cast<std::size_t>(device)].links[0].mass
                                      : m.structure.meshes[static_cast<std::size_t>(device - m.pairs)].first;
    return m.tree ? m.tree->position[static_cast<std::size_t>(mass)] : mass;
}

bool joins(const Work& w, const Mode& mode, int pair, const Sample& s) {
    const unsigned char state = w.contact[pair];
    return state == locked || (slips(state) && is_still(w, mode, pair, s));
}

// Parents come first: one pass.
void join_tree(const Work& w, const Mode& mode, const Sample& s, int* joined) {
    const ModelData& m = w.model;
    for (int p = 0; p < m.masses; ++p) {
        const TreeTopology::Edge& edge = m.tree->edges[static_cast<std::size_t>(p)];
        const bool hangs = edge.rigid >= m.pairs || (edge.rigid >= 0 && joins(w, mode, edge.rigid, s));
        joined[p] = hangs ? joined[edge.parent] : p;
    }
}

void join_masses(const Work& w, const Mode& mode, const Sample& s, int* joined) {
    const ModelData& m = w.model;
    for (int j = 0; j < m.masses; ++j) joined[j] = j;
    const auto join = [&](int a, int b) {
        if (a < 0 || b < 0 || joined[a] == joined[b]) return;
        const int kept = std::min(joined[a], joined[b]), dropped = std::max(joined[a], joined[b]);
        std::replace(joined, joined + m.masses, dropped, kept);
    };
    for (const Mesh& mesh : m.structure.meshes) {
        join(mesh.first, mesh.second);
        join(mesh.first, mesh.carrier);
    }
    for (int k = 0; k < m.pairs; ++k) {
        const auto& links = m.structure.pairs[static_cast<std::size_t>(k)].links;
        if (links[1].mass >= 0 && joins(w, mode, k, s)) join(links[0].mass, links[1].mass);
    }
}

}  // namespace

Piece piece_around(const Work& w, const Mode& mode, int device, const Sample& s) SHIFTRIG_REALTIME {
    if (device < 0) return {};
    int* const joined = w.scratch.piece.data();
    mode.tree ? join_tree(w, mode, s, joined) : join_masses(w, mode, s, joined);
    return {&w.model, joined, joined[first_place(w.model, device)]};
}

bool Piece::holds(int device) const SHIFTRIG_REALTIME {
    return !joined || joined[first_place(*model, device)] == first;
}

}  // namespace shiftrig::plant::detail
