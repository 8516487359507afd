#include "plant/contact_table.h"

#include <algorithm>
#include <utility>

#include "plant/devices.h"
#include "plant/few.h"

namespace shiftrig::plant::detail {

ContactTable::ContactTable(const ModelData& m)
    : pressed(static_cast<std::size_t>(m.pairs)),
      contact(static_cast<std::size_t>(m.contact_bytes)),
      laden(static_cast<std::size_t>(m.pairs), 1) {
    const int pairs = whole_panels(m.pairs), meshes = whole_panels(m.meshes);
    numbers = aligned_doubles(static_cast<std::size_t>(m.law_rows + 2 * pairs + 3 * meshes) + loop_slack);
    double* at = numbers.data()->value;
    const auto take = [&at](int doubles) { return std::exchange(at, at + doubles); };
    sense = take(m.law_rows);
    drag = take(pairs);
    state_code = take(pairs);
    drive = take(meshes);
    drive_offset = take(meshes);
    direction = take(meshes);
}

namespace {

constexpr double state_codes[] = {0, 1, 1, 2};  // of PairState

}  // namespace

void doubt_table(Work& w) SHIFTRIG_REALTIME {
    ContactTable& table = w.operators.table;
    const double* const held = w.scratch.held.data();
    const unsigned char* const moves = w.scratch.moves.data();
    unsigned char* const laden = table.laden.data();
    bool same = table.viscosity == w.operators.oil.viscosity;
    for (int k = 0, count = w.model.actuated_pairs; k < count; ++k) {
        const auto now = static_cast<unsigned char>(held[k] != 0 || moves[k] != 0);
        same &= laden[k] == now;
        laden[k] = now;
    }
    table.known = table.known && same;
}

void tabulate_contact(Work& w, const Mode& mode) SHIFTRIG_REALTIME {
    ContactTable& table = w.operators.table;
    if (table.known && same_bytes(table.contact.data(), w.contact, table.contact.size())) return;
    const ModelData& m = w.model;
    table.known = true;
    table.viscosity = w.operators.oil.viscosity;
    std::copy(w.contact, w.contact + m.contact_bytes, table.contact.begin());
    table.pressed_count = 0;
    table.drags = false;
    for (int k = 0; k < m.pairs; ++k) {
        const unsigned char state = w.contact[k];
        const auto i = static_cast<std::size_t>(k);
        table.sense[k] = slip_sign(state);
        table.drag[k] = state == free_running ? m.pair_laws[i].drag * table.viscosity : 0;
        table.drags = table.drags || table.drag[k] != 0;
        table.state_code[k] = state_codes[state];
        if (state != locked && table.laden[i] != 0)
            table.pressed[static_cast<std::size_t>(table.pressed_count++)] = k;
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
