#include "analysis/driveline_symbols.h"

#include <cstdio>

namespace shiftrig::analysis {

namespace {

// clang-format off
constexpr Symbol clutch{"clutch", R"(<path d="M-20 0H-4M-4 -14V14M4 -14V14M4 0H20"/>)", "parallelogram", Place::between};
constexpr Symbol freewheel{"freewheel", R"(<path d="M-20 0H-8M-8 -9V9L8 0ZM8 -9V9M8 0H20"/>)", "parallelogram", Place::between};
constexpr Symbol sprag{"freewheel", R"(<path d="M0 -18V-9M-9 -9H9L0 4ZM-14 4H14M-14 4l-4 6M-5 4l-4 6M4 4l-4 6M13 4l-4 6"/>)", "parallelogram", Place::hangs};
constexpr Symbol brake{"brake", R"(<path d="M0 -18V-6M-14 -6H14M-14 2H14M-14 2l-4 6M-5 2l-4 6M4 2l-4 6M13 2l-4 6"/>)", "parallelogram", Place::hangs};
constexpr Symbol shaft{"shaft", R"(<path d="M-20 0h4l4 -8 6 16 6 -16 6 16 6 -16 4 8h4"/>)", "plain", Place::between};
constexpr Symbol backlash{"backlash", R"(<path d="M-20 0H-11M4 -11H-11V11H4M-3 0H20M-3 -6V6"/>)", "plain", Place::between};
constexpr Symbol damper{"damper", R"(<path d="M-20 0H-2M-2 -7V7M-8 -10H8V10H-8M8 0H20"/>)", "plain", Place::between};
constexpr Symbol gear{"gear", R"(<path d="M-20 0H-13M13 0H20"/><circle cx="-4" cy="0" r="9"/><circle cx="9" cy="0" r="4"/>)", "circle", Place::between};
constexpr Symbol planetary{"planetary", R"(<circle cx="0" cy="0" r="20"/><circle cx="0" cy="0" r="7"/><circle cx="0" cy="-13" r="5"/><circle cx="11" cy="7" r="5"/><circle cx="-11" cy="7" r="5"/>)", "doublecircle", Place::between, 20};
constexpr Symbol tyre{"tyre", R"(<path d="M-20 16H20"/><circle cx="0" cy="0" r="15"/><circle cx="0" cy="0" r="6"/>)", "ellipse", Place::between};
constexpr Symbol converter{"converter", R"(<circle cx="0" cy="0" r="16"/><path d="M-20 0H-16M16 0H20M-3 -11C-12 -6 -12 6 -3 11M3 -11C12 -6 12 6 3 11"/>)", "ellipse", Place::between};
constexpr Symbol engine{"engine", R"(<path d="M0 16V8M-12 8H12V-6H-12ZM-5 -6V-12H5V-6"/>)", "cds", Place::stands};
constexpr Symbol source{"source", R"(<path d="M-10 4A10 10 0 1 1 10 4M10 4l-5 -4M10 4l3 -6M0 16V6"/>)", "cds", Place::stands};
constexpr Symbol road{"road", R"(<path d="M-16 8L16 0M-16 8H16"/>)", "cds", Place::hangs};
constexpr Symbol plough{"plough", R"(<path d="M-14 -6H8L14 8L2 2"/>)", "cds", Place::hangs};
// clang-format on

}  // namespace

std::string digits(double value) {
    char text[32];
    std::snprintf(text, sizeof text, value < 1000 ? "%.4g" : "%.0f", value);
    return text;
}

Look look_of(const plant::Shaft& s) {
    return {shaft, digits(s.stiffness) + " Nm/rad"};
}
Look look_of(const plant::Backlash& b) {
    return {backlash, digits(1e3 * b.gap) + " mrad"};
}
Look look_of(const plant::Damper& d) {
    return {damper, digits(d.damping) + " Nm s/rad"};
}
Look look_of(const plant::Clutch& c) {
    return {c.b.empty() ? brake : c.radius > 0 ? tyre : clutch, ""};
}
Look look_of(const plant::Freewheel& f) {
    return {f.b.empty() ? sprag : freewheel, digits(f.rated_torque) + " Nm"};
}
Look look_of(const plant::Gear& g) {
    return {gear, "u " + digits(g.ratio)};
}
Look look_of(const plant::Planetary& p) {
    return {planetary, "u " + digits(p.ratio)};
}
Look look_of(const plant::BrixiusTyre& t) {
    return {tyre, "r " + digits(t.radius) + " m"};
}
Look look_of(const plant::TorqueConverter&) {
    return {converter, ""};
}
Look look_of(const plant::Engine&) {
    return {engine, ""};
}
Look look_of(const plant::TorqueSource&) {
    return {source, ""};
}
Look look_of(const plant::Road&) {
    return {road, ""};
}
Look look_of(const plant::Plough&) {
    return {plough, ""};
}

}  // namespace shiftrig::analysis
