#include "plant/validation.h"

#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <string_view>

#include "plant/connectors.h"
#include "plant/plant.h"

namespace shiftrig::plant {
namespace {

std::string number(double value) {
    char text[40];
    std::snprintf(text, sizeof text, "%.9g", value);
    return text;
}

// One device under examination: its kind and name, so that rules read as one line each.
class Check {
  public:
    Check(std::string_view kind, const std::string& name) : kind_(kind), name_(name) {
        if (name.empty()) fail("name", "is empty; every device has a name");
    }
    [[noreturn]] void fail(const std::string& field, const std::string& rule) const {
        throw ModelError(kind_, name_, field, rule);
    }
    void positive(const char* field, double value) const { rule(field, value, value > 0, "> 0"); }
    void not_negative(const char* field, double value) const { rule(field, value, value >= 0, ">= 0"); }
    void not_zero(const char* field, double value) const { rule(field, value, value != 0, "different from 0"); }
    void share(const char* field, double value) const {
        rule(field, value, value > 0 && value <= 1, "in (0, 1]");
    }
    void any(const char* field, double value) const { rule(field, value, true, "finite"); }
    void rising(const char* field, const std::vector<std::pair<double, double>>& table) const {
        if (table.size() < 2) fail(field, "has fewer than two points");
        for (std::size_t i = 0; i < table.size(); ++i) {
            any(field, table[i].first);
            any(field, table[i].second);
            if (i > 0 && !(table[i].first > table[i - 1].first)) {
                fail(field, "= " + number(table[i].first) + " after " + number(table[i - 1].first) +
                                "; its first column must rise");
            }
        }
    }

  private:
    void rule(const char* field, double value, bool holds, const char* text) const {
        if (!std::isfinite(value) || !holds) fail(field, "= " + number(value) + "; must be " + text);
    }
    std::string kind_, name_;
};

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
    void translating(std::string_view kind, const std::string& device, const char* field,
                     const std::string& mass) const {
        if (motion_.at(mass) != Motion::translating) {
            throw ModelError(std::string(kind), device, field, "= \"" + mass + "\"; must be a translating mass");
        }
    }

