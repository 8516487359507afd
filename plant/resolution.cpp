#include "plant/resolution.h"

#include <algorithm>
#include <cmath>

#include "plant/format.h"
#include "plant/laws/converter.h"
#include "plant/laws/friction.h"
#include "plant/laws/tyre.h"
#include "plant/model_data.h"

namespace shiftrig::plant {
namespace {

double shortest_part(const Model& model) {
    const bool whole = model.description().transition == Transition::next_step;
    return model.step_size() / (whole ? 1 : model.data().maximum_parts);
}

std::string milliseconds(double seconds) {
    return format("%.3g ms", 1e3 * seconds);
}

// Inertias among themselves, bodies among themselves.
void warn_of_inertia_ratio(const Description& d, std::vector<std::string>& warnings) {
    const auto smaller = [](const Mass& a, const Mass& b) { return a.inertia < b.inertia; };
    for (const Motion motion : {Motion::rotating, Motion::translating}) {
        std::vector<Mass> alike;
        for (const Mass& mass : d.masses) {
            if (mass.motion == motion) alike.push_back(mass);
        }
        if (alike.empty()) continue;
        const auto [low, high] = std::minmax_element(alike.begin(), alike.end(), smaller);
        if (high->inertia <= 1e7 * low->inertia) continue;
        warnings.push_back("masses \"" + low->name + "\" and \"" + high->name + "\": inertia ratio " +
                           format("%.3g", high->inertia / low->inertia) +
                           " is beyond 1e7: joins and internal torques lose digits");
    }
}

// ---- forces that answer speed ---------------------------------------------------------------------

class Answers {
  public:
    Answers(const Model& model, std::vector<std::string>& warnings)
        : d_(model.description()),
          s_(model.data().structure),
          laws_(model.data().pair_laws),
          motions_(swinging_motions(d_, s_, {})),
          step_(model.step_size()),
          part_(shortest_part(model)),
          warnings_(warnings) {}

    void of(const Clutch& clutch) {
        const auto pair = static_cast<std::size_t>(s_.pair(clutch.name));
        const detail::PairLaw& law = laws_[pair];
        const double slope = law.full_load * steepness(law.friction).rise;
        const auto& links = s_.pairs[pair].links;
        say("clutch \"" + clutch.name + "\": its friction rises by " + format("%.3g", slope) +
                " Nm s/rad and so slows its lighter mass within ",
            1 / (slope * mobility(links[0], links[1])));
    }
    void of(const Engine& engine) {
        const double pull = engine.governor_slope * mobility({s_.mass(engine.mass), 1});
        const double lag = engine.actuator_lag;
        const std::string name = "engine \"" + engine.name + "\": ";
        say(name + "its governor corrects the speed within ", lag > 0 ? std::sqrt(lag / pull) : 1 / pull);
        if (lag > 0) say(name + "its actuator follows within ", lag);
        if (engine.turbo_lag > 0) say(name + "its turbo follows within ", engine.turbo_lag);
    }
    void of(const BrixiusTyre& tyre) {
        const double stiffness = tyre_force_slope(tyre_soil(tyre, tyre.mobility_number)) * tyre.radius *
                                 tyre.radius / tyre.relaxation_length;
        const double mobile = mobility({s_.mass(tyre.wheel), 1}, {s_.mass(tyre.body), -1 / tyre.radius});
        const double answer =
            1 / std::max(stiffness * tyre.slip_damping_time * mobile, std::sqrt(stiffness * mobile));
        say("tyre \"" + tyre.name + "\": its force answers the slip of its wheel within ", answer);
    }
    void of(const TorqueSource& source) {
        of_square("source \"" + source.name + "\": its drag", source.mass, source.quadratic);
    }
    void of(const TorqueConverter& converter) {
        const std::string name = "converter \"" + converter.name + "\": its torque";
        for (const std::string& side : {converter.pump, converter.turbine})
            of_square(name, side, steepest_coefficient(converter));
    }

