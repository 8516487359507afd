#include "plant/samples.h"

#include <algorithm>
#include <limits>

#include "plant/modes.h"

namespace shiftrig::plant {
namespace detail {
namespace {

std::size_t sample_size(const ModelData& m) {
    return static_cast<std::size_t>(m.columns + 2 * m.auxiliary + 2 * m.pairs + m.torques + m.states_padded) +
           2 * m.tyres.size() + 2 * m.converters.size() + m.engines.size() + 16;
}

void place(const ModelData& m, Sample& s, double* memory) {
    s.z = memory;
    s.f = s.z + m.states_padded;
    s.auxiliary = s.z + m.columns;
    s.auxiliary_rate = s.auxiliary + m.auxiliary;
    s.sliding = s.auxiliary_rate + m.auxiliary;
    s.holding = s.sliding + m.pairs;
    s.torque = s.holding + m.pairs;
    s.rate = s.torque + m.torques;
    s.tyre_force = s.rate + m.states_padded;
    s.tyre_slip = s.tyre_force + m.tyres.size();
    s.converter = s.tyre_slip + m.tyres.size();
    s.engine_torque = s.converter + 2 * m.converters.size();
}

}  // namespace

ScratchData::ScratchData(const ModelData& m) {
    const std::size_t size = sample_size(m);
    Sample* const samples[] = {&begin, &half, &late, &end, &middle};
    buffer.assign(size * std::size(samples), 0.);
    for (std::size_t i = 0; i < std::size(samples); ++i) place(m, *samples[i], buffer.data() + i * size);
    input.assign(m.inputs.size(), 0.);
    loads.resize(static_cast<std::size_t>(m.pairs));
    soils.resize(m.tyres.size());
    engine_inputs.resize(m.engines.size());
    const auto bytes = static_cast<std::size_t>(m.contact_bytes);
    for (auto* list : {&before, &trial, &changed, &violations}) list->assign(bytes, 0);
    family.assign(bytes, 0);
    const auto longest = static_cast<std::size_t>(std::max({m.states_padded, padded(m.torques), 3 * m.forces}));
    for (auto* vector : {&vector_a, &vector_b, &vector_c}) vector->assign(longest, 0.);
    torque_copy.assign(static_cast<std::size_t>(m.torques), 0.);
    heat.assign(static_cast<std::size_t>(m.pairs), 0.);
    workspace.assign(static_cast<std::size_t>(m.tree ? TreeWork::doubles(m) : workspace_doubles(m)), 0.);
    if (m.tree) return;
    workspace_index.assign(static_cast<std::size_t>(workspace_integers(m)), 0);
    operator_memory.assign(static_cast<std::size_t>(ModeSizes(m).operators), 0.);
}

}  // namespace detail

Scratch::Scratch(const Model& model) : data_(std::make_unique<detail::ScratchData>(model.data())) {}
Scratch::~Scratch() = default;
Scratch::Scratch(Scratch&&) noexcept = default;

void Scratch::fill_with_nan() noexcept {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    detail::ScratchData& s = *data_;
    for (auto* numbers : {&s.buffer, &s.input, &s.vector_a, &s.vector_b, &s.vector_c, &s.torque_copy, &s.heat,
                          &s.workspace, &s.operator_memory}) {
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
