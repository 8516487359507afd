#include "apps/shiftrig/certificate_report.h"

#include <fmt/format.h>

namespace shiftrig::cli {

namespace {

struct Flag {
    const char* key;
    const char* text;
};
constexpr Flag flags[] = {
    // by bit
    {"tie_up", "more pairs are closed than the motion needs: how they share the torque is not unique"},
    {"direction_search_gave_up",
     "no contact states and directions of power were found that agree with one another"},
    {"not_finite", "the state is not finite: nothing from there on is worth anything"},
    {"coarse", "even the shortest parts of a step are coarse: try a shorter step or a higher maximum_parts"},
    {"instant_not_found",
     "the instant of a change was not found, and is wrong by some of the step: try a shorter step or a "
     "higher maximum_parts"},
};

}  // namespace

nlohmann::json to_json(const rig::RunCertificate& c, const plant::Description& machine) {
    nlohmann::json ticks;
    for (std::size_t bit = 0; bit < c.flagged.size(); ++bit) ticks[flags[bit].key] = c.flagged[bit];
    const bool divides = machine.transition == plant::Transition::localised && machine.maximum_parts > 1;
    if (!divides) ticks["coarse"] = nullptr;
    return {{"torque_residual", c.torque_residual}, {"constraint_violation_rad_s", c.constraint_violation},
            {"energy_defect_j", c.energy_defect},   {"changes_located", c.events},
            {"fall_backs", c.fall_backs},           {"mode_lookups", c.mode_lookups},
            {"modes_built", c.mode_misses},         {"ticks", ticks}};
}

std::string describe(const rig::RunCertificate& c, std::ptrdiff_t told, double dissipated) {
    std::string text = fmt::format(
        "plant     {} events told, {} changes located inside steps, {} fall-backs, {} mode look-ups, {} "
        "modes built; torque residual {:.1e}, "
        "constraints {:.1e} rad/s at most; energy defect {:.2g} J of {:.4g} J lost\n",
        told, c.events, c.fall_backs, c.mode_lookups, c.mode_misses, c.torque_residual,
        c.constraint_violation, c.energy_defect, dissipated);
    for (std::size_t bit = 0; bit < c.flagged.size(); ++bit) {
        if (c.flagged[bit] > 0)
            text += fmt::format("          in {} of {} ticks {}\n", c.flagged[bit], c.ticks, flags[bit].text);
    }
    return text;
}

}  // namespace shiftrig::cli
