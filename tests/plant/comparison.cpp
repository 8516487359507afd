#include "tests/plant/comparison.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <numbers>
#include <random>

#include "plant/plant.h"

namespace shiftrig {
namespace {

using namespace plant;
using reference::Result;
using reference::Sample;
using Quantity = reference::System::Unit;
using Changes = shiftrig::Inputs;

// The signals of a run, one row per grid point: speeds, twists, clutch torques, mesh torques.
struct Table {
    std::vector<std::string> names;
    int smooth = 0;  // the first so many are continuous
    std::vector<Quantity> unit;
    std::vector<std::vector<double>> rows;
    std::vector<bool> unique;
    std::vector<double> change_times;
};

bool has_fields(const Description& d) {
    return !d.engines.empty() || !d.tyres.empty() || !d.converters.empty() || !d.roads.empty() ||
           !d.ploughs.empty();
}

Table table_of(const Description& d, const Result& result) {
    Table t;
    const auto add = [&t](const std::string& name, Quantity unit) {
        t.names.push_back(name);
        t.unit.push_back(unit);
    };
    const bool fields = has_fields(d);
    const auto shown = [&](bool smooth) {
        for (const auto& s : result.shown)
            if (s.smooth == smooth) add(s.name, s.unit);
    };
    for (const auto& m : d.masses)
        add("mass." + m.name + ".speed",
            m.motion == Motion::rotating ? Quantity::radian_per_second : Quantity::metre_per_second);
    for (const auto& s : d.shafts) add("shaft." + s.name + ".twist", Quantity::radian);
    for (const auto& b : d.backlashes) add("backlash." + b.name + ".twist", Quantity::radian);
    const auto continuous = static_cast<Eigen::Index>(t.names.size());
    if (fields) {
        add("energy.input", Quantity::joule);
        add("energy.dissipated", Quantity::joule);
    }
    shown(true);
    t.smooth = static_cast<int>(t.names.size());
    for (const auto& c : d.clutches) add("clutch." + c.name + ".torque", Quantity::newton_metre);
    for (const auto& f : d.freewheels) add("freewheel." + f.name + ".torque", Quantity::newton_metre);
    const auto pairs = static_cast<Eigen::Index>(t.names.size()) - t.smooth;
    for (const auto& g : d.gears) add("gear." + g.name + ".torque", Quantity::newton_metre);
    for (const auto& r : d.planetaries) add("row." + r.name + ".sun", Quantity::newton_metre);
    shown(false);
    for (const Sample& s : result.samples) {
        std::vector<double> row(s.z.data(), s.z.data() + continuous);
        const auto append = [&row](const auto& values) {
            row.insert(row.end(), values.data(), values.data() + values.size());
        };
        const auto append_shown = [&](bool smooth) {
            for (std::size_t i = 0; i < result.shown.size(); ++i)
                if (result.shown[i].smooth == smooth) row.push_back(s.shown[static_cast<Eigen::Index>(i)]);
        };
        if (fields) {
            row.push_back(s.input);
            row.push_back(s.input - (s.stored - result.samples.front().stored));
        }
        append_shown(true);
        append(s.friction_torque.head(pairs).eval());
        append(s.mesh_torque);
        append_shown(false);
        t.rows.push_back(row);
        t.unique.push_back(s.unique);
    }
    for (const auto& change : result.changes) t.change_times.push_back(change.time);
    return t;
}

// Slip is a difference of speeds over a speed: a ten-thousandth of a range of less than a percent is beyond what speeds
// are held to. A tyre that only rolls, or stands, has no force to speak of.
double least_range(Quantity unit) {
    return unit == Quantity::slip ? 1e-2 : unit == Quantity::newton ? 1e-2 : 0;
}

Deviation deviation(const Table& truth, const Table& other, const ComparisonOptions& options) {
    const std::size_t signals = truth.names.size();
    std::vector<double> low(signals, 1e300), high(signals, -1e300);
    for (const auto& row : truth.rows)
        for (std::size_t i = 0; i < signals; ++i) {
            low[i] = std::min(low[i], row[i]);
            high[i] = std::max(high[i], row[i]);
        }
    std::array<double, static_cast<std::size_t>(Quantity::count)> largest{}, size{};
    for (std::size_t i = 0; i < signals; ++i) {
        const auto unit = static_cast<std::size_t>(truth.unit[i]);
        largest[unit] = std::max(largest[unit], high[i] - low[i]);
        size[unit] = std::max({size[unit], std::abs(high[i]), std::abs(low[i])});
    }
    Deviation d;
    const std::size_t rows = std::min(truth.rows.size(), other.rows.size());
    for (std::size_t k = 0; k < rows; ++k) {
        const double time = static_cast<double>(k) * 1e-3;
        bool settled = truth.unique[k] && k > 0;
        for (const auto* changes : {&truth.change_times, &other.change_times})
            for (const double change : *changes)
                settled = settled && std::abs(change - time) > options.event_clearance;
        for (std::size_t i = 0; i < signals; ++i) {
            const bool smooth = static_cast<int>(i) < truth.smooth;
            if (!smooth && !settled) continue;
            const auto unit = static_cast<std::size_t>(truth.unit[i]);
            const double range =
                std::max({high[i] - low[i], options.range_floor * largest[unit], least_range(truth.unit[i])});
            const double difference = std::abs(truth.rows[k][i] - other.rows[k][i]);
            double ratio = difference / (options.tolerance * range + options.rounding * size[unit] + 1e-12);
            if (!std::isfinite(ratio)) ratio = 1e300;
            if (smooth) d.worst_speed = std::max(d.worst_speed, ratio);
            if (ratio <= d.worst) continue;
            d.worst = ratio;
            d.signal = truth.names[i];
            d.time = time;
            d.truth = truth.rows[k][i];
            d.value = other.rows[k][i];
        }
    }
    return d;
}

std::string text(const char* format, auto... values) {
    char buffer[400];
    std::snprintf(buffer, sizeof buffer, format, values...);
    return buffer;
}

// The plant's run of the same machine, with every invariant that must hold on the way.
struct PlantRun {
    Table table;
    std::vector<std::string> broken;
    int fall_backs = 0, events = 0, coarse = 0, lost = 0;
    double input = 0, stored = 0, dissipated = 0, worst_defect = 0;
    std::vector<double> final_speeds;
};

double violation_of(const Description& d, const Model& model, const Outputs& outputs) {
    const auto speed = [&](const std::string& mass) {
        return outputs.value[static_cast<std::size_t>(model.output("mass." + mass + ".speed"))];
    };
    double worst = 0;
    for (const auto& g : d.gears) worst = std::max(worst, std::abs(speed(g.a) - g.ratio * speed(g.b)));
    for (const auto& r : d.planetaries)
        worst = std::max(worst,
                         std::abs(speed(r.sun) - r.ratio * speed(r.ring) - (1 - r.ratio) * speed(r.carrier)));
    for (const auto& c : d.clutches)
        if (outputs.value[static_cast<std::size_t>(model.output("clutch." + c.name + ".state"))] == 0)
            worst = std::max(worst, std::abs(speed(c.a) - (c.b.empty() ? 0.0 : speed(c.b)) /
                                                              (c.radius > 0 ? c.radius : 1.0)));
    for (const auto& f : d.freewheels) {
        const double slip = speed(f.a) - (f.b.empty() ? 0.0 : speed(f.b));
        if (outputs.value[static_cast<std::size_t>(model.output("freewheel." + f.name + ".state"))] == 0)
            worst = std::max(worst, std::abs(slip));
    }
    return worst;
}

// Gives the model's inputs what is told from the given time on.
class Teller {
  public:
    Teller(const Model& model, const Changes& changes) : model_(model), changes_(changes) {}
    void tell(double time, plant::Inputs& inputs) {
        for (; next_ < changes_.size() && changes_[next_].time <= time + 1e-9; ++next_)
            inputs.value.at(static_cast<std::size_t>(model_.input(changes_[next_].input))) =
                changes_[next_].value;
    }

