#include "analysis/shifts.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <optional>
#include <variant>

namespace shiftrig::analysis {

namespace {

using Row = std::size_t;
using Names = std::vector<std::string>;

constexpr int no_gear = -1;

const plant::Clutch* clutch_of(const plant::Description& machine, const std::string& name) {
    for (const plant::Clutch& clutch : machine.clutches) {
        if (clutch.name == name) return &clutch;
    }
    return nullptr;
}

// The command that engages a clutch, and what of it counts as "commanded": for a hydraulic clutch the
// pressure at which its piston begins to move.
struct CommandSignal {
    std::string name;
    double threshold;
};
CommandSignal command_of(const plant::Clutch& clutch) {
    const std::string prefix = "clutch." + clutch.name;
    if (const auto* hydraulic = std::get_if<plant::ActuationHydraulic>(&clutch.actuation)) {
        const double begin = std::max(hydraulic->preload_pressure, 0.1e5);
        if (!hydraulic->solenoid) return {prefix + ".pressure_command", begin};
        double current = 0;
        for (const auto& [ampere, pascal] : hydraulic->solenoid->pressure_over_current) {
            if (pascal <= begin) current = ampere;
        }
        return {prefix + ".current_command", current};
    }
    if (std::holds_alternative<plant::ActuationApply>(clutch.actuation))
        return {prefix + ".application_command", 0.01};
    return {prefix + ".engagement", 0.01};
}

// One bit per clutch that selects gears.
using Clutches = std::bitset<plant::Description::most_selectors>;

// A gear with the columns its ratio is read from.
struct GearView {
    const Gear* gear;
    Clutches mask{};
    const std::vector<double>*in = nullptr, *out = nullptr;  // speeds, nullptr if not in the run
    struct Common {
        const std::vector<double>*slip, *speed;
    };
    std::vector<Common> common;
};

class Finder {
  public:
    Finder(const Run& run, const ShiftRules& rules)
        : run_(run), rules_(rules), rows_(run.time.size()), gears_(gears_of(run.machine)) {
        commanded_.resize(rows_);
        locked_.resize(rows_);
        for (const Gear& gear : gears_) views_.push_back(view_of(gear));
        lever_ = run.column("driver.lever");
    }

    std::vector<Shift> find() {
        for (Row i = 0; i < rows_; ++i) {
            follow_gear(i);
            const Clutches oncoming = newly_commanded(i) & ~mask(gear_) & ~locked_[i];
            if (oncoming.none()) continue;
            const int to = target(i, oncoming);
            if (to == no_gear || to == gear_) continue;
            shifts_.push_back(follow_shift(i, to));
            const Shift& shift = shifts_.back();
            i = shift.ended;
            if (shift.completed()) gear_ = last_gear_ = to;
            if (shift.end == ShiftEnd::overtaken) --i;  // the third gear's command begins the next one
        }
        for (std::size_t k = 0; k < shifts_.size(); ++k) {
            settle(shifts_[k], k + 1 < shifts_.size() ? &shifts_[k + 1] : nullptr);
        }
        return std::move(shifts_);
    }

  private:
    // ---- the clutches, row by row ----

    GearView view_of(const Gear& gear) {
        GearView view{.gear = &gear, .common = {}};
        for (const std::string& name : gear.selecting) view.mask |= bit_of(name);
        view.in = run_.column("mass." + gear.in + ".speed");
        view.out = run_.column("mass." + gear.out + ".speed");
        for (const std::string& name : gear.common) {
            const plant::Clutch* clutch = clutch_of(run_.machine, name);
            const auto* slip = run_.column("clutch." + name + ".slip");
            const auto* speed = clutch != nullptr ? run_.column("mass." + clutch->a + ".speed") : nullptr;
            if (slip != nullptr && speed != nullptr) view.common.push_back({slip, speed});
        }
        return view;
    }
    // The bit of a clutch; its columns are read when it is first asked for.
    Clutches bit_of(const std::string& name) {
        const auto place = std::find(selectors_.begin(), selectors_.end(), name);
        const auto number = static_cast<std::size_t>(place - selectors_.begin());
        const Clutches bit = Clutches{}.set(number);
        if (place != selectors_.end()) return bit;
        selectors_.push_back(name);
        const plant::Clutch* clutch = clutch_of(run_.machine, name);
        if (clutch == nullptr) return bit;
        const auto mark = [&](std::vector<Clutches>& rows, const std::vector<double>* column,
                              const auto& test) {
            for (Row i = 0; column != nullptr && i < rows_; ++i) {
                if (test((*column)[i])) rows[i] |= bit;
            }
            return column != nullptr;
        };
        const CommandSignal command = command_of(*clutch);
        mark(commanded_, run_.column(command.name), [&](double x) { return x > command.threshold; }) ||
            mark(commanded_, run_.column("clutch." + name + ".capacity"), [](double x) { return x > 0; });
        mark(locked_, run_.column("clutch." + name + ".state"), [](double x) { return x == 0; });
        return bit;
    }
    Clutches mask(int gear) const {
        return gear == no_gear ? Clutches{} : views_[static_cast<std::size_t>(gear)].mask;
    }
    Clutches newly_commanded(Row i) const {
        return i == 0 ? commanded_[i] : commanded_[i] & ~commanded_[i - 1];
    }

