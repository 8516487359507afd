#include "apps/tcu/calibration.h"

#include <algorithm>
#include <filesystem>
#include <numbers>

#include "io/field_reader.h"

namespace shiftrig::tcu {

namespace {

constexpr double rpm = 2 * std::numbers::pi / 60;
constexpr io::Rule negative{-io::rules::unbounded, -1e-3};
constexpr io::Rule gear_number{1, highest_gear};

}  // namespace

struct Ratios {  // as a stanza of its own
    std::array<double, clutch_count>& of;
};

// One list per stanza: the reader's keys, rules and meanings (io/field_reader.h).
template <class Fields>
void fields(Fields& f, Ratios& r) {
    f.number("F1", r.of[0], io::rules::positive, "first gear");
    f.number("F2", r.of[1], io::rules::positive, "second gear");
    f.number("F3", r.of[2], io::rules::positive, "third gear");
    f.number("F4", r.of[3], io::rules::positive, "fourth gear");
    f.number("FR", r.of[4], negative, "reverse");
}

template <class Fields>
void fields(Fields& f, Calibration::Machine& m) {
    Ratios ratios{m.ratio};
    f.object("ratio", ratios, "powershift input over output speed");
    f.number("input_inertia_kg_m2", m.input_inertia, io::rules::positive, "engine to powershift drums");
    f.table("full_load_rpm_nm", m.full_load, rpm, 1, "the engine's full-load curve");
}

template <class Fields>
void fields(Fields& f, Calibration::Clutch& c) {
    using namespace io::rules;
    f.number("kiss_pressure_bar", c.kiss_pressure, positive, "torque begins here");
    f.number("torque_per_pressure_nm_per_bar", c.torque_per_pressure, positive, "sliding");
    f.number("touch_pressure_bar", c.touch_pressure, positive,
             "a little above: holds the piston against the plates");
    f.number("full_pressure_bar", c.full_pressure, positive, "in gear");
    f.number("fill_pressure_bar", c.fill_pressure, positive, "command while filling");
    f.number("filled_margin_bar", c.filled_margin, not_negative, "below the kiss point, counts as filled");
    f.number("fill_timeout_s", c.fill_timeout, positive, "then the shift goes on regardless");
    f.number("locked_slip_rad_s", c.locked_slip, positive, "below it a clutch may have locked");
    f.number("locked_time_s", c.locked_time, positive, "and has, after so long");
    f.number("closing_rate_bar_per_s", c.closing_rate, positive, "to full pressure, once locked");
}

template <class Fields>
void fields(Fields& f, Calibration::Shift& s) {
    using namespace io::rules;
    f.number("torque_time_s", s.torque_time, positive, "torque is handed over in");
    f.number("inertia_time_s", s.inertia_time, positive, "the input is brought to its new speed in");
    f.number("shortest_to_go_s", s.shortest_to_go, positive, "lower bound of the time to go");
    f.number("hold_margin", s.hold_margin, at_least_one, "capacity of the offgoing clutch over its torque");
    f.number("timeout_s", s.timeout, positive, "of the inertia phase");
    f.number("pause_s", s.pause, not_negative, "between two shifts");
    f.number("engine_lead_rpm", s.engine_lead, not_negative, "asked of a leading engine above its new speed");
    f.number("engine_return_rad_s2", s.engine_return, positive, "how fast it is given back afterwards");
}

template <class Fields>
void fields(Fields& f, Calibration::Launch& l) {
    using namespace io::rules;
    f.choice("element", l.element,
             {{"gear_clutch", LaunchElement::gear_clutch}, {"main_clutch", LaunchElement::main_clutch}},
             "the clutch that slips");
    f.number("torque_nm", l.torque, positive, "greatest torque");
    f.number("torque_rate_nm_per_s", l.torque_rate, positive, "and how fast it rises");
    f.number("engine_droop", l.engine_droop, efficiency,
             "the torque fades to 0 as the engine falls by this share");
    f.number("timeout_s", l.timeout, positive, "then it is given up");
    f.number("main_clutch_torque_nm", l.main_clutch_torque, positive,
             "capacity of the main clutch when closed");
    f.number("main_release_time_s", l.main_release_time, not_negative, "until the main clutch has opened");
    f.integer("highest_gear", l.highest_gear, gear_number, "to start off in from rest");
    f.number("highest_reversal_speed_rad_s", l.highest_reversal_speed, not_negative,
             "of the powershift output against the wanted direction");
}

template <class Fields>
void fields(Fields& f, Calibration::Choice& c) {
    using namespace io::rules;
    f.number("upshift_torque_margin", c.upshift_torque_margin, positive,
             "share of full load an upshift may need");
    f.number("auto_upshift_speed_rpm", c.auto_upshift_speed, positive, "least engine speed in the new gear");
    f.number("highest_engine_speed_rpm", c.highest_engine_speed, positive, "no downshift beyond it");
    f.number("lug_speed_rpm", c.lug_speed, positive, "below it at full load the engine lugs");
    f.number("lug_load", c.lug_load, fraction, "share of the full load that counts as full");
    f.number("lug_time_s", c.lug_time, positive, "for so long");
    f.number("refusal_time_s", c.refusal_time, not_negative, "no upshift after lugging or a failed shift");
    f.number("torque_filter_s", c.torque_filter, not_negative, "time constant of the torque estimate");
}

template <class Fields>
void fields(Fields& f, Calibration::Stop& s) {
    using namespace io::rules;
    f.number("stall_guard_speed_rpm", s.stall_guard_speed, positive, "below it the driveline is opened");
    f.number("brake_speed_rpm", s.brake_speed, positive, "the same while braking");
    f.number("look_ahead_s", s.look_ahead, not_negative, "the engine's speed so far ahead is what counts");
    f.number("relaunch_speed_rpm", s.relaunch_speed, positive, "the engine must be above it to start off");
    f.number("brake_applied", s.brake_applied, efficiency, "pedal that counts as applied");
}

template <class Fields>
void fields(Fields& f, Calibration::Limp& l) {
    using namespace io::rules;
    f.number("recovery_time_s", l.recovery_time, not_negative, "signals must be sound for so long");
    f.number("slip_rad_s", l.slip, positive, "in gear at full pressure that is a fault");
    f.number("slip_time_s", l.slip_time, positive, "for so long");
    f.number("sensor_zero_rad_s", l.sensor_zero, positive, "a speed below it reads as standing");
}

template <class Fields>
void fields(Fields& f, Calibration::Bus& b) {
    f.text("can_mapping", b.mapping, "file that says what CAN frames mean, relative to this one");
}

template <class Fields>
void fields(Fields& f, Calibration& c) {
    f.number("period_s", c.period, io::rules::positive, "control cycle");
    f.object("machine", c.machine, "what the controller believes about it");
    f.object("clutch", c.clutch, "all gear clutches are alike");
    f.object("shift", c.shift, "a change of gear under load");
    f.object("launch", c.launch, "start from rest, reversal, engagement in motion");
    f.object("choice", c.choice, "which gear");
    f.object("stop", c.stop, "opening before the engine stalls");
    f.object("limp", c.limp, "faults");
    f.object("bus", c.bus, "conventions of the messages");
}

Calibration read_calibration(const std::string& path) {
    return parse_calibration(io::parse_yaml(io::read_text(path), path), path);
}

Calibration parse_calibration(const YAML::Node& root, const std::string& path) {
    Calibration calibration;
    io::ReadContext context{path, {}};
    io::FieldReader reader(context, root, root.Mark(), "", "");
    fields(reader, calibration);
    reader.finish();
    const auto& clutch = calibration.clutch;
    if (clutch.touch_pressure > clutch.full_pressure)
        for (const auto& place : context.places)
            if (place.key == "clutch.touch_pressure_bar")
                throw io::InputError(
                    path, place.line, place.column,
                    place.key + " = " + place.written + "; must be at most full_pressure_bar");
    calibration.bus.mapping = (std::filesystem::path(path).parent_path() / calibration.bus.mapping).string();
    return calibration;
}

double Calibration::pressure_for(double torque) const SHIFTRIG_REALTIME {
    return std::clamp(clutch.kiss_pressure + torque / clutch.torque_per_pressure, clutch.touch_pressure,
                      clutch.full_pressure);
}

double Calibration::full_load(double engine_speed) const SHIFTRIG_REALTIME {
    const auto& curve = machine.full_load;
    auto after = std::find_if(curve.begin(), curve.end(),
                              [&](const auto& point) { return point.first > engine_speed; });
    if (after == curve.begin()) return curve.front().second;
    if (after == curve.end()) return curve.back().second;
    const auto& [x0, y0] = *(after - 1);
    const auto& [x1, y1] = *after;
    return y0 + (y1 - y0) * (engine_speed - x0) / (x1 - x0);
}

}  // namespace shiftrig::tcu