  private:
    const Model& model_;
    const Changes& changes_;
    std::size_t next_ = 0;
};

// A vehicle begins in motion: engines and tyres as in steady running; actuators as they are told at the beginning.
State begin(const Model& model, const Changes& changes, const plant::Inputs& inputs) {
    const Description& d = model.description();
    State state(model);
    if (!has_fields(d) && (changes.empty() || changes.front().time > 0)) return state;
    Start told;
    for (const auto& m : d.masses) told.speeds.emplace_back(m.name, m.initial_speed);
    for (const auto& c : d.clutches)
        if (c.initially_locked) told.locked.push_back(c.name);
    start(model, state, told, inputs);
    return state;
}

PlantRun run_plant(const Description& d, const Changes& changes, const Table& layout, std::uint64_t seed,
                   const ComparisonOptions& options) {
    const Model model =
        Model::build(d, {.step_size = 1e-3 / options.steps_per_sample, .kernel = KernelKind::automatic});
    Operators operators(model), twin_operators(model);
    plant::Inputs inputs(model);
    Teller teller(model, changes);
    teller.tell(0, inputs);
    State state = begin(model, changes, inputs), twin = state;
    Scratch scratch(model), twin_scratch(model);
    Outputs outputs(model), twin_outputs(model);
    std::vector<std::size_t> column;
    for (const auto& name : layout.names) column.push_back(static_cast<std::size_t>(model.output(name)));
    const auto output = [&](const char* name) {
        return outputs.value[static_cast<std::size_t>(model.output(name))];
    };

    PlantRun run;
    run.table.names = layout.names;
    run.table.smooth = layout.smooth;
    const auto record = [&] {
        std::vector<double> row;
        for (const std::size_t c : column) row.push_back(outputs.value[c]);
        run.table.rows.push_back(row);
    };
    observe(model, operators, state, inputs, outputs, scratch);
    record();
    std::mt19937_64 coin(seed);
    double violation = 0, fastest = 1;
    bool finite = true, same = true, flagged = true;
    const double stored_at_start = output("energy.stored");
    double moved = stored_at_start;
    const int steps = static_cast<int>(std::lround(options.seconds / 1e-3)) * options.steps_per_sample;
    for (int k = 0; k < steps; ++k) {
        teller.tell(state.time(), inputs);
        step(model, operators, state, inputs, outputs, scratch);
        // The same from forgotten operators and a scratch full of NaN: not a bit may differ.
        if (coin() % 4 == 0) twin_operators.drop();
        twin_scratch.fill_with_nan();
        step(model, twin_operators, twin, inputs, twin_outputs, twin_scratch);
        same = same && std::memcmp(state.bytes().data(), twin.bytes().data(), state.bytes().size()) == 0;
        if ((k + 1) % options.steps_per_sample == 0) record();
        for (const double v : run.table.rows.back()) finite = finite && std::isfinite(v);
        for (const auto& m : d.masses)
            fastest = std::max(
                fastest,
                std::abs(outputs.value[static_cast<std::size_t>(model.output("mass." + m.name + ".speed"))]));
        violation = std::max(violation, violation_of(d, model, outputs));
        run.fall_backs += outputs.certificate.fall_backs;
        run.events += outputs.certificate.events;
        run.coarse += (outputs.certificate.flags & 8) != 0;
        run.lost += (outputs.certificate.flags & 16) != 0;
        flagged = flagged && outputs.certificate.fall_backs >= 0;
        for (int e = 0; e < std::min(outputs.event_count, Outputs::event_capacity); ++e)
            run.table.change_times.push_back(outputs.events[static_cast<std::size_t>(e)].time);
        moved = std::max({moved, stored_at_start + std::abs(output("energy.dissipated")),
                          output("energy.stored"), std::abs(output("energy.input"))});
        run.worst_defect = std::max(run.worst_defect, std::abs(output("energy.defect")));
    }
    run.table.unique.assign(run.table.rows.size(), true);
    run.input = output("energy.input");
    run.stored = output("energy.stored");
    run.dissipated = output("energy.dissipated");
    run.worst_defect /= moved + 1e-2;  // a machine that hardly moves is judged by microjoules
    if (!finite) run.broken.push_back("a signal is not finite");
    if (!same) run.broken.push_back("a run with forgotten operators differs in its bits");
    if (violation > 1e-10 * fastest)
        run.broken.push_back(text("constraint violated by %.3g rad/s", violation));
    const double defect = run.stored - stored_at_start - run.input + run.dissipated;
    if (!(std::abs(defect) <= 1e-4 * moved + 1e-6))
        run.broken.push_back(text("ledger open by %.3g of %.3g J", defect, moved));
    return run;
}

}  // namespace

const char* name(Outcome outcome) {
    switch (outcome) {
        case Outcome::agrees:
            return "agrees";
        case Outcome::sensitive:
            return "sensitive";
        case Outcome::ambiguous:
            return "ambiguous";
        case Outcome::reference_failed:
            return "reference failed";
        case Outcome::disagrees:
            return "disagrees";
        case Outcome::broken:
            return "broken";
    }
    return "";
}

Deviation deviation(const Description& description, const Result& truth, const Result& other,
                    const ComparisonOptions& options) {
    return deviation(table_of(description, truth), table_of(description, other), options);
}

Result run_reference(const Description& description, const ComparisonOptions& options,
                     reference::Sharing sharing, int refinement, const Changes& inputs) {
    const reference::System system = reference::system_of(description, inputs, options.seconds);
    reference::Solver solver(system, sharing);
    const double finer = 1. / refinement;
    return solver.run(options.seconds, {.step = (has_fields(description) ? 2e-5 : 1e-5) * finer,
                                        .resolution = 0.05 * finer,
                                        .phase = 1e-6 * std::pow(finer, 4)});
}

Description perturbed(Description d, double relative, std::uint64_t seed) {
    std::mt19937_64 engine(seed);
    const auto factor = [&] { return 1 + relative * (engine() % 2 == 0 ? 1 : -1); };
    for (auto& m : d.masses) m.initial_speed *= factor();
    for (auto& c : d.clutches) {
        if (auto* dry = std::get_if<DryFriction>(&c.friction))
            dry->sliding_capacity *= factor();
        else
            std::get<WetPlates>(c.friction).piston_area *= factor();
        if (auto* valve = std::get_if<ActuationHydraulic>(&c.actuation); valve && valve->fill_volume > 0)
            valve->fill_volume *= factor();
    }
    for (auto& f : d.freewheels) f.rated_torque *= factor();
    for (auto& b : d.backlashes) b.initial_twist *= factor();
    for (auto& t : d.tyres) t.weight *= factor();
    for (auto& s : d.sources) {
        const double f = factor();
        for (auto& p : s.waveform.pieces) {
            p.offset *= f;
            p.slope *= f;
            p.amplitude *= f;
        }
    }
    return d;
}

Comparison compare(const RandomSystem& system, std::uint64_t seed, const ComparisonOptions& options) {
    const Description& d = system.description;
    Comparison result;
    const auto clock = [] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
    };
    const double begin = clock();
    const auto solve = [&](const Description& machine, reference::Sharing sharing = reference::Sharing::free,
                           int refinement = 1) {
        return run_reference(machine, options, sharing, refinement, system.inputs);
    };
    const Result truth = solve(d);
    result.seconds_reference = clock() - begin;
    const Table layout = table_of(d, truth);
    const PlantRun run = run_plant(d, system.inputs, layout, seed, options);
    result.broken = run.broken;
    result.fall_backs = run.fall_backs;
    result.events = run.events;
    result.coarse = run.coarse;
    result.lost = run.lost;
    result.energy_defect = run.worst_defect;
    if (system.momentum_is_conserved) {
        double now = 0, start = 0, given = 0, missed = 0, scale = 1e-9;
        for (std::size_t i = 0; i < d.masses.size(); ++i) {
            now += d.masses[i].inertia * run.table.rows.back()[i];
            start += d.masses[i].inertia * run.table.rows.front()[i];
            scale += d.masses[i].inertia * std::abs(run.table.rows.back()[i]);
        }
        for (const auto& s : d.sources) {
            given += impulse(s.waveform, options.seconds);
            // Three points a step integrate a wave to (ωh)⁴/2880.
            for (const auto& p : s.waveform.pieces) {
                const double turn = 2 * std::numbers::pi * p.frequency * 1e-3 / options.steps_per_sample;
                missed += p.amplitude * options.seconds * turn * turn * turn * turn / 2880;
            }
        }
        if (std::abs(now - start - given) > 1e-8 * (scale + std::abs(given)) + std::abs(missed))
            result.broken.push_back(text("momentum off by %.3g of %.3g Nms", now - start - given, scale));
    }
    const auto sound = [](const Result& r) { return !r.gave_up && r.unresolved == 0; };
    const bool reference_sound = sound(truth);
    const auto judge = [&](const Result& r) {
        const Deviation difference = deviation(table_of(d, r), run.table, options);
        if (r.samples.empty() || (result.worst > 0 && difference.worst >= result.worst)) return;
        result.worst = difference.worst;
        result.worst_speed = difference.worst_speed;
        result.worst_signal = difference.signal;
        result.worst_time = difference.time;
        result.worst_truth = difference.truth;
        result.worst_value = difference.value;
    };
    if (reference_sound) judge(truth);
    // What the reference moves by when it takes shorter steps is no difference to the plant.
    if (reference_sound && result.worst > 1) {
        const Result finer = solve(d, reference::Sharing::free, options.refinement);
        if (sound(finer)) judge(finer);
    }
    // A clutch that holds more than it passes on sliding, in a closed loop at rest: when it breaks away depends on how
    // the loop shares its load, which mechanics leaves open.
    bool ambiguous = false;
    if (reference_sound && result.worst > 1) {
        const Result other = solve(d, reference::Sharing::by_loss);
        if (sound(other)) {
            ambiguous = deviation(layout, table_of(d, other), options).worst_speed > 1;
            judge(other);
        }
    }
    const auto moves = [&](std::uint64_t which) {
        const Result other = solve(perturbed(d, options.perturbation, which));
        return other.gave_up || deviation(layout, table_of(d, other), options).worst_speed > 1;
    };
    // One choice of signs may happen to leave the motion alone: where the runs differ, more of them are asked.
    const auto is_sensitive = [&] {
        const std::uint64_t last = seed + (result.worst > 1 ? options.perturbations : 1);
        for (std::uint64_t which = seed + 1; which <= last; ++which)
            if (moves(which)) return true;
        return false;
    };
    // Turned round, it does the same turned round, also where mechanics leaves open what gives way.
    if (result.broken.empty() && reference_sound && system.turns_round) {
        Table image = run_plant(mirrored(d), mirrored(system.inputs), layout, seed, options).table;
        for (auto& row : image.rows)
            for (std::size_t i = 0; i < row.size(); ++i)
                if (layout.unit[i] != Quantity::joule && layout.unit[i] != Quantity::pascal) row[i] = -row[i];
        Table upright = run.table;
        upright.unit = layout.unit;
        upright.unique = layout.unique;
        const Deviation difference = deviation(upright, image, options);
        if (difference.worst_speed > 1 && !is_sensitive())
            result.broken.push_back(
                text("its mirror image differs by %.3g tolerances", difference.worst_speed));
    }
    if (!result.broken.empty())
        result.outcome = Outcome::broken;
    else if (!reference_sound)
        result.outcome = Outcome::reference_failed;
    else if ((result.worst > 1 || !options.quick) && is_sensitive())
        result.outcome = Outcome::sensitive;
    else if (result.worst > 1)
        result.outcome = ambiguous ? Outcome::ambiguous : Outcome::disagrees;
    return result;
}

