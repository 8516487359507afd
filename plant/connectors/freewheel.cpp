#include "plant/connectors/freewheel.h"

#include "plant/assembly.h"
#include "plant/check.h"
#include "plant/format.h"
#include "plant/model_builder.h"
#include "plant/shown.h"

namespace shiftrig::plant {

void check_parameters(const Check& check, const Freewheel& f) {
    check.positive("rated_torque", f.rated_torque);
    check.share("sliding_share", f.sliding_share);
    check.not_negative("drag_torque", f.drag_torque);
}

void assemble(Assembly& assembly, const Freewheel& f) {
    assembly.structure.pairs.push_back({.name = f.name,
                                        .kind = PairKind::self_acting,
                                        .links = assembly.between(f.a, f.b),
                                        .nominal_capacity = f.rated_torque});
}

void add_pair_law(detail::ModelBuilder& builder, const Freewheel& f) {
    const int pair = builder.pair(f.name);
    detail::PairLaw& law = builder.law(pair);
    law.source = detail::LoadSource::rated;
    law.full_load = f.rated_torque;
    law.friction.base = f.sliding_share;
    law.weak_sense = -blocked_sense(f);
    law.weak_factor = f.drag_torque / f.rated_torque;
    builder.model.one_way_pairs.push_back(pair);
}

void name_outputs(detail::ModelBuilder& builder, const std::vector<Freewheel>& freewheels) {
    for (const Freewheel& f : freewheels) {
        const std::string prefix = "freewheel." + f.name + ".";
        builder.output(prefix + "torque", builder.effort_unit(f.a), "torque on the first link");
        builder.output(prefix + "slip", builder.speed_unit(f.a), "slip speed, first link minus second");
        builder.output(prefix + "state", Unit::one, "0 locked, 1 overloaded, 2 overrunning");
        builder.output(prefix + "heat_power", Unit::watt, "power of drag or overload");
        builder.output(prefix + "heat", Unit::joule, "heat of drag and overload since start");
    }
}

double* show(const detail::Shown& at, const std::vector<Freewheel>& freewheels,
             double* next) SHIFTRIG_REALTIME {
    int pair = at.first_pair(freewheels);
    for (const Freewheel& f : freewheels) {
        const unsigned char state = at.work.contact[pair];
        const double torque = at.passed(pair), slip = at.slip(pair);
        *next++ = torque;
        *next++ = slip;
        *next++ = state == detail::locked ? 0. : detail::slip_sign(state) * blocked_sense(f) > 0 ? 1. : 2.;
        *next++ = state == detail::locked ? 0. : torque * slip;
        *next++ = at.heat(pair);
        ++pair;
    }
    return next;
}

// It locks and lets go by the sense of its torque, not by pressure.
std::string in_words(const Freewheel& f, const Event& event) {
    switch (event.kind) {
        case EventKind::break_away: {
            const char* const held = event.value == 0 ? ", where others hold it" : "";
            const bool overruns =
                event.value == 0 ? is_next_to_overrun(f, event.torque) : blocked_sense(f) * event.value < 0;
            if (!overruns)
                return format("slips overloaded: torque %.1f of the rated %.1f Nm%s", event.torque,
                              f.rated_torque, held);
            // It may follow others that go in this instant, and be loaded still.
            const bool loaded = f.drag_torque + blocked_sense(f) * event.torque > 1e-4 * f.rated_torque;
            return format("overruns: torque %s %.1f Nm, it passes on none beyond a drag of %.1f%s",
                          loaded ? "was" : "fell to", event.torque, f.drag_torque, held);
        }
        case EventKind::lock:
            return format("locks: slip %.3g, torque %.1f of %.1f Nm rated", event.slip, event.torque,
                          f.rated_torque);
        case EventKind::engage: {
            const double sense = event.slip != 0 ? event.slip : event.value;
            return format(blocked_sense(f) * sense < 0 ? "begins overrunning: slip %.3f rad/s"
                                                       : "begins slipping: slip %.3f rad/s",
                          event.slip);
        }
        case EventKind::reverse:
            return format(event.torque == 0 || blocked_sense(f) * event.torque < 0
                              ? "overruns: its slip turns, drag %.1f of %.1f Nm"
                              : "slips overloaded: its slip turns, torque %.1f of %.1f Nm sliding",
                          event.torque, event.capacity);
        default:
            return {};
    }
}

// It has to be pressed together: it does not pull.
const char* beyond_limit(const Freewheel& f, double torque, double tolerance) {
    if (freewheel_margin(f, torque) > -tolerance) return nullptr;
    return is_next_to_overrun(f, torque) ? "overruns" : "slips overloaded";
}

}  // namespace shiftrig::plant
