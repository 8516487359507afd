#include "io/lcm/names.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace shiftrig::io::lcm {

namespace {

using plant::Unit;

constexpr std::pair<const char*, CommandKind> command_inputs[] = {
    {".pressure_command", CommandKind::pressure}, {".current_command", CommandKind::current},
    {".release_command", CommandKind::fraction},  {".application_command", CommandKind::fraction},
    {".engagement", CommandKind::fraction},
};

// The devices that have the quantity, in the order of the table: `clutch.F1.torque` gives "F1".
std::vector<std::string> devices_with(const SignalTable& signals, const std::string& kind,
                                      const std::string& quantity) {
    std::vector<std::string> names;
    const std::string prefix = kind + ".", suffix = "." + quantity;
    for (int i = 0; i < signals.size(); ++i) {
        const std::string& name = signals.signal(i).name;
        if (name.size() > prefix.size() + suffix.size() && name.starts_with(prefix) && name.ends_with(suffix))
            names.push_back(name.substr(prefix.size(), name.size() - prefix.size() - suffix.size()));
    }
    return names;
}

void limit(std::vector<std::string>& names, std::size_t most, const char* what,
           std::vector<std::string>& warnings) {
    if (names.size() <= most) return;
    warnings.push_back("LCM messages carry the first " + std::to_string(most) + " of " +
                       std::to_string(names.size()) + " " + what);
    names.resize(most);
}

// Zero-terminated within the field; longer names are cut.
template <std::size_t size>
void put_name(std::uint8_t (&field)[size], const std::string& name) {
    const std::size_t length = std::min(name.size(), size - 1);
    std::memcpy(field, name.data(), length);
    std::memset(field + length, 0, size - length);
}

template <std::size_t size>
std::string get_name(const std::uint8_t (&field)[size]) {
    return {field, std::find(field, field + size, 0)};
}

std::size_t count_of(std::int32_t count, std::size_t most) {
    return std::min(static_cast<std::size_t>(std::max(count, 0)), most);
}

void find_driver(Names& names, const SignalTable& signals) {
    names.throttle = signals.find("driver.throttle");
    names.brake = signals.find("driver.brake");
    names.clutch_pedal = signals.find("driver.clutch_pedal");
    names.lever = signals.find("driver.lever");
    names.automatic = signals.find("driver.auto");
    names.parking_brake = signals.find("driver.parking_brake");
}

void add_status(Names& names, SignalTable& signals) {
    names.selected_gear = find_or_add(signals, "controller.selected_gear");
    names.current_gear = find_or_add(signals, "controller.current_gear");
    names.shift_in_process = find_or_add(signals, "controller.shift_in_process");
    names.limp = find_or_add(signals, "controller.limp");
}

}  // namespace

int find_or_add(SignalTable& signals, const std::string& name, Unit unit) {
    const int found = signals.find(name);
    if (found >= 0) return found;
    plant::Signal signal;
    signal.name = name;
    signal.unit = unit;
    return signals.add(signal);
}

Names names_of_rig(SignalTable& signals, std::vector<std::string>& warnings) {
    Names names;
    const auto first = [&](const std::string& kind, const std::string& quantity) {
        const auto devices = devices_with(signals, kind, quantity);
        return devices.empty() ? std::string() : devices.front();
    };

    auto clutches = devices_with(signals, "clutch", "torque");
    limit(clutches, array_length, "clutches", warnings);
    for (const auto& name : clutches) {
        const std::string stem = "clutch." + name;
        ClutchSignals clutch;
        clutch.name = name;
        for (const auto& [quantity, kind] : command_inputs) {
            const int index = signals.find(stem + quantity);
            if (index < 0) continue;
            clutch.command = index;
            clutch.kind = kind;
        }
        clutch.pressure = signals.find(stem + ".pressure");
        clutch.torque = signals.find(stem + ".torque");
        clutch.slip = signals.find(stem + ".slip");
        clutch.capacity = signals.find(stem + ".capacity");
        clutch.temperature = signals.find(stem + ".temperature");
        clutch.state = signals.find(stem + ".state");
        names.clutches.push_back(std::move(clutch));
    }
    const auto list = [&](const char* kind, const char* quantity, std::size_t most, const char* what) {
        auto devices = devices_with(signals, kind, quantity);
        limit(devices, most, what, warnings);
        std::vector<NamedSignal> found;
        for (const auto& name : devices)
            found.push_back({name, signals.find(std::string(kind) + "." + name + "." + quantity)});
        return found;
    };
    names.sensors = list("sensor", "speed", array_length, "speed sensors");
    names.masses = list("mass", "speed", mass_array_length, "masses");
    names.shafts = list("shaft", "torque", array_length, "shafts");

    names.engine = first("engine", "torque");
    const std::string engine = "engine." + names.engine;
    names.engine_torque = signals.find(engine + ".torque");
    names.engine_load = signals.find(engine + ".load");
    names.speed_request_enable = signals.find(engine + ".speed_request_enable");
    names.speed_request = signals.find(engine + ".speed_request");
    names.torque_limit = signals.find(engine + ".torque_limit");
    names.fuel_cut = signals.find(engine + ".fuel_cut");
    names.oil_temperature = signals.find("oil.temperature");
    const std::string body = "body." + first("body", "acceleration");
    names.acceleration = signals.find(body + ".acceleration");
    names.distance = signals.find(body + ".distance");
    names.draft = signals.find("plough." + first("plough", "draft") + ".draft");
    names.safe_command = signals.find("rig.safe_command");
    names.overruns = signals.find("rig.overruns");
    names.tick_load = signals.find("rig.tick_load");
    find_driver(names, signals);
    add_status(names, signals);
    return names;
}

