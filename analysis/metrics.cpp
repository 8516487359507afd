// The metrics of one shift. With t_a the instant it was asked for, t_b begun, t_e ended, t_s settled
// (1 s after its end or when the next is asked for), ā the mean over the 0.3 s before t_a:
#include <algorithm>
#include <cmath>
#include <span>

#include "analysis/filter.h"
#include "analysis/scorecard.h"

namespace shiftrig::analysis {

namespace {

using Row = std::size_t;
using Values = std::vector<double>;
using Value = std::optional<double>;

constexpr double lead = 5;        // [s] of signal before t_a that lets the filters settle
constexpr double before = 0.3;    // [s] of the mean before t_a
constexpr double ride_band = 10;  // [Hz] of what the driver feels
constexpr double carries = 0.05;  // share of the torque before that counts as carrying torque

class Meter {
  public:
    Meter(const Run& run, const std::vector<Gear>& gears, const Shift& shift)
        : run_(run), gears_(gears), shift_(shift) {
        const auto n = static_cast<double>(run.time.size());
        interval_ = run.time.size() > 1 ? (run.time.back() - run.time.front()) / (n - 1) : 1e-3;
        const double t = run.time[shift.asked];
        first_ = row_at(t - lead);
        last_ = row_at(run.time[shift.settled] + 1);
        mean_from_ = row_at(t - before);
    }

    std::vector<Metric> all() {
        std::vector<Metric> list;
        const auto add = [&list](const char* metric, Value value, const std::string& clutch = {}) {
            list.push_back({metric, clutch, value, Verdict::told});
        };
        const Values* acceleration = body_acceleration();
        const Values ride = acceleration ? low_pass(stretch(*acceleration), interval_, ride_band) : Values{};
        add("duration_s", shift_.duration());
        add("peak_acceleration_change_m_s2", peak_change(ride));
        add("vdv_m_s1_75", acceleration ? vdv(*acceleration) : Value{});
        add("speed_dip_percent", speed_dip());
        for (const plant::Clutch& clutch : run_.machine.clutches) {
            if (!worth_telling(clutch.name)) continue;
            add("clutch_energy_j", rise("clutch." + clutch.name + ".heat"), clutch.name);
            add("clutch_peak_power_w", greatest("clutch." + clutch.name + ".heat_power"), clutch.name);
            add("clutch_temperature_degc", greatest("clutch." + clutch.name + ".temperature"), clutch.name);
        }
        add("torque_hole_percent", torque_hole());
        for (const plant::Clutch& clutch : run_.machine.clutches) {
            if (is_holding_pair(clutch)) add("slip_time_s", slip_time(clutch.name), clutch.name);
        }
        add("peak_jerk_m_s3", peak(derivative(ride, interval_)));
        add("fill_time_s", fill_time());
        add("torque_phase_s", torque_phase());
        add("inertia_phase_s", inertia_phase());
        add("flare_rad_s", flare());
        add("tie_up_torque_nm", tie_up_torque());
        return list;
    }

  private:
    // ---- windows ----

    Row row_at(double time) const {
        const auto place = std::lower_bound(run_.time.begin(), run_.time.end(), time - 1e-9);
        return std::min<Row>(static_cast<Row>(place - run_.time.begin()), run_.time.size() - 1);
    }
    // The rows that are filtered, from t_a − lead to t_s + 1 s; rows of the shift are offset by first_ in it.
    std::span<const double> stretch(const Values& x) const { return {x.data() + first_, last_ - first_ + 1}; }
    const Values* clutch(const std::string& name, const char* quantity) const {
        return run_.column("clutch." + name + "." + quantity);
    }
    template <class Test>
    double time_while(Row from, Row until, const Test& test) const {
        double sum = 0;
        for (Row i = from; i < until; ++i) {
            if (test(i)) sum += run_.time[i + 1] - run_.time[i];
        }
        return sum;
    }
    template <class Test>
    std::optional<Row> first_row(Row from, Row until, const Test& test) const {
        for (Row i = from; i <= until; ++i) {
            if (test(i)) return i;
        }
        return std::nullopt;
    }
    double mean_before(const Values& x) const {
        double sum = 0;
        for (Row i = mean_from_; i <= shift_.asked; ++i) sum += x[i];
        return sum / static_cast<double>(shift_.asked - mean_from_ + 1);
    }

    // ---- what the driver feels ----

