#include "plant/warnings.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "plant/format.h"
#include "plant/model_data.h"
#include "plant/resolution.h"

namespace shiftrig::plant {
namespace {

std::string joined(const std::vector<std::string>& words) {
    std::string text;
    for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
    return text;
}

std::vector<LookedAt> states_of(const Description& d) {
    std::vector<LookedAt> states;
    const auto look = [&](GearVariant&& state, const std::string& label, bool is_gear) {
        ModalResult modal = natural_modes(state.description, state.closed);
        states.push_back({std::move(state), std::move(modal), label, is_gear});
    };
    for (GearVariant& gear : gear_variants(d)) {
        const std::string label = "gear " + gear.name;
        look(std::move(gear), label, true);
    }
    for (GearVariant& state : other_states(d)) {
        const std::string label = state.name;
        look(std::move(state), label, false);
    }
    return states;
}

// ---- losses ---------------------------------------------------------------------------------------

// Of 8000 random gear trains with efficiencies from 0.3 one had no solution and one had two; from 0.5 on all had one.
void warn_of_losses(const Description& d, std::vector<std::string>& warnings) {
    const auto warn = [&](const std::string& device, double value, const std::string& more) {
        if (value < 0.5)
            warnings.push_back(
                device + format(" %.3g", value) +
                " is below 0.5: the losses of several such meshes may agree with no directions "
                "of power, or with two" +
                more);
    };
    const std::string holds = "; a real one as poor mostly holds itself when driven backwards, which ";
    for (const Gear& gear : d.gears) {
        const std::string name = "gear \"" + gear.name + "\": ";
        const bool both_ways = gear.backward_efficiency <= 0;
        warn(
            name + "efficiency", gear.efficiency,
            both_ways ? holds + "one efficiency for both ways does not show (backward_efficiency does)" : "");
        if (!both_ways) warn(name + "backward_efficiency", gear.backward_efficiency, "");
    }
    for (const Planetary& row : d.planetaries)
        warn("planetary row \"" + row.name + "\": efficiency", row.efficiency,
             holds + "one efficiency for both ways does not show");
}

// ---- rigid parts that contradict one another --------------------------------------------------------

std::string mesh_in_words(const Mesh& mesh) {
    return (mesh.planetary ? "planetary row \"" : "gear \"") + mesh.name + "\"";
}

// Masses that the same meshes hold.
struct Held {
    std::set<int> masses, meshes;
};

std::vector<Held> held_for_ever(const Description& d, const Structure& s) {
    const RigidSet meshes = rigid_set(d, s, {}, meshes_alone);
    const auto holders = held_by(meshes, s.inertia);
    std::vector<Held> groups;
    for (int j = 0; j < s.masses(); ++j) {
        const std::vector<int>& own = holders[static_cast<std::size_t>(j)];
        if (own.empty()) continue;
        Held held{{j}, {own.begin(), own.end()}};
        for (auto other = groups.begin(); other != groups.end();) {
            const bool shared = std::any_of(held.meshes.begin(), held.meshes.end(),
                                            [&](int k) { return other->meshes.count(k) > 0; });
            if (!shared) {
                ++other;
                continue;
            }
            held.masses.insert(other->masses.begin(), other->masses.end());
            held.meshes.insert(other->meshes.begin(), other->meshes.end());
            other = groups.erase(other);
        }
        groups.push_back(held);
    }
    return groups;
}

std::vector<std::string> held_in_words(const Description& d) {
    const Structure s = build_structure(d);
    std::vector<std::string> result;
    for (const Held& held : held_for_ever(d, s)) {
        std::vector<std::string> masses, meshes;
        for (const int j : held.masses)
            masses.push_back("\"" + s.mass_names[static_cast<std::size_t>(j)] + "\"");
        for (const int k : held.meshes)
            meshes.push_back(mesh_in_words(s.meshes[static_cast<std::size_t>(k)]));
        result.push_back(joined(meshes) + " contradict one another: " + joined(masses) +
                         " can only stand still, for ever");
    }
    return result;
}

// With every combination of ratios; which one it is, is said where not all do it.
void warn_of_contradicting_meshes(const std::vector<LookedAt>& states, std::vector<std::string>& warnings) {
    std::vector<std::string> options, found;
    std::vector<int> times;
    std::vector<std::string> first;  // combination that shows it
    for (const LookedAt& at : states) {
        std::string option;
        for (const auto& [gear, name] : at.state.options) option += " " + gear + " " + name;
        if (std::find(options.begin(), options.end(), option) != options.end()) continue;
        options.push_back(option);
        for (const std::string& text : held_in_words(at.state.description)) {
            const auto known = std::find(found.begin(), found.end(), text);
            if (known != found.end()) {
                ++times[static_cast<std::size_t>(known - found.begin())];
                continue;
            }
            found.push_back(text);
            times.push_back(1);
            first.push_back(option);
        }
    }
    for (std::size_t i = 0; i < found.size(); ++i) {
        const bool always = times[i] == static_cast<int>(options.size()) || first[i].empty();
        warnings.push_back(always ? found[i] : "with" + first[i] + ": " + found[i]);
    }
}

// ---- dampers along a chain ------------------------------------------------------------------------

// Three points of a step are all that the ledger along the tree has.
void warn_of_fast_dampers(const Model& model, const std::vector<LookedAt>& states,
                          std::vector<std::string>& warnings) {
    if (!model.data().tree) return;
    double fastest = 1 / model.step_size();  // [1/s]
    std::string name;
    for (const LookedAt& at : states) {
        const Structure s = build_structure(at.state.description);
        const Eigen::MatrixXd basis = swinging_motions(at.state.description, s, at.state.closed);
        for (const auto* elastics : {&s.shafts, &s.dampers}) {
            for (const Elastic& elastic : *elastics) {
                // Of one damper alone: d aᵀ J⁻¹ a, among the motions that the rigid set leaves.
                Eigen::RowVectorXd slip = Eigen::RowVectorXd::Zero(basis.cols());
                for (const Link& link : elastic.links) {
                    if (link.mass >= 0) slip += link.factor * basis.row(link.mass);
                }
                const double rate = elastic.damping * slip.squaredNorm();
                if (!(rate > fastest)) continue;
                fastest = rate;
                name = elastic.name;
            }
        }
    }
    if (name.empty()) return;
    warnings.push_back(
        "damping of \"" + name +
        format("\": a slip there dies out within %.2g ms, a step is %.2g ms: on the engine for long "
               "chains the account of energy does not follow that (energy.defect tells)",
               1e3 / fastest, 1e3 * model.step_size()));
}

// ---- gears ----------------------------------------------------------------------------------------

void warn_of_tie_ups(const LookedAt& at, std::vector<std::string>& warnings) {
    if (at.state.name == "all closed") return;  // nobody drives like that
    for (const TieUp& tie : at.state.tie_ups)
        warnings.push_back(at.label + ": the loop of " + joined(tie.devices) +
                           " is closed twice: the split of torque is not unique");
}

// What gears and rows hold without any clutch is told of them, once.
void warn_of_a_blocked_output(const LookedAt& at, std::vector<std::string>& warnings) {
    const Description& d = at.state.description;
    if (!at.is_gear || at.state.blocked_by.empty()) return;
    if (!output_held_by(d, build_structure(d), {}, meshes_alone).empty()) return;
    warnings.push_back(at.label + ": the output \"" + d.output_mass + "\" is blocked by " +
                       joined(at.state.blocked_by));
}

void warn_of_resonances(const LookedAt& at, std::vector<std::string>& warnings) {
    const Description& d = at.state.description;
    const Structure s = build_structure(d);
    for (const Engine& engine : d.engines) {
        const auto mass = static_cast<std::size_t>(s.mass(engine.mass));
        const double order = engine.cylinders / 2.;  // four strokes: each ignites every other revolution
        for (const DampedMode& mode : at.modal.damped) {
            const double speed = mode.frequency * 2 * pi / order;
            const bool unmoved = mode.kinetic_share[mass]<1e-3, damped_away = mode.damping_ratio> 0.5;
            if (speed < engine.low_idle || speed > engine.high_idle || unmoved || damped_away) continue;
            warnings.push_back(
                at.label +
                format(": engine order %.3g meets the mode at %.1f Hz at %.0f rpm (damping ratio %.2f)",
                       order, mode.frequency, speed * 30 / pi, mode.damping_ratio));
        }
    }
}

}  // namespace

std::string initial_speed_warning(const Model& model) {
    const Description& d = model.description();
    const Structure& s = model.data().structure;
    const State state(model);
    double fastest = 0;
    for (const Mass& mass : d.masses) fastest = std::max(fastest, std::fabs(mass.initial_speed));
    const double rounding = 1e-9 * fastest;
    std::vector<std::string> devices, speeds;
    const auto contradicts = [&](const auto& links) {
        double slip = 0;
        for (const Link& link : links) {
            if (link.mass >= 0)
                slip += link.factor * d.masses[static_cast<std::size_t>(link.mass)].initial_speed;
        }
        return std::fabs(slip) > rounding;
    };
    for (const Mesh& mesh : s.meshes) {
        if (contradicts(mesh.column(mesh.ratio))) devices.push_back(mesh_in_words(mesh));
    }
    for (const FrictionPair& pair : s.pairs) {
        if (pair.initially_locked && contradicts(pair.links))
            devices.push_back("locked \"" + pair.name + "\"");
    }
    for (std::size_t j = 0; j < d.masses.size(); ++j) {
        const double begins = state.speeds()[j], told = d.masses[j].initial_speed;
        if (std::fabs(begins - told) <= rounding) continue;
        speeds.push_back("\"" + d.masses[j].name + "\" at " +
                         format("%.4g %s instead of %.4g", std::fabs(begins) > rounding ? begins : 0.,
                                d.masses[j].motion == Motion::rotating ? "rad/s" : "m/s", told));
    }
    if (devices.empty() || speeds.empty()) return {};
    return "initial speeds contradict " + joined(devices) + ": the run begins with " + joined(speeds);
}

std::vector<std::string> model_warnings(const Model& model) {
    const Description& d = model.description();
    const std::vector<LookedAt> states = states_of(d);
    std::vector<std::string> warnings;
    warn_of_losses(d, warnings);
    warn_of_contradicting_meshes(states, warnings);
    if (const std::string text = initial_speed_warning(model); !text.empty()) warnings.push_back(text);
    warn_of_what_steps_miss(model, states, warnings);
    warn_of_fast_dampers(model, states, warnings);
    for (const LookedAt& at : states) {
        warn_of_a_blocked_output(at, warnings);
        warn_of_tie_ups(at, warnings);
        warn_of_resonances(at, warnings);
    }
    return warnings;
}

}  // namespace shiftrig::plant
