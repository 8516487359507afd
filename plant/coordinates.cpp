// Coordinates of a mode: which speeds determine all others, and everything that is multiplied with them.
#include <algorithm>
#include <cmath>
#include <utility>

#include "plant/dense.h"
#include "plant/modes.h"

namespace shiftrig::plant::detail {
namespace {

// Calls with the kinematic column of an active row.
template <typename Function>
void with_row(const ModelData& m, int unknown, const Function& function) {
    if (unknown < m.pairs) {
        function(m.pair_slip[static_cast<std::size_t>(unknown)]);
    } else if (unknown < m.pairs + m.meshes) {
        function(m.mesh_slip[static_cast<std::size_t>(unknown - m.pairs)]);
    } else {
        function(m.mesh_motion[static_cast<std::size_t>(unknown - m.pairs - m.meshes)]);
    }
}

// Solves Cᵀω = 0 for as many speeds as there are independent rows, by Gauss and Jordan with complete pivoting. The
// largest pivots of the √J-scaled rows are the lightest masses, so what remains free is heavy and no factor is large;
// elimination itself works on the plain rows, whose ones and ratios stay what they are. Writes ω = E q (column-major,
// states_padded rows) and the coordinates.
void choose_coordinates(const ModelData& m, Mode& mode, double* expansion, double* reduced, int* pivot_mass) {
    const int n = m.masses, rows = mode.row_count, rank = mode.rank, stride = m.states_padded;
    std::fill(reduced, reduced + rows * n, 0.);
    double* row_length = reduced + rows * n;
    for (int r = 0; r < rows; ++r) {
        double* row = reduced + r * n;
        with_row(m, mode.rows[r], [&](const auto& links) {
            for (const Link& link : links) row[link.mass] += link.factor;
        });
        double square = 0;
        for (int j = 0; j < n; ++j)
            square += row[j] * row[j] / m.structure.inertia[static_cast<std::size_t>(j)];
        row_length[r] = std::sqrt(square);
    }
    const auto is_pivot = [&](int mass, int count) {
        return std::find(pivot_mass, pivot_mass + count, mass) != pivot_mass + count;
    };
    for (int r = 0; r < rank; ++r) {
        int best = r, mass = -1;
        double largest = -1;
        for (int j = 0; j < n; ++j) {
            if (is_pivot(j, r)) continue;
            for (int i = r; i < rows; ++i) {
                const double size = std::fabs(reduced[i * n + j]) /
                                    (m.root_inertia[static_cast<std::size_t>(j)] * row_length[i]);
                if (size <= largest) continue;
                largest = size;
                best = i;
                mass = j;
            }
        }
        pivot_mass[r] = mass;
        if (best != r) {
            std::swap_ranges(reduced + best * n, reduced + (best + 1) * n, reduced + r * n);
            std::swap(row_length[best], row_length[r]);
        }
        const double pivot = reduced[r * n + mass];
        for (int j = 0; j < n; ++j) reduced[r * n + j] /= pivot;
        row_length[r] /= std::fabs(pivot);
        for (int i = 0; i < rows; ++i) {
            const double factor = reduced[i * n + mass];
            if (i == r || factor == 0) continue;
            add_scaled(reduced + i * n, -factor, reduced + r * n, n);
            reduced[i * n + mass] = 0;
        }
    }
    mode.order = 0;
    std::fill(expansion, expansion + stride * m.states, 0.);
    for (int j = 0; j < n; ++j) {
        if (is_pivot(j, rank)) continue;
        double* column = expansion + mode.order * stride;
        column[j] = 1;
        for (int r = 0; r < rank; ++r) {
            column[pivot_mass[r]] = 0 - reduced[r * n + j];
        }
        mode.coordinates[mode.order++] = j;
    }
    for (int e = 0; e < m.twists; ++e) {
        expansion[mode.order * stride + n + e] = 1;
        mode.coordinates[mode.order++] = n + e;
    }
}

template <typename Links>
double slip(const Links& links, const double* speeds) {
    double sum = 0;
    for (const Link& link : links) {
        if (link.mass >= 0) sum += link.factor * speeds[link.mass];
    }
    return sum;
}

void build_view(const ModelData& m, const Mode& mode, const double* expansion, double* view) {
    const int rows = padded(m.seen);
    std::fill(view, view + rows * mode.order, 0.);
    for (int c = 0; c < mode.order; ++c) {
        const double* z = expansion + c * m.states_padded;
        double* const column = view + c * rows;
        double* next = column;
        for (int k = 0; k < m.forces; ++k) {
            const bool held =
                k < m.pairs && mode.bound[k];  // others hold it at zero: not even rounding is left
            *next++ = held ? 0 : slip(m.force_columns[static_cast<std::size_t>(k)], z);
        }
        for (int k = 0; k < m.meshes; ++k) *next++ = slip(m.mesh_motion[static_cast<std::size_t>(k)], z);
        next = column + m.law_rows;
        for (int k = 0; k < m.meshes; ++k) *next++ = slip(m.mesh_loss[static_cast<std::size_t>(k)], z);
        for (const auto& shaft : m.shaft_rate) *next++ = slip(shaft, z);
        for (const auto& damper : m.damper_rate) *next++ = slip(damper, z);
        std::copy(z, z + m.states, column + m.power_rows);
    }
    to_panels(view, m.seen, mode.order, mode.view);
}

// A matrix over [z; f] (column-major) becomes one over [q; f].
void fold(const ModelData& m, const Mode& mode, const double* expansion, const double* full, int rows,
          double* folded) {
    for (int c = 0; c < mode.order; ++c) {
        double* column = folded + c * rows;
        std::fill(column, column + rows, 0.);
        for (int j = 0; j < m.states; ++j) {
            const double factor = expansion[c * m.states_padded + j];
            if (factor != 0) add_scaled(column, factor, full + j * rows, rows);
        }
    }
    std::copy(full + m.states * rows, full + m.columns * rows, folded + mode.order * rows);
}

// Accelerations of the active rows from M̃ and M_R: what [Algin] eq. (15) makes zero. Each row is scaled so that the
// torque with most weight in it counts as it is.
void build_balance(const ModelData& m, Mode& mode, const double* expansion, double* full, double* folded) {
    const Structure& s = m.structure;
    const int rows = padded(mode.row_count);
    std::fill(full, full + rows * (m.columns + mode.row_count), 0.);
    // What a unit torque out of these links does to each row.
    const auto add = [&](int c, double torque, const auto& links) {
        for (int r = 0; r < mode.row_count; ++r) {
            with_row(m, mode.rows[r], [&](const auto& row) {
                for (const Link& a : row) {
                    for (const Link& b : links) {
                        if (a.mass < 0 || a.mass != b.mass) continue;
                        full[c * rows + r] -=
                            torque * a.factor * b.factor / s.inertia[static_cast<std::size_t>(a.mass)];
                    }
                }
            });
        }
    };
    const auto damped = [&](double damping, const auto& links) {
        for (const Link& link : links) {
            if (link.mass >= 0) add(link.mass, damping * link.factor, links);
        }
    };
    for (int e = 0; e < m.twists; ++e) {
        if (!is_shaft_closed(m, mode, e)) continue;
        const Elastic& shaft = s.shafts[static_cast<std::size_t>(e)];
        add(m.masses + e, shaft.stiffness, shaft.links);
        damped(shaft.damping, shaft.links);
    }
    for (const Elastic& damper : s.dampers) damped(damper.damping, damper.links);
    for (int k = 0; k < m.forces; ++k) add(m.states + k, 1, m.force_columns[static_cast<std::size_t>(k)]);
    for (int r = 0; r < mode.row_count; ++r) {
        const int unknown = mode.rows[r], c = m.columns + r;
        if (unknown < m.pairs) {
            add(c, 1, s.pairs[static_cast<std::size_t>(unknown)].links);
        } else if (unknown < m.pairs + m.meshes) {
            const auto k = static_cast<std::size_t>(unknown - m.pairs);
            const Mesh& mesh = s.meshes[k];
            add(c, 1, mesh.column(mesh.ratio));
            // û in place of u: the difference lies on the loss column.
            add(c, mode.loss_share[k], m.mesh_loss[k]);
        } else {
            add(c, 1, m.mesh_loss[static_cast<std::size_t>(unknown - m.pairs - m.meshes)]);
        }
    }
    fold(m, mode, expansion, full, rows, folded);
    const int columns = mode.order + m.forces + mode.row_count;
    std::copy(full + m.columns * rows, full + (m.columns + mode.row_count) * rows,
              folded + (mode.order + m.forces) * rows);
    for (int r = 0; r < mode.row_count; ++r) {
        double largest = 0;
        for (int c = mode.order; c < columns; ++c)
            largest = std::max(largest, std::fabs(folded[c * rows + r]));
        for (int c = 0; c < columns; ++c) folded[c * rows + r] /= largest;
    }
    to_panels(folded, mode.row_count, columns, mode.balance);
}

}  // namespace

int coordinates_workspace(const ModelData& m) noexcept {
    const int widest = std::max(m.states_padded, padded(m.torques + static_cast<int>(m.translating.size())));
    return m.states_padded * m.states + m.torques * (m.masses + 1) + padded(m.seen) * m.states +
           2 * widest * (m.columns + m.torques);
}

void build_coordinates(const ModelData& m, Mode& mode, const double* motion, const double* torque,
                       double* workspace, int* integers) SHIFTRIG_REALTIME {
    double* expansion = workspace;
    double* scratch = expansion + m.states_padded * m.states;
    choose_coordinates(m, mode, expansion, scratch, integers);
    build_view(m, mode, expansion, scratch);
    const int columns = mode.order + m.forces;
    fold(m, mode, expansion, motion, m.states_padded, scratch);
    to_panels(scratch, m.states, columns, mode.rates);

    // Torques, and under them the accelerations of translating masses.
    const int translating = static_cast<int>(m.translating.size());
    const int torque_rows = padded(mode.row_count), all_rows = padded(mode.row_count + translating);
    double* both = scratch;
    for (int c = 0; c < m.columns; ++c) {
        double* column = both + c * all_rows;
        std::fill(column, column + all_rows, 0.);
        std::copy(torque + c * torque_rows, torque + c * torque_rows + mode.row_count, column);
        for (int i = 0; i < translating; ++i) {
            column[mode.row_count + i] =
                motion[c * m.states_padded + m.translating[static_cast<std::size_t>(i)]];
        }
    }
    double* folded = both + all_rows * m.columns;
    fold(m, mode, expansion, both, all_rows, folded);
    to_panels(folded, mode.row_count + translating, columns, mode.torques);
    to_panels(folded + all_rows * mode.order, mode.row_count + translating, m.forces, mode.force_torques);

    double* full = scratch;
    build_balance(m, mode, expansion, full, full + padded(mode.row_count) * (m.columns + mode.row_count));
}

}  // namespace shiftrig::plant::detail