Names names_of_controller(const plant_info_t& info, SignalTable& signals) {
    Names names;
    for (std::size_t i = 0; i < count_of(info.clutch_count, array_length); ++i) {
        ClutchSignals clutch;
        clutch.name = get_name(info.clutch_name[i]);
        const int kind_sent = info.clutch_command[i];
        clutch.kind =
            kind_sent >= 0 && kind_sent <= 3 ? static_cast<CommandKind>(kind_sent) : CommandKind::none;
        const std::string stem = "clutch." + clutch.name;
        switch (clutch.kind) {
            case CommandKind::pressure:
                clutch.command = find_or_add(signals, stem + ".pressure_command", Unit::pascal);
                break;
            case CommandKind::current:
                clutch.command = find_or_add(signals, stem + ".current_command", Unit::ampere);
                break;
            case CommandKind::fraction:
                // Release, application or engagement: the rig knows which; the controller's own name wins.
                for (const auto& [quantity, kind] : command_inputs)
                    if (kind == CommandKind::fraction && clutch.command < 0)
                        clutch.command = signals.find(stem + quantity);
                if (clutch.command < 0) clutch.command = find_or_add(signals, stem + ".release_command");
                break;
            case CommandKind::none:
                break;
        }
        clutch.pressure = find_or_add(signals, stem + ".pressure", Unit::pascal);
        names.clutches.push_back(std::move(clutch));
    }
    for (std::size_t i = 0; i < count_of(info.sensor_count, array_length); ++i) {
        const std::string name = get_name(info.sensor_name[i]);
        names.sensors.push_back(
            {name, find_or_add(signals, "sensor." + name + ".speed", Unit::radian_per_second)});
    }
    names.engine = get_name(info.engine_name);
    if (!names.engine.empty()) {
        const std::string engine = "engine." + names.engine;
        names.engine_torque = find_or_add(signals, engine + ".torque", Unit::newton_metre);
        names.engine_load = find_or_add(signals, engine + ".load");
        names.speed_request_enable = find_or_add(signals, engine + ".speed_request_enable");
        names.speed_request = find_or_add(signals, engine + ".speed_request", Unit::radian_per_second);
        names.fuel_cut = find_or_add(signals, engine + ".fuel_cut");
        const bool known = signals.find(engine + ".torque_limit") >= 0;
        names.torque_limit = find_or_add(signals, engine + ".torque_limit");
        if (!known) signals.value[static_cast<std::size_t>(names.torque_limit)] = 1;  // no limit
    }
    names.oil_temperature = find_or_add(signals, "oil.temperature", Unit::celsius);
    for (const char* driver : {"throttle", "brake", "clutch_pedal", "lever", "auto", "parking_brake"})
        find_or_add(signals, std::string("driver.") + driver);
    find_driver(names, signals);
    add_status(names, signals);
    return names;
}

void describe(const Names& names, plant_info_t& info) {
    put_name(info.engine_name, names.engine);
    info.clutch_count = static_cast<std::int32_t>(names.clutches.size());
    for (std::size_t i = 0; i < names.clutches.size(); ++i) {
        put_name(info.clutch_name[i], names.clutches[i].name);
        info.clutch_command[i] = static_cast<std::int8_t>(names.clutches[i].kind);
    }
    const auto put_all = [](const auto& list, std::int32_t& count, auto& fields) {
        count = static_cast<std::int32_t>(list.size());
        for (std::size_t i = 0; i < list.size(); ++i) put_name(fields[i], list[i].name);
    };
    put_all(names.sensors, info.sensor_count, info.sensor_name);
    put_all(names.masses, info.mass_count, info.mass_name);
    put_all(names.shafts, info.shaft_count, info.shaft_name);
}

}  // namespace shiftrig::io::lcm
