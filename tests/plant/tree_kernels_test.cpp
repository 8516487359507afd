// The loops of the engine for long chains, in every kernel that this processor runs, against the equations they stand for,
// on random forests: long runs and short ones, branches that hang far up, roots in the middle. What stands behind the
// vectors is not a number: it must not matter.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "plant/few.h"
#include "plant/modes.h"
#include "plant/tree.h"
#include "tests/plant/kernel_kinds.h"
#include "tests/plant/parts.h"

namespace shiftrig::plant::detail {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr int margin = 8;

// Room on both sides, as the engine has it.
struct Vector {
    explicit Vector(int size) : memory(static_cast<std::size_t>(size + 2 * margin), nan), count(size) {}
    Vector(int size, std::mt19937_64& random, double scale = 1) : Vector(size) {
        std::uniform_real_distribution<double> draw(-scale, scale);
        for (int g = 0; g < size; ++g) (*this)[g] = draw(random);
    }
    double& operator[](int g) { return memory[static_cast<std::size_t>(g + margin)]; }
    double operator[](int g) const { return memory[static_cast<std::size_t>(g + margin)]; }
    double* data() { return memory.data() + margin; }
    const double* data() const { return memory.data() + margin; }
    Eigen::Map<const Eigen::VectorXd> eigen() const { return {data(), count}; }
    std::vector<double> memory;
    int count;
};

// Masses on shafts: each hangs on the one before it, or with this chance on another; some by an open clutch, which is none.
Description forest(std::mt19937_64& random, int n, double branches, double roots) {
    Description d;
    d.name = "forest";
    d.method = Method::ark3;
    std::uniform_real_distribution<double> chance(0, 1), size(0.5, 2);
    for (int j = 0; j < n; ++j) {
        const std::string name = "m" + std::to_string(j);
        d.masses.push_back(mass(name, size(random)));
        if (j % 3 == 0) d.dampers.push_back({"air" + name, name, "", 0.3 * size(random)});
        if (j == 0) continue;
        const int up =
            chance(random) < branches ? static_cast<int>(random() % static_cast<unsigned>(j)) : j - 1;
        const std::string parent = "m" + std::to_string(up);
        if (chance(random) < roots) {
            d.clutches.push_back(clutch("c" + name, parent, name, 10));
        } else {
            d.shafts.push_back({"s" + name, parent, name, 1e4 * size(random), 20 * size(random), 0});
        }
    }
    return d;
}

class TreeKernelsOf : public testing::TestWithParam<KernelKind> {
  protected:
    // Calls `look` with the mode of each of many forests.
    template <typename Look>
    void on_forests(const Look& look) {
        for (int n = 0; n < 120; ++n) {
            const int size = 2 + static_cast<int>(random() % 120u);
            const double branches[] = {0, 0.03, 0.5}, roots[] = {0, 0.2};
            const Model model =
                Model::build(forest(random, size, branches[n % 3], roots[n / 3 % 2]), {1e-3, GetParam()});
            const ModelData& m = model.data();
            Operators operators(model);
            Scratch scratch(model);
            std::vector<unsigned char> contact(static_cast<std::size_t>(whole_words(m.contact_bytes)), 0);
            std::fill_n(contact.begin(), m.contact_bytes, static_cast<unsigned char>(free_running));
            for (int k = 0; n % 4 == 3 && k < m.pairs; ++k)
                contact[static_cast<std::size_t>(k)] = random() % 4 == 0 ? locked : free_running;
            const Mode& mode = find_mode(m, operators.data(), contact.data(), scratch.data());
            const TreePaths& t = mode.tree->paths;
            branching += t.hanging > 0;
            scanned += t.long_runs;
            const GroupForces& forces = mode.tree->forces;
            const int block = m.tree->kernel.block;
            with_many_forces += forces.count > block + block / 2;
            with_gaps += forces.count > 0 && forces.count < m.forces;
            const int* const in_line = mode.tree->masses.in_line;
            with_lines += std::count(in_line, in_line + size / block, 1) > 1;
            look(m, *mode.tree, t);
        }
        EXPECT_GT(branching, 20);
        EXPECT_GT(scanned, 20);
        EXPECT_GT(with_many_forces, 5);
        EXPECT_GT(with_gaps, 5);
        EXPECT_GT(with_lines, 20);
    }
    // Of each group and its parent; roots have none.
    static double difference(const TreeMode& tree, const Vector& v, int g) {
        return tree.parent[g] < 0 ? 0 : v[g] - v[tree.parent[g]];
    }
    // What links with these torques do to the groups.
    static Eigen::VectorXd on_groups(const TreeMode& tree, const Eigen::VectorXd& link) {
        Eigen::VectorXd sum = Eigen::VectorXd::Zero(link.size());
        for (int g = 0; g < link.size(); ++g) {
            if (tree.parent[g] < 0) continue;
            sum(g) -= link(g);
            sum(tree.parent[g]) += link(g);
        }
        return sum;
    }