  private:
    double mobility(Link a, Link b = {}) const {
        Eigen::RowVectorXd slip = a.factor * motions_.row(a.mass);
        if (b.mass >= 0) slip += b.factor * motions_.row(b.mass);
        return slip.squaredNorm();
    }
    void say(const std::string& what, double time) {
        if (time >= part_) return;
        warnings_.push_back(what + format("%.3g µs; a step of ", 1e6 * time) + milliseconds(step_) +
                            format(" resolves no less than %.3g µs", 1e6 * part_));
    }
    // Torques that grow with the square of the speed are too steep from some speed on; beyond these nothing turns.
    void of_square(const std::string& what, const std::string& name, double coefficient) {
        const int mass = s_.mass(name);
        const bool rotates = d_.masses[static_cast<std::size_t>(mass)].motion == Motion::rotating;
        const double fastest = rotates ? 1000 : 100;
        const double limit = 1 / (2 * coefficient * mobility({mass, 1}) * part_);
        if (!(limit < fastest)) return;
        warnings_.push_back(what + format(" above %.3g %s slows mass \"", limit, rotates ? "rad/s" : "m/s") +
                            name + "\" faster than a step of " + milliseconds(step_) + " resolves");
    }

    const Description& d_;
    const Structure& s_;
    const std::vector<detail::PairLaw>& laws_;
    Eigen::MatrixXd motions_;  // everything open: where bodies are lightest
    double step_, part_;
    std::vector<std::string>& warnings_;
};

// ---- friction on a body that swings ---------------------------------------------------------------

// A mode may well be too fast for the step: it is exact. But let friction act on a body that swings in it and hardly moves
// otherwise, and it is the swing that turns the friction round.
constexpr double swings_alone = 0.8;  // share of modes too fast in what a blow at the pair sets off
constexpr double takes_part = 0.1;    // one mode in that share, one mass in the energy of a mode

std::string quoted(const std::string& name) {
    return "\"" + name + "\"";
}

void append(std::string& list, const std::string& word) {
    list += (list.empty() ? "" : ", ") + word;
}

struct FastMode {
    std::string masses, pairs;
    std::vector<std::string> states;
    double frequency = 0, damping_ratio = 0;
};

std::string first_of(const std::vector<std::string>& words) {
    constexpr std::size_t enough = 3;
    std::string text;
    for (std::size_t i = 0; i < std::min(words.size(), enough); ++i) append(text, words[i]);
    if (words.size() > enough) text += format(" and %d more", static_cast<int>(words.size() - enough));
    return text;
}

// What would resolve it.
std::string remedy(const Model& model, double omega, double bound) {
    const double h = model.step_size(), parts = h / shortest_part(model);
    const std::string steps = "take steps of " + milliseconds(bound / omega * parts);
    const std::string damp = " damp it, or make the mass part of its neighbour";
    if (model.description().transition == Transition::next_step) return steps + "," + damp;
    const double needed = std::exp2(std::ceil(std::log2(omega * h / bound)));
    return steps + (needed <= Description::most_parts ? format(" or maximum_parts %.0f,", needed) : ",") +
           damp;
}

// By mode, the pairs that slip in this state and are turned round by modes beyond `fastest` [Hz].
std::vector<std::string> pairs_turned_round(const Structure& s, const LookedAt& at, double fastest) {
    const Eigen::MatrixXd pairs = s.pair_columns();
    const Eigen::MatrixXd motions = swinging_motions(at.state.description, s, at.state.closed);
    std::vector<std::string> result(at.modal.modes.size());
    for (std::size_t k = 0; k < s.pairs.size(); ++k) {
        const auto& closed = at.state.closed;
        if (s.pairs[k].rolling_contact ||
            std::find(closed.begin(), closed.end(), s.pairs[k].name) != closed.end())
            continue;
        const Eigen::VectorXd slip = pairs.col(static_cast<Eigen::Index>(k));
        const double all = (motions.transpose() * slip).squaredNorm();
        double sum = 0;
        std::vector<double> shares;
        for (const Mode& mode : at.modal.modes) {
            double swing = 0, kinetic = 0;
            for (std::size_t j = 0; j < mode.shape.size(); ++j) {
                swing += slip[static_cast<Eigen::Index>(j)] * mode.shape[j];
                kinetic += s.inertia[j] * mode.shape[j] * mode.shape[j];
            }
            const bool counts = mode.frequency > fastest && mode.damping_ratio < 1;
            shares.push_back(counts ? swing * swing / (kinetic * all) : 0);
            sum += shares.back();
        }
        for (std::size_t i = 0; sum > swings_alone && i < shares.size(); ++i) {
            if (shares[i] > takes_part) append(result[i], quoted(s.pairs[k].name));
        }
    }
    return result;
}

std::string masses_of(const Description& d, const Mode& mode) {
    std::string masses;
    for (std::size_t j = 0; j < mode.kinetic_share.size(); ++j) {
        if (mode.kinetic_share[j] > takes_part) append(masses, quoted(d.masses[j].name));
    }
    return masses;
}

// The same mode of several states once.
std::vector<FastMode> fast_modes(const std::vector<LookedAt>& states, double fastest) {
    std::vector<FastMode> result;
    for (const LookedAt& at : states) {
        const std::vector<Mode>& modes = at.modal.modes;
        if (modes.empty() || modes.back().frequency <= fastest) continue;
        const auto pairs = pairs_turned_round(build_structure(at.state.description), at, fastest);
        for (std::size_t i = 0; i < pairs.size(); ++i) {
            if (pairs[i].empty()) continue;
            const Mode& mode = modes[i];
            const std::string masses = masses_of(at.state.description, mode);
            const auto known = std::find_if(result.begin(), result.end(), [&](const FastMode& other) {
                return other.masses == masses && other.pairs == pairs[i] &&
                       std::fabs(other.frequency / mode.frequency - 1) < 1e-3;
            });
            if (known != result.end())
                known->states.push_back(at.label);
            else
                result.push_back({masses, pairs[i], {at.label}, mode.frequency, mode.damping_ratio});
        }
    }
    return result;
}

void warn_of_friction_on_fast_modes(const Model& model, const std::vector<LookedAt>& states,
                                    std::vector<std::string>& warnings) {
    const double bound = model.data().tree ? 0.3 : 2;  // ωh of the shortest part
    const double h = model.step_size(), part = shortest_part(model);
    for (const FastMode& mode : fast_modes(states, bound / (2 * pi * part))) {
        const double omega = 2 * pi * mode.frequency;
        warnings.push_back(
            first_of(mode.states) + format(": mode at %.5g Hz of ", mode.frequency) + mode.masses +
            format(" (ωh = %.3g, damping ratio %.2g): a step of ", omega * h, mode.damping_ratio) +
            milliseconds(h) + format(" (its shortest part: %.3g µs)", 1e6 * part) +
            " does not resolve how it turns the friction of " + mode.pairs + " round; " +
            remedy(model, omega, bound));
    }
}

}  // namespace

void warn_of_what_steps_miss(const Model& model, const std::vector<LookedAt>& states,
                             std::vector<std::string>& warnings) {
    const Description& d = model.description();
    warn_of_inertia_ratio(d, warnings);
    Answers answers(model, warnings);
    for (const Clutch& clutch : d.clutches) answers.of(clutch);
    for (const Engine& engine : d.engines) answers.of(engine);
    for (const BrixiusTyre& tyre : d.tyres) answers.of(tyre);
    for (const TorqueConverter& converter : d.converters) answers.of(converter);
    for (const TorqueSource& source : d.sources) answers.of(source);
    warn_of_friction_on_fast_modes(model, states, warnings);
}

}  // namespace shiftrig::plant
