#include "plant/contact_table.h"

#include <utility>

#include "plant/devices.h"
#include "plant/few.h"

namespace shiftrig::plant::detail {

ContactTable::ContactTable(const ModelData& m)
    : contact(static_cast<std::size_t>(whole_words(m.contact_bytes))) {
    const int pairs = whole_panels(m.pairs), meshes = whole_panels(m.meshes);
    numbers = aligned_doubles(static_cast<std::size_t>(m.law_rows + 5 * pairs + 3 * meshes) + loop_slack);
    double* at = numbers.data()->value;
    const auto take = [&at](int doubles) { return std::exchange(at, at + doubles); };
    sense = take(m.law_rows);
    drag = take(pairs);
    base = take(pairs);
    rise = take(pairs);
    inverse_speed = take(pairs);
    state_code = take(pairs);
    drive = take(meshes);
    drive_offset = take(meshes);
    direction = take(meshes);
}

namespace {

constexpr double state_codes[] = {0, 1, 1, 2};  // of PairState

}  // namespace

void tabulate_contact(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    const ModelData& m = w.model;
    ContactTable& table = w.operators.table;
    if (table.known && table.viscosity == w.operators.oil.viscosity &&
        same_states(table.contact.data(), w.contact, m.contact_bytes))
        return;
    table.known = true;
    table.viscosity = w.operators.oil.viscosity;
    copy_states(w.contact, m.contact_bytes, table.contact.data());
    table.fades = table.acts = false;
    for (int k = 0; k < m.pairs; ++k) {
        const unsigned char state = w.contact[k];
        const auto i = static_cast<std::size_t>(k);
        table.sense[k] = slip_sign(state);
        table.drag[k] = state == free_running ? m.pair_laws[i].drag * table.viscosity : 0;
        const FrictionLaw& friction = m.pair_laws[i].friction;
        const bool slides = state != locked, tabled = friction.factor_over_slip != nullptr;
        // One that runs free has no force: what it would pass is not asked for at every instant.
        const bool fades = slips(state) || (slides && k >= m.actuated_pairs);
        table.base[k] = tabled ? 0 : slides ? friction.base : m.sliding_at_rest[i];
        table.rise[k] = tabled || !fades ? 0 : friction.rise;
        table.inverse_speed[k] = friction.inverse_speed;
        table.acts = table.acts || (k < m.actuated_pairs && (table.sense[k] != 0 || table.drag[k] != 0));
        table.fades = table.fades || (k < m.actuated_pairs && table.rise[k] != 0);
        table.state_code[k] = state_codes[state];
    }
    for (int k = 0; k < m.meshes; ++k) {
        const unsigned char state = w.contact[m.pairs + k];
        const bool rests = state == stuck || mode.bound[m.pairs + k];
        const bool lossy = m.lossy[static_cast<std::size_t>(k)] != 0;
        const double sign = motion_sign(state), x = loss_exponent(state);
        const bool checked = lossy && !rests;
        table.drive[k] = checked ? sign * x : 0;
        table.drive_offset[k] = checked ? loss_kink(w, k, sign) * (sign * x) : 0;
        table.direction[k] = rests ? 0 : x;
        // A tree has no motions in its view.
        if (!mode.tree) table.sense[m.forces + k] = checked ? sign : 0;
    }
}

}  // namespace shiftrig::plant::detail