    std::mt19937_64 random{11};
    int branching = 0, scanned = 0, with_many_forces = 0, with_gaps = 0, with_lines = 0;
};

INSTANTIATE_TEST_SUITE_P(Kernels, TreeKernelsOf, testing::ValuesIn(offered_kernels()), kernel_name);

TEST_P(TreeKernelsOf, SolveTheStageMatrix) {
    on_forests([&](const ModelData& m, const TreeMode& tree, const TreePaths& t) {
        const int n = t.groups;
        const double weight = tree.matrix.weight;
        const Vector right(n, random, 100);
        Vector q = right;
        m.tree->kernel.solve(t, tree.matrix, q.data());
        // Each group's row of M + hγ D + (hγ)² K.
        Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n, n);
        for (int g = 0; g < n; ++g) {
            matrix(g, g) += tree.mass[g] + weight * tree.drag[g];
            const int up = tree.parent[g];
            if (up < 0) continue;
            const double coupling = weight * (tree.damping[g] + weight * tree.stiffness[g]);
            matrix(g, g) += coupling;
            matrix(up, up) += coupling;
            matrix(g, up) -= coupling;
            matrix(up, g) -= coupling;
        }
        const Eigen::VectorXd wanted = matrix.partialPivLu().solve(right.eigen());
        EXPECT_LT((q.eigen() - wanted).cwiseAbs().maxCoeff(), 1e-11 * wanted.cwiseAbs().maxCoeff()) << n;
    });
}

TEST_P(TreeKernelsOf, TellWhatLinksDo) {
    on_forests([&](const ModelData& m, const TreeMode& tree, const TreePaths& t) {
        const int n = t.groups;
        const Vector speed(n, random, 100);
        Vector twist(n, random, 0.01), rate(n), passed(n), torque(n);
        m.tree->kernel.shaft_torques(t, speed.data(), twist.data(), rate.data(), passed.data(),
                                     torque.data());
        Eigen::VectorXd link(n);
        for (int g = 0; g < n; ++g) {
            const double delta = difference(tree, speed, g);
            EXPECT_EQ(rate[g], delta);
            link(g) = tree.stiffness[g] * twist[g] + tree.damping[g] * delta;
            EXPECT_NEAR(passed[g], link(g), 1e-12 * (1 + std::fabs(link(g))));
        }
        const Eigen::VectorXd sum = on_groups(tree, link);
        for (int g = 0; g < n; ++g)
            EXPECT_NEAR(torque[g], sum(g) - tree.drag[g] * speed[g],
                        1e-10 * link.cwiseAbs().maxCoeff() + 1e-12);
    });
}

