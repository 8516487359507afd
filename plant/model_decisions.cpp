#include "plant/model_decisions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "plant/laws/converter.h"
#include "plant/laws/friction.h"
#include "plant/laws/heat.h"
#include "plant/laws/sensor.h"

namespace shiftrig::plant::detail {
namespace {

// How fast two links could be moved against each other if they were free: acceleration per torque.
double mobility_between(const ModelData& m, const std::array<Link, 2>& links) {
    double mobility = 0;
    for (const Link& link : links) {
        if (link.mass >= 0)
            mobility += link.factor * link.factor / m.structure.inertia[static_cast<std::size_t>(link.mass)];
    }
    return mobility;
}

// As many parts of a step as `reach` time constants or radians of turn ask for.
void divide_step(ModelData& m, double reach, int most) {
    if (m.maximum_parts == 1) return;
    while (m.maximum_parts < reach && m.maximum_parts < most)
        m.maximum_parts = std::min(2 * m.maximum_parts, most);
}

}  // namespace

// A contact of flanks can be as short as half a period of the lightest motion they allow. The parts of a step have to
// see it, and its events have to have room. Forces that swing with it (a load that grows with speed) cost a part of turn
// ωh a phase of order (ωh)⁴, which hundreds of contacts add up: half a radian, not one. Friction that rises with speed is
// a damper that the step does not take exactly: its parts are to be short against its time constant. Such that falls makes
// a slip grow by that time constant. A converter near synchronous speed is such a damper as well.
void bound_step(ModelData& m) {
    constexpr int most_for_flanks = 1 << 14, most_for_damping = Description::most_parts;
    constexpr double usual_speed = 200;  // of an engine [rad/s]
    m.maximum_events = m.description.maximum_events;
    m.maximum_parts = m.description.maximum_parts;
    for (int k = 0; k < m.pairs; ++k) {
        const PairLaw& law = m.pair_laws[static_cast<std::size_t>(k)];
        const Steepness steep = steepness(law.friction);
        const double rate = law.full_load * std::max(steep.rise, steep.fall) *
                            mobility_between(m, m.structure.pairs[static_cast<std::size_t>(k)].links);
        divide_step(m, 4 * rate * m.options.step_size, most_for_damping);
    }
    for (const TorqueConverter& c : m.description.converters) {
        const double slope = 2 * usual_speed * steepest_coefficient(c);
        for (const std::string& side : {c.pump, c.turbine}) {
            const double mobility = mobility_between(m, {Link{m.structure.mass(side), 1}, Link{}});
            divide_step(m, 4 * slope * mobility * m.options.step_size, most_for_damping);
        }
    }
    for (const BacklashLaw& law : m.backlashes) {
        const double mobility =
            mobility_between(m, m.structure.shafts[static_cast<std::size_t>(law.shaft)].links);
        const double turn = std::sqrt(law.stiffness * mobility) * m.options.step_size;  // ωh
        m.maximum_events += 2 * static_cast<int>(std::ceil(std::min(turn, 1e4) / 3)) + 2;
        divide_step(m, 2 * turn, most_for_flanks);
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
    at.loops = take(m.pairs);
    at.drive_sides = take(m.meshes);
    at.resting = take(m.meshes);
    take(loop_slack);  // read, never written, by loops over what stands before it
    at.size = next;
    for (PairLaw& law : m.pair_laws) {
        if (law.actuator >= 0) law.actuator += at.actuators;
        if (law.temperature >= 0) law.temperature += at.temperatures;
    }
}

}  // namespace shiftrig::plant::detail
