#include "plant/samples.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "plant/modes.h"

namespace shiftrig::plant {
namespace detail {

std::size_t sample_size(const ModelData& m) {
    const auto translating = static_cast<int>(m.translating.size());
    return static_cast<std::size_t>(padded(m.seen) + m.states + m.forces + padded(m.torques + translating) +
                                    4 + 2 * m.auxiliary + 3 * m.pairs + m.torques + m.states_padded) +
           2 * m.tyres.size() + 2 * m.converters.size() + m.engines.size();
}

void place_sample(const ModelData& m, Sample& s, double* memory) {
    const auto take = [&memory](std::size_t doubles) { return std::exchange(memory, memory + doubles); };
    const auto pairs = static_cast<std::size_t>(m.pairs), auxiliary = static_cast<std::size_t>(m.auxiliary);
    s.z = take(static_cast<std::size_t>(padded(m.seen)));
    s.slip = s.z + m.states;
    s.turning = s.slip + m.forces;
    s.swing = s.turning + m.meshes;
    s.f = take(static_cast<std::size_t>(m.states + m.forces)) + m.states;
    s.active = take(static_cast<std::size_t>(padded(m.torques + static_cast<int>(m.translating.size())) + 4));
    s.auxiliary = take(auxiliary);
    s.auxiliary_rate = take(auxiliary);
    s.load = take(pairs);
    s.sliding = take(pairs);
    s.holding = take(pairs);
    s.torque = take(static_cast<std::size_t>(m.torques));
    s.rate = take(static_cast<std::size_t>(m.states_padded));
    s.tyre_force = take(m.tyres.size());
    s.tyre_slip = take(m.tyres.size());
    s.converter = take(2 * m.converters.size());
    s.engine_torque = take(m.engines.size());
}

ScratchData::ScratchData(const ModelData& m) {
    const std::size_t size = sample_size(m);
    Sample* const samples[] = {&half, &late, &middle};
    buffer.assign(size * std::size(samples), 0.);
    for (std::size_t i = 0; i < std::size(samples); ++i)
        place_sample(m, *samples[i], buffer.data() + i * size);
    loads.resize(static_cast<std::size_t>(m.pairs));
    held.assign(static_cast<std::size_t>(m.pairs), 0.);
    moving.assign(static_cast<std::size_t>(m.pairs), 0);
    quiet.assign(static_cast<std::size_t>(m.pairs), 0);
    engine_modes.resize(m.engines.size());
    const auto bytes = static_cast<std::size_t>(m.contact_bytes);
    for (auto* list : {&before, &trial, &release, &changed, &violations}) list->assign(bytes, 0);
    family.assign(bytes, 0);
    overcome.assign(static_cast<std::size_t>(m.pairs), 0);
    const auto longest =
        static_cast<std::size_t>(std::max({3 * m.states_padded, padded(m.torques), 3 * m.forces}) +
                                 m.states_padded + m.columns + m.torques);
    for (auto* vector : {&vector_a, &vector_b, &vector_c}) vector->assign(longest, 0.);
    torque_copy.assign(static_cast<std::size_t>(m.torques), 0.);
    heat.assign(static_cast<std::size_t>(m.pairs), 0.);
    workspace.assign(static_cast<std::size_t>(m.tree ? TreeWork::doubles(m) : workspace_doubles(m)), 0.);
    if (m.tree) return;
    workspace_index.assign(static_cast<std::size_t>(workspace_integers(m)), 0);
    for (auto* memory : {&operator_memory, &ledger_memory}) {
        memory->assign(static_cast<std::size_t>(ModeSizes(m).operators), 0.);
    }
}

}  // namespace detail

Scratch::Scratch(const Model& model) : data_(std::make_unique<detail::ScratchData>(model.data())) {}
Scratch::~Scratch() = default;
Scratch::Scratch(Scratch&&) noexcept = default;
Scratch& Scratch::operator=(Scratch&&) noexcept = default;

void Scratch::fill_with_nan() noexcept {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    detail::ScratchData& s = *data_;
    for (auto* numbers : {&s.buffer, &s.vector_a, &s.vector_b, &s.vector_c, &s.torque_copy, &s.heat, &s.held,
                          &s.workspace, &s.operator_memory, &s.ledger_memory}) {
        std::fill(numbers->begin(), numbers->end(), nan);
    }
    for (detail::PairLoad& load : s.loads) {
        load.values = {nan, nan, nan};
        load.hydraulic.valve = {nan, nan, nan};
        load.hydraulic.filled_from = load.hydraulic.spring_begin = load.hydraulic.spring_end = nan;
        load.scale = nan;
    }
    s.dissipated = s.input_work = nan;
}

}  // namespace shiftrig::plant