TEST_P(TreeKernelsOf, CombineAndFinishStages) {
    on_forests([&](const ModelData& m, const TreeMode& tree, const TreePaths& t) {
        const int n = t.groups;
        const Vector q[4] = {{n, random, 100}, {n, random, 100}, {n, random, 100}, {n, random, 100}};
        const Vector net(n, random, 50);
        for (int count = 1; count <= 4; ++count) {
            const double* const speeds[] = {q[0].data(), q[1].data(), q[2].data(), q[3].data()};
            const double of_momentum[] = {-0.5, -0.2, 0.1, 0.4}, weights[] = {1, 2, 3, 4};
            const StageSums sums{count, speeds, of_momentum, weights, 1e-3, net.data(), 1e-3};
            const double weight = tree.matrix.weight;
            Vector twist(n, random, 0.01), right(n), untwisted(n), way(n);
            m.tree->kernel.combine(t, weight, sums, nullptr, untwisted.data(), way.data());
            m.tree->kernel.combine(t, weight, sums, twist.data(), right.data(), way.data());
            Eigen::VectorXd momentum(n), link(n), twisted_link(n);
            for (int g = 0; g < n; ++g) {
                double p = 1e-3 * net[g], turned = 0;
                for (int j = 0; j < count; ++j) {
                    p += tree.mass[g] * of_momentum[j] * (j == 0 ? q[0][g] : q[j][g] - q[0][g]);
                    turned += 1e-3 * weights[j] * q[j][g];
                }
                momentum(g) = p;
                EXPECT_NEAR(way[g], turned, 1e-15 * 400);
            }
            for (int g = 0; g < n; ++g) {
                link(g) = weight * tree.stiffness[g] * difference(tree, way, g);
                twisted_link(g) = weight * tree.stiffness[g] * (twist[g] + difference(tree, way, g));
            }
            const auto differs = [&](const Vector& sum, const Eigen::VectorXd& passed) {
                return (sum.eigen() - momentum - on_groups(tree, passed)).cwiseAbs().maxCoeff();
            };
            EXPECT_LT(differs(untwisted, link), 1e-12 * 400);
            EXPECT_LT(differs(right, twisted_link), 1e-12 * 400);
        }
        Vector way(n, random, 0.1), twist(n, random, 0.01), speed(n), end(n);
        m.tree->kernel.finish(t, 4e-4, twist.data(), way.data(), q[3].data(), speed.data(), end.data());
        for (int g = 0; g < n; ++g) {
            EXPECT_EQ(speed[g], q[3][g]);
            const double turned = difference(tree, way, g) + 4e-4 * difference(tree, q[3], g);
            EXPECT_NEAR(end[g], tree.parent[g] < 0 ? 0 : twist[g] + turned, 1e-15);
        }
    });
}

TEST_P(TreeKernelsOf, FindTheMiddleAndWhatItLoses) {
    on_forests([&](const ModelData& m, const TreeMode& tree, const TreePaths& t) {
        const int n = t.groups;
        const Vector speed[2] = {{n, random, 100}, {n, random, 100}},
                     net[2] = {{n, random, 50}, {n, random, 50}};
        Vector rate[2] = {Vector(n), Vector(n)}, half(n);
        for (int i = 0; i < 2; ++i) {
            for (int g = 0; g < n; ++g) rate[i][g] = difference(tree, speed[i], g);
        }
        const MiddleSums sums{1e-3,
                              {speed[0].data(), speed[1].data()},
                              {net[0].data(), net[1].data()},
                              {rate[0].data(), rate[1].data()},
                              tree.loss,
                              tree.drag_loss};
        const double lost = m.tree->kernel.middle(t, sums, half.data());
        double wanted = 0;
        for (int g = 0; g < n; ++g) {
            const double change = (net[0][g] - net[1][g]) * tree.inverse_mass[g];
            EXPECT_NEAR(half[g], 0.5 * (speed[0][g] + speed[1][g]) + 1e-3 / 8 * change, 1e-13 * 100);
        }
        for (int g = 0; g < n; ++g) {
            const double d = difference(tree, half, g);
            wanted += tree.loss[g] * (rate[0][g] * rate[0][g] + 4 * d * d + rate[1][g] * rate[1][g]);
            wanted += tree.drag_loss[g] *
                      (speed[0][g] * speed[0][g] + 4 * half[g] * half[g] + speed[1][g] * speed[1][g]);
        }
        EXPECT_NEAR(lost, wanted, 1e-12 * wanted);
    });
}

