#include "plant/samples.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "plant/few.h"
#include "plant/modes.h"
#include "plant/rest_problem.h"

namespace shiftrig::plant {
namespace detail {

std::size_t sample_size(const ModelData& m) {
    const auto translating = static_cast<int>(m.translating.size());
    const std::size_t doubles =
        static_cast<std::size_t>(whole_panels(m.seen) + whole_panels(m.torques + translating) +
                                 whole_panels(m.states_padded) + m.states + m.forces + 2 * m.auxiliary +
                                 m.pairs + 2 * whole_panels(m.pairs) + m.torques + loop_slack) +
        2 * m.tyres.size() + 2 * m.converters.size() + 2 * m.engines.size() +
        (m.tree ? group_state_size(m) : 0);
    return (doubles + panel_rows - 1) / panel_rows * panel_rows;
}

void place_sample(const ModelData& m, Sample& s, double* memory) {
    const auto take = [&memory](std::size_t doubles) { return std::exchange(memory, memory + doubles); };
    const auto pairs = static_cast<std::size_t>(m.pairs),
               padded_pairs = static_cast<std::size_t>(whole_panels(m.pairs)),
               auxiliary = static_cast<std::size_t>(m.auxiliary);
    if (m.tree) place_groups(m, s.groups, take(group_state_size(m)));
    s.slip =
        take(static_cast<std::size_t>(whole_panels(m.seen)));  // what products write begins on cache lines
    s.motion = s.slip + m.forces;
    s.turning = s.slip + m.law_rows;
    s.swing = s.turning + m.meshes;
    s.z = s.slip + m.power_rows;
    s.rate = take(static_cast<std::size_t>(whole_panels(m.states_padded)));
    s.f = take(static_cast<std::size_t>(m.columns)) + m.states;
    s.active =
        take(static_cast<std::size_t>(whole_panels(m.torques + static_cast<int>(m.translating.size()))));
    s.auxiliary = take(auxiliary);
    s.auxiliary_rate = take(auxiliary);
    s.load = take(pairs);
    s.sliding = take(padded_pairs);
    s.holding = take(padded_pairs);
    s.torque = take(static_cast<std::size_t>(m.torques));
    s.tyre_force = take(m.tyres.size());
    s.tyre_slip = take(m.tyres.size());
    s.converter = take(2 * m.converters.size());
    s.engine_torque = take(m.engines.size());
    s.engine_full_load = take(m.engines.size());
}

ScratchData::ScratchData(const ModelData& m) {
    const std::size_t size = sample_size(m);
    Sample* const samples[] = {&half, &late, &middle};
    buffer = aligned_doubles(size * std::size(samples));
    for (std::size_t i = 0; i < std::size(samples); ++i)
        place_sample(m, *samples[i], buffer.data()->value + i * size);
    loads.resize(static_cast<std::size_t>(m.pairs));
    held.assign(static_cast<std::size_t>(m.pairs) + loop_slack, 0.);
    for (auto* list : {&moving, &piston_pairs}) list->assign(static_cast<std::size_t>(m.pairs), 0);
    pistons.resize(static_cast<std::size_t>(m.pairs));
    piston_valves.resize(static_cast<std::size_t>(m.pairs));
    moves.assign(static_cast<std::size_t>(m.pairs), 0);
    engine_modes.resize(m.engines.size());
    const auto bytes = static_cast<std::size_t>(whole_words(m.contact_bytes));
    for (auto* list : {&before, &trial, &release, &changed, &violations, &found, &told})
        list->assign(bytes, 0);
    family.assign(bytes, 0);
    losses.resize(static_cast<std::size_t>(m.meshes));
    notes.resize(static_cast<std::size_t>(m.contact_bytes));
    noted.resize(static_cast<std::size_t>(m.contact_bytes));
    overcome.assign(static_cast<std::size_t>(m.pairs), 0);
    onward.assign(static_cast<std::size_t>(m.pairs), 0);
    eased.assign(static_cast<std::size_t>(m.pairs), 0);
    const auto longest = static_cast<std::size_t>(
        whole_panels(std::max({3 * m.states_padded, padded(m.torques), 3 * m.forces}) + m.states_padded +
                     m.columns + m.torques));
    vectors = aligned_doubles(3 * longest);
    vector_a = vectors.data()->value;
    vector_b = vector_a + longest;
    vector_c = vector_b + longest;
    torque_copy.assign(static_cast<std::size_t>(m.torques), 0.);
    works = aligned_doubles(static_cast<std::size_t>(m.forces) + loop_slack);
    work = works.data()->value;
    workspace_memory =
        aligned_doubles(m.tree ? tree_work_size(m) : static_cast<std::size_t>(workspace_doubles(m)));
    workspace = workspace_memory.data()->value;
    if (m.tree) place_tree_work(m, tree, workspace);
    standstill.assign(static_cast<std::size_t>(rest_workspace(m)), 0.);
    workspace_index.assign(static_cast<std::size_t>(workspace_integers(m)), 0);
    piece.assign(static_cast<std::size_t>(m.masses), 0);
    if (m.tree) return;
    for (auto* memory : {&operator_memory, &ledger_memory}) {
        *memory = aligned_doubles(static_cast<std::size_t>(ModeSizes(m).operators));
    }
    course_memory = aligned_doubles(static_cast<std::size_t>(5 * m.states_padded));
}

}  // namespace detail

Scratch::Scratch(const Model& model) : data_(std::make_unique<detail::ScratchData>(model.data())) {}
Scratch::~Scratch() = default;
Scratch::Scratch(Scratch&&) noexcept = default;
Scratch& Scratch::operator=(Scratch&&) noexcept = default;

void Scratch::fill_with_nan() noexcept {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    detail::ScratchData& s = *data_;
    for (auto* numbers : {&s.torque_copy, &s.held, &s.standstill}) {
        std::fill(numbers->begin(), numbers->end(), nan);
    }
    for (auto* lines : {&s.buffer, &s.vectors, &s.works, &s.workspace_memory, &s.operator_memory,
                        &s.ledger_memory, &s.course_memory}) {
        for (detail::CacheLine& line : *lines) std::fill(std::begin(line.value), std::end(line.value), nan);
    }
    for (detail::PairLoad& load : s.loads) {
        load.values = {nan, nan, nan};
        load.hydraulic.valve = {nan, nan, nan};
        load.hydraulic.full_until = load.hydraulic.filled_from = nan;
        load.hydraulic.spring_begin = load.hydraulic.spring_end = nan;
    }
    for (PistonCourse& c : s.pistons) c.piston = c.excess = c.rate = c.next = nan;
    for (ValveBefore& v : s.piston_valves) v.state.valve = v.state.slewed = v.targets.late = nan;
    s.dissipated = s.input_work = nan;
}

}  // namespace shiftrig::plant