    const Values* body_acceleration() const {
        for (const plant::Mass& mass : run_.machine.masses) {
            if (mass.motion != plant::Motion::translating) continue;
            if (const Values* x = run_.column("body." + mass.name + ".acceleration")) return x;
        }
        return nullptr;
    }
    const Values* body_speed() const {
        for (const plant::Mass& mass : run_.machine.masses) {
            if (mass.motion == plant::Motion::translating) return run_.column("mass." + mass.name + ".speed");
        }
        return nullptr;
    }
    // max |a − ā| over [t_a, t_s], a low-passed at 10 Hz.
    Value peak_change(const Values& ride) const {
        if (ride.empty()) return {};
        double mean = 0, result = 0;
        for (Row i = mean_from_; i <= shift_.asked; ++i) mean += ride[i - first_];
        mean /= static_cast<double>(shift_.asked - mean_from_ + 1);
        for (Row i = shift_.asked; i <= shift_.settled; ++i)
            result = std::max(result, std::abs(ride[i - first_] - mean));
        return result;
    }
    // max |ȧ| over [t_a, t_s].
    Value peak(const Values& jerk) const {
        if (jerk.empty()) return {};
        double result = 0;
        for (Row i = shift_.asked; i <= shift_.settled; ++i)
            result = std::max(result, std::abs(jerk[i - first_]));
        return result;
    }
    // (∫ a_w⁴ dt)^¼ over [t_a, t_s], a_w weighted with W_d.
    Value vdv(const Values& acceleration) const {
        const Values weighted = weight_horizontal(stretch(acceleration), interval_);
        const Row from = shift_.asked - first_, until = shift_.settled - first_;
        return vibration_dose(std::span(weighted).subspan(from, until - from + 1), interval_);
    }
    // (v̄ − min v)/v̄ over [t_a, t_s]; only where the vehicle was rolling.
    Value speed_dip() const {
        const Values* speed = body_speed();
        if (speed == nullptr || standing_start()) return {};
        const double mean = mean_before(*speed), sign = mean < 0 ? -1 : 1;
        if (std::abs(mean) < 0.1) return {};
        double least = std::abs(mean);
        for (Row i = shift_.asked; i <= shift_.settled; ++i) least = std::min(least, sign * (*speed)[i]);
        return 100 * (std::abs(mean) - least) / std::abs(mean);
    }
    bool standing_start() const {
        return shift_.kind == ShiftKind::launch || shift_.kind == ShiftKind::shuttle;
    }

    // ---- the driveline's torque ----

    // Of the shaft nearest to the output: the one that ends on the output mass.
    const Values* drive_torque() const {
        for (const plant::Shaft& shaft : run_.machine.shafts) {
            if (shaft.a == run_.machine.output_mass || shaft.b == run_.machine.output_mass) {
                return run_.column("shaft." + shaft.name + ".torque");
            }
        }
        return run_.machine.shafts.empty()
                   ? nullptr
                   : run_.column("shaft." + run_.machine.shafts.back().name + ".torque");
    }
    // (M̄ − min M)/M̄ over [t_a, t_e], M low-passed at 10 Hz; over 100 if the torque reversed.
    Value torque_hole() const {
        const Values* torque = drive_torque();
        const bool power =
            shift_.kind == ShiftKind::power_upshift || shift_.kind == ShiftKind::power_downshift;
        if (torque == nullptr || !power) return {};
        const Values felt = low_pass(stretch(*torque), interval_, ride_band);
        const double mean = mean_before(*torque), sign = mean < 0 ? -1 : 1;
        if (mean == 0) return {};
        double least = std::abs(mean);
        for (Row i = shift_.asked; i <= shift_.ended; ++i) least = std::min(least, sign * felt[i - first_]);
        return 100 * (std::abs(mean) - least) / std::abs(mean);
    }
    // What the offgoing clutch carries against the direction before the shift: the gears work against each other.
    // The greatest over [t_a, t_s], 0 if none.
    Value tie_up_torque() const {
        if (shift_.offgoing.empty() || standing_start()) return {};
        double result = 0;
        for (const std::string& name : shift_.offgoing) {
            const Values* torque = clutch(name, "torque");
            if (torque == nullptr) return {};
            const double sign = mean_before(*torque) < 0 ? -1 : 1;
            for (Row i = shift_.asked; i <= shift_.settled; ++i)
                result = std::max(result, -sign * (*torque)[i]);
        }
        return result;
    }

    // ---- phases ----