    // ---- which gear is in ----

    void follow_gear(Row i) {
        for (int gear = 0; gear < static_cast<int>(views_.size()); ++gear) {
            if (locked_[i] == mask(gear) && mask(gear).any()) gear_ = last_gear_ = gear;
        }
        // Neutral once no clutch is locked that makes a gear and the last gear's command is gone.
        if (gear_ != no_gear && locked_[i] != mask(gear_) && (commanded_[i] & mask(gear_)) != mask(gear_))
            gear_ = no_gear;
        if (gear_ != no_gear) last_in_gear_ = i;
    }

    // The gear whose clutches, and no others, come to be commanded; failing that the one that keeps most of
    // what is commanded now.
    int target(Row begun, Clutches oncoming) const {
        const double until = run_.time[begun] + rules_.launch_timeout;
        const auto leads_to = [&](int gear) { return gear != gear_ && (mask(gear) & oncoming).any(); };
        const int gears = static_cast<int>(views_.size());
        for (Row i = begun; i < rows_ && run_.time[i] <= until && (commanded_[i] & oncoming) == oncoming;
             ++i) {
            for (int gear = 0; gear < gears; ++gear) {
                if (leads_to(gear) && commanded_[i] == mask(gear)) return gear;
            }
        }
        int best = no_gear, most = -1;
        for (int gear = 0; gear < gears; ++gear) {
            const int kept = static_cast<int>((mask(gear) & commanded_[begun]).count());
            if (leads_to(gear) && kept > most) {
                most = kept;
                best = gear;
            }
        }
        return best;
    }

    // ---- one shift ----

    Shift follow_shift(Row begun, int to) const {
        Shift shift;
        shift.begun = begun;
        shift.asked = begun;
        const int from = origin(begun, to, shift.asked);
        shift.from = from == no_gear ? neutral : gears_[static_cast<std::size_t>(from)].name;
        shift.to = gears_[static_cast<std::size_t>(to)].name;
        shift.oncoming = names(mask(to) & ~mask(from));
        shift.offgoing = names(mask(from) & ~mask(to));
        shift.kind = kind_of(shift.asked, from, to);
        const bool launch = shift.kind == ShiftKind::launch || shift.kind == ShiftKind::shuttle;
        const double time_over =
            launch ? run_.time[begun] + rules_.launch_timeout : run_.time[shift.asked] + rules_.timeout;

        const auto finish = [&](ShiftEnd end, Row row) {
            shift.end = end;
            shift.ended = row;
            shift.asked_at = run_.time[shift.asked];
            shift.ended_at = run_.time[row];
            return shift;
        };
        const Clutches oncoming = mask(to) & ~mask(from), strangers = ~(mask(to) | mask(from));
        bool in_ratio = false;
        Row since = begun;
        for (Row i = begun; i < rows_; ++i) {
            const bool holds = ratio_holds(views_[static_cast<std::size_t>(to)], i);
            if (holds && !in_ratio) since = i;
            in_ratio = holds;
            if (in_ratio && (run_.time[i] - run_.time[since] >= rules_.hold || i + 1 == rows_)) {
                return finish(ShiftEnd::completed, since);
            }
            if (i > begun && (commanded_[i - 1] & ~commanded_[i] & oncoming).any())
                return finish(ShiftEnd::taken_back, i);
            if (i > begun && (newly_commanded(i) & strangers).any()) return finish(ShiftEnd::overtaken, i);
            if (run_.time[i] >= time_over && !in_ratio) return finish(ShiftEnd::timed_out, i);
        }
        return finish(ShiftEnd::run_ended, rows_ - 1);
    }

    // The gear a shift comes from, and the row in which the lever asked for it, if it did.
    int origin(Row begun, int to, Row& asked) const {
        const std::optional<Row> moved = last_lever_move(begun);
        const bool unanswered = moved && (shifts_.empty() || shifts_.back().begun < *moved);
        const auto before = [&](Row row) {
            return run_.time[begun] - run_.time[row] <= rules_.lever_lookback;
        };
        if (unanswered && before(*moved)) asked = *moved;
        if (gear_ != no_gear || last_gear_ == no_gear || last_gear_ == to) return gear_;
        // The driveline was opened on the way from one gear to the other (a shuttle, a change with a gap): the
        // lever asked for it, not for neutral, while the gear before was in.
        if (unanswered && *moved <= last_in_gear_ && (*lever_)[*moved] != 0) {
            asked = *moved;
            return last_gear_;
        }
        return before(last_in_gear_) ? last_gear_ : no_gear;
    }

