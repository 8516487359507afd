// The table of modes: bounded, least recently used goes. A mode is a pure function of model, step size and
// contact states, so forgetting one costs time, never bits.
#include <algorithm>
#include <utility>

#include "plant/few.h"
#include "plant/ledger.h"
#include "plant/modes.h"

namespace shiftrig::plant {
namespace detail {
namespace {

constexpr std::size_t memory_budget = std::size_t{96} << 20;  // [bytes]
constexpr int most_modes = 256, fewest_modes = 12;

// Of a mode's key, so that a look-up walks through numbers, not through keys.
std::uint64_t hash_of(const unsigned char* key, std::size_t bytes) {
    std::uint64_t hash = 0xcbf29ce484222325ull;  // FNV-1a
    for (std::size_t i = 0; i < bytes; ++i) hash = (hash ^ key[i]) * 0x100000001b3ull;
    return hash;
}

}  // namespace

OperatorsData::OperatorsData(const ModelData& m) {
    if (m.tree) {
        place_trees(m);
    } else {
        place_matrices(m);
    }
    const auto key_bytes = static_cast<std::size_t>(padded(m.contact_bytes));
    const auto rows = static_cast<std::size_t>(m.torques), states = static_cast<std::size_t>(m.states);
    const auto meshes = static_cast<std::size_t>(m.meshes);
    keys.assign(modes.size() * 2 * key_bytes, 0);
    const auto entries = static_cast<std::size_t>(m.tree ? 0 : SparseRates::most_entries(m.states));
    const auto sparse = static_cast<std::size_t>(m.tree ? 0 : SparseRates::integers(m.states));
    const std::size_t row_integers = rows + states + static_cast<std::size_t>(m.pairs) + sparse;
    row_memory.assign(modes.size() * row_integers, 0);
    link_memory.resize(modes.size() * rows);
    const std::size_t relations = meshes * static_cast<std::size_t>(m.tree ? 0 : m.contact_bytes);
    const std::size_t shares = static_cast<std::size_t>(whole_panels(m.meshes));  // zeros behind the last
    share_memory.assign(modes.size() * (shares + meshes) + loop_slack, 0.);
    relation_memory.assign(modes.size() * relations, 0);
    for (std::size_t i = 0; i < modes.size(); ++i) {
        modes[i].key = keys.data() + i * 2 * key_bytes;
        modes[i].bound = modes[i].key + key_bytes;
        modes[i].rows = row_memory.data() + i * row_integers;
        modes[i].coordinates = modes[i].rows + rows;
        modes[i].loop = modes[i].coordinates + states;
        SparseRates& rates = modes[i].sparse_rates;
        rates.column = modes[i].loop + m.pairs;
        rates.row = rates.column + entries;
        rates.row_begin = rates.row + entries;
        rates.column_begin = rates.row_begin + (sparse - 2 * entries) / 2;
        modes[i].row_links = link_memory.data() + i * rows;
        modes[i].loss_share = share_memory.data() + i * (shares + meshes);
        modes[i].family_mobility = modes[i].loss_share + shares;
        modes[i].relations = relation_memory.data() + i * relations;
    }
    wanted.assign(key_bytes, 0);
    recent_contact.assign(static_cast<std::size_t>(whole_words(m.contact_bytes)), 0);
    hashes.assign(modes.size(), 0);
    raw_input.assign(m.inputs.size(), 0.);
    input.assign(m.inputs.size(), 0.);
    commands.resize(static_cast<std::size_t>(m.pairs));
    rest_loads.assign(static_cast<std::size_t>(m.pairs), 0.);
    sensor_faults.resize(m.sensors.size());
    source_inputs.assign(m.sources.size(), 0.);
    soils.resize(m.tyres.size());
    engine_settings.resize(m.engines.size());
    grade_forces.assign(m.road_mass.size(), 0.);
    sample_memory = aligned_doubles(2 * sample_size(m));
    for (std::size_t i = 0; i < 2; ++i)
        place_sample(m, samples[i], sample_memory.data()->value + i * sample_size(m));
    carried_engines.assign(3 * m.engines.size(), 0.);
    hydraulics.resize(static_cast<std::size_t>(m.pairs));
    table = ContactTable(m);
}

void OperatorsData::place_matrices(const ModelData& m) {
    const ModeSizes sizes(m);
    const auto per_mode = static_cast<std::size_t>(sizes.doubles()) + std::size_t{8} * panel_rows;
    const auto affordable = static_cast<int>(memory_budget / (8 * per_mode + 1));
    modes.resize(static_cast<std::size_t>(std::clamp(affordable, fewest_modes, most_modes)));
    memory = aligned_doubles(modes.size() * per_mode);
    double* at = memory.data()->value;
    const auto levels = static_cast<std::size_t>(m.ledger_levels);
    level_operators.resize(modes.size() * levels);
    for (Mode& mode : modes) {
        mode.ledger_of_level =
            level_operators.data() + static_cast<std::size_t>(&mode - modes.data()) * levels;
        const auto take = [&at](int doubles) { return std::exchange(at, at + whole_panels(doubles)); };
        mode.basis = take(sizes.basis);
        mode.view = take(sizes.view);
        mode.mobility = take(sizes.mobility);
        mode.rates = take(sizes.rates);
        mode.torques = take(sizes.torques);
        mode.force_torques = take(sizes.force_torques);
        mode.balance = take(sizes.balance);
        mode.step_memory = take(sizes.operators);
        mode.ledger_memory = take(sizes.operators);
        for (std::size_t level = 0; level < levels; ++level)
            mode.ledger_of_level[level].from_begin = take(sizes.operators);
        mode.scaled_rates = take(sizes.scaled_rates);
        mode.energy_root = take(sizes.energy_root);
        mode.sparse_rates.value = take(sizes.sparse_rates);
    }
}

// A long chain keeps few modes: building one costs no more than a step.
void OperatorsData::place_trees(const ModelData& m) {
    modes.resize(fewest_modes);
    trees.resize(modes.size());
    const TreeSizes sizes = place_tree(m, trees.front(), {});
    memory = aligned_doubles(modes.size() * sizes.doubles);
    integers.assign(modes.size() * sizes.integers, 0);
    bytes.assign(modes.size() * sizes.bytes, 0);
    tree_masses.resize(modes.size() * sizes.masses);
    tree_forces.resize(modes.size() * sizes.forces);
    tree_edges.resize(modes.size() * sizes.edges);
    for (std::size_t i = 0; i < modes.size(); ++i) {
        place_tree(m, trees[i],
                   {memory.data()->value + i * sizes.doubles, integers.data() + i * sizes.integers,
                    bytes.data() + i * sizes.bytes, tree_masses.data() + i * sizes.masses,
                    tree_forces.data() + i * sizes.forces, tree_edges.data() + i * sizes.edges});
        modes[i].tree = &trees[i];
    }
}

Mode& find_mode(const ModelData& m, OperatorsData& o, const unsigned char* contact,
                ScratchData& scratch) SHIFTRIG_REALTIME {
    const auto found = [&](Mode& mode) -> Mode& {
        mode.last_use = ++o.clock;
        o.recent = &mode;
        if (contact != scratch.trial.data()) o.in_force = &mode;
        return mode;
    };
    if (o.recent && same_states(o.recent_contact.data(), contact, m.contact_bytes)) return found(*o.recent);
    copy_states(contact, m.contact_bytes, o.recent_contact.data());
    mode_key(m, contact, o.wanted.data());
    const std::size_t bytes = o.wanted.size();
    if (o.recent && same_bytes(o.recent->key, o.wanted.data(), bytes)) return found(*o.recent);
    const std::uint64_t hash = hash_of(o.wanted.data(), bytes);
    for (std::size_t i = 0; i < o.modes.size(); ++i) {
        Mode& mode = o.modes[i];
        if (o.hashes[i] != hash || mode.last_use == 0 || !same_bytes(mode.key, o.wanted.data(), bytes))
            continue;
        return found(mode);
    }
    Mode* oldest = &o.modes[&o.modes[0] == o.in_force ? 1 : 0];  // there are more than two
    for (Mode& mode : o.modes) {
        if (&mode != o.in_force && mode.last_use < oldest->last_use) oldest = &mode;
    }
    o.hashes[static_cast<std::size_t>(oldest - o.modes.data())] = hash;
    ++o.misses;
    std::copy(o.wanted.begin(), o.wanted.end(), oldest->key);
    if (m.tree) {
        build_tree_mode(m, *oldest);
        set_loss_shares(m, *oldest);
    } else {
        build_mode(m, *oldest, scratch.workspace, scratch.workspace_index.data());
        std::fill(oldest->family_mobility, oldest->family_mobility + m.meshes, -1.);
        oldest->step.length = 0;
    }
    list_row_links(m, *oldest);
    oldest->wedges = wedges(m, *oldest);
    return found(*oldest);
}

void make_ready(const ModelData& m, Mode& mode, ScratchData& scratch) SHIFTRIG_REALTIME {
    mode.step = build_step_operators(m, mode, m.options.step_size, mode.step_memory, scratch.workspace,
                                     scratch.workspace_index.data());
    build_ledger(m, mode, scratch.workspace, scratch.workspace_index.data());
}

void at_oil_temperature(const ModelData& m, OperatorsData& o, double temperature) SHIFTRIG_REALTIME {
    if (o.oil_known && o.oil_temperature == temperature) return;
    o.oil_temperature = temperature;
    o.oil_known = true;
    o.oil = m.description.oil ? oil_effects(*m.description.oil, temperature) : OilEffects{};
    for (int k = 0; k < m.pairs; ++k) {
        const auto i = static_cast<std::size_t>(k);
        const PairLaw& law = m.pair_laws[i];
        if (law.hydraulic) o.hydraulics[i] = hydraulic_operator(*law.hydraulic, o.oil, m.options.step_size);
    }
}

}  // namespace detail

Operators::Operators(const Model& model) : data_(std::make_unique<detail::OperatorsData>(model.data())) {}
Operators::~Operators() = default;
Operators::Operators(Operators&&) noexcept = default;
Operators& Operators::operator=(Operators&&) noexcept = default;

void Operators::drop() noexcept {
    for (detail::Mode& mode : data_->modes) mode.last_use = 0;
    data_->recent = nullptr;
    data_->in_force = nullptr;
    data_->oil_known = data_->inputs_known = data_->carried = data_->table.known = false;
}

}  // namespace shiftrig::plant
