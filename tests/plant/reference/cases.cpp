#include "tests/plant/reference/cases.h"

namespace shiftrig::cases {
namespace {

using namespace plant;

Mass mass(const char* name, double inertia, double speed = 0) {
    return {.name = name, .inertia = inertia, .initial_speed = speed};
}

Waveform pieces(std::vector<Waveform::Piece> list) {
    return {std::move(list)};
}

Clutch dry(const char* name, const char* a, const char* b, double sliding, double static_ratio,
           Waveform engagement) {
    Clutch clutch;
    clutch.name = name;
    clutch.a = a;
    clutch.b = b;
    clutch.friction =
        DryFriction{.sliding_capacity = sliding, .static_ratio = static_ratio, .factor_over_slip = {}};
    if (engagement.pieces.empty())
        clutch.actuation = ActuationConstant{};
    else
        clutch.actuation = ActuationDirect{.profile = std::move(engagement)};
    return clutch;
}

}  // namespace

Description coupled_clutches() {
    Description d;
    d.name = "CoupledClutches";
    d.masses = {mass("J1", 1, 10), mass("J2", 1), mass("J3", 1), mass("J4", 1)};
    d.sources = {{.name = "torque", .mass = "J1", .waveform = pieces({{.amplitude = 10, .frequency = 5}})}};
    // cos(0.4π t) = sin(2π·0.2·(t + 1.25))
    d.clutches = {dry("clutch1", "J1", "J2", 10, 1.1,
                      pieces({{.amplitude = 1, .frequency = 0.2, .phase_time = -1.25}})),
                  dry("clutch2", "J2", "J3", 10, 1.1, pieces({{.from = 0.4, .offset = 1}})),
                  dry("clutch3", "J3", "J4", 10, 1.1, pieces({{.from = 0.9, .offset = 1}}))};
    return d;
}

Description lossy_gear_demo() {
    Description d;
    d.name = "LossyGearDemo1";
    d.masses = {mass("Inertia1", 1), mass("Inertia2", 1.5)};
    d.gears = {
        {.name = "gear", .a = "Inertia1", .b = "Inertia2", .ratio = 2, .efficiency = 0.5, .options = {}}};
    d.sources = {
        {.name = "drive", .mass = "Inertia1", .waveform = pieces({{.amplitude = 10, .frequency = 1}})},
        {.name = "load", .mass = "Inertia2", .waveform = pieces({{.from = 0, .offset = -10, .slope = 2.5}})}};
    return d;
}

Description friction() {
    Description d;
    d.name = "Friction";
    d.masses = {mass("inertia3", 1, 100), mass("inertia2", 0.05, 90), mass("inertia1", 1, 90)};
    d.shafts = {{.name = "spring", .a = "inertia2", .b = "inertia1", .stiffness = 160, .damping = 1}};
    d.clutches = {dry("clutch", "inertia3", "inertia2", 80, 1, {}),
                  dry("brake", "inertia1", "", 800, 1, pieces({{.from = 0.5, .offset = 1}}))};
    // 200 sin(100 t)
    d.sources = {
        {.name = "torque",
         .mass = "inertia3",
         .waveform = pieces({{.until = 0.5, .amplitude = 200, .frequency = 15.915494309189533577}})}};
    return d;
}

Description two_inertias() {
    Description d;
    d.name = "two inertias";
    d.masses = {mass("first", 2.6, 188.5), mass("second", 1.0)};
    d.clutches = {dry("clutch", "first", "second", 1500, 1, {})};
    return d;
}

Description stick_slip() {
    Description d;
    d.name = "stick-slip";
    d.masses = {mass("load", 1, 0.2), mass("belt", 1e12, 0.2), mass("wall", 1e12)};
    d.shafts = {{.name = "spring", .a = "load", .b = "wall", .stiffness = 1}};
    d.clutches = {dry("contact", "belt", "load", 0.7, 1 / 0.7, {})};
    d.clutches[0].initially_locked = true;
    return d;
}

Description light_body() {
    Description d;
    d.name = "light body";
    d.masses = {mass("engine", 1), mass("ring", 1e-4), mass("load", 10)};
    // Willis: sun − u ring − (1 − u) carrier = 0 with u = −ring/sun = −2
    d.planetaries = {{.name = "row", .sun = "engine", .ring = "ring", .carrier = "load", .ratio = -2}};
    d.clutches = {
        dry("brake", "ring", "", 150, 1,
            pieces({{.until = 2, .offset = 1}, {.from = 2, .until = 2.15, .offset = 1, .slope = -1 / 0.15}})),
        dry("clutch", "engine", "ring", 150, 1,
            pieces({{.from = 2, .until = 2.15, .slope = 1 / 0.15}, {.from = 2.15, .offset = 1}}))};
    d.sources = {{.name = "engine", .mass = "engine", .waveform = pieces({{.from = 0.5, .offset = 30}})},
                 {.name = "load", .mass = "load", .waveform = {}, .quadratic = 0.15}};
    return d;
}

}  // namespace shiftrig::cases