    // From the first command of an oncoming clutch to its kiss point: the first torque it could carry.
    Value fill_time() const {
        Value longest;
        for (const std::string& name : shift_.oncoming) {
            const Values* capacity = clutch(name, "capacity");
            if (capacity == nullptr) return {};
            const auto kiss =
                first_row(shift_.begun, shift_.settled, [&](Row i) { return (*capacity)[i] > 0; });
            if (!kiss) return {};
            longest = std::max(longest.value_or(0), run_.time[*kiss] - run_.time[shift_.begun]);
        }
        return longest;
    }
    // How long both the oncoming and the offgoing clutch carry more than 5 % of what the offgoing one carried before.
    Value torque_phase() const {
        if (shift_.oncoming.size() != 1 || shift_.offgoing.size() != 1) return {};
        const Values *on = clutch(shift_.oncoming[0], "torque"), *off = clutch(shift_.offgoing[0], "torque");
        if (on == nullptr || off == nullptr) return {};
        const double least = carries * std::abs(mean_before(*off));
        if (least == 0) return {};
        return time_while(shift_.asked, shift_.settled,
                          [&](Row i) { return std::abs((*on)[i]) > least && std::abs((*off)[i]) > least; });
    }
    // From where the offgoing clutches let the speeds leave the old ratio (what their slip makes of the input's speed
    // exceeds 2 % of it) to t_e.
    Value inertia_phase() const {
        if (!shift_.completed() || shift_.offgoing.empty()) return {};
        std::optional<Row> leaves;
        for (const std::string& name : shift_.offgoing) {
            const Values* slip = clutch(name, "slip");
            const Values* speed = input_speed();
            const Value per = slip_per_input(name);
            if (slip == nullptr || speed == nullptr || !per) return {};
            const auto row = first_row(shift_.asked, shift_.ended, [&](Row i) {
                return std::abs((*slip)[i] / *per) > 0.02 * std::max(std::abs((*speed)[i]), 0.5);
            });
            if (row) leaves = std::min(leaves.value_or(*row), *row);
        }
        if (!leaves) return 0.0;
        return run_.time[shift_.ended] - run_.time[*leaves];
    }
    // How far the input runs above both the old and the new gear's speed: over [t_a, t_e], the lesser of what the
    // slips of the offgoing and of the oncoming clutch make of it.
    Value flare() const {
        if (shift_.oncoming.size() != 1 || shift_.offgoing.size() != 1 || standing_start()) return {};
        const std::string &oncoming = shift_.oncoming[0], &offgoing = shift_.offgoing[0];
        const Values *on = clutch(oncoming, "slip"), *off = clutch(offgoing, "slip"), *speed = input_speed();
        const Value per_on = slip_per_input(oncoming), per_off = slip_per_input(offgoing);
        if (on == nullptr || off == nullptr || speed == nullptr || !per_on || !per_off) return {};
        const double sign = mean_before(*speed) < 0 ? -1 : 1;
        double result = 0;
        for (Row i = shift_.asked; i <= shift_.ended; ++i)
            result = std::max(result, std::min(sign * (*on)[i] / *per_on, sign * (*off)[i] / *per_off));
        return result;
    }

    // ---- the gears ----

    const Gear* gear(const std::string& name) const {
        for (const Gear& candidate : gears_) {
            if (candidate.name == name) return &candidate;
        }
        return nullptr;
    }
    // Of the gearbox.
    const Values* input_speed() const {
        const Gear* to = gear(shift_.to);
        return to == nullptr ? nullptr : run_.column("mass." + to->in + ".speed");
    }
    Value slip_per_input(const std::string& clutch) const {
        const Gear *from = gear(shift_.from), *to = gear(shift_.to);
        if (from == nullptr || to == nullptr) return {};
        const Value per = slip_per_input_speed(run_.machine, *from, *to, clutch);
        return per && *per != 0 ? per : Value{};
    }

    // ---- clutches ----

    // Pairs that are there to hold, not to select a gear or to brake: the main clutch, a Coulomb wheel contact.
    bool is_holding_pair(const plant::Clutch& pair) const {
        const auto& common = gears_.front().common;  // the same of every gear
        return pair.radius != 0 || std::find(common.begin(), common.end(), pair.name) != common.end();
    }
    // Clutches of this shift always; others only if they took heat in it, other than the drag of open plates.
    bool worth_telling(const std::string& name) const {
        const auto in = [&name](const std::vector<std::string>& list) {
            return std::find(list.begin(), list.end(), name) != list.end();
        };
        if (in(shift_.oncoming) || in(shift_.offgoing)) return true;
        const bool engaged = greatest("clutch." + name + ".capacity").value_or(1) > 0;
        return engaged && rise("clutch." + name + ".heat").value_or(0) > 1;
    }
    // x(t_s) − x(t_a).
    Value rise(const std::string& signal) const {
        const Values* x = run_.column(signal);
        if (x == nullptr) return {};
        return (*x)[shift_.settled] - (*x)[shift_.asked];
    }
    // max x over [t_a, t_s].
    Value greatest(const std::string& signal) const {
        const Values* x = run_.column(signal);
        if (x == nullptr) return {};
        const auto from = x->begin() + static_cast<std::ptrdiff_t>(shift_.asked);
        return *std::max_element(from, x->begin() + static_cast<std::ptrdiff_t>(shift_.settled) + 1);
    }
    // How long the pair slips in [t_a, t_s].
    Value slip_time(const std::string& name) const {
        const Values* state = clutch(name, "state");
        if (state == nullptr) return {};
        constexpr double slipping = 1;
        return time_while(shift_.asked, shift_.settled, [&](Row i) { return (*state)[i] == slipping; });
    }

    const Run& run_;
    const std::vector<Gear>& gears_;
    const Shift& shift_;
    double interval_ = 1e-3;  // [s]
    Row first_ = 0, last_ = 0, mean_from_ = 0;
};

}  // namespace

std::vector<Metric> measure(const Run& run, const std::vector<Gear>& gears, const Shift& shift) {
    return Meter(run, gears, shift).all();
}

}  // namespace shiftrig::analysis