TEST_P(TreeKernelsOf, FindTheLargestSwing) {
    on_forests([&](const ModelData& m, const TreeMode& tree, const TreePaths& t) {
        const int n = t.groups;
        const Vector q[4] = {{n, random, 100}, {n, random, 100}, {n, random, 100}, {n, random, 100}};
        const double* const speeds[] = {q[0].data(), q[1].data(), q[2].data(), q[3].data()};
        const double weights[] = {2, 1, 0, -1};
        StageSums sums{4, speeds};
        sums.weight_of_way = weights;
        sums.h = 1e-3;
        Vector way(n), turned(n);
        const Swing swing = m.tree->kernel.swing_error(t, sums, way.data());
        double error = 0, fastest = 0;
        for (int g = 0; g < n; ++g) {
            for (int j = 0; j < 4; ++j) turned[g] = (j == 0 ? 0 : turned[g]) + 1e-3 * weights[j] * q[j][g];
            fastest = std::max(fastest, std::fabs(q[3][g]));
        }
        for (int g = 0; g < n; ++g) error = std::max(error, std::fabs(difference(tree, turned, g)));
        EXPECT_EQ(swing.fastest, fastest);
        EXPECT_NEAR(swing.error, error, 1e-14);
    });
}

TEST_P(TreeKernelsOf, TakeFromGroupsAndGiveToThem) {
    on_forests([&](const ModelData& m, const TreeMode& tree, const TreePaths& t) {
        const int n = t.groups;
        const TreeKernel& kernel = m.tree->kernel;
        const Vector speed(n, random, 100), f[2] = {{m.forces, random, 50}, {m.forces, random, 50}};
        Vector slip(m.forces), sum(n, random), scaled(n, random), spread(m.masses);
        const GroupForces& forces = tree.forces;
        kernel.slips(forces.slip, speed.data(), forces.place, forces.count, slip.data());
        kernel.spread(tree.masses, speed.data(), m.masses, spread.data());
        Eigen::VectorXd wanted = sum.eigen(), wanted_scaled = scaled.eigen();
        const double* const both[] = {f[0].data(), f[1].data()};
        const double weights[] = {0.25, -1};
        const Efforts efforts{2, both, weights, 2};
        kernel.give(forces, efforts, nullptr, sum.data());
        kernel.give(forces, efforts, tree.inverse_mass, scaled.data());
        for (int j = 0; j < m.masses; ++j)
            EXPECT_EQ(spread[j], tree.masses.ratio[j] * speed[tree.masses.group[j]]);
        for (int i = 0; i < forces.count; ++i) {
            const int k = forces.place[i];
            const GroupPairs &seen = forces.slip, &share = forces.share;
            EXPECT_NEAR(slip[k],
                        seen.of_first[i] * speed[seen.first[i]] + seen.of_second[i] * speed[seen.second[i]],
                        1e-12);
            const double effort = 0.5 * f[0][k] - 2 * f[1][k];
            wanted(share.first[i]) += share.of_first[i] * effort;
            wanted(share.second[i]) += share.of_second[i] * effort;
            wanted_scaled(share.first[i]) += share.of_first[i] * effort * tree.inverse_mass[share.first[i]];
            wanted_scaled(share.second[i]) +=
                share.of_second[i] * effort * tree.inverse_mass[share.second[i]];
        }
        EXPECT_LT((sum.eigen() - wanted).cwiseAbs().maxCoeff(), 1e-12);
        EXPECT_LT((scaled.eigen() - wanted_scaled).cwiseAbs().maxCoeff(), 1e-12);
    });
}

}  // namespace
}  // namespace shiftrig::plant::detail
