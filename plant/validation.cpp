#include "plant/validation.h"

#include <cmath>
#include <map>
#include <set>
#include <string>
#include <string_view>

#include "plant/check.h"
#include "plant/connectors.h"
#include "plant/plant.h"

namespace shiftrig::plant {
namespace {

// Who ends where. A name that is no mass, used by several connectors, is a massless joint.
class Joints {
  public:
    explicit Joints(const Description& d) {
        for (const Mass& mass : d.masses) motion_[mass.name] = mass.motion;
    }
    void link(std::string_view kind, const std::string& device, const char* field, const std::string& end) {
        links_.push_back({std::string(kind), device, field, end});
    }
    void check() const {
        for (const End& end : links_) {
            if (motion_.count(end.at)) continue;
            std::string rule = "= \"" + end.at + "\" is not a mass";
            for (const End& other : links_) {
                if (&other == &end || other.at != end.at) continue;
                rule = "= \"" + end.at + "\" is not a mass: " + end.kind + " \"" + end.device + "\" and " +
                       other.kind + " \"" + other.device +
                       "\" meet there without a mass between them (regularity rule)";
                break;
            }
            throw ModelError(end.kind, end.device, end.field, rule);
        }
    }
    Motion motion(const std::string& mass) const { return motion_.at(mass); }
    void moves(std::string_view kind, const std::string& device, const char* field, const std::string& mass,
               Motion motion, const char* why = "") const {
        if (motion_.at(mass) == motion) return;
        throw ModelError(std::string(kind), device, field,
                         "= \"" + mass + "\"; must be a " +
                             (motion == Motion::rotating ? "rotating" : "translating") + " mass" + why);
    }

  private:
    struct End {
        std::string kind, device, field, at;
    };
    std::map<std::string, Motion> motion_;
    std::vector<End> links_;
};

void check_unique_names(const Description& d) {
    std::map<std::string, std::string> seen;
    const auto add = [&](const char* what, const std::string& name) {
        const auto [at, fresh] = seen.emplace(name, what);
        if (!fresh)
            throw ModelError(what, name, "name", "= \"" + name + "\" is already the name of a " + at->second);
    };
    for (const Mass& mass : d.masses) add("mass", mass.name);
    // A mass may lend its name to a device (the engine on the mass "engine"); two devices may not share one.
    seen.clear();
    for_each_connector(d, [&](const auto& device) { add(kind(device), device.name); });
    seen.clear();
    for (const SpeedSensor& sensor : d.sensors) add("sensor", sensor.name);
}

}  // namespace

void validate(const Description& d) {
    if (d.masses.empty())
        throw ModelError("model", d.name, "masses", "is empty; a machine has at least one mass");
    for (const Mass& mass : d.masses) {
        const Check check("mass", mass.name);
        check.positive("inertia", mass.inertia);
        check.any("initial_speed", mass.initial_speed);
    }
    check_unique_names(d);

    Joints joints(d);
    for_each_connector(d, [&](const auto& device) {
        const Check check(kind(device), device.name);
        check_parameters(check, device);
        const auto links = ends(device);
        for (std::size_t i = 0; i < links.size(); ++i) {
            if (!links[i].may_be_housing || !links[i].mass.empty())
                joints.link(kind(device), device.name, links[i].field, links[i].mass);
            for (std::size_t first = 0; first < i; ++first) {
                if (links[first].mass == links[i].mass)
                    check.fail(links[i].field,
                               "= \"" + links[i].mass + "\"; both links end on the same mass");
            }
        }
    });
    for (const SpeedSensor& sensor : d.sensors) {
        const Check check("sensor", sensor.name);
        if (!sensor.ideal && sensor.teeth < 1) {
            check.fail("teeth", "= " + std::to_string(sensor.teeth) + "; must be >= 1");
        }
        check.not_negative("drop_out_speed", sensor.drop_out_speed);
        joints.link("sensor", sensor.name, "mass", sensor.mass);
    }
    joints.check();

    for_each_connector(d, [&](const auto& device) {
        const auto links = ends(device);
        for (const End& end : links) {
            if (end.mass.empty() || end.motion == EndMotion::any) continue;
            const bool alike = end.motion == EndMotion::alike;
            const Motion motion = alike                                  ? joints.motion(links[0].mass)
                                  : end.motion == EndMotion::translating ? Motion::translating
                                                                         : Motion::rotating;
            joints.moves(kind(device), device.name, end.field, end.mass, motion,
                         alike ? ", as the other end is" : "");
        }
    });
    for (const SpeedSensor& sensor : d.sensors) {
        if (!sensor.ideal)
            joints.moves("sensor", sensor.name, "mass", sensor.mass, Motion::rotating, " to have teeth");
    }
    const auto between_one_and = [&](int most, const char* field, int value) {
        if (value < 1 || value > most)
            throw ModelError("model", d.name, field,
                             "= " + std::to_string(value) + "; must be within 1 and " + std::to_string(most));
    };
    constexpr double most_combinations = 1000;
    double combinations = 1;
    for (const Gear& gear : d.gears) combinations *= std::fmax(1, static_cast<double>(gear.options.size()));
    if (combinations > most_combinations)
        throw ModelError("model", d.name, "gears",
                         "have " + number(combinations) + " combinations of options; must be " +
                             number(most_combinations) + " at most");
    std::set<std::string> selectors;
    for (const GearPath& path : d.gear_paths) selectors.insert(path.closed.begin(), path.closed.end());
    if (selectors.size() > Description::most_selectors)
        throw ModelError("model", d.name, "gear_paths",
                         "name " + std::to_string(selectors.size()) + " clutches; must be " +
                             std::to_string(Description::most_selectors) + " at most");
    between_one_and(Description::most_events, "maximum_events", d.maximum_events);
    between_one_and(Description::most_parts, "maximum_parts", d.maximum_parts);
    if (d.oil) {
        const Check check("oil", "oil");
        const Oil& oil = *d.oil;
        check.positive("viscosity_at_zero", oil.viscosity_at_zero);
        check.not_negative("viscosity_decay", oil.viscosity_decay);
        check.any("initial_temperature", oil.initial_temperature);
        check.positive("drag_speed_limit", oil.drag_speed_limit);
        check.any("cold_temperature", oil.cold_temperature);
        check.any("warm_temperature", oil.warm_temperature);
        if (!(oil.warm_temperature > oil.cold_temperature))
            check.fail("warm_temperature",
                       "= " + number(oil.warm_temperature) + "; must be > cold_temperature");
        check.positive("cold_dead_time_factor", oil.cold_dead_time_factor);
        check.positive("cold_valve_frequency_factor", oil.cold_valve_frequency_factor);
        check.positive("fill_viscosity", oil.fill_viscosity);
        check.not_negative("pump_flow", oil.pump_flow);
    }
    for_each_connector(d, [&](const auto& device) { check_surroundings(d, device); });
}

}  // namespace shiftrig::plant
