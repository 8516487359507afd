#include "apps/serve/machine_page.h"

#include <nlohmann/json.hpp>

#include "analysis/driveline_svg.h"

namespace shiftrig::serve {

using nlohmann::json;
using plant::Unit;

namespace {

class Page {
  public:
    explicit Page(const rig::Rig& rig) : rig_(rig), machine_(rig.model().description()) {}

    json build() const {
        json page;
        page["name"] = machine_.name;
        page["identity"] = std::string("kernel ") + std::string(rig_.model().kernel()) + ", engine " +
                           std::string(rig_.model().engine());
        page["signals"] = signals();
        page["gauges"] = gauges();
        page["plots"] = plots();
        page["driver"] = driver();
        page["environment"] = environment();
        page["faults"] = json::array();
        for (const auto& fault : faults_of(rig_))
            page["faults"].push_back({{"name", fault.name}, {"label", fault.label}});
        page["parameters"] = json::array();
        for (const auto& parameter : parameters_of(machine_))
            page["parameters"].push_back({{"name", parameter.name},
                                          {"device", parameter.device},
                                          {"label", parameter.label},
                                          {"unit", parameter.unit},
                                          {"value", parameter.value}});
        page["driveline_svg"] = analysis::driveline_svg(machine_);
        return page;
    }

  private:
    bool has(const std::string& name) const { return rig_.signals().find(name) >= 0; }
    double now(const std::string& name) const { return rig_.value(rig_.signals().find(name)); }

    json signals() const {
        json list = json::array();
        for (int i = 0; i < rig_.signals().size(); ++i) {
            const auto& signal = rig_.signals().signal(i);
            list.push_back({{"name", signal.name}, {"unit", plant::symbol(signal.unit)}});
        }
        return list;
    }

    json gauge(const std::string& signal, const std::string& label) const {
        const auto& known = rig_.signals().signal(rig_.signals().find(signal));
        return {{"signal", signal}, {"label", label}, {"unit", plant::symbol(known.unit)}};
    }

    json gauges() const {
        json list = json::array();
        const auto add = [&](const std::string& signal, const std::string& label) {
            if (has(signal)) list.push_back(gauge(signal, label));
        };
        for (const auto& engine : machine_.engines) {
            add("mass." + engine.mass + ".speed", "Engine");
            add("engine." + engine.name + ".load", "Engine load");
        }
        if (has("controller.current_gear")) {
            auto gear = gauge("controller.current_gear", "Gear");
            gear["words"] = json::object();
            gear["words"]["0"] = "N";
            for (const auto& position : rig_.setup().model.controller.lever)
                if (!position.gear_path.empty())
                    gear["words"][std::to_string(position.lever)] = position.gear_path;
            list.push_back(gear);
        }
        for (const auto& mass : machine_.masses)
            if (mass.motion == plant::Motion::translating)
                add("mass." + mass.name + ".speed", "Speed of " + mass.name);
        for (const auto& tyre : machine_.tyres) add("tyre." + tyre.name + ".slip", "Wheel slip");
        for (const auto& plough : machine_.ploughs) add("plough." + plough.name + ".draft", "Draft");
        if (machine_.engines.empty() && !machine_.input_mass.empty())
            add("mass." + machine_.input_mass + ".speed", machine_.input_mass);
        add("oil.temperature", "Oil");
        return list;
    }

    json plots() const {
        json list = json::array();
        const auto group = [&](const char* title, auto&& names) {
            json signals = json::array();
            for (const std::string& name : names)
                if (has(name)) signals.push_back(name);
            if (!signals.empty()) list.push_back({{"title", title}, {"signals", signals}});
        };
        std::vector<std::string> pressures, torques, slips, speeds, shafts, vehicles;
        for (const auto& clutch : machine_.clutches) {
            const std::string stem = "clutch." + clutch.name;
            pressures.push_back(stem + ".pressure");
            torques.push_back(stem + ".torque");
            slips.push_back(stem + ".slip");
        }
        for (const auto& freewheel : machine_.freewheels) {
            torques.push_back("freewheel." + freewheel.name + ".torque");
            slips.push_back("freewheel." + freewheel.name + ".slip");
        }
        for (const auto& shaft : machine_.shafts) shafts.push_back("shaft." + shaft.name + ".torque");
        for (const auto& backlash : machine_.backlashes)
            shafts.push_back("backlash." + backlash.name + ".torque");
        for (const auto& sensor : machine_.sensors) speeds.push_back("mass." + sensor.mass + ".speed");
        if (speeds.empty())
            for (const auto& mass : machine_.masses)
                if (mass.motion == plant::Motion::rotating) speeds.push_back("mass." + mass.name + ".speed");
        for (const auto& mass : machine_.masses)
            if (mass.motion == plant::Motion::translating) vehicles.push_back("mass." + mass.name + ".speed");
        group("Clutch pressures", pressures);
        group("Speeds", speeds);
        group("Vehicle speed", vehicles);
        group("Clutch torques", torques);
        group("Clutch slip", slips);
        group("Shaft torques", shafts);
        return list;
    }

    json slider(const std::string& signal, const std::string& label, double minimum, double maximum,
                double step, int digits, const std::string& unit = "") const {
        return {{"signal", signal}, {"label", label},   {"minimum", minimum}, {"maximum", maximum},
                {"step", step},     {"digits", digits}, {"unit", unit},       {"value", now(signal)}};
    }

