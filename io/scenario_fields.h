// The field lists of a scenario file; see field_reader.h.
#pragma once

#include <string>
#include <vector>

#include "io/field_reader.h"
#include "io/scenario_file.h"

namespace shiftrig::io {

using namespace rules;

// ---- as written, before it becomes a ScenarioFile ----------------------------------------------------

struct TimelineText {
    double at = 0, over = 0;
    std::string note;
    std::vector<Setting> settings;
    int line = 0, column = 0;
};

struct ShiftText {
    std::string from, to;
    bool completed = true;
    int line = 0, column = 0;
};

struct ExpectText {
    std::vector<ShiftText> shifts;
    bool no_shifts = false;
    std::vector<MetricLimit> scorecard;
    std::vector<ExpectedEvent> must, must_not;
    std::vector<SignalBound> signals;
    struct Final {
        NamedQuantity quantity;
        double minimum = -unbounded, maximum = unbounded;
    };
    std::vector<Final> final_state;
};

struct ScenarioText {
    ScenarioFile file;
    std::string model;
    std::vector<TimelineText> timeline;
    ExpectText expect;
};

// ---- the lists ---------------------------------------------------------------------------------------

template <class Fields>
void fields(Fields& f, ScenarioStart& s) {
    f.named_words("options", s.options, "option in use per gear: {range: M}");
    f.optional_names("locked", s.locked, "clutches closed at the start");
    f.settings("speeds", s.speeds,
               "mass_unit: {engine_rpm: 1840, vehicle_kmh: 8}; all others follow through what is locked");
    f.settings("inputs", s.inputs, "signal_unit: {driver.throttle: 0.7, clutch.F2.pressure_command_bar: 18}");
    f.optional_number("settle_s", s.settle, not_negative,
                      "the plant runs under these inputs, without the controller, before time 0 [0]");
}

template <class Fields>
void fields(Fields& f, TimelineText& t) {
    f.number("at_s", t.at, not_negative, "when");
    f.optional_number("over_s", t.over, not_negative, "how long the change takes, linearly [0: at once]");
    f.optional_text("note", t.note, "for the reader");
    f.other_settings(t.settings, "signal with its unit, and the value it goes to");
}

template <class Fields, class Bounded>
void bounds(Fields& f, Bounded& b) {
    f.optional_number("min", b.minimum, any, "in the unit written");
    f.optional_number("max", b.maximum, any, "in the unit written");
}

template <class Fields>
void window(Fields& f, Window& w) {
    f.optional_number("from_s", w.from, not_negative, "[from the beginning]");
    f.optional_number("until_s", w.until, not_negative, "[to the end]");
}

template <class Fields>
void fields(Fields& f, ShiftText& s) {
    f.text("from", s.from, "gear");
    f.text("to", s.to, "gear");
    f.flag("completed", s.completed, "whether it has to complete [true]");
}

template <class Fields>
void fields(Fields& f, MetricLimit& m) {
    f.optional_text("shift", m.shift, "F2->F3; every shift where absent");
    f.text("metric", m.metric, "of the scorecard, such as duration_s");
    bounds(f, m);
}

template <class Fields>
void fields(Fields& f, ExpectedEvent& e) {
    Choices<std::string> kinds;
    for (const char* kind :
         {"lock", "break_away", "engage", "release", "reverse", "mesh_sticks", "mesh_releases", "drive_side",
          "tie_up", "fall_back", "engine_stalls", "engine_starts", "facing_warning", "facing_failure",
          "flank_closes", "flank_opens", "safe_command"})
        kinds.emplace_back(kind, kind);
    f.choice("kind", e.kind, kinds, "of event");
    f.optional_text("device", e.device, "[any]");
    window(f, e.window);
}

template <class Fields>
void fields(Fields& f, SignalBound& b) {
    f.quantity("signal", b.quantity, "with its unit: mass.vehicle.speed_kmh");
    window(f, b.window);
    bounds(f, b);
}

template <class Fields>
void fields(Fields& f, ExpectText::Final& b) {
    f.quantity("signal", b.quantity, "with its unit: mass.vehicle.speed_kmh");
    bounds(f, b);
}

template <class Fields>
void fields(Fields& f, ExpectText& e) {
    f.flag("no_shifts", e.no_shifts, "true: no shift may be found");
    f.list("shifts", e.shifts, "exactly these, in this order");
    f.list("scorecard", e.scorecard, "limits on metrics");
    f.list("must", e.must, "events that have to happen");
    f.list("must_not", e.must_not, "events that may not happen");
    f.list("signals", e.signals, "bounds that hold all through a window of time");
    f.list("final", e.final_state, "bounds at the end");
}

template <class Fields>
void fields(Fields& f, ScenarioText& s) {
    f.text("model", s.model, "model file, from this file's folder");
    f.optional_text("about", s.file.description, "one line");
    f.number("duration_s", s.file.duration, positive, "simulated time");
    f.optional_integer("seed", s.file.seed, not_negative,
                       "of the noise of sensors, and of bus_faults that name no other [1]");
    f.optional_object("start", s.file.start, "state and inputs at the beginning");
    f.list("timeline", s.timeline, "what changes when");
    f.raw("bus_faults", s.file.bus_faults, "scripted faults of messages");
    f.no_key("bus", "the bit rate of the in-process bus stands under bus_faults (bit_rate)");
    f.raw("controller", s.file.controller, "calibration and faults of the built-in controller");
    f.optional_object("expect", s.expect, "what shiftrig test checks");
}

}  // namespace shiftrig::io
