// From contact states to the matrices of one mode, see modes.h.
#include <algorithm>
#include <cmath>

#include "plant/dense.h"
#include "plant/modes.h"

namespace shiftrig::plant::detail {
namespace {

// A column is dependent on others if less than this is left of its unit length after projecting them out.
constexpr double dependent = 1e-9;

// J^(−1/2)-scaled column of a device, normalised; returns its length before that.
template <typename Links>
double scaled_column(const ModelData& m, const Links& links, double* column) {
    std::fill(column, column + m.masses, 0.);
    for (const Link& link : links) {
        if (link.mass >= 0)
            column[link.mass] += link.factor / m.root_inertia[static_cast<std::size_t>(link.mass)];
    }
    const double length = std::sqrt(dot(column, column, m.masses));
    for (int j = 0; j < m.masses; ++j) column[j] /= length;
    return length;
}

void project_out(const double* basis, int rank, int n, double* column) {
    for (int pass = 0; pass < 2; ++pass) {  // twice is enough
        for (int k = 0; k < rank; ++k) add_scaled(column, -dot(basis + k * n, column, n), basis + k * n, n);
    }
}

// Appends the rest of `column` to the basis if enough is left.
bool extend_basis(double* basis, int& rank, int n, double* column) {
    project_out(basis, rank, n, column);
    const double rest = std::sqrt(dot(column, column, n));
    if (rest < dependent) return false;
    for (int j = 0; j < n; ++j) basis[rank * n + j] = column[j] / rest;
    ++rank;
    return true;
}

// Orthonormal basis of `count` columns, the longest remainder first.
int pivoted_basis(double* columns, int count, int n, double* basis) {
    int rank = 0;
    for (int step = 0; step < std::min(count, n); ++step) {
        int best = -1;
        double longest = dependent * dependent;
        for (int c = 0; c < count; ++c) {
            const double rest = dot(columns + c * n, columns + c * n, n);
            if (rest > longest) {
                longest = rest;
                best = c;
            }
        }
        if (best < 0) break;
        double* column = columns + best * n;
        if (!extend_basis(basis, rank, n, column)) break;
        std::fill(column, column + n, 0.);
        const double* q = basis + (rank - 1) * n;
        for (int c = 0; c < count; ++c) add_scaled(columns + c * n, -dot(q, columns + c * n, n), q, n);
    }
    return rank;
}

// x of a mesh in the mode; a stuck one has no loss.
int exponent(const ModelData& m, const Mode& mode, int mesh) {
    return key_exponent(mode.key[m.pairs + mesh]);
}

// Of dependent rows: Gᵀ = Q Lᵀ, Q (rows × rank) with orthonormal columns, so that G⁺ = Q L⁻¹ without G Gᵀ, in which weights far
// apart would cost twice the digits. Leaves Q, and L⁻¹ times the right sides in their place; `lower` is for L.
void share_out(const Mode& mode, const double* g, double* q, double* lower, double* right, int columns) {
    const int rows = mode.row_count, rank = mode.rank;
    for (int k = 0; k < rank; ++k) {
        double* const v = q + k * rows;
        double* const l = lower + k * rank;  // a row of L
        for (int r = 0; r < rows; ++r) v[r] = g[r * rank + k];
        std::fill(l, l + rank, 0.);
        for (int pass = 0; pass < 2; ++pass) {  // twice is enough
            for (int other = 0; other < k; ++other) {
                const double part = dot(q + other * rows, v, rows);
                l[other] += part;
                add_scaled(v, -part, q + other * rows, rows);
            }
        }
        l[k] = std::sqrt(dot(v, v, rows));
        for (int r = 0; r < rows; ++r) v[r] = l[k] == 0 ? 0 : v[r] / l[k];
    }
    for (int j = 0; j < columns; ++j) {
        double* const x = right + j * rank;
        for (int k = 0; k < rank; ++k) {
            const double* const l = lower + k * rank;
            x[k] = l[k] == 0 ? 0 : (x[k] - dot(l, x, k)) / l[k];
        }
    }
}

// Of a row that the others cannot replace (Q Qᵀ)_rr = 1; less means that it shares its load, with those where (Q Qᵀ)_rs is not 0:
// they are in one loop.
void find_loops(const ModelData& m, Mode& mode, const double* q, int* joined) {
    const int rows = mode.row_count;
    const auto share = [&](int r, int other) {
        double sum = 0;
        for (int k = 0; k < mode.rank; ++k) sum += q[k * rows + r] * q[k * rows + other];
        return sum;
    };
    for (int r = 0; r < rows; ++r) joined[r] = r;  // to which earlier row of its loop each row
    const auto root = [joined](int r) {
        while (joined[r] != r) r = joined[r];
        return r;
    };
    for (int r = 0; r < rows; ++r) {
        if (mode.rows[r] >= m.pairs || share(r, r) >= 1 - 1e-9) continue;
        mode.bound[mode.rows[r]] |= shares_load;
        for (int other = 0; other < rows; ++other) {
            if (other == r || std::fabs(share(r, other)) < 1e-9) continue;
            const int one = root(r), two = root(other);
            joined[std::max(one, two)] = std::min(one, two);
        }
    }
    for (int r = 0; r < mode.first_mesh; ++r) {
        if (mode.bound[mode.rows[r]] & shares_load) mode.loop[mode.rows[r]] = root(r) + 1;
    }
}

}  // namespace

void set_loss_shares(const ModelData& m, Mode& mode) SHIFTRIG_REALTIME {
    for (int k = 0; k < m.meshes; ++k) {
        const Mesh& mesh = m.structure.meshes[static_cast<std::size_t>(k)];
        mode.loss_share[k] = 1 - mesh.force_ratio(exponent(m, mode, k)) / mesh.ratio;
    }
}

static bool has_mesh_at_rest(const ModelData& m, const Mode& mode) {
    return std::any_of(m.lossy_meshes.begin(), m.lossy_meshes.end(),
                       [&](int k) { return mode.key[m.pairs + k] == 0 || mode.bound[m.pairs + k] != 0; });
}

bool wedges(const ModelData& m, const Mode& mode) SHIFTRIG_REALTIME {
    bool found = false;
    for (int k = 0; k < m.pairs; ++k) found = found || (!mode.key[k] && mode.bound[k]);
    return found;
}

void list_row_links(const ModelData& m, Mode& mode) SHIFTRIG_REALTIME {
    mode.rests = has_mesh_at_rest(m, mode);
    for (int r = 0; r < mode.row_count; ++r) {
        const int unknown = mode.rows[r];
        std::array<Link, 3>& links = mode.row_links[r];
        const auto take = [&](const std::array<Link, 2>& two) { links = {two[0], two[1], Link{0, 0}}; };
        if (unknown < m.pairs) {
            take(m.pair_slip[static_cast<std::size_t>(unknown)]);
        } else if (unknown < m.pairs + m.meshes) {
            links = m.mesh_slip[static_cast<std::size_t>(unknown - m.pairs)];
        } else {
            take(m.mesh_motion[static_cast<std::size_t>(unknown - m.pairs - m.meshes)]);
        }
    }
}

ModeSizes::ModeSizes(const ModelData& m) {
    basis = m.masses * m.masses;
    mobility = panel_size(m.masses, m.masses);
    const int translating = static_cast<int>(m.translating.size());
    view = panel_size(m.seen, m.states);
    rates = panel_size(m.states, m.columns);
    scaled_rates = m.states_padded * m.columns;
    energy_root = 2 * m.states_padded;
    torques = panel_size(m.torques + translating, m.columns);
    force_torques = panel_size(m.torques + translating, m.forces);
    balance = panel_size(m.torques, m.columns + m.torques);
    operators = m.states_padded * (3 * m.columns + 5 * m.forces) + 4 * panel_rows;  // of one length
    levels = m.ledger_levels * whole_panels(operators);
    sparse_rates = SparseRates::most_entries(m.states);
}

void mode_key(const ModelData& m, const unsigned char* contact, unsigned char* key) SHIFTRIG_REALTIME {
    for (int k = 0; k < m.pairs; ++k) key[k] = contact[k] == locked;
    for (int k = m.pairs; k < m.first_flank; ++k) {
        key[k] = contact[k] == stuck ? 0 : contact[k] & driven ? 2 : 1;
    }
    for (int k = m.first_flank; k < m.contact_bytes; ++k) key[k] = contact[k] != flanks_open;
}

int workspace_doubles(const ModelData& m) noexcept {
    const int n = m.masses, unknowns = m.torques;
    const int square = m.states_padded * m.states_padded;
    const int mode = n * unknowns           // columns
                     + n * unknowns         // force columns
                     + unknowns * unknowns  // G
                     + 2 * n * unknowns     // T̂, right-hand sides
                     + unknowns * unknowns  // of share_out(): Q
                     + padded(n) * n        // B
                     + 4 * (m.states_padded + m.torques) + m.states_padded * m.columns +
                     padded(m.torques) * m.columns + coordinates_workspace(m);
    const int exponential =
        16 * square + 3 * m.states_padded * (m.columns + 5 * m.forces) + sparse_workspace_doubles(m.states);
    return std::max(mode, exponential) + 64;
}

int workspace_integers(const ModelData& m) noexcept {
    return std::max({m.masses, m.torques, sparse_workspace_integers(m.states)});
}

void build_mode(const ModelData& m, Mode& mode, double* workspace, int* integers) SHIFTRIG_REALTIME {
    const Structure& s = m.structure;
    const int n = m.masses;
    const auto mesh_key = [&](int k) { return mode.key[m.pairs + k]; };
    double* columns = workspace;
    double* force = columns + n * m.torques;  // Ĉ scaled by J^(−1/2)

    // The active set: locked pairs and all meshes, then what stuck meshes add to them.
    mode.row_count = 0;
    for (int k = 0; k < m.pairs; ++k) {
        if (mode.key[k]) mode.rows[mode.row_count++] = k;
    }
    mode.first_mesh = mode.row_count;
    for (int k = 0; k < m.meshes; ++k) mode.rows[mode.row_count++] = m.pairs + k;
    for (int r = 0; r < mode.row_count; ++r) {
        const int unknown = mode.rows[r];
        if (unknown < m.pairs) {
            scaled_column(m, s.pairs[static_cast<std::size_t>(unknown)].links, columns + r * n);
        } else {
            const Mesh& mesh = s.meshes[static_cast<std::size_t>(unknown - m.pairs)];
            scaled_column(m, mesh.column(mesh.ratio), columns + r * n);
        }
    }
    mode.base_rank = mode.rank = pivoted_basis(columns, mode.row_count, n, mode.basis);

    double* column = columns;
    const auto rest = [&] {
        project_out(mode.basis, mode.rank, n, column);
        return std::sqrt(dot(column, column, n));
    };
    for (int k = 0; k < m.meshes; ++k) {
        const Mesh& mesh = s.meshes[static_cast<std::size_t>(k)];
        scaled_column(m, mesh.motion(), column);
        mode.bound[m.pairs + k] = rest() < dependent ? held_in_set : 0;
    }
    for (int k = 0; k < m.meshes; ++k) {
        const Mesh& mesh = s.meshes[static_cast<std::size_t>(k)];
        if (!mesh.lossy() || mesh_key(k) != 0 || mode.bound[m.pairs + k]) continue;
        scaled_column(m, mesh.motion(), column);
        if (extend_basis(mode.basis, mode.rank, n, column))
            mode.rows[mode.row_count++] = m.pairs + m.meshes + k;
    }
    for (int k = 0; k < m.pairs; ++k) {
        scaled_column(m, s.pairs[static_cast<std::size_t>(k)].links, column);
        mode.bound[k] = rest() < dependent ? held_in_set : 0;
    }
    for (int k = 0; k < m.meshes; ++k) {  // moving meshes that stuck ones hold
        const Mesh& mesh = s.meshes[static_cast<std::size_t>(k)];
        scaled_column(m, mesh.motion(), column);
        if (rest() < dependent) mode.bound[m.pairs + k] |= held_in_set;
    }
    const int rows = mode.row_count, rank = mode.rank;
    mode.redundant = rows > rank;
    std::fill(mode.loop, mode.loop + m.pairs, 0);

    // Ĉ, its unknowns scaled to unit columns (square case) or by √W (dependent rows).
    const double mesh_weight = s.mesh_weight();
    double* g = force + n * m.torques;
    double* transmission = g + m.torques * m.torques;  // T̂, rows × masses
    double* right = transmission + rows * n;
    double* square = right + rows * n;
    double* b = square + m.torques * m.torques;  // B, masses × masses, padded
    double* scale = b + padded(n) * n;
    for (int r = 0; r < rows; ++r) {
        const int unknown = mode.rows[r];
        double* c = force + r * n;
        double length, weight = 0;
        if (unknown < m.pairs) {
            const FrictionPair& pair = s.pairs[static_cast<std::size_t>(unknown)];
            length = scaled_column(m, pair.links, c);
            weight = pair.nominal_capacity;
        } else if (unknown < m.pairs + m.meshes) {
            const Mesh& mesh = s.meshes[static_cast<std::size_t>(unknown - m.pairs)];
            length = scaled_column(m, mesh.column(mesh.force_ratio(exponent(m, mode, unknown - m.pairs))), c);
            weight = mesh_weight * mesh.first_link_weight();
        } else {
            const Mesh& mesh = s.meshes[static_cast<std::size_t>(unknown - m.pairs - m.meshes)];
            length = scaled_column(m, mesh.loss(), c);
            weight = s.loss_weight() * mesh.first_link_weight();
        }
        // c is a unit column; the true one is length·c. Work with √W·length·c in the dependent case.
        scale[r] = mode.redundant ? std::sqrt(weight) : 1 / length;
        if (mode.redundant) {
            for (int j = 0; j < n; ++j) c[j] *= length * scale[r];
        }
    }
    for (int r = 0; r < rows; ++r) {
        for (int k = 0; k < rank; ++k) g[r * rank + k] = dot(mode.basis + k * n, force + r * n, n);
    }
    // right = Qᵀ J^(−1/2), rank × masses
    for (int j = 0; j < n; ++j) {
        for (int k = 0; k < rank; ++k) {
            right[j * rank + k] = mode.basis[k * n + j] / m.root_inertia[static_cast<std::size_t>(j)];
        }
    }
    if (!mode.redundant) {
        solve(g, rank, right, n);
        for (int j = 0; j < n; ++j) {
            for (int r = 0; r < rows; ++r) transmission[j * rows + r] = scale[r] * right[j * rank + r];
        }
    } else {
        share_out(mode, g, square, transmission, right, n);
        find_loops(m, mode, square, integers);
        for (int j = 0; j < n; ++j) {
            double* const column_of = transmission + j * rows;
            std::fill(column_of, column_of + rows, 0.);
            for (int k = 0; k < rank; ++k)
                add_scaled(column_of, right[j * rank + k], square + k * rows, rows);
            for (int r = 0; r < rows; ++r) column_of[r] *= scale[r];
        }
    }

    // B = Π₀ J⁻¹ (I − Ĉ T̂), column by column; force still holds scaled columns c with Ĉ = √J · (c/s).
    const int stride = padded(n);
    for (int j = 0; j < n; ++j) {
        double* response = b + j * stride;  // first J^(1/2) ω̇
        std::fill(response, response + stride, 0.);
        response[j] = 1 / m.root_inertia[static_cast<std::size_t>(j)];
        for (int r = 0; r < rows; ++r) {
            add_scaled(response, -transmission[j * rows + r] / scale[r], force + r * n, n);
        }
        project_out(mode.basis, rank, n, response);
        for (int i = 0; i < n; ++i) response[i] /= m.root_inertia[static_cast<std::size_t>(i)];
    }
    to_panels(b, n, n, mode.mobility);

    // L, S̃, R: every elastic element and every force is a column of torques on the masses.
    const int states = m.states_padded, torque_rows = padded(rows);
    double* motion = scale + m.torques;            // [L S̃], states × columns
    double* torque = motion + states * m.columns;  // [R_z R_f]
    double* response = torque + torque_rows * m.columns;
    double* reaction = response + states;
    std::fill(motion, motion + states * m.columns, 0.);
    std::fill(torque, torque + torque_rows * m.columns, 0.);
    // What a unit torque out of these links does to the accelerations and to the unknowns.
    const auto apply = [&](const std::array<Link, 2>& links) {
        std::fill(response, response + n, 0.);
        std::fill(reaction, reaction + rows, 0.);
        for (const Link& link : links) {
            if (link.mass < 0) continue;
            add_scaled(response, -link.factor, b + link.mass * stride, n);
            add_scaled(reaction, -link.factor, transmission + link.mass * rows, rows);
        }
    };
    const auto add_to = [&](int c, double factor) {
        add_scaled(motion + c * states, factor, response, n);
        add_scaled(torque + c * torque_rows, factor, reaction, rows);
    };
    const auto damp = [&](const Elastic& elastic) {
        for (const Link& link : elastic.links) {
            if (link.mass >= 0) add_to(link.mass, elastic.damping * link.factor);
        }
    };
    for (int e = 0; e < m.twists; ++e) {
        const Elastic& shaft = s.shafts[static_cast<std::size_t>(e)];
        for (const Link& link : shaft.links) {
            if (link.mass >= 0) motion[link.mass * states + n + e] = link.factor;  // φ̇
        }
        if (!is_shaft_closed(m, mode, e)) continue;
        apply(shaft.links);
        add_to(n + e, shaft.stiffness);
        damp(shaft);
    }
    for (const Elastic& damper : s.dampers) {
        apply(damper.links);
        damp(damper);
    }
    for (int k = 0; k < m.forces; ++k) {
        apply(m.force_columns[static_cast<std::size_t>(k)]);
        add_to(m.states + k, 1);
    }
    set_loss_shares(m, mode);
    build_coordinates(m, mode, motion, torque, reaction + rows, integers);
    scale_rates(m, mode);
}

}  // namespace shiftrig::plant::detail