namespace {

std::string text_of(const Waveform& w) {
    std::string s;
    for (const auto& p : w.pieces) {
        s += " [";
        if (p.from > 0) s += text("from %g ", p.from);
        if (p.until < 1e9) s += text("until %g ", p.until);
        s += text("%g", p.offset);
        if (p.slope != 0) s += text(" %+g/s", p.slope);
        if (p.amplitude != 0) s += text(" %+g sin %g Hz at %g", p.amplitude, p.frequency, p.phase_time);
        s += "]";
    }
    return s;
}

}  // namespace

std::string describe(const Description& d) {
    std::string s = d.name + "\n";
    for (const auto& m : d.masses)
        s += text("  mass %s J=%.6g w0=%.8g\n", m.name.c_str(), m.inertia, m.initial_speed);
    for (const auto& e : d.shafts)
        s += text("  shaft %s %s-%s k=%.6g d=%.6g twist0=%.6g\n", e.name.c_str(), e.a.c_str(), e.b.c_str(),
                  e.stiffness, e.damping, e.initial_twist);
    for (const auto& b : d.backlashes)
        s += text("  backlash %s %s-%s k=%.6g d=%.6g gap=%.6g twist0=%.6g\n", b.name.c_str(), b.a.c_str(),
                  b.b.c_str(), b.stiffness, b.damping, b.gap, b.initial_twist);
    for (const auto& k : d.dampers)
        s += text("  damper %s %s-%s d=%.6g\n", k.name.c_str(), k.a.c_str(), k.b.c_str(), k.damping);
    for (const auto& c : d.clutches) {
        s += text("  clutch %s %s-%s%s", c.name.c_str(), c.a.c_str(), c.b.c_str(),
                  c.initially_locked ? " locked" : "");
        if (c.radius > 0) s += text(" on the road, r=%.4g", c.radius);
        if (const auto* law = std::get_if<DryFriction>(&c.friction))
            s += text(" %.6g Nm static x%.4g falling %.3g over %.4g rad/s", law->sliding_capacity,
                      law->static_ratio, law->falling, law->falling_speed);
        if (const auto* wet = std::get_if<WetPlates>(&c.friction)) {
            const auto& valve = std::get<ActuationHydraulic>(c.actuation);
            s += text(" wet, %d surfaces %.4g/%.4g m, %.4g m2, mu %.4g static %.4g %+.4g over %.4g m/s",
                      wet->surfaces, wet->outer_radius, wet->inner_radius, wet->piston_area, wet->mu_static,
                      wet->mu_sliding, wet->mu_rise, wet->mu_speed);
            s += text(", return %.4g clearance %.3g; valve %.3g s %.4g rad/s %.3g slew %.4g, %.4g Pa",
                      wet->return_pressure, wet->clearance, valve.dead_time, valve.natural_frequency,
                      valve.damping_ratio, valve.slew, valve.maximum_pressure);
            if (valve.fill_volume > 0)
                s += text("; piston from %.4g Pa, %.4g m3 at %.4g m3/s", valve.preload_pressure,
                          valve.fill_volume, valve.fill_flow);
        }
        if (const auto* a = std::get_if<ActuationApply>(&c.actuation))
            s += text(" applied, lag %.4g", a->lag);
        if (const auto* r = std::get_if<ActuationRelease>(&c.actuation))
            s += text(" released, lag %.4g", r->lag);
        if (const auto* direct = std::get_if<ActuationDirect>(&c.actuation)) s += text_of(direct->profile);
        s += "\n";
    }
    if (d.oil)
        s += text("  oil of %.4g Pa s at 0 degC, %.4g degC, pump %.4g m3/s\n", d.oil->viscosity_at_zero,
                  d.oil->initial_temperature, d.oil->pump_flow);
    for (const auto& f : d.freewheels)
        s += text("  freewheel %s %s-%s blocks %s %.6g Nm share %.4g drag %.4g\n", f.name.c_str(),
                  f.a.c_str(), f.b.c_str(), f.blocks == Sense::forward ? "forward" : "backward",
                  f.rated_torque, f.sliding_share, f.drag_torque);
    for (const auto& g : d.gears)
        s += text("  gear %s %s-%s u=%.6g eta=%.6g bearing=%.4g\n", g.name.c_str(), g.a.c_str(), g.b.c_str(),
                  g.ratio, g.efficiency, g.bearing_torque);
    for (const auto& r : d.planetaries)
        s += text("  row %s sun %s ring %s carrier %s u=%.6g eta=%.6g\n", r.name.c_str(), r.sun.c_str(),
                  r.ring.c_str(), r.carrier.c_str(), r.ratio, r.efficiency);
    for (const auto& t : d.sources)
        s += text("  source %s on %s%s quadratic %.4g\n", t.name.c_str(), t.mass.c_str(),
                  text_of(t.waveform).c_str(), t.quadratic);
    for (const auto& t : d.tyres)
        s += text("  tyre %s %s-%s r=%.6g Bn=%.5g sigma=%.4g tau=%.4g W=%.6g rolling %.4g\n", t.name.c_str(),
                  t.wheel.c_str(), t.body.c_str(), t.radius, t.mobility_number, t.relaxation_length,
                  t.slip_damping_time, t.weight, t.rolling_coefficient);
    const auto list = [](const std::vector<std::pair<double, double>>& table) {
        std::string points;
        for (const auto& [x, y] : table) points += text(" (%.5g, %.5g)", x, y);
        return points;
    };
    for (const auto& e : d.engines)
        s += text(
            "  engine %s on %s, lag %.4g, governor %.5g idle %.5g..%.5g, friction %.4g+%.4g w, turbo "
            "%.4g %.4g, fade %.4g..%.4g stall %.4g;%s\n",
            e.name.c_str(), e.mass.c_str(), e.actuator_lag, e.governor_slope, e.low_idle, e.high_idle,
            e.friction_constant, e.friction_per_speed, e.turbo_instant_fraction, e.turbo_lag, e.fade_from,
            e.fade_to, e.stall_speed, list(e.full_load).c_str());
    for (const auto& c : d.converters)
        s += text("  converter %s %s-%s K%s", c.name.c_str(), c.pump.c_str(), c.turbine.c_str(),
                  (list(c.k_over_speed_ratio) + " R" + list(c.torque_ratio_over_speed_ratio) + "\n").c_str());
    for (const auto& r : d.roads)
        s += text("  road of %s, %.6g kg, air %.4g\n", r.body.c_str(), r.mass, r.air_coefficient);
    for (const auto& p : d.ploughs)
        s += text("  plough of %s, F=%.4g A=%.4g B=%.4g C=%.4g W=%.4g T=%.4g\n", p.body.c_str(),
                  p.soil_factor, p.a, p.b, p.c, p.width, p.depth);
    return s;
}

