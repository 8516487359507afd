// The loops over all devices, in every kernel that this processor runs, against the plain laws one device at a time. What
// stands behind the arrays is not a number: it must not matter.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "plant/laws/friction.h"
#include "plant/laws/heat.h"
#include "plant/laws/oil.h"
#include "plant/laws/sensor.h"
#include "tests/plant/kernel_kinds.h"

namespace shiftrig::plant::detail {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr int most = 19;  // beyond two registers, whatever their size

class DeviceLoopsOf : public testing::TestWithParam<KernelKind> {
  protected:
    // So many numbers of either sign, and what follows them.
    std::vector<double> numbers(int count, double scale = 10, double behind = nan) {
        std::uniform_real_distribution<double> draw(-scale, scale);
        std::vector<double> v;
        for (int i = 0; i < count; ++i) v.push_back(draw(random));
        v.resize(v.size() + loop_slack, behind);
        return v;
    }
    std::vector<double> positive(int count, double behind = nan) {
        std::vector<double> v = numbers(count, 10, behind);
        for (int i = 0; i < count; ++i) v[at(i)] = std::fabs(v[at(i)]);
        return v;
    }
    static std::size_t at(int i) { return static_cast<std::size_t>(i); }

    DeviceLoops loops = choose_kernel(GetParam()).loops;
    std::mt19937_64 random{7};
};

INSTANTIATE_TEST_SUITE_P(Kernels, DeviceLoopsOf, testing::ValuesIn(offered_kernels()), kernel_name);

TEST_P(DeviceLoopsOf, SeeTheOneSpeedThatHasTheWrongSense) {
    for (int count = 1; count <= most; ++count) {
        std::vector<double> sense = numbers(count, 1, 0), end = positive(count);
        for (int i = 0; i < count; ++i) {
            sense[at(i)] = i % 3 == 2 ? 0 : sense[at(i)] < 0 ? -1 : 1;
            end[at(i)] *= sense[at(i)] == 0 ? -1 : sense[at(i)];
        }
        const SpeedCheck check{sense.data(), end.data(), end.data(), end.data(), count};
        EXPECT_TRUE(loops.senses_hold(check)) << count;
        for (int i = 0; i < count; ++i) {
            end[at(i)] = -end[at(i)];
            EXPECT_EQ(loops.senses_hold(check), sense[at(i)] == 0) << i << " of " << count;
            end[at(i)] = -end[at(i)];
        }
    }
}

TEST_P(DeviceLoopsOf, SuspectEveryMarginThatFallsAndRisesAgain) {
    int dips = 0;
    for (int n = 0; n < 2000; ++n) {
        const int count = 1 + n % most;
        const std::vector<double> sense(at(count) + loop_slack, 0);
        std::vector<double> one = sense;
        const auto place = at(static_cast<int>(random() % static_cast<unsigned>(count)));
        one[place] = n % 2 ? 1 : -1;
        const std::vector<double> begin = numbers(count), half = numbers(count), end = numbers(count);
        const SpeedCheck check{one.data(), begin.data(), half.data(), end.data(), count};
        // The parabola through the three: does it have its least inside, and does it end above 0?
        const double g0 = one[place] * begin[place], gm = one[place] * half[place],
                     g1 = one[place] * end[place];
        const double slope = 4 * gm - 3 * g0 - g1, bend = 2 * (g0 - 2 * gm + g1);
        const bool dips_here = slope < 0 && slope + 2 * bend > 0 && g1 > 0;
        EXPECT_EQ(loops.may_dip(check), dips_here) << g0 << ' ' << gm << ' ' << g1;
        dips += dips_here;
    }
    EXPECT_GT(dips, 100);
}

// Bit for bit, whatever registers do it: a sample may come from a step or be computed anew.
TEST_P(DeviceLoopsOf, SeeThePairThatShouldEngageOrLetGo) {
    for (int count = 0; count <= most; ++count) {
        std::vector<double> sliding = positive(count), holding = positive(count), code = numbers(count);
        for (int k = 0; k < count; ++k) {
            code[at(k)] = k % 3;  // 2: free
            if (code[at(k)] == 2) sliding[at(k)] = holding[at(k)] = 0;
            if (k % 3 == 0) (k % 2 ? sliding : holding)[at(k)] = 0;  // one of both is enough
        }
        EXPECT_TRUE(loops.pressed_engage(sliding.data(), holding.data(), code.data(), count)) << count;
        for (int k = 0; k < count; ++k) {
            const double kept = code[at(k)];
            code[at(k)] = kept == 2 ? 1 : 2;
            EXPECT_FALSE(loops.pressed_engage(sliding.data(), holding.data(), code.data(), count)) << k;
            code[at(k)] = kept;
        }
    }
}

TEST_P(DeviceLoopsOf, SeeTheOneMeshWhosePowerHasTurned) {
    for (int count = 0; count <= most; ++count) {
        std::vector<double> torque = numbers(count), direction = numbers(count), checked = numbers(count),
                            told = numbers(count);
        for (int k = 0; k < count; ++k) {
            torque[at(k)] = k % 2 ? 5 : -5;
            checked[at(k)] = k % 3 == 2 ? 0 : k % 2 ? 1 : -1;
            direction[at(k)] = told[at(k)] = k % 4 < 2 ? 1 : -1;
        }
        const MeshFlow flow{torque.data(), direction.data(), checked.data(), count};
        EXPECT_FALSE(loops.some_turned(flow, told.data(), 5)) << count;
        for (int k = 0; k < count; ++k) {
            direction[at(k)] = -direction[at(k)];
            EXPECT_EQ(loops.some_turned(flow, told.data(), 5), k % 3 != 2) << k << " of " << count;
            EXPECT_FALSE(loops.some_turned(flow, told.data(), 5.1)) << "too little torque";
            direction[at(k)] = -direction[at(k)];
        }
    }
}

TEST_P(DeviceLoopsOf, PressSlideAndDragAsTheLawsDo) {
    for (int count = 1; count <= most; ++count) {
        const std::vector<double> load = positive(count), rest = positive(count), base = positive(count);
        std::vector<double> slip = numbers(count, 100), inverse_speed = positive(count);
        const std::vector<double> drag = positive(count);
        std::vector<double> sense = numbers(count, 1), rise = numbers(count, 0.1);
        for (int k = 0; k < count; ++k) {
            sense[at(k)] = k % 3 - 1;
            if (k % 4 == 0) rise[at(k)] = 0;
            if (k % 7 == 1)
                inverse_speed[at(k)] = 745.1 / std::fabs(slip[at(k)]);  // the smallest numbers there are
            if (k % 7 == 2) inverse_speed[at(k)] = 1e5;                 // and less
        }
        for (const bool fades : {false, true}) {
            const FrictionTerms terms{
                load.data(),          slip.data(), sense.data(), drag.data(), base.data(), rise.data(),
                inverse_speed.data(), rest.data(), fades,        60,          count};
            std::vector<double> holds = numbers(count), slides = numbers(count), f = numbers(count),
                                stage = f;
            loops.press(terms, f.data(), holds.data(), slides.data());
            loops.slide(terms, stage.data());
            for (int k = 0; k < count; ++k) {
                FrictionLaw law;
                law.base = base[at(k)];
                law.rise = fades ? rise[at(k)] : 0;
                law.inverse_speed = inverse_speed[at(k)];
                const double passed = sliding_capacity(law, load[at(k)], slip[at(k)]);
                EXPECT_EQ(holds[at(k)], load[at(k)] * rest[at(k)]);
                EXPECT_EQ(slides[at(k)], passed) << k << " of " << count;
                EXPECT_EQ(f[at(k)], drag_torque(drag[at(k)], 1, slip[at(k)], 60) + sense[at(k)] * passed);
                EXPECT_EQ(stage[at(k)], f[at(k)]);
            }
        }
    }
}

TEST_P(DeviceLoopsOf, BookByForceAndInAll) {
    for (int forces = 1; forces <= most; ++forces) {
        const int meshes = forces % 5, swings = forces % 4;
        std::vector<double> f[3], slip[3], torque[3], turning[3], swing[3];
        for (int i = 0; i < 3; ++i) {
            f[i] = numbers(forces);
            slip[i] = numbers(forces);
            torque[i] = numbers(meshes);
            turning[i] = numbers(meshes);
            swing[i] = numbers(swings);
        }
        std::vector<double> lost(at(forces) + loop_slack, 0), given = lost;
        for (int k = 0; k < forces; ++k) (k % 3 == 0 ? given : lost)[at(k)] = k % 7 != 6;
        const std::vector<double> share = numbers(meshes, 0.1, 0), damping = numbers(swings, 5, 0);
        std::vector<double> work(at(forces) + loop_slack, 1);
        PowerTerms terms;
        for (int i = 0; i < 3; ++i) {
            terms.force[i] = f[i].data();
            terms.slip[i] = slip[i].data();
            terms.mesh_torque[i] = torque[i].data();
            terms.turning[i] = turning[i].data();
            terms.swing[i] = swing[i].data();
        }
        terms.lost = lost.data();
        terms.given = given.data();
        terms.forces = forces;
        terms.loss_share = share.data();
        terms.meshes = meshes;
        terms.damping = damping.data();
        terms.swings = swings;
        const double h = 1e-3, weight[3] = {h / 6, 4 * h / 6, h / 6};
        const Work3 booked = loops.book(terms, h, work.data());
        double lost_work = 0, given_work = 0;
        for (int k = 0; k < forces; ++k) {
            double part = 0;
            for (int i = 0; i < 3; ++i) part += weight[i] * f[i][at(k)] * slip[i][at(k)];
            EXPECT_NEAR(work[at(k)], 1 + part, 1e-14);
            if (lost[at(k)] != 0) lost_work += part;
            if (given[at(k)] != 0) given_work -= part;
        }
        for (int i = 0; i < 3; ++i) {
            for (int k = 0; k < meshes; ++k)
                lost_work += weight[i] * share[at(k)] * torque[i][at(k)] * turning[i][at(k)];
            for (int k = 0; k < swings; ++k)
                lost_work += weight[i] * damping[at(k)] * swing[i][at(k)] * swing[i][at(k)];
        }
        EXPECT_NEAR(booked.lost, lost_work, 1e-14 * (1 + std::fabs(lost_work)));
        EXPECT_NEAR(booked.given, given_work, 1e-14 * (1 + std::fabs(given_work)));
    }
}

TEST_P(DeviceLoopsOf, SumSquares) {
    for (int count = 0; count <= most; ++count) {
        const std::vector<double> v = numbers(count), weight = numbers(count, 3, 0),
                                  rest = numbers(count / 2);
        double weighted = 0, all = 0, left = 0;
        for (int i = 0; i < count; ++i) {
            weighted += weight[at(i)] * v[at(i)] * v[at(i)];
            all += v[at(i)] * v[at(i)];
        }
        for (int i = 0; i < count / 2; ++i) left += rest[at(i)] * rest[at(i)];
        EXPECT_NEAR(loops.weighted_square(weight.data(), v.data(), count), weighted, 1e-12);
        EXPECT_NEAR(loops.share_of_squares(rest.data(), count / 2, v.data(), count), all > 0 ? left / all : 0,
                    1e-14);
        std::vector<double> difference = numbers(count);
        loops.subtract(v.data(), weight.data(), count, difference.data());
        for (int i = 0; i < count; ++i) EXPECT_EQ(difference[at(i)], v[at(i)] - weight[at(i)]);
    }
}

TEST_P(DeviceLoopsOf, FindTheLargestMagnitude) {
    for (int count = 0; count <= most; ++count) {
        const std::vector<double> a = numbers(count),
                                  b = numbers(count);  // what stands behind them is not a number
        double of_a = 0, of_both = 0;
        for (int i = 0; i < count; ++i) {
            of_a = std::max(of_a, std::fabs(a[at(i)]));
            of_both = std::max(of_both, std::fabs(a[at(i)] - b[at(i)]));
        }
        EXPECT_EQ(loops.largest(a.data(), count), of_a);
        EXPECT_EQ(loops.largest_difference(a.data(), b.data(), count), of_both);
        for (int i = 0; i < count; ++i) {
            std::vector<double> one(a.size(), 1);
            one[at(i)] = i % 2 == 0 ? -3 : 3;
            EXPECT_EQ(loops.largest(one.data(), count), 3) << i << " of " << count;
        }
    }
}

TEST_P(DeviceLoopsOf, HeatAsTheLawDoesAndTellWhenALimitIsPassed) {
    FacingHeat p;
    p.surface_capacity = 120;
    p.bulk_capacity = 1400;
    p.surface_to_bulk = 400;
    p.bulk_to_oil = 120;
    const HeatOperator op = heat_operator(p, 1e-3);
    for (int count = 1; count <= most; ++count) {
        const auto constant = [&](double value) {
            std::vector<double> v(at(count), value);
            v.resize(v.size() + loop_slack, 0);
            return v;
        };
        const std::vector<double> e11 = constant(op.e11), e12 = constant(op.e12), e21 = constant(op.e21),
                                  e22 = constant(op.e22), f1 = constant(op.f1), f2 = constant(op.f2);
        std::vector<double> warn = constant(200), fail = constant(250);
        for (std::size_t i = at(count); i < warn.size(); ++i)
            warn[i] = fail[i] = std::numeric_limits<double>::infinity();
        std::vector<int> pair(at(count) + loop_slack, 0);
        for (int k = 0; k < count; ++k) pair[at(k)] = count - 1 - k;
        const HeatTerms terms{e11.data(), e12.data(),  e21.data(),  e22.data(),  f1.data(),
                              f2.data(),  warn.data(), fail.data(), pair.data(), count};
        std::vector<double> surface = positive(count, 0), bulk = positive(count, 0), before = numbers(count);
        const std::vector<double> work = positive(count);
        std::vector<HeatState> plain;
        for (int k = 0; k < count; ++k) plain.push_back({surface[at(k)], bulk[at(k)]});
        for (int n = 0; n < 40; ++n) {
            bool passes = false;
            for (int k = 0; k < count; ++k) {
                const double was = plain[at(k)].surface;
                advance_heat(op, plain[at(k)], work[at(pair[at(k)])] * 1000, 80);
                for (double limit : {200., 250.}) passes |= was < limit && plain[at(k)].surface >= limit;
            }
            EXPECT_EQ(loops.heat(terms, work.data(), 1000, 80, surface.data(), bulk.data(), before.data()),
                      passes);
            for (int k = 0; k < count; ++k) {
                ASSERT_EQ(surface[at(k)], plain[at(k)].surface) << k << " of " << count;
                ASSERT_EQ(bulk[at(k)], plain[at(k)].bulk);
            }
        }
    }
}

TEST_P(DeviceLoopsOf, PickUpsReadAsTheLawDoes) {
    for (int count = 1; count <= most; ++count) {
        std::vector<SpeedSensor> sensors;
        std::vector<double> teeth, pitch, directional, drop_out;
        std::vector<int> mass;
        for (int i = 0; i < count; ++i) {
            SpeedSensor p;
            p.ideal = i % 5 == 4;
            p.teeth = 20 + 7 * i;
            p.directional = i % 2 == 0;
            p.drop_out_speed = 0.5;
            sensors.push_back(p);
            teeth.push_back(p.ideal ? 0 : p.teeth);
            pitch.push_back(p.ideal ? 0 : tooth_pitch(p));
            directional.push_back(p.directional);
            drop_out.push_back(p.drop_out_speed);
            mass.push_back(count - 1 - i);
        }
        for (auto* v : {&teeth, &pitch, &directional, &drop_out}) v->resize(v->size() + loop_slack, 0);
        mass.resize(mass.size() + loop_slack, 0);
        const PickupTerms terms{teeth.data(),    pitch.data(), directional.data(),
                                drop_out.data(), mass.data(),  count};
        const auto room = at(count) + loop_slack;
        std::vector<double> position(room, 0), since(room, SensorState{}.since_edge), reading(room, 0);
        std::vector<SensorState> plain(at(count));
        // Fast, slow, at rest, and back again.
        std::vector<double> begin = numbers(count, 400, 0);
        for (int n = 0; n < 600; ++n) {
            std::vector<double> end = begin;
            for (int k = 0; k < count; ++k) end[at(k)] = n < 400 ? begin[at(k)] * 0.97 : begin[at(k)] - 0.3;
            loops.pick_up(terms, begin.data(), end.data(), 1e-3, position.data(), since.data(),
                          reading.data());
            for (int i = 0; i < count; ++i) {
                SensorState& state = plain[at(i)];
                advance_pickup(sensors[at(i)], state, begin[at(mass[at(i)])], end[at(mass[at(i)])], 1e-3);
                ASSERT_EQ(reading[at(i)], state.reading)
                    << "pick-up " << i << " of " << count << ", step " << n;
                ASSERT_EQ(position[at(i)], state.position) << i;
                ASSERT_EQ(since[at(i)], state.since_edge) << i;
            }
            begin = end;
        }
    }
}

TEST_P(DeviceLoopsOf, ShowShaftsByQuantity) {
    for (int count = 0; count <= most; ++count) {
        const std::vector<double> stiffness = numbers(count), damping = numbers(count),
                                  twist = numbers(count), rate = numbers(count);
        std::vector<double> shown(at(2 * count) + loop_slack, 0);
        double* const end = loops.show_shafts(
            {stiffness.data(), damping.data(), twist.data(), rate.data(), count}, shown.data());
        EXPECT_EQ(end - shown.data(), 2 * count);
        for (int e = 0; e < count; ++e) {
            EXPECT_EQ(shown[at(e)], stiffness[at(e)] * twist[at(e)] + damping[at(e)] * rate[at(e)]);
            EXPECT_EQ(shown[at(count + e)], twist[at(e)]);
        }
    }
}

TEST_P(DeviceLoopsOf, SeeTheOneBitThatDiffersAndCopyEveryNumber) {
    for (int count = 0; count <= most; ++count) {
        const std::vector<double> a = numbers(count);
        std::vector<double> b(at(count) + loop_slack, -7);
        loops.copy(a.data(), count, b.data());
        EXPECT_EQ(std::vector<double>(b.begin(), b.begin() + count),
                  std::vector<double>(a.begin(), a.begin() + count));
        EXPECT_EQ(b[at(count)], -7) << "nothing is written behind the last";
        EXPECT_TRUE(loops.same(a.data(), b.data(), count));
        for (int i = 0; i < count; ++i) {
            const double kept = b[at(i)];
            b[at(i)] = std::nextafter(kept, 1e9);
            EXPECT_FALSE(loops.same(a.data(), b.data(), count)) << i << " of " << count;
            b[at(i)] = kept;
        }
    }
}

TEST_P(DeviceLoopsOf, ShowClutchesByQuantity) {
    for (int count = 0; count <= most; ++count) {
        const std::vector<double> force = numbers(count), torque = numbers(count), slip = numbers(count),
                                  capacity = numbers(count), code = numbers(count), heat = numbers(count);
        std::vector<double> shown(at(6 * count) + loop_slack, 0);
        double* const end = loops.show_clutches(
            {force.data(), torque.data(), slip.data(), capacity.data(), code.data(), heat.data(), count},
            shown.data());
        EXPECT_EQ(end - shown.data(), 6 * count);
        for (int k = 0; k < count; ++k) {
            const double wanted[] = {force[at(k)] + torque[at(k)], slip[at(k)], capacity[at(k)], code[at(k)],
                                     force[at(k)] * slip[at(k)],   heat[at(k)]};
            for (int q = 0; q < 6; ++q) EXPECT_EQ(shown[at(q * count + k)], wanted[q]) << q << ' ' << k;
        }
    }
}

}  // namespace
}  // namespace shiftrig::plant::detail
