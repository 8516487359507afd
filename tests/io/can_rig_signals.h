// A table with every signal the tractor's mapping speaks of, as the rig would make it from the model.
#pragma once

#include <string>

#include "io/can/mapping.h"
#include "io/signals.h"

namespace shiftrig::io::can {

inline SignalTable rig_signals() {
    using plant::Unit;
    SignalTable table;
    const auto add = [&table](const std::string& name, Unit unit, double initial = 0) {
        plant::Signal signal;
        signal.name = name;
        signal.unit = unit;
        signal.initial = initial;
        return table.add(signal);
    };
    for (const std::string clutch : {"F1", "F2", "F3", "F4", "FR"}) {
        add("clutch." + clutch + ".pressure_command", Unit::pascal);
        add("clutch." + clutch + ".pressure", Unit::pascal);
        add("clutch." + clutch + ".temperature", Unit::celsius, 90);
        for (const std::string fault : {"stuck", "valve_stuck", "leak"})
            add("clutch." + clutch + "." + fault, Unit::one);
    }
    add("clutch.Fc.release_command", Unit::one);
    add("clutch.Fc.stuck", Unit::one);
    add("clutch.Fc.capacity", Unit::newton_metre, 2400);
    add("engine.engine.speed_request_enable", Unit::one);
    add("engine.engine.speed_request", Unit::radian_per_second);
    add("engine.engine.torque_limit", Unit::one, 1);
    add("engine.engine.torque", Unit::newton_metre);
    add("engine.engine.load", Unit::one);
    add("engine.engine.stalled", Unit::one);
    for (const std::string sensor : {"engine", "disc", "input", "output", "wheels"}) {
        for (const std::string quantity : {"speed", "bias", "noise"})
            add("sensor." + sensor + "." + quantity, Unit::radian_per_second);
        for (const std::string fault : {"stuck", "dropout", "missing_teeth"})
            add("sensor." + sensor + "." + fault, Unit::one);
    }
    add("mass.vehicle.speed", Unit::metre_per_second);
    add("mass.engine.speed", Unit::radian_per_second);
    add("oil.temperature", Unit::celsius, 90);
    for (const std::string driver : {"throttle", "brake", "lever", "clutch_pedal", "parking_brake", "auto"})
        add("driver." + driver, Unit::one);
    add("rig.safe_command", Unit::one);
    return table;
}

inline double& value(SignalTable& table, const std::string& name) {
    return table.value.at(static_cast<std::size_t>(table.find(name)));
}

inline Mapping tractor_mapping() {
    return read_mapping(SHIFTRIG_SOURCE_DIR "/config/can/tractor.yaml");
}

}  // namespace shiftrig::io::can
