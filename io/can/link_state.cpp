// The changing part of a CanLink, for snapshots.
#include "io/can/link_data.h"

namespace shiftrig::io::can {

namespace {

void archive_report(Archive& a, MessageReport& r) {
    a(r.status, r.good, r.wrong_length, r.wrong_checksum, r.wrong_counter, r.implausible, r.missed,
      r.timeouts, r.limited, r.send_dropped);
}

}  // namespace

void CanLink::archive(Archive& a) {
    Data& d = *data_;
    for (ReceivedMessage& m : d.received) {
        archive_report(a, m.report);
        a(m.heard_ns, m.good_ns, m.bad_ns, m.seen_good, m.seen_bad, m.last_was_bad, m.was_overdue, m.counting,
          m.last_counter, m.expected);
    }
    for (SentMessage& m : d.sent) {
        archive_report(a, m.report);
        a(m.frame, m.due_ns, m.turn, m.next_counter, m.requested);
        for (Field& field : m.fields) a(field.travelled);
    }
    a(d.started_receiving, d.started_sending, d.valid, d.receive_start_ns, d.last_send_ns);
    a(d.hearing_commands, d.commands_gathered, d.commands_began_ns);
    if (d.network) d.network->archive(a);
    for (Condition& c : d.conditions) a(c.holds, c.since_ns);
    a(d.awaiting, d.pending, d.asked_before, d.question_counter, d.question_ns, d.command_arrived_ns);
}

}  // namespace shiftrig::io::can