    bool ratio_holds(const GearView& view, Row i) const {
        constexpr double standstill =
            0.5;  // [rad/s]; below it a ratio says nothing and the clutches have to be locked
        if (view.in != nullptr && view.out != nullptr && view.gear->ratio &&
            std::abs((*view.in)[i]) > standstill) {
            const double wanted = *view.gear->ratio * (*view.out)[i];
            if (std::abs((*view.in)[i] - wanted) > rules_.ratio_tolerance * std::abs(wanted)) return false;
        } else if (locked_[i] != view.mask) {
            return false;
        }
        return std::all_of(view.common.begin(), view.common.end(), [&](const GearView::Common& clutch) {
            const double speed = std::max(std::abs((*clutch.speed)[i]), standstill);
            return std::abs((*clutch.slip)[i]) <= rules_.ratio_tolerance * speed;
        });
    }

    ShiftKind kind_of(Row asked, int from, int to) const {
        if (from == no_gear) return ShiftKind::launch;
        const double before = gears_[static_cast<std::size_t>(from)].ratio.value_or(0);
        const double after = gears_[static_cast<std::size_t>(to)].ratio.value_or(0);
        if (before * after < 0) return ShiftKind::shuttle;
        const bool up = std::abs(after) < std::abs(before);
        if (engine_torque_before(asked) >= 0)
            return up ? ShiftKind::power_upshift : ShiftKind::power_downshift;
        return up ? ShiftKind::coast_upshift : ShiftKind::coast_downshift;
    }
    // Summed over all engines and 0.3 s: only its sign counts.
    double engine_torque_before(Row asked) const {
        double torque = 0;
        for (const plant::Engine& engine : run_.machine.engines) {
            const auto* column = run_.column("engine." + engine.name + ".torque");
            for (Row i = asked + 1; column != nullptr && i-- > 0 && run_.time[asked] - run_.time[i] <= 0.3;) {
                torque += (*column)[i];
            }
        }
        return torque;
    }

    Names names(Clutches clutches) const {
        Names list;
        for (std::size_t k = 0; k < selectors_.size(); ++k) {
            if (clutches[k]) list.push_back(selectors_[k]);
        }
        return list;
    }
    std::optional<Row> last_lever_move(Row until) const {
        for (Row i = until; lever_ != nullptr && i > 0; --i) {
            if ((*lever_)[i] != (*lever_)[i - 1]) return i;
        }
        return std::nullopt;
    }
    void settle(Shift& shift, const Shift* next) const {
        Row row = shift.ended;
        while (row + 1 < rows_ && run_.time[row + 1] <= shift.ended_at + rules_.settling) ++row;
        shift.settled = next != nullptr ? std::clamp(next->asked, shift.ended, row) : row;
    }

    const Run& run_;
    const ShiftRules& rules_;
    const std::size_t rows_;
    const std::vector<Gear> gears_;
    std::vector<GearView> views_;  // of gears_
    Names selectors_;              // by bit
    std::vector<Clutches> commanded_, locked_;
    const std::vector<double>* lever_ = nullptr;
    std::vector<Shift> shifts_;
    int gear_ = no_gear, last_gear_ = no_gear;  // in now (neutral: none), in before
    Row last_in_gear_ = 0;                      // last row with a gear in
};

}  // namespace

std::string_view name(ShiftKind kind) {
    switch (kind) {
        case ShiftKind::power_upshift:
            return "power upshift";
        case ShiftKind::power_downshift:
            return "power downshift";
        case ShiftKind::coast_upshift:
            return "coast upshift";
        case ShiftKind::coast_downshift:
            return "coast downshift";
        case ShiftKind::launch:
            return "launch";
        case ShiftKind::shuttle:
            return "shuttle";
    }
    return "";
}

std::string_view name(ShiftEnd end) {
    switch (end) {
        case ShiftEnd::completed:
            return "completed";
        case ShiftEnd::taken_back:
            return "taken back";
        case ShiftEnd::overtaken:
            return "overtaken by another shift";
        case ShiftEnd::timed_out:
            return "not completed in time";
        case ShiftEnd::run_ended:
            return "the run ended";
    }
    return "";
}

std::vector<Shift> find_shifts(const Run& run, const ShiftRules& rules) {
    if (run.time.empty() || run.machine.gear_paths.empty()) return {};
    return Finder(run, rules).find();
}

std::vector<std::string> scorecard_signals(const plant::Description& machine) {
    Names names{"driver.lever"};
    for (const plant::Clutch& clutch : machine.clutches) {
        names.push_back(command_of(clutch).name);
        for (const char* quantity :
             {"torque", "slip", "capacity", "state", "heat_power", "heat", "temperature"}) {
            names.push_back("clutch." + clutch.name + "." + quantity);
        }
    }
    for (const plant::Mass& mass : machine.masses) {
        names.push_back("mass." + mass.name + ".speed");
        if (mass.motion == plant::Motion::translating) names.push_back("body." + mass.name + ".acceleration");
    }
    for (const plant::Shaft& shaft : machine.shafts) names.push_back("shaft." + shaft.name + ".torque");
    for (const plant::Engine& engine : machine.engines) names.push_back("engine." + engine.name + ".torque");
    return names;
}

}  // namespace shiftrig::analysis
