#include "plant/resolution.h"

#include <algorithm>
#include <cmath>

#include "plant/format.h"
#include "plant/laws/friction.h"
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

void warn_of_inertia_ratio(const Description& d, std::vector<std::string>& warnings) {
    const auto smaller = [](const Mass& a, const Mass& b) { return a.inertia < b.inertia; };
    std::vector<Mass> rotating;
    for (const Mass& mass : d.masses) {
        if (mass.motion == Motion::rotating) rotating.push_back(mass);
    }
    if (rotating.empty()) return;
    const auto [low, high] = std::minmax_element(rotating.begin(), rotating.end(), smaller);
    if (high->inertia <= 1e7 * low->inertia) return;
    warnings.push_back("masses \"" + low->name + "\" and \"" + high->name + "\": inertia ratio " +
                       format("%.3g", high->inertia / low->inertia) +
                       " is beyond 1e7: joins and internal torques lose digits");
}

// ---- forces that answer speed ---------------------------------------------------------------------

class Answers {
  public:
    Answers(const Model& model, std::vector<std::string>& warnings)
        : d_(model.description()),
          s_(model.data().structure),
          motions_(swinging_motions(d_, s_, {})),
          step_(model.step_size()),
          part_(shortest_part(model)),
          warnings_(warnings) {}

    void of(const Clutch& clutch) {
        const auto* dry = std::get_if<DryFriction>(&clutch.friction);
        if (!dry) return;
        const FrictionLaw law = friction_law(*dry);
        const double slope = load_from_engagement(law, 1) * steepest_rise(law);
        const auto links = s_.pairs[static_cast<std::size_t>(s_.pair(clutch.name))].links;
        say("clutch \"" + clutch.name + "\": its friction rises by " + format("%.3g", slope) +
                " Nm s/rad and so slows its lighter mass within ",
            1 / (slope * mobility(links[0], links[1])));
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

    const Description& d_;
    const Structure& s_;
    Eigen::MatrixXd motions_;  // everything open: where bodies are lightest
    double step_, part_;
    std::vector<std::string>& warnings_;
};

}  // namespace

void warn_of_what_steps_miss(const Model& model, const std::vector<LookedAt>&,
                             std::vector<std::string>& warnings) {
    const Description& d = model.description();
    warn_of_inertia_ratio(d, warnings);
    Answers answers(model, warnings);
    for (const Clutch& clutch : d.clutches) answers.of(clutch);
}

}  // namespace shiftrig::plant
