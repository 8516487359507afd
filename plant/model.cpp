// Builds a Model: indices, laws with their constants, and the names of all signals.
#include <algorithm>
#include <cmath>
#include <limits>

#include "plant/laws/engine.h"
#include "plant/laws/hydraulics.h"
#include "plant/laws/oil.h"
#include "plant/laws/sensor.h"
#include "plant/laws/tyre.h"
#include "plant/model_data.h"
#include "plant/modes.h"

namespace shiftrig::plant {
namespace detail {
namespace {

int add_input(ModelData& m, const std::string& name, Unit unit, double initial, double minimum,
              double maximum, const std::string& description) {
    const auto [at, fresh] = m.input_index.emplace(name, static_cast<int>(m.inputs.size()));
    if (fresh) m.inputs.push_back({name, unit, initial, minimum, maximum, description});
    return at->second;
}

int add_output(ModelData& m, const std::string& name, Unit unit, const std::string& description) {
    const int index = static_cast<int>(m.outputs.size());
    m.output_index.emplace(name, index);
    m.outputs.push_back({name, unit, 0, -1e300, 1e300, description});
    return index;
}

int add_switch(ModelData& m, const std::string& name, const std::string& description) {
    return add_input(m, name, Unit::one, 0, 0, 1, description);
}

void add_breakpoints(ModelData& m, const Waveform& waveform) {
    for (const Waveform::Piece& piece : waveform.pieces) {
        if (piece.from > -1e299) m.breakpoints.push_back(piece.from);
        if (piece.until < 1e299) m.breakpoints.push_back(piece.until);
    }
}

// Current that the characteristic turns into this pressure.
double current_for(const Solenoid& solenoid, double pressure) {
    Table inverse;
    for (const auto& [current, value] : solenoid.pressure_over_current) {
        if (inverse.empty() || value > inverse.back().first) inverse.push_back({value, current});
    }
    return interpolate(inverse, pressure);
}

PairLaw clutch_law(ModelData& m, const Clutch& c, int& actuator_slots) {
    PairLaw law;
    const std::string prefix = "clutch." + c.name + ".";
    if (const auto* dry = std::get_if<DryFriction>(&c.friction)) {
        law.friction = friction_law(*dry);
        law.full_load = load_from_engagement(law.friction, 1);
    } else {
        const auto& wet = std::get<WetPlates>(c.friction);
        law.friction = friction_law(wet);
        if (c.drag) law.drag = drag_factor(wet);
    }
    law.actuator = actuator_slots;
    const double h = m.options.step_size;
    if (const auto* direct = std::get_if<ActuationDirect>(&c.actuation)) {
        if (direct->profile.pieces.empty()) {
            law.source = LoadSource::input;
            law.command = add_input(m, prefix + "engagement", Unit::one, direct->initial, 0, 1e6,
                                    "share of the nominal capacity");
        } else {
            law.source = LoadSource::waveform;
            law.profile = &direct->profile;
            add_breakpoints(m, direct->profile);
        }
    } else if (const auto* release = std::get_if<ActuationRelease>(&c.actuation)) {
        law.source = LoadSource::release;
        law.lag = lag_operator(release->lag, h);
        law.command = add_input(m, prefix + "release_command", Unit::one, release->initial, 0, 1,
                                "0 closed … 1 released");
        actuator_slots += 1;
    } else if (const auto* apply = std::get_if<ActuationApply>(&c.actuation)) {
        law.source = LoadSource::apply;
        law.lag = lag_operator(apply->lag, h);
        law.command = apply->by_driver_brake
                          ? add_input(m, "driver.brake", Unit::one, apply->initial, 0, 1, "service brake")
                          : add_input(m, prefix + "application_command", Unit::one, apply->initial, 0, 1,
                                      "0 open … 1 applied");
        actuator_slots += 1;
    } else if (const auto* hydraulic = std::get_if<ActuationHydraulic>(&c.actuation)) {
        law.source = LoadSource::hydraulic;
        law.hydraulic = hydraulic;
        law.full_load = load_from_pressure(law.friction, hydraulic->maximum_pressure);
        law.command =
            hydraulic->solenoid
                ? add_input(m, prefix + "current_command", Unit::ampere,
                            current_for(*hydraulic->solenoid, hydraulic->initial), 0,
                            hydraulic->solenoid->pressure_over_current.back().first, "solenoid current")
                : add_input(m, prefix + "pressure_command", Unit::pascal, hydraulic->initial, 0,
                            hydraulic->maximum_pressure, "valve pressure wanted");
        law.valve_stuck = add_switch(m, prefix + "valve_stuck", "fault: 1 holds the valve's outlet pressure");
        law.leak = add_switch(m, prefix + "leak", "fault: share of the chamber pressure lost");
        law.delay_slots =
            static_cast<int>(delay_slots(*hydraulic, m.description.oil ? &*m.description.oil : nullptr, h));
        actuator_slots += hydraulic_slots + law.delay_slots;
    } else {
        law.source = LoadSource::constant;
    }
    law.stuck = add_input(m, prefix + "stuck", Unit::one, 0, 0, 2, "fault: 1 stuck open, 2 stuck closed");
    if (c.heat) {
        law.heat = &*c.heat;
    }
    return law;
}

void build_laws(ModelData& m) {
    const Description& d = m.description;
    const Structure& s = m.structure;
    int actuator_slots = 0, heated = 0;
    for (const FrictionPair& pair : s.pairs) {
        PairLaw law;
        switch (pair.kind) {
            case PairKind::clutch:
                law = clutch_law(m, d.clutches[static_cast<std::size_t>(pair.source)], actuator_slots);
                break;
            case PairKind::freewheel: {
                const Freewheel& f = d.freewheels[static_cast<std::size_t>(pair.source)];
                law.source = LoadSource::rated;
                law.full_load = f.rated_torque;
                law.freewheel = static_cast<int>(m.freewheels.size());
                m.freewheels.push_back(freewheel_law(f, static_cast<int>(m.pair_laws.size())));
                break;
            }
            case PairKind::rolling:
                law.source = LoadSource::rolling;
                law.full_load = rolling_moment(d.tyres[static_cast<std::size_t>(pair.source)]);
                break;
            case PairKind::body_resistance:
                law.source = LoadSource::resistance;
                break;
            case PairKind::engine_friction:
                law.source = LoadSource::engine;
                break;
        }
        if (pair.kind != PairKind::clutch) law.friction.base = law.friction.static_factor = 1;
        if (law.freewheel >= 0)
            law.friction.base = d.freewheels[static_cast<std::size_t>(pair.source)].sliding_share;
        if (law.heat) law.temperature = heated++;
        law.sliding_at_rest = sliding_factor(law.friction, 0);
        if (law.source == LoadSource::waveform) m.depends_on_time = true;
        const int k = static_cast<int>(m.pair_laws.size());
        if (law.hydraulic) m.hydraulic_pairs.push_back(k);
        if (law.source == LoadSource::release || law.source == LoadSource::apply) m.pedal_pairs.push_back(k);
        if (law.source == LoadSource::waveform) m.waveform_pairs.push_back(k);
        if (law.heat) m.heated_pairs.push_back(k);
        if (law.source < LoadSource::rolling) m.actuated_pairs = k + 1;
        m.pair_laws.push_back(law);
    }
    m.layout.actuators = actuator_slots;  // sizes for now, offsets in build_layout
    m.layout.temperatures = 2 * whole_panels(heated);

    if (!d.engines.empty())
        m.throttle = add_input(m, "driver.throttle", Unit::one, 0, 0, 1, "sets the engine's no-load speed");
    for (const BrixiusTyre& tyre : d.tyres) {
        TyreLaw law;
        law.wheel = s.mass(tyre.wheel);
        law.body = s.mass(tyre.body);
        law.mobility = add_input(m, "environment.mobility_number", Unit::one, tyre.mobility_number, 1, 1e4,
                                 "Brixius number of the soil");
        law.resistance = s.pair(tyre.body + ".resistance");
        m.tyres.push_back(law);
    }
    for (const TorqueConverter& c : d.converters)
        m.converters.push_back({s.mass(c.pump), s.mass(c.turbine), -1, -1});
    for (const Engine& e : d.engines) {
        const std::string prefix = "engine." + e.name + ".";
        EngineLaw law;
        law.mass = s.mass(e.mass);
        law.pair = s.pair(e.name + ".friction");
        law.peak = largest_value(e.full_load);
        law.full_load = Curve(e.full_load);
        law.start = add_switch(m, prefix + "start", "rising edge starts a stalled engine");
        law.speed_request_enable =
            add_switch(m, prefix + "speed_request_enable", "1: hold the speed request");
        law.speed_request =
            add_input(m, prefix + "speed_request", Unit::radian_per_second, 0, 0, 1e4, "speed control");
        law.torque_limit = add_input(m, prefix + "torque_limit", Unit::one, 1, 0, 1, "of the full-load peak");
        law.fuel_cut = add_switch(m, prefix + "fuel_cut", "1: no fuel");
        m.engines.push_back(law);
    }
    for (const TorqueSource& source : d.sources) {
        SourceLaw law;
        law.mass = s.mass(source.mass);
        if (source.input)
            law.input = add_input(m, "source." + source.name + ".torque", Unit::newton_metre, 0, -1e9, 1e9,
                                  "test-bench torque");
        add_breakpoints(m, source.waveform);
        if (!source.waveform.pieces.empty()) m.depends_on_time = true;
        m.sources.push_back(law);
    }
    for (const Road& road : d.roads) {
        m.grade =
            add_input(m, "environment.grade", Unit::one, 0, -10, 10, "slope of the road, positive uphill");
        m.road_mass.push_back(s.mass(road.body));
    }
    for (const Plough& plough : d.ploughs) {
        m.draft = add_input(m, "environment.draft", Unit::one, 0, 0, 10, "plough 0 out … 1 in the ground");
        m.ploughs.push_back(
            {s.mass(plough.body), s.pair(plough.body + ".resistance"), -1, plough_curve(plough)});
    }
    if (d.oil)
        m.oil_temperature = add_input(m, "environment.oil_temperature", Unit::celsius,
                                      d.oil->initial_temperature, -40, 200, "transmission oil");
    for (const SpeedSensor& sensor : d.sensors) {
        const std::string prefix = "sensor." + sensor.name + ".";
        SensorLaw law;
        law.mass = s.mass(sensor.mass);
        law.bias = add_input(m, prefix + "bias", Unit::radian_per_second, 0, -1e6, 1e6,
                             "fault: added to the reading");
        law.noise =
            add_input(m, prefix + "noise", Unit::radian_per_second, 0, 0, 1e6, "fault: standard deviation");
        law.stuck = add_switch(m, prefix + "stuck", "fault: 1 holds the reading");
        law.dropout = add_switch(m, prefix + "dropout", "fault: 1 reads 0");
        law.missing_teeth = add_input(m, prefix + "missing_teeth", Unit::one, 0, 0, 1000,
                                      "fault: teeth without an edge per turn");
        m.sensors.push_back(law);
    }
    std::sort(m.breakpoints.begin(), m.breakpoints.end());
    m.breakpoints.erase(std::unique(m.breakpoints.begin(), m.breakpoints.end()), m.breakpoints.end());
}

void build_sizes(ModelData& m) {
    const Structure& s = m.structure;
    m.masses = s.masses();
    m.twists = static_cast<int>(s.shafts.size());
    m.pairs = static_cast<int>(s.pairs.size());
    m.meshes = static_cast<int>(s.meshes.size());
    m.states = m.masses + m.twists;
    m.states_padded = padded(m.states);
    m.torques = m.pairs + 2 * m.meshes;
    m.first_flank = m.pairs + m.meshes;
    m.plain_shafts = static_cast<int>(m.description.shafts.size());
    m.contact_bytes = m.first_flank + m.twists - m.plain_shafts;
    m.auxiliary = static_cast<int>(m.description.tyres.size() + 2 * m.description.engines.size());
    for (double inertia : s.inertia) m.root_inertia.push_back(std::sqrt(inertia));
    for (const FrictionPair& pair : s.pairs) {
        const double noteworthy = 1e-2 * pair.nominal_capacity;
        if (pair.kind != PairKind::clutch || (m.noteworthy_torque > 0 && noteworthy > m.noteworthy_torque))
            continue;
        m.noteworthy_torque = noteworthy;
    }
    for (double inertia : s.inertia) m.energy_factor.push_back(0.5 * inertia);
    for (const Elastic& shaft : s.shafts)
        m.energy_factor.push_back(shaft.gap > 0 ? 0 : 0.5 * shaft.stiffness);
    for (int j = 0; j < m.masses; ++j) {
        if (m.description.masses[static_cast<std::size_t>(j)].motion == Motion::translating)
            m.translating.push_back(j);
    }

    const auto branchless = [](auto links) {
        for (Link& link : links) {
            if (link.mass < 0) link = {0, 0};
        }
        return links;
    };
    for (const FrictionPair& pair : s.pairs) m.pair_slip.push_back(branchless(pair.links));
    for (const Mesh& mesh : s.meshes) m.mesh_motion.push_back(branchless(mesh.motion()));
    for (const Mesh& mesh : s.meshes) {
        const double slope = mesh.forward_efficiency - 1 / mesh.backward_efficiency;
        if (mesh.lossy()) m.lossy_meshes.push_back(static_cast<int>(m.lossy.size()));
        m.lossy.push_back(mesh.lossy());
        m.loss_kink.push_back(slope < 0 ? (mesh.forward_bearing - mesh.backward_bearing) / slope
                                        : mesh.forward_bearing / 2);
    }
    for (const Mesh& mesh : s.meshes) m.mesh_slip.push_back(branchless(mesh.column(mesh.ratio)));
    for (const Mesh& mesh : s.meshes) {
        m.mesh_loss.push_back(
            branchless(std::array<Link, 2>{Link{mesh.second, mesh.ratio}, Link{mesh.carrier, -mesh.ratio}}));
    }
    for (const Elastic& shaft : s.shafts) m.shaft_rate.push_back(branchless(shaft.links));
    for (const Elastic& damper : s.dampers) m.damper_rate.push_back(branchless(damper.links));

    for (const FrictionPair& pair : s.pairs) m.force_columns.push_back(pair.links);
    for (const Mesh& mesh : s.meshes) {
        const bool bearing = mesh.forward_bearing > 0 || mesh.backward_bearing > 0;
        m.bearing_force.push_back(bearing ? static_cast<int>(m.force_columns.size()) : -1);
        if (bearing)
            m.force_columns.push_back({Link{mesh.second, mesh.ratio}, Link{mesh.carrier, -mesh.ratio}});
    }
    m.first_external = static_cast<int>(m.force_columns.size());
    m.external_force.assign(static_cast<std::size_t>(m.masses), -1);
    const auto external = [&](int mass) {
        int& index = m.external_force[static_cast<std::size_t>(mass)];
        if (index >= 0) return;
        index = static_cast<int>(m.force_columns.size());
        m.force_columns.push_back({Link{mass, -1}, Link{}});  // into the mass
    };
    for (const TyreLaw& tyre : m.tyres) {
        external(tyre.wheel);
        external(tyre.body);
    }
    for (const ConverterLaw& converter : m.converters) {
        external(converter.pump);
        external(converter.turbine);
    }
    for (const EngineLaw& engine : m.engines) external(engine.mass);
    for (const SourceLaw& source : m.sources) external(source.mass);
    for (int mass : m.road_mass) external(mass);
    for (const PloughLaw& plough : m.ploughs) external(plough.mass);
    for (int mass : m.translating) external(mass);
    const auto force_on = [&m](int mass) { return m.external_force[static_cast<std::size_t>(mass)]; };
    for (TyreLaw& tyre : m.tyres) {
        tyre.wheel_force = force_on(tyre.wheel);
        tyre.body_force = force_on(tyre.body);
    }
    for (ConverterLaw& converter : m.converters) {
        converter.pump_force = force_on(converter.pump);
        converter.turbine_force = force_on(converter.turbine);
    }
    for (EngineLaw& engine : m.engines) engine.force = force_on(engine.mass);
    for (SourceLaw& source : m.sources) source.force = force_on(source.mass);
    for (int mass : m.road_mass) m.road_force.push_back(force_on(mass));
    for (PloughLaw& plough : m.ploughs) plough.force = force_on(plough.mass);
    for (int mass : m.translating) m.translating_force.push_back(force_on(mass));
    m.first_flank_force = static_cast<int>(m.force_columns.size());
    for (int e = m.plain_shafts; e < m.twists; ++e) {
        const Elastic& shaft = s.shafts[static_cast<std::size_t>(e)];
        m.backlashes.push_back({e, m.first_flank + e - m.plain_shafts,
                                static_cast<int>(m.force_columns.size()), shaft.stiffness, shaft.damping,
                                0.5 * shaft.gap});
        m.force_columns.push_back(shaft.links);
    }
    m.forces = static_cast<int>(m.force_columns.size());
    for (const auto& links : m.force_columns) m.force_on.push_back(branchless(links));
    m.columns = m.states + m.forces;
    m.law_rows = whole_panels(m.forces + m.meshes);
    m.power_rows = m.law_rows + whole_panels(m.meshes + m.twists + static_cast<int>(s.dampers.size()));
    m.seen = m.power_rows + m.states;
    for (const auto* elastics : {&s.shafts, &s.dampers}) {
        for (const Elastic& elastic : *elastics)
            m.swing_damping.push_back(elastic.gap > 0 ? 0 : elastic.damping);
    }
    if (m.description.oil) m.drag_speed_limit = m.description.oil->drag_speed_limit;
    for (const PairLaw& law : m.pair_laws) {
        m.static_factor.push_back(law.friction.static_factor);
        m.sliding_at_rest.push_back(law.sliding_at_rest);
    }
    for (int k = 0; k < m.forces; ++k) {
        m.power_lost.push_back(k < m.first_external ? 1 : 0);
        m.power_given.push_back(k >= m.first_external && k < m.first_flank_force ? 1 : 0);
    }
    m.loses_in_fields = !m.tyres.empty() || !m.converters.empty();
    m.swings = static_cast<int>(m.swing_damping.size());
    for (auto* numbers : {&m.energy_factor, &m.static_factor, &m.sliding_at_rest, &m.swing_damping,
                          &m.power_lost, &m.power_given})
        numbers->resize(numbers->size() + loop_slack, 0.);
}

// A contact of flanks can be as short as half a period of the lightest motion they allow. The parts of a step have to
// see it, and its events have to have room.
void bound_step(ModelData& m) {
    m.maximum_events = m.description.maximum_events;
    m.maximum_parts = m.description.maximum_parts;
    for (const BacklashLaw& law : m.backlashes) {
        double mobility = 0;
        for (const Link& link : m.structure.shafts[static_cast<std::size_t>(law.shaft)].links)
            mobility += link.factor * link.factor / m.structure.inertia[static_cast<std::size_t>(link.mass)];
        const double turn = std::sqrt(law.stiffness * mobility) * m.options.step_size;  // ωh
        m.maximum_events += 2 * static_cast<int>(std::ceil(std::min(turn, 1e4) / 3)) + 2;
        while (m.maximum_parts > 1 && m.maximum_parts < turn && m.maximum_parts < 1 << 14)
            m.maximum_parts *= 2;
    }
}

// Beyond about 40 speeds and twists a step along the tree is cheaper than dense products.
void choose_engine(ModelData& m) {
    constexpr int dense_limit = 40;
    const Method method = m.description.method;
    const std::string size = std::to_string(m.states) + " speeds and twists";
    const bool small = m.states <= dense_limit;
    m.engine_reason = method != Method::automatic ? "as the model asks" : small ? size : size + ", a tree";
    if (method == Method::etd3 || (method == Method::automatic && small)) return;
    std::string obstacle;
    m.tree = build_topology(m, obstacle);
    if (m.tree) return;
    if (method == Method::ark3)
        throw ModelError("model", m.description.name, "method",
                         "= ark3 needs a machine without loops: " + obstacle);
    m.engine_reason = size + " would take ark3, but " + obstacle;
}

// Constants of the loops over heated clutches and pick-ups, side by side.
void build_device_numbers(ModelData& m) {
    constexpr double never = std::numeric_limits<double>::infinity();
    const auto panels = [](std::size_t count) {
        return static_cast<std::size_t>(whole_panels(static_cast<int>(count)));
    };
    HeatNumbers& heat = m.heat;
    for (auto* numbers : {&heat.e11, &heat.e12, &heat.e21, &heat.e22, &heat.f1, &heat.f2})
        numbers->assign(panels(m.heated_pairs.size()), 0.);
    heat.warn = heat.fail = std::vector<double>(panels(m.heated_pairs.size()), never);
    heat.pair.assign(panels(m.heated_pairs.size()), 0);
    for (std::size_t i = 0; i < m.heated_pairs.size(); ++i) {
        heat.pair[i] = m.heated_pairs[i];
        const FacingHeat& p = *m.pair_laws[static_cast<std::size_t>(m.heated_pairs[i])].heat;
        const HeatOperator op = heat_operator(p, m.options.step_size);
        heat.e11[i] = op.e11;
        heat.e12[i] = op.e12;
        heat.e21[i] = op.e21;
        heat.e22[i] = op.e22;
        heat.f1[i] = op.f1;
        heat.f2[i] = op.f2;
        if (p.warn_temperature > 0) heat.warn[i] = p.warn_temperature;
        if (p.fail_temperature > 0) heat.fail[i] = p.fail_temperature;
    }
    PickupNumbers& pickups = m.pickups;
    const std::vector<SpeedSensor>& sensors = m.description.sensors;
    for (auto* numbers : {&pickups.teeth, &pickups.pitch, &pickups.directional, &pickups.drop_out_speed})
        numbers->assign(panels(sensors.size()), 0.);
    pickups.mass.assign(panels(sensors.size()), 0);
    for (std::size_t i = 0; i < sensors.size(); ++i) {
        const SpeedSensor& p = sensors[i];
        pickups.mass[i] = m.sensors[i].mass;
        if (p.ideal || p.teeth <= 0) continue;
        pickups.teeth[i] = p.teeth;
        pickups.pitch[i] = tooth_pitch(p);
        pickups.directional[i] = p.directional ? 1 : 0;
        pickups.drop_out_speed[i] = p.drop_out_speed;
    }
}

void build_layout(ModelData& m) {
    StateLayout& at = m.layout;
    const int actuators = at.actuators, temperatures = at.temperatures;
    int next = StateLayout::header;
    const auto take = [&next](int slots) { return std::exchange(next, next + slots); };
    at.speeds = take(m.masses);
    at.twists = take(m.twists);
    at.distances = take(static_cast<int>(m.translating.size()));
    at.auxiliary = take(m.auxiliary);
    at.contact = take((m.contact_bytes + 7) / 8);
    at.actuators = take(actuators);
    at.heat = take(m.pairs);
    at.temperatures = take(temperatures);
    at.bulk_temperature = temperatures / 2;
    at.energy = take(3);
    at.engines = take(3 * static_cast<int>(m.engines.size()));
    at.sensors = take(4 * whole_panels(static_cast<int>(m.sensors.size())));
    at.tie_up = take(1);
    at.drive_sides = take(m.meshes);
    take(loop_slack);  // read, never written, by loops over what stands before it
    at.size = next;
    for (PairLaw& law : m.pair_laws) {
        if (law.actuator >= 0) law.actuator += at.actuators;
        if (law.temperature >= 0) law.temperature += at.temperatures;
    }
}

void build_outputs(ModelData& m) {
    const Description& d = m.description;
    const Structure& s = m.structure;
    const auto add = [&](const std::string& name, Unit unit, const char* text) {
        return add_output(m, name, unit, text);
    };
    for (const Mass& mass : d.masses) {
        add("mass." + mass.name + ".speed",
            mass.motion == Motion::rotating ? Unit::radian_per_second : Unit::metre_per_second, "speed");
    }
    for (const Shaft& shaft : d.shafts) {
        add("shaft." + shaft.name + ".torque", Unit::newton_metre, "torque on the first link");
        add("shaft." + shaft.name + ".twist", Unit::radian, "twist, positive where the first link is ahead");
    }
    // One quantity of all devices after the other: loops write them so.
    const auto of_clutches = [&](const char* quantity, Unit unit, const char* text, const auto& has) {
        for (std::size_t k = 0; k < d.clutches.size(); ++k) {
            if (has(m.pair_laws[k])) add("clutch." + d.clutches[k].name + quantity, unit, text);
        }
    };
    const auto every = [](const PairLaw&) { return true; };
    of_clutches(".torque", Unit::newton_metre, "torque on the first link", every);
    of_clutches(".slip", Unit::radian_per_second, "slip speed, first link minus second", every);
    of_clutches(".capacity", Unit::newton_metre, "sliding capacity at the present slip", every);
    of_clutches(".state", Unit::one, "0 locked, 1 slipping, 2 free", every);
    of_clutches(".heat_power", Unit::watt, "friction power", every);
    of_clutches(".heat", Unit::joule, "friction heat since start", every);
    of_clutches(".pressure", Unit::pascal, "chamber pressure",
                [](const PairLaw& law) { return law.hydraulic; });
    of_clutches(".temperature", Unit::celsius, "facing surface", [](const PairLaw& law) { return law.heat; });
    for (const Freewheel& f : d.freewheels) {
        const std::string prefix = "freewheel." + f.name + ".";
        add(prefix + "torque", Unit::newton_metre, "torque on the first link");
        add(prefix + "slip", Unit::radian_per_second, "slip speed, first link minus second");
        add(prefix + "state", Unit::one, "0 locked, 1 overloaded, 2 overrunning");
        add(prefix + "heat_power", Unit::watt, "power of drag or overload");
        add(prefix + "heat", Unit::joule, "heat of drag and overload since start");
    }
    for (const Backlash& b : d.backlashes) {
        const std::string prefix = "backlash." + b.name + ".";
        add(prefix + "torque", Unit::newton_metre, "torque on the first link");
        add(prefix + "twist", Unit::radian, "twist, 0 in the middle of the play");
        add(prefix + "state", Unit::one, "0 open, +1 or -1 the flank that is closed");
    }
    for (const Gear& gear : d.gears)
        add("gear." + gear.name + ".torque", Unit::newton_metre, "torque from the first link into the gear");
    for (const Gear& gear : d.gears)
        add("gear." + gear.name + ".direction", Unit::one,
            "x: +1 the first link drives, -1 it is driven, 0 at rest");
    for (const Gear& gear : d.gears)
        add("gear." + gear.name + ".power", Unit::watt, "power into the first link");
    for (const Planetary& row : d.planetaries) {
        const std::string prefix = "row." + row.name + ".";
        add(prefix + "sun", Unit::newton_metre, "torque from the sun into the row");
        add(prefix + "ring", Unit::newton_metre, "torque from the ring into the row");
        add(prefix + "carrier", Unit::newton_metre, "torque from the carrier into the row");
        add(prefix + "direction", Unit::one, "x: +1 the sun drives, -1 it is driven, 0 at rest");
    }
    for (const BrixiusTyre& tyre : d.tyres) {
        add("tyre." + tyre.name + ".force", Unit::newton, "force of the wheel on the body");
        add("tyre." + tyre.name + ".slip", Unit::one, "slip, positive when driving");
    }
    for (const TorqueConverter& c : d.converters) {
        add("converter." + c.name + ".pump_torque", Unit::newton_metre, "from the pump into the converter");
        add("converter." + c.name + ".turbine_torque", Unit::newton_metre,
            "from the converter to the turbine");
    }
    for (const Engine& e : d.engines) {
        add("engine." + e.name + ".torque", Unit::newton_metre, "net torque on the crankshaft");
        add("engine." + e.name + ".load", Unit::one, "of full load at this speed");
        add("engine." + e.name + ".stalled", Unit::one, "1: stalled");
    }
    for (int j : m.translating) {
        const std::string prefix = "body." + s.mass_names[static_cast<std::size_t>(j)] + ".";
        add(prefix + "acceleration", Unit::metre_per_second2, "acceleration");
        add(prefix + "distance", Unit::metre, "way since start");
    }
    for (const Plough& p : d.ploughs)
        add("plough." + p.name + ".draft", Unit::newton, "force that resists the body");
    for (const SpeedSensor& sensor : d.sensors)
        add("sensor." + sensor.name + ".speed", Unit::radian_per_second, "reading");
    if (d.oil) {
        add("oil.temperature", Unit::celsius, "oil temperature");
        add("oil.viscosity", Unit::one, "dynamic viscosity in Pa s");
    }
    add("energy.input", Unit::joule, "work of engines, sources, grade and air since start");
    add("energy.stored", Unit::joule, "kinetic and strain energy");
    add("energy.dissipated", Unit::joule, "friction, mesh losses, damping, tyres, converters since start");
    add("energy.defect", Unit::joule, "stored minus start minus input plus dissipated");
    add("certificate.torque_residual", Unit::one, "of the internal torques, relative");
    add("certificate.constraint_violation", Unit::one, "worst speed difference across a rigid device, rad/s");
    add("certificate.energy_defect", Unit::joule, "of this step");
    add("certificate.events", Unit::one, "state changes located inside this step");
    add("certificate.fall_backs", Unit::one, "state changes deferred to the end of this step");
    add("certificate.mode_lookups", Unit::one, "modes asked for");
    add("certificate.mode_misses", Unit::one, "modes built");
    add("certificate.flags", Unit::one, "bit 0 tie-up, bit 1 direction search gave up, bit 2 not finite");
}

}  // namespace
}  // namespace detail

Model::Model(std::unique_ptr<detail::ModelData> data) : data_(std::move(data)) {}
Model::Model(Model&&) noexcept = default;
Model& Model::operator=(Model&&) noexcept = default;
Model::~Model() = default;

Model Model::build(const Description& description, const BuildOptions& options) {
    auto data = std::make_unique<detail::ModelData>();
    detail::ModelData& m = *data;
    m.description = description;
    m.options = options;
    if (!(options.step_size > 0) || !std::isfinite(options.step_size)) {
        throw ModelError("model", description.name, "step_size",
                         "= " + std::to_string(options.step_size) + "; must be > 0");
    }
    m.kernel = detail::choose_kernel(options.kernel);
    m.structure = build_structure(m.description);
    detail::build_laws(m);
    detail::build_sizes(m);
    detail::bound_step(m);
    detail::choose_engine(m);
    detail::build_device_numbers(m);
    detail::build_layout(m);
    detail::build_outputs(m);
    for (const FrictionPair& pair : m.structure.pairs) m.device_names.push_back(pair.name);
    for (const Mesh& mesh : m.structure.meshes) m.device_names.push_back(mesh.name);
    for (const Backlash& backlash : m.description.backlashes) m.device_names.push_back(backlash.name);
    for (const Engine& engine : m.description.engines) m.device_names.push_back(engine.name);
    return Model(std::move(data));
}

double Model::step_size() const noexcept {
    return data_->options.step_size;
}
std::string_view Model::kernel() const noexcept {
    return data_->kernel.name;
}
std::string_view Model::engine() const noexcept {
    return data_->tree ? "ark3" : "etd3";
}
std::string_view Model::engine_reason() const noexcept {
    return data_->engine_reason;
}
const Description& Model::description() const noexcept {
    return data_->description;
}
const std::vector<Signal>& Model::inputs() const noexcept {
    return data_->inputs;
}
const std::vector<Signal>& Model::outputs() const noexcept {
    return data_->outputs;
}
const std::vector<std::string>& Model::device_names() const noexcept {
    return data_->device_names;
}
std::size_t Model::state_size() const noexcept {
    return static_cast<std::size_t>(data_->layout.size) * sizeof(double);
}

int Model::input(std::string_view name) const noexcept {
    const auto at = data_->input_index.find(name);
    return at == data_->input_index.end() ? -1 : at->second;
}
int Model::output(std::string_view name) const noexcept {
    const auto at = data_->output_index.find(name);
    return at == data_->output_index.end() ? -1 : at->second;
}

Inputs::Inputs(const Model& model) {
    for (const Signal& signal : model.inputs()) value.push_back(signal.initial);
}
Outputs::Outputs(const Model& model) : value(model.outputs().size(), 0.) {}

}  // namespace shiftrig::plant