  private:
    struct End {
        std::string kind, device, field, at;
    };
    std::map<std::string, Motion> motion_;
    std::vector<End> links_;
};

void check_waveform(const Check& check, const char* field, const Waveform& waveform) {
    for (const Waveform::Piece& piece : waveform.pieces) {
        for (double value : {piece.offset, piece.slope, piece.amplitude, piece.frequency, piece.phase_time}) {
            check.any(field, value);
        }
        if (!(piece.from < piece.until)) check.fail(field, "has a piece that ends before it begins");
        if (piece.slope != 0 && piece.from < -1e299) check.fail(field, "has a slope without a start time");
    }
}

// ---- what each kind of connector asks of its parameters; its links are looked at for all of them alike --------

void check_parameters(const Check& check, const Shaft& e) {
    check.positive("stiffness", e.stiffness);
    check.not_negative("damping", e.damping);
    check.any("initial_twist", e.initial_twist);
}

void check_parameters(const Check& check, const Backlash& b) {
    check.positive("stiffness", b.stiffness);
    check.not_negative("damping", b.damping);
    check.positive("gap", b.gap);
    check.any("initial_twist", b.initial_twist);
}

void check_parameters(const Check& check, const Damper& k) {
    check.positive("damping", k.damping);
}

void check_parameters(const Check& check, const Clutch& c) {
    check.not_negative("radius", c.radius);
    if (const auto* dry = std::get_if<DryFriction>(&c.friction)) {
        check.positive("sliding_capacity", dry->sliding_capacity);
        if (!(dry->static_ratio >= 1)) {
            check.fail("static_ratio", "= " + number(dry->static_ratio) + "; must be >= 1");
        }
        check.any("static_ratio", dry->static_ratio);
        check.any("falling", dry->falling);
        if (dry->falling > 1) check.fail("falling", "= " + number(dry->falling) + "; must be <= 1");
        check.positive("falling_speed", dry->falling_speed);
        if (!dry->factor_over_slip.empty()) check.rising("factor_over_slip", dry->factor_over_slip);
    } else {
        const auto& wet = std::get<WetPlates>(c.friction);
        if (wet.surfaces < 1) check.fail("surfaces", "= " + std::to_string(wet.surfaces) + "; must be >= 1");
        check.positive("outer_radius", wet.outer_radius);
        check.positive("inner_radius", wet.inner_radius);
        if (!(wet.inner_radius < wet.outer_radius)) {
            check.fail("inner_radius", "= " + number(wet.inner_radius) + "; must be < outer_radius");
        }
        check.positive("piston_area", wet.piston_area);
        check.not_negative("return_pressure", wet.return_pressure);
        check.positive("mu_sliding", wet.mu_sliding);
        check.any("mu_rise", wet.mu_rise);
        if (!(wet.mu_sliding + wet.mu_rise > 0)) check.fail("mu_rise", "makes the sliding friction negative");
        if (!(wet.mu_static >= wet.mu_sliding)) {
            check.fail("mu_static", "= " + number(wet.mu_static) + "; must be >= mu_sliding");
        }
        check.any("mu_static", wet.mu_static);
        check.positive("mu_speed", wet.mu_speed);
        if (c.drag) check.positive("clearance", wet.clearance);
        if (!std::holds_alternative<ActuationHydraulic>(c.actuation)) {
            check.fail("actuation", "of wet plates must be hydraulic: their capacity comes from a pressure");
        }
    }
    if (c.drag && !std::holds_alternative<WetPlates>(c.friction)) {
        check.fail("drag", "needs wet plates: a dry pair has no oil to shear");
    }
    if (const auto* h = std::get_if<ActuationHydraulic>(&c.actuation)) {
        if (!std::holds_alternative<WetPlates>(c.friction)) {
            check.fail("actuation", "by pressure needs wet plates: a dry pair has no piston area");
        }
        check.not_negative("dead_time", h->dead_time);
        check.positive("natural_frequency", h->natural_frequency);
        check.positive("damping_ratio", h->damping_ratio);
        check.positive("slew", h->slew);
        check.positive("maximum_pressure", h->maximum_pressure);
        check.not_negative("preload_pressure", h->preload_pressure);
        check.not_negative("stroke", h->stroke);
        check.not_negative("fill_volume", h->fill_volume);
        if (h->fill_volume > 0) check.positive("fill_flow", h->fill_flow);
        if (h->solenoid) {
            check.rising("solenoid", h->solenoid->pressure_over_current);
            check.not_negative("hysteresis", h->solenoid->hysteresis);
        }
        check.any("initial", h->initial);
    } else if (const auto* direct = std::get_if<ActuationDirect>(&c.actuation)) {
        check_waveform(check, "profile", direct->profile);
        check.not_negative("initial", direct->initial);
    } else if (const auto* release = std::get_if<ActuationRelease>(&c.actuation)) {
        check.not_negative("lag", release->lag);
    } else if (const auto* apply = std::get_if<ActuationApply>(&c.actuation)) {
        check.not_negative("lag", apply->lag);
    }
    if (c.heat) {
        check.positive("surface_capacity", c.heat->surface_capacity);
        check.positive("bulk_capacity", c.heat->bulk_capacity);
        check.not_negative("surface_to_bulk", c.heat->surface_to_bulk);
        check.not_negative("bulk_to_oil", c.heat->bulk_to_oil);
    }
}

void check_parameters(const Check& check, const Freewheel& f) {
    check.positive("rated_torque", f.rated_torque);
    check.share("sliding_share", f.sliding_share);
    check.not_negative("drag_torque", f.drag_torque);
}

void check_parameters(const Check& check, const Gear& g) {
    check.not_zero("ratio", g.ratio);
    check.share("efficiency", g.efficiency);
    if (g.backward_efficiency != 0) check.share("backward_efficiency", g.backward_efficiency);
    check.not_negative("bearing_torque", g.bearing_torque);
    check.any("backward_bearing_torque", g.backward_bearing_torque);
    for (const auto& option : g.options) check.not_zero("options", option.second);
}

void check_parameters(const Check& check, const Planetary& p) {
    check.not_zero("ratio", p.ratio);
    if (p.ratio == 1) check.fail("ratio", "= 1; sun and ring would turn as one whatever the carrier does");
    check.share("efficiency", p.efficiency);
}

void check_parameters(const Check& check, const BrixiusTyre& t) {
    check.positive("radius", t.radius);
    check.positive("mobility_number", t.mobility_number);
    check.positive("relaxation_length", t.relaxation_length);
    check.not_negative("slip_damping_time", t.slip_damping_time);
    check.positive("weight", t.weight);
    check.not_negative("rolling_coefficient", t.rolling_coefficient);
}

void check_parameters(const Check& check, const TorqueConverter& c) {
    check.rising("k_over_speed_ratio", c.k_over_speed_ratio);
    check.rising("torque_ratio_over_speed_ratio", c.torque_ratio_over_speed_ratio);
}

void check_parameters(const Check& check, const TorqueSource& source) {
    check_waveform(check, "waveform", source.waveform);
    check.not_negative("quadratic", source.quadratic);
}

void check_parameters(const Check& check, const Road& road) {
    check.not_negative("mass", road.mass);
    check.not_negative("air_coefficient", road.air_coefficient);
}

void check_parameters(const Check& check, const Plough& p) {
    check.positive("soil_factor", p.soil_factor);
    check.positive("a", p.a);
    check.not_negative("b", p.b);
    check.not_negative("c", p.c);
    check.positive("width", p.width);
    check.positive("depth", p.depth);
}

void check_parameters(const Check& check, const Engine& e) {
    check.rising("full_load", e.full_load);
    check.positive("governor_slope", e.governor_slope);
    check.positive("low_idle", e.low_idle);
    if (!(e.high_idle > e.low_idle)) check.fail("high_idle", "= " + number(e.high_idle) + "; must be > low_idle");
    check.not_negative("friction_constant", e.friction_constant);
    check.not_negative("friction_per_speed", e.friction_per_speed);
    check.not_negative("actuator_lag", e.actuator_lag);
    check.not_negative("turbo_lag", e.turbo_lag);
    if (!(e.turbo_instant_fraction > 0 && e.turbo_instant_fraction <= 1)) {
        check.fail("turbo_instant_fraction", "= " + number(e.turbo_instant_fraction) + "; must be in (0, 1]");
    }
    check.not_negative("fade_to", e.fade_to);
    check.not_negative("fade_from", e.fade_from);
    check.not_negative("stall_speed", e.stall_speed);
}

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
    if (d.masses.empty()) throw ModelError("model", d.name, "masses", "is empty; a machine has at least one mass");
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