std::string timelines(const RandomSystem& system, const ComparisonOptions& options, double until) {
    std::string s;
    for (const auto& change : system.inputs)
        s += text("  from %.3f %s = %g\n", change.time, change.input.c_str(), change.value);
    s += "reference:\n";
    const Description& d = system.description;
    for (const auto& change : run_reference(d, options, reference::Sharing::free, 1, system.inputs).changes) {
        if (change.time < until)
            s += text("  t=%.7f %s %s\n", change.time, change.device.c_str(), change.what.c_str());
    }
    s += "plant:\n";
    const Model model = Model::build(d, {.step_size = 1e-3 / options.steps_per_sample});
    Operators operators(model);
    plant::Inputs inputs(model);
    Teller teller(model, system.inputs);
    teller.tell(0, inputs);
    State state = begin(model, system.inputs, inputs);
    Scratch scratch(model);
    Outputs outputs(model);
    while (state.time() < until) {
        teller.tell(state.time(), inputs);
        step(model, operators, state, inputs, outputs, scratch);
        for (int e = 0; e < std::min(outputs.event_count, Outputs::event_capacity); ++e) {
            s += "  " + explain(model, outputs.events[static_cast<std::size_t>(e)]) + "\n";
        }
    }
    return s;
}

}  // namespace shiftrig
