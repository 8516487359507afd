// Where a run begins: the State block of a description, and of a machine already in motion.
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <span>

#include "plant/contact.h"
#include "plant/devices.h"
#include "plant/laws/engine.h"
#include "plant/laws/hydraulics.h"
#include "plant/laws/sensor.h"
#include "plant/ledger.h"
#include "plant/model_data.h"

namespace shiftrig::plant {
namespace {

using detail::ModelData;

// The speeds nearest to `wanted` (in the sense of kinetic energy, so that momentum is conserved) for which
// the named columns slip at zero and the pinned masses turn as told. `mounted`: what a spring holds to the housing stands.
Eigen::VectorXd compatible_speeds(const ModelData& m, const Eigen::VectorXd& wanted,
                                  const std::vector<int>& locked, bool following,
                                  const std::vector<std::pair<int, double>>& pinned, bool mounted = true) {
    const Structure& s = m.structure;
    const Eigen::MatrixXd pairs = s.pair_columns(), meshes = s.mesh_columns(), shafts = s.shaft_columns();
    const auto is_told = [&](int mass) {
        return std::any_of(pinned.begin(), pinned.end(), [=](const auto& pin) { return pin.first == mass; });
    };
    const auto n = static_cast<Eigen::Index>(m.masses);
    // What is not rigid follows as if it were: shafts untwisted, tyres rolling unless the body's speed is told.
    std::vector<std::size_t> rolling;
    for (std::size_t t = 0; following && t < m.tyres.size(); ++t) {
        if (!is_told(m.tyres[t].body)) rolling.push_back(t);
    }
    std::vector<Eigen::Index> untwisted;
    for (Eigen::Index k = 0; following && k < shafts.cols(); ++k) {
        if (mounted || s.shafts[static_cast<std::size_t>(k)].links[1].mass >= 0) untwisted.push_back(k);
    }
    const Eigen::Index rows =
        static_cast<Eigen::Index>(locked.size() + pinned.size() + rolling.size() + untwisted.size()) +
        meshes.cols();
    if (rows == 0) return wanted;
    Eigen::MatrixXd c(rows, n);
    Eigen::VectorXd value = Eigen::VectorXd::Zero(rows);
    Eigen::Index row = 0;
    for (int k : locked) c.row(row++) = pairs.col(k).transpose();
    for (Eigen::Index k = 0; k < meshes.cols(); ++k) c.row(row++) = meshes.col(k).transpose();
    for (const Eigen::Index k : untwisted) c.row(row++) = shafts.col(k).transpose();
    for (const std::size_t t : rolling) {
        c.row(row).setZero();
        c(row, m.tyres[t].wheel) = m.description.tyres[t].radius;
        c(row++, m.tyres[t].body) = -1;
    }
    for (const auto& [mass, speed] : pinned) {
        c.row(row).setZero();
        c(row, mass) = 1;
        value(row++) = speed;
    }
    Eigen::VectorXd root(n);
    for (Eigen::Index j = 0; j < n; ++j) root(j) = m.root_inertia[static_cast<std::size_t>(j)];
    // Minimise |√J (ω − wanted)|: the least-norm correction in √J-scaled speeds.
    const Eigen::MatrixXd scaled = c * root.cwiseInverse().asDiagonal();
    const Eigen::VectorXd correction = scaled.completeOrthogonalDecomposition().solve(value - c * wanted);
    Eigen::VectorXd speeds = wanted + root.cwiseInverse().cwiseProduct(correction);
    // What nothing drives stands, exactly: a wheel that creeps at 1e-16 rad/s would have any slip.
    const double rounding = 1e-12 * speeds.cwiseAbs().maxCoeff();
    for (Eigen::Index j = 0; j < n; ++j) {
        if (wanted(j) == 0 && std::fabs(speeds(j)) < rounding) speeds(j) = 0;
    }
    return speeds;
}

// Actuators at rest at the inputs, auxiliary states as in steady running, contact states by the slip speeds.
void initialise(const ModelData& m, double* block, const std::vector<double>& inputs,
                const std::vector<int>& locked) {
    const Structure& s = m.structure;
    const double* speeds = block + m.layout.speeds;
    auto* contact = reinterpret_cast<unsigned char*>(block + m.layout.contact);
    const auto input = [&](int index) {
        const auto i = static_cast<std::size_t>(index);
        return index < 0 ? 0. : m.inputs[i].limited(inputs[i]);
    };
    for (int k = 0; k < m.pairs; ++k) {
        const auto i = static_cast<std::size_t>(k);
        const detail::PairLaw& law = m.pair_laws[i];
        contact[k] = detail::free_running;  // settled by its capacity in the first step
        switch (law.source) {
            case detail::LoadSource::release:
            case detail::LoadSource::apply:
                block[law.actuator] = input(law.command);
                break;
            case detail::LoadSource::hydraulic: {
                double command = input(law.command), play = 0;
                if (law.hydraulic->solenoid) {
                    play = command;
                    command = interpolate(law.hydraulic->solenoid->pressure_over_current, command);
                }
                HydraulicState state = hydraulic_rest(
                    *law.hydraulic, law.friction.return_pressure, limited_command(*law.hydraulic, command),
                    std::span<double>(block + law.actuator + detail::hydraulic_slots,
                                      static_cast<std::size_t>(law.delay_slots)));
                state.play = play;
                detail::write_hydraulic(block + law.actuator, state);
                break;
            }
            default:
                break;
        }
        if (law.temperature >= 0)
            block[law.temperature] = block[law.temperature + m.layout.bulk_temperature] =
                input(m.oil_temperature);
    }
    for (int k : locked) contact[k] = detail::locked;
    for (int k = 0; k < m.meshes; ++k) {
        const Mesh& mesh = s.meshes[static_cast<std::size_t>(k)];
        const double motion = detail::slip_of(mesh.motion(), speeds);
        const bool stuck = mesh.lossy() && std::fabs(motion) <= detail::at_rest;
        contact[m.pairs + k] = stuck          ? static_cast<unsigned char>(detail::stuck)
                               : mesh.lossy() ? detail::moving(motion, 1)
                                              : static_cast<unsigned char>(detail::moves);
    }
    for (const BacklashLaw& law : m.backlashes) {
        const double twist = block[m.layout.twists + law.shaft];
        const double rate = detail::slip_fast(m.shaft_rate[static_cast<std::size_t>(law.shaft)], speeds);
        const double side = twist < 0 ? -1 : 1;
        contact[law.device] = detail::closed_flank(open_margin(law, side, twist, rate) < 0 ? side : 0);
    }
    double* auxiliary = block + m.layout.auxiliary;
    for (std::size_t t = 0; t < m.tyres.size(); ++t, ++auxiliary) {
        const double rim = speeds[m.tyres[t].wheel] * m.description.tyres[t].radius,
                     v = speeds[m.tyres[t].body];
        const double rolling = std::fmax(std::fabs(rim), std::fabs(v));
        *auxiliary = rolling > 0 ? (rim - v) / rolling : 0;
    }
    for (std::size_t e = 0; e < m.engines.size(); ++e, auxiliary += 2) {
        const detail::EngineLaw& law = m.engines[e];
        const Engine& engine = m.description.engines[e];
        const double speed = speeds[law.mass];
        const bool running = !has_stalled(engine, speed);
        block[m.layout.engines + 3 * static_cast<int>(e)] =
            static_cast<double>(static_cast<int>(running ? EngineMode::running : EngineMode::stalled));
        if (!running) continue;
        const EngineInput in{input(m.throttle), input(law.speed_request_enable) > 0.5,
                             input(law.speed_request), input(law.torque_limit), input(law.fuel_cut) > 0.5};
        const double full = full_load(engine, speed);
        auxiliary[0] = torque_demand(engine, engine_setting(engine, law.peak, in), speed, full, 1);
        auxiliary[1] = full > 0 ? std::clamp(auxiliary[0] / full, 0., 1.) : 0;
    }
    const detail::SensorSlots sensor_slots = detail::sensor_slots(m.layout, m.sensors.size(), block);
    for (std::size_t i = 0; i < m.sensors.size(); ++i) {
        const SpeedSensor& sensor = m.description.sensors[i];
        const double speed = speeds[m.sensors[i].mass];
        sensor_slots.since_edge[i] = speed == 0 ? SensorState{}.since_edge : 0;  // a tooth is there just now
        sensor_slots.reading[i] = sensor_slots.output[i] =
            sensor.ideal || sensor.directional ? speed : std::fabs(speed);
    }
    double* energy = block + m.layout.energy;
    energy[0] = energy[1] = 0;
    std::vector<double> z(speeds, speeds + m.masses);
    z.insert(z.end(), block + m.layout.twists, block + m.layout.twists + m.twists);
    z.resize(z.size() + detail::loop_slack);
    energy[2] = detail::stored_energy(m, z.data(), contact);
}

}  // namespace

State::State(const Model& model) {
    const ModelData& m = model.data();
    block.assign(static_cast<std::size_t>(m.layout.size), 0.);
    detail::write_integer(&block[1], m.masses);
    detail::write_integer(&block[2], m.twists);
    block[3] = m.options.step_size;

    Eigen::VectorXd wanted(m.masses);
    for (Eigen::Index j = 0; j < wanted.size(); ++j) {
        wanted(j) = m.description.masses[static_cast<std::size_t>(j)].initial_speed;
    }
    std::vector<int> locked;
    for (int k = 0; k < m.pairs; ++k) {
        if (m.structure.pairs[static_cast<std::size_t>(k)].initially_locked) locked.push_back(k);
    }
    const Eigen::VectorXd speeds = compatible_speeds(m, wanted, locked, false, {});
    std::copy(speeds.begin(), speeds.end(), block.data() + m.layout.speeds);
    double* twist = block.data() + m.layout.twists;
    for (const Elastic& shaft : m.structure.shafts) *twist++ = shaft.initial_twist;
    initialise(m, block.data(), Inputs(model).value, locked);
}

std::int64_t State::steps() const noexcept {
    return detail::read_integer(block.data());
}
double State::time() const noexcept {
    return static_cast<double>(steps()) * block[3];
}

std::span<const double> State::speeds() const noexcept {
    return {block.data() + detail::StateLayout::header,
            static_cast<std::size_t>(detail::read_integer(&block[1]))};
}
std::span<const double> State::twists() const noexcept {
    return {speeds().data() + speeds().size(), static_cast<std::size_t>(detail::read_integer(&block[2]))};
}

std::span<const std::byte> State::bytes() const noexcept {
    return std::as_bytes(std::span<const double>(block));
}

bool State::is_of(const Model& model) const noexcept {
    const ModelData& m = model.data();
    const double* const at = block.data();
    if (static_cast<int>(block.size()) != m.layout.size || detail::read_integer(at) < 0 ||
        detail::read_integer(at + 1) != m.masses || detail::read_integer(at + 2) != m.twists ||
        at[3] != m.options.step_size)
        return false;
    const auto* const contact = reinterpret_cast<const unsigned char*>(at + m.layout.contact);
    for (int k = 0; k < m.contact_bytes; ++k) {
        const unsigned char state = contact[k];
        if (k < m.pairs || k >= m.first_flank) {
            const int most = k < m.pairs ? int{detail::free_running} : int{detail::flank_backward};
            if (state > most) return false;
            continue;
        }
        const bool moving = (state & detail::moves) != 0;
        if (state > (detail::moves | detail::moves_backward | detail::driven) ||
            (!moving && state != detail::stuck))
            return false;
    }
    for (const int k : m.hydraulic_pairs) {
        const detail::PairLaw& law = m.pair_laws[static_cast<std::size_t>(k)];
        const double head = at[law.actuator + detail::head_slot];
        if (!(head >= 0 && head < law.delay_slots)) return false;
    }
    for (std::size_t e = 0; e < m.engines.size(); ++e) {
        const double mode = at[m.layout.engines + 3 * static_cast<int>(e)];
        if (!(mode >= 0 && mode <= static_cast<int>(EngineMode::cranking))) return false;
    }
    return true;
}

bool State::restore(const Model& model, std::span<const std::byte> bytes) {
    if (bytes.size() != block.size() * sizeof(double)) return false;
    State restored(*this);
    std::memcpy(restored.block.data(), bytes.data(), bytes.size());
    if (!restored.is_of(model)) return false;
    block.swap(restored.block);
    return true;
}

void start(const Model& model, State& state, const Start& start, const Inputs& inputs) {
    const ModelData& m = model.data();
    std::vector<int> locked;
    for (const std::string& name : start.locked) {
        const int pair = m.structure.pair(name);
        if (pair < 0)
            throw ModelError("start", name, "locked", "is no clutch, brake or freewheel of the model");
        locked.push_back(pair);
    }
    std::vector<std::pair<int, double>> pinned;
    for (const auto& [name, speed] : start.speeds) {
        const int mass = m.structure.mass(name);
        if (mass < 0) throw ModelError("start", name, "speeds", "is no mass of the model");
        pinned.emplace_back(mass, speed);
    }
    const Eigen::VectorXd rest = Eigen::VectorXd::Zero(m.masses);
    using Told = std::pair<int, double>;
    const auto first_missed = [&](const Eigen::VectorXd& speeds) {
        return std::find_if(pinned.begin(), pinned.end(), [&](const Told& told) {
            return std::fabs(speeds(told.first) - told.second) > 1e-9 * (1 + std::fabs(told.second));
        });
    };
    Eigen::VectorXd speeds = compatible_speeds(m, rest, locked, true, pinned);
    // A spring to the housing holds nothing rigidly: what is told moves it.
    if (first_missed(speeds) != pinned.end())
        speeds = compatible_speeds(m, rest, locked, true, pinned, false);
    if (const auto missed = first_missed(speeds); missed != pinned.end())
        throw ModelError("start", m.structure.mass_names[static_cast<std::size_t>(missed->first)], "speeds",
                         "contradicts the other speeds through gears and locked devices");
    std::fill(state.block.begin() + detail::StateLayout::header, state.block.end(), 0.);
    detail::write_integer(&state.block[0], 0);
    std::copy(speeds.begin(), speeds.end(), state.block.data() + m.layout.speeds);
    initialise(m, state.block.data(), inputs.value, locked);
}

void begin_account(const Model& model, State& state) noexcept {
    const ModelData& m = model.data();
    double* block = state.block.data();
    detail::write_integer(block, 0);
    std::fill(block + m.layout.distances, block + m.layout.auxiliary, 0.);
    std::fill(block + m.layout.heat, block + m.layout.temperatures, 0.);
    std::fill_n(block + m.layout.resting, m.meshes, 0.);  // told anew
    std::fill_n(block + m.layout.loops, m.pairs, 0.);
    double* energy = block + m.layout.energy;
    energy[0] = energy[1] = 0;
    energy[2] = detail::stored_energy(m, block + m.layout.speeds,
                                      reinterpret_cast<const unsigned char*>(block + m.layout.contact));
}

}  // namespace shiftrig::plant
