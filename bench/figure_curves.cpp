// Problems with published curves or known answers.
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "bench/figure_data.h"
#include "plant/plant.h"
#include "plant/statics.h"
#include "tests/plant/machines.h"
#include "tests/plant/reference/cases.h"
#include "tests/plant/reference/curves.h"
#include "tests/plant/reference/solver.h"

namespace shiftrig::figures {
namespace {

using namespace plant;
using Row = std::vector<double>;

// The named outputs of a run at 0, sample, 2·sample, …
std::vector<Row> run(Description description, double seconds, double step_size,
                     const std::vector<std::string>& names, Transition transition = Transition::localised,
                     double sample = 1e-3) {
    description.transition = transition;
    const Model model = Model::build(description, {.step_size = step_size, .kernel = KernelKind::automatic});
    Operators operators(model);
    State state(model);
    const Inputs inputs(model);
    Outputs outputs(model);
    Scratch scratch(model);
    std::vector<std::size_t> columns;
    for (const auto& name : names) columns.push_back(static_cast<std::size_t>(model.output(name)));
    std::vector<Row> rows;
    const auto record = [&] {
        Row row;
        for (const std::size_t c : columns) row.push_back(outputs.value[c]);
        rows.push_back(row);
    };
    observe(model, operators, state, inputs, outputs, scratch);
    record();
    const long steps = std::lround(seconds / step_size),
               every = std::max(1L, std::lround(sample / step_size));
    for (long k = 1; k <= steps; ++k) {
        step(model, operators, state, inputs, outputs, scratch);
        if (k % every == 0) record();
    }
    return rows;
}

reference::Curves data(const char* file) {
    return reference::read_curves(std::string(SHIFTRIG_DATA "/") + file);
}

// One curve of the figure: an output of the plant as the published curve defines it.
struct Shown {
    const char* column;
    std::function<double(const Row&)> of;
};

void against_curves(std::FILE* out, const Description& d, const char* file,
                    const std::vector<std::string>& names, const std::vector<Shown>& shown) {
    const reference::Curves curves = data(file);
    const std::size_t n = curves["time"].size();
    const double seconds = 1e-3 * static_cast<double>(n - 1);
    const auto localised = run(d, seconds, 1e-3, names);
    const auto next_step = run(d, seconds, 1e-3, names, Transition::next_step);
    std::fputs("time", out);
    for (const auto& s : shown) std::fprintf(out, ",%s,%s plant,%s next step", s.column, s.column, s.column);
    std::fputs("\n", out);
    for (std::size_t i = 0; i < n; ++i) {
        std::fprintf(out, "%.3f", 1e-3 * static_cast<double>(i));
        for (const auto& s : shown)
            std::fprintf(out, ",%.9g,%.9g,%.9g", curves[s.column][i], s.of(localised.at(i)),
                         s.of(next_step.at(i)));
        std::fputs("\n", out);
    }
}

}  // namespace

void coupled_clutches(std::FILE* out) {
    against_curves(out, cases::coupled_clutches(), "CoupledClutches.csv",
                   {"mass.J1.speed", "mass.J2.speed", "mass.J3.speed", "mass.J4.speed"},
                   {{"J1.w", [](const Row& r) { return r[0]; }},
                    {"clutch1.w_rel", [](const Row& r) { return r[1] - r[0]; }},
                    {"clutch2.w_rel", [](const Row& r) { return r[2] - r[1]; }},
                    {"clutch3.w_rel", [](const Row& r) { return r[3] - r[2]; }}});
}

void lossy_gear(std::FILE* out) {
    against_curves(out, cases::lossy_gear_demo(), "LossyGearDemo1.csv",
                   {"mass.Inertia2.speed", "gear.gear.torque"},
                   {{"Inertia2.w", [](const Row& r) { return r[0]; }},
                    {"gear0.tau_a", [](const Row& r) { return r[1]; }}});
}

void friction(std::FILE* out) {
    against_curves(out, cases::friction(), "Friction.csv",
                   {"mass.inertia3.speed", "mass.inertia2.speed", "mass.inertia1.speed"},
                   {{"inertia3.w", [](const Row& r) { return r[0]; }},
                    {"clutch.w_rel", [](const Row& r) { return r[1] - r[0]; }},
                    {"spring.w_rel", [](const Row& r) { return r[2] - r[1]; }}});
}

// Position of the load and the error of the second break-away, for a row of step sizes.
void stick_slip(std::FILE* out) {
    Description d = cases::stick_slip();
    const double exact = 5 + 2 * std::numbers::pi - 2 * std::atan(1.5) + 3;  // second break-away [s]
    std::fputs("step,localised,next_step\n", out);
    for (const double step_size : {1e-3, 2e-3, 5e-3, 1e-2, 2e-2}) {
        double found[2] = {0, 0};
        for (const Transition transition : {Transition::localised, Transition::next_step}) {
            d.transition = transition;
            const Model model = Model::build(d, {.step_size = step_size, .kernel = KernelKind::automatic});
            Operators operators(model);
            State state(model);
            const Inputs inputs(model);
            Outputs outputs(model);
            Scratch scratch(model);
            int breaks = 0;
            for (int k = 0; k * step_size < 14 && breaks < 2; ++k) {
                step(model, operators, state, inputs, outputs, scratch);
                for (int e = 0; e < outputs.event_count; ++e)
                    if (outputs.events[static_cast<std::size_t>(e)].kind == EventKind::break_away &&
                        ++breaks == 2)
                        found[transition == Transition::next_step] =
                            outputs.events[static_cast<std::size_t>(e)].time;
            }
        }
        std::fprintf(out, "%g,%.4g,%.4g\n", step_size, std::abs(found[0] - exact),
                     std::abs(found[1] - exact));
    }
    std::fputs("\ntime,position,next_step_20ms\n", out);
    const auto fine = run(d, 14, 1e-3, {"shaft.spring.twist"}, Transition::localised, 0.02);
    const auto coarse = run(d, 14, 2e-2, {"shaft.spring.twist"}, Transition::next_step, 0.02);
    for (std::size_t i = 0; i < fine.size(); ++i)
        std::fprintf(out, "%.2f,%.6g,%.6g\n", 0.02 * static_cast<double>(i), fine[i][0], coarse[i][0]);
}

void light_body(std::FILE* out) {
    const Description d = cases::light_body();
    const reference::System system(d);
    reference::Solver solver(system);
    const auto truth = solver.run(3.0, {.step = 4e-6});
    const auto rows = run(d, 3.0, 1e-3,
                          {"mass.engine.speed", "mass.ring.speed", "mass.load.speed", "clutch.brake.torque",
                           "clutch.clutch.torque"});
    std::fputs(
        "time,engine,ring,load,brake torque,clutch torque,engine reference,ring reference,load reference\n",
        out);
    for (std::size_t i = 0; i < rows.size(); ++i) {
        std::fprintf(out, "%.3f", 1e-3 * static_cast<double>(i));
        for (const double v : rows[i]) std::fprintf(out, ",%.9g", v);
        for (int m = 0; m < 3; ++m) std::fprintf(out, ",%.9g", truth.samples[i].z[m]);
        std::fputs("\n", out);
    }
}

// Both wrong models of [Algin] beside the plant, at 1 ms.
//   eq. (2) compares the applied torque M1 with the capacity: J1 = 9, J2 = 1 kg m², M1 = 1, M2 = −10 Nm, capacity 3 Nm.
//           The clutch would have to carry (J2 M1 − J1 M2)/(J1 + J2) = 9.1 Nm and must slip; the wrong model holds it.
//   eq. (1) closes where |Δω| < ε: the two inertias of the closing problem pass a band of 0.6 rad/s within a step.
void wrong_models(std::FILE* out) {
    const double h = 1e-3;
    Description d;
    d.masses = {{.name = "first", .inertia = 9}, {.name = "second", .inertia = 1}};
    Clutch clutch;
    clutch.name = "clutch";
    clutch.a = "first";
    clutch.b = "second";
    clutch.friction = DryFriction{.sliding_capacity = 3, .factor_over_slip = {}};
    clutch.actuation = ActuationConstant{};
    clutch.initially_locked = true;
    d.clutches = {clutch};
    d.sources = {{.name = "drive", .mass = "first", .waveform = {{{.offset = 1}}}},
                 {.name = "load", .mass = "second", .waveform = {{{.offset = -10}}}}};
    const auto rows = run(d, 1.0, h, {"mass.first.speed", "mass.second.speed"});
    std::fputs("time,first,second,eq. (2)\n", out);
    for (std::size_t i = 0; i < rows.size(); i += 10) {
        const double t = h * static_cast<double>(i);
        std::fprintf(out, "%.3f,%.8g,%.8g,%.8g\n", t, rows[i][0], rows[i][1], t * (1 - 10) / 10.0);
    }

    const auto closing = run(cases::two_inertias(), 0.12, h, {"clutch.clutch.slip"});
    const double band = 0.3, j1 = 2.6, j2 = 1.0, capacity = 1500;
    double w1 = 188.5, w2 = 0;
    bool closed = false;
    std::fputs("\ntime,slip,eq. (1)\n", out);
    for (std::size_t i = 0; i < closing.size(); ++i) {
        if (i >= 80)
            std::fprintf(out, "%.3f,%.8g,%.8g\n", h * static_cast<double>(i), closing[i][0], w1 - w2);
        const double sign = w1 > w2 ? 1 : -1;
        closed = closed || std::abs(w1 - w2) < band;
        if (closed) continue;
        w1 -= h * sign * capacity / j1;
        w2 += h * sign * capacity / j2;
    }
}

// Torques on the links of the WT gearbox, as printed in [Algin] Table 2 and as solved.
void table_2(std::FILE* out) {
    struct Printed {
        const char* gear;
        std::vector<std::string> closed;
        bool ideal;
        double torque[3][3];
    };
    const Printed printed[] = {
        {"III", {"C1", "C3"}, true, {{0.294, 0.523, -0.817}, {0.259, 0.816, -1.075}, {0.447, 1.077, -1.524}}},
        {"III",
         {"C1", "C3"},
         false,
         {{0.291, 0.502, -0.793}, {0.259, 0.791, -1.050}, {0.450, 1.052, -1.502}}},
        {"V", {"C2", "C3"}, true, {{-0.209, -0.372, 0.581}, {-0.184, -0.580, 0.764}, {0.184, 0.443, -0.627}}},
        {"V",
         {"C2", "C3"},
         false,
         {{-0.211, -0.364, 0.575}, {-0.184, -0.562, 0.746}, {0.184, 0.430, -0.614}}}};
    constexpr const char* links[] = {"sun", "ring", "carrier"};
    std::fputs("gear,losses,row,link,printed,solved\n", out);
    for (const auto& p : printed) {
        StaticsProblem problem;
        problem.closed = p.closed;
        problem.inputs = {{"input", 1}};
        problem.ideal = p.ideal;
        const StaticsResult result = solve_statics(machines::wt_gearbox(), problem);
        for (int row = 0; row < 3; ++row)
            for (int link = 0; link < 3; ++link) {
                const std::string name = "row" + std::to_string(row + 1) + "." + links[link];
                for (const auto& l : result.links)
                    if (l.name == name)
                        std::fprintf(out, "%s,%d,%d,%s,%.3f,%.4f\n", p.gear, !p.ideal, row + 1, links[link],
                                     p.torque[row][link], l.torque);
            }
    }
}

}  // namespace shiftrig::figures
