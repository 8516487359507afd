// The instant at which a pair gives way: known as nearly as rounding allows, and what follows must not hang on which side of it.
#include <cmath>
#include <numbers>

#include "tests/plant/mirrored.h"

namespace shiftrig::plant {
namespace {

// A clutch of 10 Nm, a gear of η = 0.8 and a brake that holds 8.82 Nm and passes 6.3: no more than 8 Nm ever come to it. Where the
// clutch gave way a little below its limit it slipped backwards, and the brake was taken to go in its place.
TEST(Instant, ABrakeWithinItsLimitStaysWhereTheClutchBeforeItSlips) {
    for (const Method method : {Method::etd3, Method::ark3}) {
        for (const double frequency : {3.3, 4.1, 5., 5.9, 7.7}) {
            for (const double h : {5e-4, 1e-3, 2e-3}) {
                Description d;
                d.method = method;
                d.masses = {mass("m0", 0.2), mass("m1", 0.2), mass("m2", 0.2)};
                d.gears = {lossy_gear("g", "m1", "m2", 1, 0.8)};
                d.clutches = {held("c", "m0", "m1", 10, 1), held("b", "m2", "", 6.3, 1.4)};
                Waveform load;
                load.pieces = {{.amplitude = 15, .frequency = frequency}};
                d.sources = {source("m0", load)};
                BuildOptions options;
                options.step_size = h;
                const Both both(d, 0.3 / frequency, options);
                both.expect_mirror_images();
                const std::vector<double> gives_way = both.forward.times(EventKind::break_away, "c");
                ASSERT_EQ(gives_way.size(), 1u) << frequency << ' ' << h;
                EXPECT_NEAR(gives_way[0], std::asin(10. / 15) / (2 * std::numbers::pi * frequency), 1e-7);
                EXPECT_TRUE(both.forward.times(EventKind::break_away, "b").empty()) << frequency << ' ' << h;
                EXPECT_EQ(both.forward.state.speeds()[2], 0);
            }
        }
    }
}

// A brake that broke away at rest passes on 3.99 Nm where the other one holds, and 4.64 Nm no more. When the other one is at its limit
// too all goes, whatever the length of the step.
TEST(Instant, ALastHolderAtItsLimitLetsAllGo) {
    Description d;
    d.masses = {mass("m0", 1.7237), mass("m1", 0.2436, -9.593)};
    d.gears = {lossy_gear("g0", "m1", "m0", 1.34744, 0.60927, 0.1416, 0.86612)};
    d.clutches = {clutch("b0", "m1", "", 3.992, 1.164), clutch("b1", "m0", "", 4.1924)};
    Waveform load;
    load.pieces = {{.amplitude = 15.48, .frequency = 6.988, .phase_time = 0.03021}};
    d.sources = {source("m0", load)};
    for (const double h : {1e-3, 5e-4, 1e-4}) {
        BuildOptions options;
        options.step_size = h;
        const Both both(d, 0.34, options);
        both.expect_mirror_images();
        for (const char* brake : {"b0", "b1"})
            ASSERT_EQ(both.forward.times(EventKind::break_away, brake).size(), 1u) << h;
        EXPECT_NEAR(both.forward.times(EventKind::break_away, "b0")[0], 0.33350609, 1e-8) << h;
        EXPECT_NEAR(both.forward.times(EventKind::break_away, "b1")[0], 0.33358084, 1e-8) << h;
        EXPECT_NEAR(both.forward.times(EventKind::mesh_releases, "g0").back(), 0.33358084, 1e-8) << h;
    }
}

// Two gears and two brakes at rest behind a shaft. One brake weakens and gives way; the other one can hold what is left, so it does,
// in whichever order the gears stand.
TEST(Instant, NoOtherBrakeIsTornLooseThatCouldHold) {
    for (const bool reversed : {false, true}) {
        Description d;
        d.masses = {mass("m0", 0.0561228), mass("m1", 1.98783), mass("m2", 0.150015), mass("m3", 0.862237)};
        d.gears = {lossy_gear("g0", "m0", "m2", 1.97882, 0.68584, 0, 0.702905),
                   lossy_gear("g1", "m0", "m3", -2.13541, 0.809878, 0, 0.696518)};
        if (reversed) std::swap(d.gears[0], d.gears[1]);
        Shaft s;
        s.name = "s0", s.a = "m0", s.b = "m1";
        s.stiffness = 143.114, s.damping = 0.0622441;
        d.shafts = {s};
        Waveform grows = constant(0.97347, -1e300, 0.05778), wave;
        grows.pieces.push_back({.from = 0.05778, .offset = 0.97347, .slope = 0.24748});
        wave.pieces = {{.offset = 0.5, .amplitude = 0.45, .frequency = 6.41, .phase_time = 0.1647}};
        d.clutches = {clutch("b0", "m2", "", 5.99109, 1.02566, ActuationDirect{.profile = grows}),
                      clutch("b1", "m3", "", 11.7262, 1.21443, ActuationDirect{.profile = wave})};
        d.sources = {source("m1", constant(19.2511))};
        const Both both(d, 0.11);
        both.expect_mirror_images();
        const Rig& rig = both.forward;
        ASSERT_EQ(rig.times(EventKind::break_away, "b1").size(), 1u) << reversed;
        EXPECT_NEAR(rig.times(EventKind::break_away, "b1")[0], 0.0948392, 1e-6) << reversed;
        EXPECT_EQ(rig.times(EventKind::break_away, "b0").size(), 1u) << reversed;
        EXPECT_NEAR(rig.times(EventKind::break_away, "b0")[0], 0.0987599, 1e-6) << reversed;
        EXPECT_NEAR(rig.times(EventKind::mesh_releases, "g0").back(), 0.0987599, 1e-6) << reversed;
    }
}

Clutch pressed_from(const char* name, const char* a, const char* b, double sliding, double static_ratio,
                    double from, double slope) {
    return clutch(name, a, b, sliding, static_ratio,
                  ActuationDirect{.profile = {{{.from = from, .slope = slope}}}});
}

// While b2 holds nothing could slip in c1; b2 gives way in the very instant, and takes m2 along the other way. From then on
// m0 and m1 go with (−3.5 + 0.43 + 30 t)/1.1, m2 with −(0.43 + 30 t)/0.3 rad/s².
TEST(Instant, APairPressedFromNothingGoesAsOthersTakeItThatGiveWayWithIt) {
    for (const bool reversed : {false, true}) {
        Description d;
        d.masses = {mass("m0", 1), mass("m1", 0.1), mass("m2", 0.3)};
        d.clutches = {clutch("c0", "m0", "m1", 15), pressed_from("c1", "m0", "m2", 10, 1, 0, 3),
                      clutch("b2", "m2", "m1", 0.43)};
        if (reversed) std::swap(d.clutches[0], d.clutches[2]);
        d.sources = {source("m1", constant(-3.5))};
        const Both both(d, 0.002);
        both.expect_mirror_images();
        const double t = 0.002;
        EXPECT_NEAR(both.forward.state.speeds()[0], (-3.07 * t + 15 * t * t) / 1.1, 1e-12) << reversed;
        EXPECT_NEAR(both.forward.state.speeds()[2], -(0.43 * t + 15 * t * t) / 0.3, 1e-12) << reversed;
        EXPECT_EQ(both.forward.fall_backs, 0);
    }
}

// c0 slips under a load that outgrows it. What it passes the brake can hold, whichever of them is asked first.
TEST(Instant, OfTwoPressedFromNothingTheWeakerOneGoes) {
    for (const bool reversed : {false, true}) {
        Description d;
        d.masses = {mass("m0", 1), mass("m1", 0.44), mass("m2", 1), mass("m3", 1)};
        Planetary row;
        row.name = "r0", row.sun = "m1", row.ring = "m2", row.carrier = "m0";
        row.ratio = -3.4, row.efficiency = 1;
        d.planetaries = {row};
        d.clutches = {pressed_from("c0", "m0", "m3", 8, 1, 0.03, 2.6),
                      pressed_from("b1", "m2", "", 3.3, 1.34, 0.03, 3.35)};
        if (reversed) std::swap(d.clutches[0], d.clutches[1]);
        TorqueSource load = source("m3", constant(0));
        load.waveform.pieces = {{.from = 0.03, .slope = -90}};
        d.sources = {load};
        const Both both(d, 0.2);
        both.expect_mirror_images();
        EXPECT_EQ(both.forward.state.speeds()[2], 0) << reversed;
        EXPECT_EQ(both.forward.times(EventKind::engage, "c0").size(), 1u) << reversed;
        EXPECT_EQ(both.forward.times(EventKind::lock, "b1").size(), 1u) << reversed;
        EXPECT_EQ(both.forward.fall_backs, 0);
    }
}

// A gear of nearly 1 with three devices across it: what they do to each other is 3e-3 of their torques, and an acceleration of
// nothing but rounding was taken for motion. All is at rest; the weak brake was let go and caught again in every step.
TEST(Instant, RoundingInANearlyParallelLoopIsNoMotion) {
    Description d;
    d.masses = {mass("m0", 0.12432, 5.9424), mass("m1", 0.15212, 5.9587)};
    d.gears = {lossy_gear("g0", "m0", "m1", 0.997266, 1)};
    const auto pressed = [](double at_first, double slope_at_first, double later, double slope_later) {
        Waveform w;
        w.pieces = {{.from = 0, .until = 0.126451, .offset = at_first, .slope = slope_at_first},
                    {.from = 0.126451, .offset = later, .slope = slope_later}};
        return ActuationDirect{.profile = w};
    };
    Waveform wave;
    wave.pieces = {{.offset = 0.5, .amplitude = 0.5, .frequency = 5.742, .phase_time = 0.3331}};
    d.clutches = {clutch("b0", "m1", "", 10, 1, pressed(0.20088, -1.5886, 0, 0.39381)),
                  clutch("b1", "m1", "m0", 9.6792, 1, pressed(0.28197, 0, 0.30497, 0)),
                  clutch("b2", "m1", "", 38.207, 1, pressed(0.099772, 0, 0.86276, 0)),
                  clutch("b3", "m0", "m1", 10, 1, ActuationDirect{.profile = wave})};
    d.freewheels = {{"f0", "m0", "m1", Sense::forward, 1000, 0.8, 1.28948}};
    TorqueSource falls = source("m0", constant(0));
    falls.name = "falls";
    falls.waveform.pieces = {{.from = 0, .until = 0.246717, .slope = -100.36},
                             {.from = 0.246717, .offset = -24.761}};
    d.sources = {source("m0", constant(14.303)), source("m1", constant(4.3797)), falls};
    Rig rig(d);
    rig.run(0.4);
    EXPECT_EQ(rig.fall_backs, 0);
    EXPECT_LT(rig.events.size(), 20u);
    for (const double speed : rig.state.speeds()) EXPECT_EQ(speed, 0);
}

}  // namespace
}  // namespace shiftrig::plant