    for (const Clutch& c : d.clutches) {
        if (c.radius > 0) {
            if (c.b.empty()) Check("clutch", c.name).fail("radius", "is given, but there is no road mass b");
            joints.translating("clutch", c.name, "b", c.b);
        }
    }
    for (const BrixiusTyre& t : d.tyres) joints.translating("tyre", t.name, "body", t.body);
    for (const Road& road : d.roads) joints.translating("road", road.name, "body", road.body);
    for (const Plough& p : d.ploughs) joints.translating("plough", p.name, "body", p.body);
    const auto at_least_one = [&](const char* field, int value) {
        if (value < 1) throw ModelError("model", d.name, field, "= " + std::to_string(value) + "; must be >= 1");
    };
    at_least_one("maximum_events", d.maximum_events);
    at_least_one("maximum_parts", d.maximum_parts);
    if (d.oil) {
        const Check check("oil", "oil");
        check.positive("viscosity_at_zero", d.oil->viscosity_at_zero);
        check.not_negative("viscosity_decay", d.oil->viscosity_decay);
        check.positive("drag_speed_limit", d.oil->drag_speed_limit);
        check.not_negative("pump_flow", d.oil->pump_flow);
    }
    for (const Clutch& c : d.clutches) {
        const bool needs_oil = c.drag || c.heat;
        if (needs_oil && !d.oil) {
            Check("clutch", c.name).fail(c.drag ? "drag" : "heat", "needs the model's oil");
        }
    }
}

}  // namespace shiftrig::plant
