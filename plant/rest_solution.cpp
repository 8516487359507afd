// Solutions of the problem that rest_problem.cpp poses: by Lemke's method; and, where that finds a motion, whether rest is a
// solution too, by linear programs.
#include <algorithm>
#include <cmath>

#include "plant/complementarity.h"
#include "plant/dense.h"
#include "plant/linear_program.h"
#include "plant/rest_problem.h"

namespace shiftrig::plant::detail {
namespace {

double sense_of(const RestProblem& rest) {
    return rest.mirrored ? -1 : 1;
}
// Of the mirror image loads change their sign, and limits their sides.
double upper(const RestProblem& rest, const RestJoint& joint) {
    return rest.mirrored ? -joint.lower : joint.upper;
}
double lower(const RestProblem& rest, const RestJoint& joint) {
    return rest.mirrored ? -joint.upper : joint.lower;
}

// y and the torques of meshes at rest with every joint at its upper limit and M ≥ κ, and what they answer to p.
void start_at_limits(RestProblem& rest) {
    const int count = rest.count, meshes = rest.mesh_rows;
    const double sense = sense_of(rest);
    // (I − H C) y = H M_0 + o + δ v − p, where M = M_0 + C y and H holds the slopes.
    for (int i = 0; i < count; ++i) {
        const RestJoint& joint = rest.joints[i];
        for (int j = 0; j < count; ++j) {
            const double follows = joint.mesh < 0 ? 0 : rest.mesh[(1 + j) * meshes + joint.row];
            rest.left[j * count + i] = (i == j ? 1 : 0) - joint.slope * follows;
            rest.inverse[j * count + i] = i == j ? 1 : 0;
        }
        rest.inverse[count * count + i] =
            upper(rest, joint) + (joint.mesh < 0 ? 0 : joint.slope * sense * rest.mesh[joint.row]);
    }
    solve(rest.left, count, rest.inverse, count + 1);
    std::copy(rest.inverse + count * count, rest.inverse + count * (count + 1), rest.y);
    for (int i = 0; i < count; ++i) {
        for (int j = 0; j < count; ++j) rest.response[i * count + j] = rest.inverse[j * count + i];
    }
    const auto turns = [&](int mesh_row, int j) {
        double sum = 0;
        for (int l = 0; l < count; ++l)
            sum += rest.mesh[(1 + l) * meshes + mesh_row] * rest.response[l * count + j];
        return sum;
    };
    double largest = 0;
    for (int i = 0; i < count; ++i) {
        const RestJoint& joint = rest.joints[i];
        rest.torque[i] = 0;
        largest = std::max({largest, std::fabs(rest.b[i]) / joint.scale, std::fabs(rest.y[i]) * joint.scale});
        if (joint.mesh < 0) continue;
        rest.torque[i] = sense * rest.mesh[joint.row];
        for (int j = 0; j < count; ++j) {
            rest.torque[i] += rest.mesh[(1 + j) * meshes + joint.row] * rest.y[j];
            rest.turn[i * count + j] = turns(joint.row, j);
        }
        largest = std::max(largest, std::fabs(rest.torque[i]) * joint.scale);
    }
    rest.unit = largest;
}

// The rows of w − N z = q, counted in rest.unit, so that its numbers are of one size.
void lay_out(RestProblem& rest, Split split) {
    const int count = rest.count, bends = rest.bends, size = rest.size(), columns = lemke_columns(size);
    const auto row_of = [&](const double* matrix, int i) { return matrix + i * count; };
    const auto mobility = [&](int i, int j) {
        const double w = rest.w[i * count + j];
        if (split == Split::any || i != j) return w;
        const RestJoint& joint = rest.joints[i];
        return w * (1 + (split == Split::as_modes ? joint.give : joint.give_on_losses));
    };
    std::fill(rest.tableau, rest.tableau + size * columns, 0.);
    for (int i = 0; i < count; ++i) {
        const RestJoint& joint = rest.joints[i];
        const int bend = joint.bend;
        // Of w_r = N z + q the entries of −N at p_j, and at v_j, which acts like −δ_j p_j.
        const auto set_row = [&](int r, const auto& entry, double constant, double unit) {
            double* const row = rest.tableau + r * columns;
            row[r] = 1;
            for (int j = 0; j < count; ++j) {
                const RestJoint& other = rest.joints[j];
                const double value = entry(j) * unit / other.scale;  // of −p_j
                row[size + j] = value;
                if (other.bend >= 0) row[size + 2 * count + other.bend] = -other.difference * value;
            }
            row[columns - 1] = constant * unit / rest.unit;
            return row;
        };
        double acceleration = sense_of(rest) * rest.b[i];
        for (int j = 0; j < count; ++j) acceleration -= mobility(i, j) * rest.y[j];
        double* const slip = set_row(
            i,
            [&](int j) {
                double gain = 0;
                for (int l = 0; l < count; ++l) gain += mobility(i, l) * rest.response[l * count + j];
                return -gain;
            },
            acceleration, 1 / joint.scale);
        slip[size + count + i] = -1;  // β
        const double *const response = row_of(rest.response, i), *const turn = row_of(rest.turn, i);
        double low = lower(rest, joint);
        if (bend >= 0) low += joint.slope * rest.torque[i];
        double* const room = set_row(
            count + i, [&](int j) { return response[j] - (bend < 0 ? 0 : joint.slope * turn[j]); },
            rest.y[i] - low, joint.scale);
        if (bend < 0) continue;
        room[size + 2 * count + bends + bend] = -joint.difference;  // v'
        double* const ahead = set_row(
            2 * count + bend, [&](int j) { return turn[j]; }, rest.torque[i] - joint.kink, joint.scale);
        double* const behind = set_row(
            2 * count + bends + bend, [&](int j) { return -turn[j]; }, -rest.torque[i] - joint.kink,
            joint.scale);
        ahead[size + 2 * count + bend] -= 1;
        behind[size + 2 * count + bends + bend] -= 1;
    }
}

// Moves y and the torques of meshes on from where they start by what was found for z_j, as `value(j)` has it.
template <typename Value>
void take(RestProblem& rest, const Value& value) {
    const int count = rest.count;
    for (int j = 0; j < count; ++j) {
        const RestJoint& joint = rest.joints[j];
        const double bent = joint.bend < 0 ? 0 : joint.difference * value(2 * count + joint.bend);
        const double gives = (bent - value(j)) * rest.unit / joint.scale;
        if (gives == 0) continue;
        for (int i = 0; i < count; ++i) {
            rest.y[i] += rest.response[i * count + j] * gives;
            if (rest.joints[i].bend >= 0) rest.torque[i] += rest.turn[i * count + j] * gives;
        }
    }
    const double sense = sense_of(rest);
    for (int i = 0; i < count; ++i) {
        rest.y[i] *= sense;
        rest.torque[i] *= sense;
    }
}

}  // namespace

constexpr int most_courses = 4;  // of Lemke's method, until one leads to a solution

bool solve_rest_problem(Split split, RestProblem& rest) SHIFTRIG_REALTIME {
    const int size = rest.size(), columns = lemke_columns(size);
    start_at_limits(rest);
    if (!(rest.unit > 0)) return false;
    bool solved = false;
    for (int course = 0; course < most_courses && !solved; ++course) {
        lay_out(rest, split);
        solved = solve_complementarity(rest.tableau, rest.basis, size, course);
    }
    if (!solved) return false;
    take(rest, [&](int z) {
        for (int r = 0; r < size; ++r) {
            if (rest.basis[r] == size + z) return rest.tableau[r * columns + columns - 1];
        }
        return 0.;
    });
    return true;
}

namespace {

constexpr int most_bends = 5;  // that are asked whether something may rest

// Where the torque of a mesh is: beyond κ ahead, beyond it behind, or neither (both, where κ < 0).
enum Region { ahead, behind, between, regions };

// Nothing goes, M of each mesh is where `region` has it, and pairs use no more than 1 − s of their limits, s as large as can be:
// p = p' + s · upper, and likewise on the other side. Its column is the one that Lemke's method has for itself.
bool solve_within(RestProblem& rest, const Region* region, double& spared) {
    const int count = rest.count, bends = rest.bends, size = rest.size(), columns = lemke_columns(size);
    const int s = 2 * size, last = columns - 1;
    lay_out(rest, Split::any);
    Program program{.tableau = rest.tableau, .rows = size, .columns = columns, .basis = rest.basis};
    std::fill(program.enters, program.enters + s, true);
    program.enters[s] = true;
    for (int r = 0; r < size; ++r) rest.basis[r] = r;
    const auto exclude = [&](int complement) {  // 0, of w with this number
        program.enters[complement] = false;
        if (rest.basis[complement] == complement) rest.basis[complement] = -1;
    };
    for (int i = 0; i < count; ++i) {
        exclude(i);
        program.enters[size + count + i] = false;
    }
    for (int j = 0; j < bends; ++j) {
        for (const Region side : {ahead, behind}) {
            const int w = 2 * count + (side == ahead ? 0 : bends) + j;
            const RestJoint* joint = rest.joints;
            while (joint->bend != j) ++joint;
            const bool beyond = region[j] == between ? joint->kink < 0 : region[j] == side;
            if (beyond) {
                program.enters[size + w] = false;
            } else {
                exclude(w);
            }
        }
    }
    for (int r = 0; r < size; ++r) {
        double* const row = rest.tableau + r * columns;
        double sum = 0;
        for (int j = 0; j < count; ++j) {
            const RestJoint& joint = rest.joints[j];
            if (joint.mesh < 0) sum += row[size + j] * joint.upper * joint.scale / rest.unit;
        }
        const int i = r - count;
        if (i >= 0 && i < count && rest.joints[i].mesh < 0)
            sum -= rest.joints[i].lower * rest.joints[i].scale / rest.unit;
        row[s] = sum;
    }
    if (!solve_program(program, s)) return false;
    const auto value = [&](int variable) {
        for (int r = 0; r < size; ++r) {
            if (rest.basis[r] == variable) return rest.tableau[r * columns + last];
        }
        return 0.;
    };
    spared = value(s);
    take(rest, [&](int z) {
        const bool pair = z < count && rest.joints[z].mesh < 0;
        return value(size + z) +
               (pair ? spared * rest.joints[z].upper * rest.joints[z].scale / rest.unit : 0);
    });
    return true;
}

}  // namespace

bool find_rest(RestProblem& rest) SHIFTRIG_REALTIME {
    if (rest.bends == 0 || rest.bends > most_bends) return false;
    rest.mirrored = false;
    double best = -1;
    double y[most_joints], torque[most_joints];
    Region region[most_bends] = {};
    for (bool more = true; more;) {
        start_at_limits(rest);
        if (!(rest.unit > 0)) return false;
        double spared = 0;
        if (solve_within(rest, region, spared) && spared > best + 1e-9) {
            best = spared;
            std::copy(rest.y, rest.y + rest.count, y);
            std::copy(rest.torque, rest.torque + rest.count, torque);
        }
        more = false;
        for (int j = 0; j < rest.bends && !more; ++j) {
            const RestJoint* joint = rest.joints;
            while (joint->bend != j) ++joint;
            const int kinds = joint->kink != 0 ? regions : between;
            region[j] = static_cast<Region>((region[j] + 1) % kinds);
            more = region[j] != ahead;
        }
    }
    if (best < 0) return false;
    std::copy(y, y + rest.count, rest.y);
    std::copy(torque, torque + rest.count, rest.torque);
    return true;
}

int side_at_rest(const RestProblem& rest, int i) SHIFTRIG_REALTIME {
    const RestJoint& joint = rest.joints[i];
    double most = joint.upper, least = joint.lower;
    if (joint.mesh >= 0) {
        const double m = rest.torque[i];
        most = joint.slope * m + joint.upper + joint.difference * std::max(joint.kink - m, 0.);
        least = joint.slope * m + joint.lower - joint.difference * std::max(joint.kink + m, 0.);
    }
    const double near = 1e-9 * rest.unit / joint.scale;
    if (most - rest.y[i] <= near && rest.y[i] - least > near) return 1;
    return rest.y[i] - least <= near && most - rest.y[i] > near ? -1 : 0;
}

int side_of(const RestProblem& rest, int i, double& going) SHIFTRIG_REALTIME {
    const int count = rest.count, size = rest.size(), columns = lemke_columns(size);
    double forward = -1, backward = -1;  // not in the basis
    for (int r = 0; r < size; ++r) {
        const double value = std::max(rest.tableau[r * columns + columns - 1], 0.);
        if (rest.basis[r] == i) forward = value;
        if (rest.basis[r] == size + count + i) backward = value;
    }
    going = std::max({forward, backward, 0.});
    if (forward < 0 && backward < 0) return 0;
    return (forward >= backward) != rest.mirrored ? 1 : -1;
}

unsigned char state_of(const RestProblem& rest, int i, int side) SHIFTRIG_REALTIME {
    const RestJoint& joint = rest.joints[i];
    if (joint.mesh < 0) return side == 0 ? static_cast<unsigned char>(locked) : slipping(side);
    if (side == 0) return stuck;
    return moving(side, (rest.torque[i] - side * joint.kink) * side < 0 ? -1 : 1);
}

}  // namespace shiftrig::plant::detail