    json driver() const {
        json list = json::array();
        const auto& lever = rig_.setup().model.controller.lever;
        if (!lever.empty()) {
            json options = json::array();
            bool neutral = false;
            for (const auto& position : lever) {
                neutral = neutral || position.lever == 0;
                options.push_back({{"value", position.lever},
                                   {"label", position.gear_path.empty() ? "N" : position.gear_path}});
            }
            if (!neutral) options.insert(options.begin(), json::object({{"value", 0}, {"label", "N"}}));
            list.push_back({{"signal", "driver.lever"},
                            {"label", "Lever"},
                            {"options", options},
                            {"value", now("driver.lever")}});
        }
        if (has("driver.throttle")) list.push_back(slider("driver.throttle", "Throttle", 0, 1, 0.01, 2));
        if (has("driver.brake")) list.push_back(slider("driver.brake", "Brake", 0, 1, 0.01, 2));
        if (has("driver.clutch_pedal") && !rig_.setup().model.controller.pedal_clutch.empty())
            list.push_back(slider("driver.clutch_pedal", "Clutch pedal", 0, 1, 0.01, 2));
        for (const auto& engine : machine_.engines) {
            const std::string start = "engine." + engine.name + ".start";
            if (has(start))
                list.push_back(
                    {{"signal", start},
                     {"label", "Starter"},
                     {"options", {{{"value", 0}, {"label", "off"}}, {{"value", 1}, {"label", "crank"}}}},
                     {"value", now(start)}});
        }
        for (const auto& source : machine_.sources)
            if (has("source." + source.name + ".torque"))
                list.push_back(slider("source." + source.name + ".torque", "Torque " + source.name, -500, 500,
                                      1, 0, "Nm"));
        return list;
    }

    json environment() const {
        json list = json::array();
        if (has("environment.grade"))
            list.push_back(slider("environment.grade", "Grade", -0.2, 0.2, 0.005, 3));
        if (has("environment.draft"))
            list.push_back(slider("environment.draft", "Plough in the ground", 0, 1, 0.01, 2));
        if (has("environment.mobility_number"))
            list.push_back(slider("environment.mobility_number", "Soil (Brixius number)", 15, 80, 1, 0));
        if (has("environment.oil_temperature"))
            list.push_back(slider("environment.oil_temperature", "Oil temperature", -10, 110, 1, 0, "°C"));
        return list;
    }

    const rig::Rig& rig_;
    const plant::Description& machine_;
};

}  // namespace

json machine_page(const rig::Rig& rig) {
    return Page(rig).build();
}

std::vector<Fault> faults_of(const rig::Rig& rig) {
    std::vector<Fault> list;
    const auto add = [&](const std::string& signal, const std::string& name, const std::string& label,
                         double active) {
        const int index = rig.signals().find(signal);
        if (index >= 0) list.push_back({name, label, index, active, 0});
    };
    const auto& machine = rig.model().description();
    for (const auto& clutch : machine.clutches) {
        const std::string stem = "clutch." + clutch.name;
        add(stem + ".stuck", clutch.name + ".stuck_open", clutch.name + " stuck open", 1);
        add(stem + ".stuck", clutch.name + ".stuck_closed", clutch.name + " stuck closed", 2);
        add(stem + ".valve_stuck", clutch.name + ".valve_stuck", clutch.name + " valve stuck", 1);
    }
    for (const auto& sensor : machine.sensors)
        add("sensor." + sensor.name + ".dropout", sensor.name + ".dropout", "no " + sensor.name + " speed",
            1);
    return list;
}

std::vector<Parameter> parameters_of(const plant::Description& machine) {
    std::vector<Parameter> list;
    for (const auto& clutch : machine.clutches) {
        const auto add = [&](const char* key, const char* label, const char* unit, double value) {
            list.push_back({"clutches." + clutch.name + "." + key, clutch.name, label, unit, value});
        };
        if (const auto* wet = std::get_if<plant::WetPlates>(&clutch.friction)) {
            add("wet_plates.mu_static", "static friction", "", wet->mu_static);
            add("wet_plates.mu_sliding", "sliding friction", "", wet->mu_sliding);
            add("wet_plates.mu_rise", "rise towards rest", "", wet->mu_rise);
        }
        if (const auto* dry = std::get_if<plant::DryFriction>(&clutch.friction))
            add("dry.sliding_capacity_nm", "sliding capacity", "Nm", dry->sliding_capacity);
        if (const auto* valve = std::get_if<plant::ActuationHydraulic>(&clutch.actuation)) {
            add("hydraulic.natural_frequency_rad_s", "valve frequency", "rad/s", valve->natural_frequency);
            add("hydraulic.damping_ratio", "valve damping", "", valve->damping_ratio);
            add("hydraulic.slew_bar_per_s", "slew", "bar/s", valve->slew * 1e-5);
            add("hydraulic.fill_volume_cm3", "fill volume", "cm³", valve->fill_volume * 1e6);
            add("hydraulic.fill_flow_l_per_min", "fill flow", "l/min", valve->fill_flow * 6e4);
        }
    }
    return list;
}

}  // namespace shiftrig::serve
