// The field lists of a model file: one function per device, in the order of plant/description.h. Given a
// FieldReader they read, given a FieldSchema they describe. A key is the member's name with its unit, so
// that a plant::ModelError about a member finds its line.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "io/field_reader.h"
#include "plant/description.h"

namespace shiftrig::io {

using namespace rules;
inline constexpr Rule dead_time{0, 10};  // [s]: a delay line that fits into memory

// ---- what the file says and plant::Description does not hold -----------------------------------------

struct GearPathText {
    std::string name;
    std::vector<std::string> closed;
    int lever = 0;
};

struct SafeCommandText {
    std::string name;
    std::string command;  // "pressure_command"
    double value = 0, within = 0;
};

struct ControllerText {
    double command_timeout = 0.1;
    std::vector<SafeCommandText> safe_command;
    std::string pedal_clutch;
};

struct ModelText {
    std::string about;
    plant::Description machine;
    std::vector<GearPathText> gear_paths;
    ControllerText controller;
    YAML::Node can{YAML::NodeType::Undefined}, templates{YAML::NodeType::Undefined};
};

// ---- masses, shafts ----------------------------------------------------------------------------------

template <class Fields>
void fields(Fields& f, plant::Mass& m) {
    f.one_of({{"inertia_kg_m2",
               [&] {
                   m.motion = plant::Motion::rotating;
                   f.number("inertia_kg_m2", m.inertia, positive, "moment of inertia of a rotating mass");
                   f.optional_number("initial_speed_rad_s", m.initial_speed, any, "speed at the start [0]");
               }},
              {"mass_kg", [&] {
                   m.motion = plant::Motion::translating;
                   f.number("mass_kg", m.inertia, positive, "mass of a translating body");
                   f.optional_number("initial_speed_m_s", m.initial_speed, any, "speed at the start [0]");
               }}});
}

template <class Fields>
void fields(Fields& f, plant::Shaft& s) {
    f.link("a", s.a, "mass at the first end");
    f.link_or_housing("b", s.b, "mass at the second end, or housing");
    f.number("stiffness_nm_per_rad", s.stiffness, positive, "torsional stiffness");
    f.number("damping_nm_s_per_rad", s.damping, not_negative, "damper parallel to the stiffness");
    f.optional_number("initial_twist_rad", s.initial_twist, any, "twist at the start, a ahead of b [0]");
}

template <class Fields>
void fields(Fields& f, plant::Backlash& b) {
    f.link("a", b.a, "mass at the first end");
    f.link_or_housing("b", b.b, "mass at the second end, or housing");
    f.number("stiffness_nm_per_rad", b.stiffness, positive, "of the closed flanks");
    f.number("damping_nm_s_per_rad", b.damping, not_negative, "damper parallel to it while they are closed");
    f.number("gap_rad", b.gap, positive, "the whole play, from flank to flank");
    f.optional_number("initial_twist_rad", b.initial_twist, any,
                      "at the start, a ahead of b [0: in the middle]");
}

template <class Fields>
void fields(Fields& f, plant::Damper& d) {
    f.link("a", d.a, "first mass");
    f.link_or_housing("b", d.b, "second mass, or housing");
    f.number("damping_nm_s_per_rad", d.damping, positive, "torque per difference of speed");
}

// ---- functions of time -------------------------------------------------------------------------------

template <class Fields>
void fields(Fields& f, plant::Waveform::Piece& p) {
    f.optional_number("from_s", p.from, any, "begins to act [always]");
    f.optional_number("until_s", p.until, any, "ceases to act [never]");
    f.optional_number("offset", p.offset, any, "constant part, Nm for a torque");
    f.optional_number("slope_per_s", p.slope, any, "slope·(t − from_s)");
    f.optional_number("amplitude", p.amplitude, any, "amplitude·sin(2π·frequency·(t − phase_time))");
    f.optional_number("frequency_hz", p.frequency, not_negative, "of the sine");
    f.optional_number("phase_time_s", p.phase_time, any, "time at which the sine passes zero");
}

// ---- friction pairs ----------------------------------------------------------------------------------

template <class Fields>
void fields(Fields& f, plant::DryFriction& d) {
    f.number("sliding_capacity_nm", d.sliding_capacity, positive,
             "friction torque while slipping, fully engaged (N for translating masses)");
    f.number("static_ratio", d.static_ratio, at_least_one, "static over sliding capacity");
    f.optional_number("falling", d.falling, at_most_one,
                      "share of the sliding capacity lost at high slip: factor 1 − falling·(1 − "
                      "e^(−|Δω|/falling_speed)) [0]");
    f.optional_number("falling_speed_rad_s", d.falling_speed, positive, "slip speed of that fall [1]");
    f.optional_table("factor_over_slip_rad_s", d.factor_over_slip, 1, 1,
                     "instead: [[rad/s, factor of sliding_capacity], …], piecewise linear",
                     {any, not_negative});
}

template <class Fields>
void fields(Fields& f, plant::WetPlates& w) {
    f.integer("surfaces", w.surfaces, at_least_one, "number of friction surfaces");
    f.number("outer_radius_m", w.outer_radius, positive, "of the facing");
    f.number("inner_radius_m", w.inner_radius, positive, "of the facing");
    f.number("piston_area_m2", w.piston_area, positive, "pressed area of the piston");
    f.number("return_pressure_bar", w.return_pressure, not_negative,
             "pressure that balances the return spring at full stroke: the kiss point");
    f.number("mu_static", w.mu_static, positive, "static friction coefficient");
    f.number("mu_sliding", w.mu_sliding, positive,
             "at high slip: μ(v) = mu_sliding + mu_rise·e^(−v/mu_speed)");
    f.number("mu_rise", w.mu_rise, any, "rise of the sliding coefficient towards zero slip");
    f.number("mu_speed_m_s", w.mu_speed, positive, "speed of that rise, at the mean radius");
    f.number("clearance_mm", w.clearance, positive, "per surface when open: drag of the oil");
}

template <class Fields>
void fields(Fields&, plant::ActuationConstant&) {}

template <class Fields>
void fields(Fields& f, plant::Waveform& w) {
    f.list("pieces", w.pieces, "the sum of these; none: the input commands");
}

template <class Fields>
void fields(Fields& f, plant::ActuationDirect& d) {
    f.optional_object("profile", d.profile,
                      "engagement 0…1 over time, for self-contained reference problems");
    f.optional_number("initial", d.initial, fraction, "engagement at the start [0]");
}

template <class Fields>
void fields(Fields& f, plant::ActuationRelease& r) {
    f.number("lag_s", r.lag, not_negative, "first-order lag of the release");
    f.optional_number("initial", r.initial, fraction, "release at the start [0: closed]");
}

template <class Fields>
void fields(Fields& f, plant::ActuationApply& a) {
    f.number("lag_s", a.lag, not_negative, "first-order lag of the application");
    f.flag("by_driver_brake", a.by_driver_brake, "true: a service brake on the driver's pedal");
    f.optional_number("initial", a.initial, fraction,
                      "application at the start [0]; the same for all service brakes");
}

template <class Fields>
void fields(Fields& f, plant::Solenoid& s) {
    f.table("pressure_over_current_a_bar", s.pressure_over_current, 1, 1e5, "[[A, bar], …], rising");
    f.number("hysteresis_a", s.hysteresis, not_negative, "full width of the hysteresis band");
}

template <class Fields>
void fields(Fields& f, plant::ActuationHydraulic& h) {
    f.number("dead_time_s", h.dead_time, dead_time, "of the valve with warm oil");
    f.number("natural_frequency_rad_s", h.natural_frequency, positive, "of the valve");
    f.number("damping_ratio", h.damping_ratio, positive, "of the valve");
    f.number("slew_bar_per_s", h.slew, positive, "steepest change of pressure");
    f.number("maximum_pressure_bar", h.maximum_pressure, positive, "of the supply");
    f.number("preload_pressure_bar", h.preload_pressure, not_negative,
             "return spring at zero stroke; at most return_pressure_bar");
    f.number("stroke_mm", h.stroke, not_negative,
             "of the piston to the kiss point; 0 with fill_volume 0: no fill");
    f.number("fill_volume_cm3", h.fill_volume, not_negative, "oil that the stroke takes");
    f.number("fill_flow_l_per_min", h.fill_flow, not_negative, "at which it is filled with warm oil");
    f.optional_object("solenoid", h.solenoid, "commanded by current instead of pressure");
    f.optional_number("initial_pressure_bar", h.initial, not_negative,
                      "command and chamber at the start [0]");
}

template <class Fields>
void fields(Fields& f, plant::FacingHeat& h) {
    f.number("surface_capacity_j_per_k", h.surface_capacity, positive,
             "heat capacity of the facing's surface");
    f.number("bulk_capacity_j_per_k", h.bulk_capacity, positive, "heat capacity of the plates");
    f.number("surface_to_bulk_w_per_k", h.surface_to_bulk, positive, "heat flow between them");
    f.number("bulk_to_oil_w_per_k", h.bulk_to_oil, not_negative, "heat flow into the oil");
    f.number("facing_area_m2", h.facing_area, positive, "of all surfaces");
    f.number("warn_temperature_degc", h.warn_temperature, any, "an event above it");
    f.number("fail_temperature_degc", h.fail_temperature, any, "the facing is lost above it");
}

template <class Fields>
void fields(Fields& f, plant::Clutch& c) {
    f.link("a", c.a, "first mass; for a wheel contact the wheel");
    f.link_or_housing("b", c.b, "second mass; housing makes it a brake");
    f.one_of(
        {{"dry",
          [&] { f.object("dry", c.friction.emplace<plant::DryFriction>(), "capacity given as a torque"); }},
         {"wet_plates", [&] {
              f.object("wet_plates", c.friction.emplace<plant::WetPlates>(), "wet multi-plate clutch");
          }}});
    auto& engaged = c.actuation;
    f.one_of(
        {{"constant",
          [&] { f.object("constant", engaged.emplace<plant::ActuationConstant>(), "always engaged: {}"); }},
         {"direct",
          [&] {
              f.object("direct", engaged.emplace<plant::ActuationDirect>(), "engagement 0…1 as commanded");
          }},
         {"release",
          [&] { f.object("release", engaged.emplace<plant::ActuationRelease>(), "spring-closed"); }},
         {"apply",
          [&] { f.object("apply", engaged.emplace<plant::ActuationApply>(), "applied by a command 0…1"); }},
         {"hydraulic",
          [&] { f.object("hydraulic", engaged.emplace<plant::ActuationHydraulic>(), "valve and piston"); }}});
    f.optional_object("heat", c.heat, "facing surface and bulk as two heat nodes");
    f.optional_number("radius_m", c.radius, positive, "makes it a wheel on a road: slip ω_a − v_b/radius");
    f.flag("initially_locked", c.initially_locked, "closed at the start");
    f.flag("drag", c.drag, "drag of the oil while open (needs oil)");
}

template <class Fields>
void fields(Fields& w, plant::Freewheel& f) {
    w.link("a", f.a, "first mass");
    w.link_or_housing("b", f.b, "second mass, or housing: a sprag that holds a on one side");
    w.choice("blocks", f.blocks,
             Choices<plant::Sense>{{"forward", plant::Sense::forward}, {"backward", plant::Sense::backward}},
             "sense of ω_a − ω_b that it does not let go: a cannot run ahead of b [forward], or fall behind");
    w.number("rated_torque_nm", f.rated_torque, positive, "that it holds in that sense");
    w.number("sliding_share", f.sliding_share, share,
             "of the rated torque that is left while it slips overloaded");
    w.optional_number("drag_torque_nm", f.drag_torque, not_negative, "while overrunning [0]");
}

// ---- rigid devices -----------------------------------------------------------------------------------

template <class Fields>
void fields(Fields& f, plant::Gear& g) {
    f.link("a", g.a, "first mass");
    f.link("b", g.b, "second mass");
    std::string in_use;
    int teeth_a = 0, teeth_b = 0;
    f.one_of({{"ratio", [&] { f.number("ratio", g.ratio, not_zero, "ω_a/ω_b"); }},
              {"teeth_a",
               [&] {
                   f.integer("teeth_a", teeth_a, at_least_one,
                             "teeth of the wheel on a; ratio = teeth_b/teeth_a");
                   f.integer("teeth_b", teeth_b, at_least_one, "teeth of the wheel on b");
                   g.ratio = teeth_a > 0 ? static_cast<double>(teeth_b) / teeth_a : 0;
               }},
              {"options", [&] {
                   f.named_numbers("options", g.options, not_zero,
                                   "selectable ratios ω_a/ω_b: {L: 6.05, M: 3.02}");
                   f.text("in_use", in_use, "the option in use where none is asked for");
                   for (const auto& [name, ratio] : g.options)
                       if (name == in_use) g.ratio = ratio;  // still 0: refused by check_options
               }}});
    f.number("efficiency", g.efficiency, efficiency, "of the mesh; 1: no losses");
    f.optional_number("bearing_torque_nm", g.bearing_torque, not_negative,
                      "load-independent friction on a [0]");
    f.optional_number("backward_efficiency", g.backward_efficiency, efficiency,
                      "where b drives [as efficiency]");
    f.optional_number("backward_bearing_torque_nm", g.backward_bearing_torque, not_negative,
                      "where b drives [as bearing_torque]");
}

template <class Fields>
void fields(Fields& f, plant::Planetary& p) {
    f.link("sun", p.sun, "link 1");
    f.link("ring", p.ring, "link 2");
    f.link("carrier", p.carrier, "link 3");
    int sun_teeth = 0, ring_teeth = 0;
    f.one_of(
        {{"ratio",
          [&] {
              f.number("ratio", p.ratio, not_zero, "ω_sun/ω_ring, carrier held; negative for a simple row");
          }},
         {"teeth_sun", [&] {
              f.integer("teeth_sun", sun_teeth, at_least_one, "a simple row: ratio = −teeth_ring/teeth_sun");
              f.integer("teeth_ring", ring_teeth, at_least_one, "of the ring");
              p.ratio = sun_teeth > 0 ? -static_cast<double>(ring_teeth) / sun_teeth : 0;
          }}});
    f.number("efficiency", p.efficiency, efficiency, "of the meshes with the carrier held; 1: no losses");
}

// ---- force laws --------------------------------------------------------------------------------------

template <class Fields>
void fields(Fields& f, plant::BrixiusTyre& t) {
    f.link("wheel", t.wheel, "rotating mass");
    f.link("body", t.body, "translating mass");
    f.number("radius_m", t.radius, positive, "rolling radius");
    f.number("mobility_number", t.mobility_number, {plant::softest_soil, plant::hardest_soil},
             "Brixius Bn: about 80 hard, 55 firm, 40 tilled, 20 soft; the input "
             "environment.mobility_number is that of the first tyre and changes the others in proportion");
    f.number("relaxation_length_m", t.relaxation_length, positive, "way the force takes to follow the slip");
    f.number("slip_damping_time_s", t.slip_damping_time, not_negative, "slip-rate damping at low speed");
    f.number("weight_n", t.weight, positive, "on this contact");
    f.number("rolling_coefficient", t.rolling_coefficient, not_negative,
             "rolling moment over weight and radius");
}

template <class Fields>
void fields(Fields& f, plant::TorqueConverter& c) {
    f.link("pump", c.pump, "driving mass");
    f.link("turbine", c.turbine, "driven mass");
    f.table("k_over_speed_ratio_rad_s_per_sqrt_nm", c.k_over_speed_ratio, 1, 1,
            "[[turbine/pump speed, K = ω/√T], …]", {fraction, positive});
    f.table("torque_ratio_over_speed_ratio", c.torque_ratio_over_speed_ratio, 1, 1,
            "[[turbine/pump speed, turbine/pump torque], …]; their product nowhere beyond 1",
            {fraction, not_negative});
}

template <class Fields>
void fields(Fields& f, plant::Engine& e) {
    f.link("mass", e.mass, "the crankshaft");
    f.table("full_load_rpm_nm", e.full_load, unit_spelling("_rpm")->factor, 1,
            "[[rpm, Nm], …], net full-load torque");
    f.number("governor_slope_nm_s_per_rad", e.governor_slope, positive,
             "torque per drop below the no-load speed");
    f.number("low_idle_rpm", e.low_idle, positive, "no-load speed at throttle 0");
    f.number("high_idle_rpm", e.high_idle, positive, "no-load speed at throttle 1");
    f.number("friction_constant_nm", e.friction_constant, not_negative, "engine braking at standstill");
    f.number("friction_per_speed_nm_s_per_rad", e.friction_per_speed, not_negative, "its rise with speed");
    f.number("actuator_lag_s", e.actuator_lag, not_negative, "of the injected quantity");
    f.number("turbo_instant_fraction", e.turbo_instant_fraction, share,
             "share of full load without boost; 1: no turbo");
    f.number("turbo_lag_s", e.turbo_lag, not_negative, "of the boost");
    f.number("fade_from_rpm", e.fade_from, not_negative, "below it the full-load curve falls linearly …");
    f.number("fade_to_rpm", e.fade_to, not_negative, "… to nothing here");
    f.number("stall_speed_rpm", e.stall_speed, not_negative, "below it the engine has stalled");
    f.optional_integer("cylinders", e.cylinders, at_least_one,
                       "of four strokes: `check` warns where the order cylinders/2 meets a mode [6]");
}

template <class Fields>
void fields(Fields& f, plant::TorqueSource& s) {
    f.link("mass", s.mass, "mass the torque (N on a translating one) acts on");
    f.optional_object("waveform", s.waveform, "prescribed torque over time");
    f.optional_number("quadratic_nm_s2_per_rad2", s.quadratic, not_negative, "drag −quadratic·ω·|ω| [0]");
    f.flag("input", s.input, "adds the input source.<name>.torque");
}

template <class Fields>
void fields(Fields& f, plant::Road& r) {
    f.link("body", r.body, "translating mass");
    f.number("mass_kg", r.mass, positive, "that gravity acts on");
    f.number("air_coefficient_n_s2_per_m2", r.air_coefficient, not_negative, "½·ρ·c_w·A");
}

template <class Fields>
void fields(Fields& f, plant::Plough& p) {
    f.link("body", p.body, "translating mass");
    f.number("soil_factor", p.soil_factor, positive, "ASABE D497: 1.0 fine, 0.70 medium, 0.45 coarse");
    f.number("a", p.a, positive, "draft = soil_factor·(a + b·S + c·S²)·width·depth, S in km/h, depth in cm");
    f.number("b", p.b, not_negative, "see a");
    f.number("c", p.c, not_negative, "see a");
    f.number("width_m", p.width, positive, "of the implement");
    f.number("depth_cm", p.depth, positive, "of the furrow");
}

// ---- fluids, sensors ---------------------------------------------------------------------------------

template <class Fields>
void fields(Fields& f, plant::Oil& o) {
    f.number("viscosity_at_zero_pa_s", o.viscosity_at_zero, positive, "at 0 °C");
    f.number("viscosity_decay_per_degc", o.viscosity_decay, not_negative, "viscosity_at_zero·e^(−decay·T)");
    f.number("initial_temperature_degc", o.initial_temperature, any,
             "input environment.oil_temperature at the start");
    f.number("drag_speed_limit_rad_s", o.drag_speed_limit, positive,
             "drag is linear up to this slip, constant above");
    f.number("cold_temperature_degc", o.cold_temperature, any, "where the two factors below hold");
    f.number("warm_temperature_degc", o.warm_temperature, any,
             "where they are 1, above cold_temperature_degc; between, by ln of the viscosity");
    f.number("cold_dead_time_factor", o.cold_dead_time_factor, positive, "on the valves' dead time");
    f.number("cold_valve_frequency_factor", o.cold_valve_frequency_factor, positive,
             "on the valves' frequency");
    f.number("fill_viscosity_pa_s", o.fill_viscosity, positive, "fill flow ÷ (1 + viscosity/fill_viscosity)");
    f.number("pump_flow_l_per_min", o.pump_flow, not_negative, "shared by all clutches; 0: unlimited");
}

template <class Fields>
void fields(Fields& f, plant::SpeedSensor& s) {
    f.link("mass", s.mass, "whose speed it reads");
    f.one_of(
        {{"ideal", [&] { f.flag("ideal", s.ideal, "true: copies the speed"); }},
         {"teeth", [&] {
              s.ideal = false;
              f.integer("teeth", s.teeth, at_least_one, "of the pulse wheel; speed by period measurement");
              f.flag("directional", s.directional, "false: reads |speed|");
              f.number("drop_out_speed_rad_s", s.drop_out_speed, not_negative, "below it the sensor reads 0");
          }}});
}

// ---- the bench's side --------------------------------------------------------------------------------

template <class Fields>
void fields(Fields& f, GearPathText& g) {
    f.names("closed", g.closed, "clutches and brakes closed, freewheels locked in it");
    f.optional_integer("lever", g.lever, any,
                       "position of the lever that asks for it: −1 reverse, 1… forward");
}

template <class Fields>
void fields(Fields& f, SafeCommandText& s) {
    const auto command = [&](const char* key, const char* signal, const Rule& rule, const char* text) {
        return Alternative{key, [&f, &s, key, signal, rule, text] {
                               s.command = signal;
                               f.number(key, s.value, rule, text);
                           }};
    };
    f.one_of({command("pressure_bar", "pressure_command", not_negative, "hydraulic clutch"),
              command("current_a", "current_command", not_negative, "hydraulic clutch with a solenoid"),
              command("release", "release_command", fraction, "spring-closed clutch: 1 opens it"),
              command("application", "application_command", fraction, "brake: 1 applies it"),
              command("engagement", "engagement", fraction, "directly engaged clutch")});
    f.number("within_s", s.within, not_negative, "reached linearly in this time");
}

template <class Fields>
void fields(Fields& f, ControllerText& c) {
    f.number("command_timeout_s", c.command_timeout, positive,
             "without a valid command until the safe command acts");
    f.section("safe_command", "safe command", c.safe_command,
              "per clutch; a clutch not named here opens within 0.05 s");
    f.optional_text("pedal_clutch", c.pedal_clutch, "clutch that the driver's pedal releases");
}

template <class Fields>
void fields(Fields& f, ModelText& model) {
    plant::Description& d = model.machine;
    f.text("name", d.name, "of the machine");
    f.optional_text("about", model.about, "what it is, and where its figures come from");
    f.raw("templates", model.templates,
          "maps that others take in with << and an anchor; not read themselves");
    f.section("masses", "mass", d.masses, "lumped masses; every link of a device ends on one");
    f.section("shafts", "shaft", d.shafts, "elastic shafts with their dampers");
    f.section("backlashes", "backlash", d.backlashes, "elastic shafts with play");
    f.section("dampers", "damper", d.dampers, "between masses or to the housing");
    f.section("clutches", "clutch", d.clutches, "clutches, brakes, Coulomb wheel contacts");
    f.section("freewheels", "freewheel", d.freewheels, "one-way clutches, sprags");
    f.section("gears", "gear", d.gears, "fixed-axis gears, range groups");
    f.section("planetaries", "planetary row", d.planetaries, "planetary rows");
    f.section("tyres", "tyre", d.tyres, "Brixius traction with relaxation");
    f.section("converters", "converter", d.converters, "torque converters");
    f.section("engines", "engine", d.engines, "diesel engines");
    f.section("sources", "source", d.sources, "prescribed torques");
    f.section("roads", "road", d.roads, "grade and air on a body");
    f.section("ploughs", "plough", d.ploughs, "draft on a body");
    f.section("sensors", "sensor", d.sensors, "speed pick-ups");
    f.optional_object("oil", d.oil, "of the clutches");
    f.section("gear_paths", "gear path", model.gear_paths, "which clutches make which gear");
    f.optional_text("input_mass", d.input_mass, "of gear ratios and of statics");
    f.optional_text("output_mass", d.output_mass, "of gear ratios and of statics");
    f.optional_number("gravity_m_s2", d.gravity, not_negative, "[9.80665]");
    f.optional_object("controller", model.controller, "how the machine meets its controller and driver");
    f.raw("can", model.can, "bus mapping");
    f.choice("transition", d.transition,
             Choices<plant::Transition>{{"localised", plant::Transition::localised},
                                        {"next_step", plant::Transition::next_step}},
             "when a change of contact acts: inside the step [localised] or in the next step");
    f.choice("method", d.method,
             Choices<plant::Method>{{"automatic", plant::Method::automatic},
                                    {"etd3", plant::Method::etd3},
                                    {"ark3", plant::Method::ark3}},
             "integration; [automatic] goes by the model's size");
    f.optional_integer("maximum_events", d.maximum_events, {1, plant::Description::most_events},
                       "localised per step, in each of its parts [4]");
    f.optional_integer("maximum_parts", d.maximum_parts, {1, plant::Description::most_parts},
                       "of a step where shafts swing or forces change too fast for one [16]; 1: never");
}

}  // namespace shiftrig::io
