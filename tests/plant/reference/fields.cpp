#include "tests/plant/reference/fields.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <variant>

#include "tests/plant/reference/wet_plates.h"

namespace shiftrig::reference {
namespace {

using namespace plant;
using Unit = System::Unit;
using Table = std::vector<std::pair<double, double>>;

double value_of(const Table& table, double x) {  // level beyond its ends
    if (x <= table.front().first) return table.front().second;
    if (x >= table.back().first) return table.back().second;
    std::size_t right = 1;
    while (table[right].first < x) ++right;
    const auto& [x0, y0] = table[right - 1];
    const auto& [x1, y1] = table[right];
    return y0 + (y1 - y0) * (x - x0) / (x1 - x0);
}

double sign(double x) {
    return x < 0 ? -1 : x > 0 ? 1 : 0;
}

// ---- each law with what it needs to be told -------------------------------------------------------------

struct Tyre {
    BrixiusTyre p;
    int wheel, body, kappa;
    Told mobility;
    double share;

    struct Slip {
        double rate, effective;
    };
    Slip slip(const Vector& z) const {
        const double rim = z[wheel] * p.radius, v = z[body], sigma = p.relaxation_length;
        const double speed = std::max(std::abs(rim), std::abs(v));
        const double rate = (rim - v - speed * z[kappa]) / sigma;
        return {rate, z[kappa] + p.slip_damping_time * sigma / (sigma + p.slip_damping_time * speed) * rate};
    }
    double bn(When when) const { return share * mobility.at(when.inside); }
    double largest(When when) const { return 0.88 * (1 - std::exp(-0.1 * bn(when))) * p.weight; }
    double force(When when, const Vector& z) const {
        const double s = slip(z).effective;
        return largest(when) * (1 - std::exp(-7.5 * std::abs(s))) * sign(s);
    }
    double resistance(When when, const Vector& z) const {
        return (1 / bn(when) + 0.5 * std::abs(slip(z).effective) / std::sqrt(bn(when))) * p.weight;
    }
};

struct Motor {  // an engine
    Engine p;
    int mass, state;  // torque, boost, mode, cranked, start before
    Told throttle, start, request_enable, request, limit, cut;

    static constexpr double at_rest = 1e-9;  // no engine is turned backwards by rounding [rad/s]
    enum Mode { running, stalled, cranking };
    int mode(const Vector& z) const { return static_cast<int>(z[state + 2]); }
    double full(double w) const {
        if (w >= p.fade_from - (p.fade_from > 0 ? 0 : at_rest)) return value_of(p.full_load, w);
        if (w <= p.fade_to) return 0;
        return value_of(p.full_load, p.fade_from) * (w - p.fade_to) / (p.fade_from - p.fade_to);
    }
    double friction(double w) const { return p.friction_constant + p.friction_per_speed * std::abs(w); }
    double demand(When when, double w, double boost) const {
        if (cut.at(when.inside) > 0.5) return -friction(w);
        const double no_load = request_enable.at(when.inside) > 0.5
                                   ? request.at(when.inside)
                                   : p.low_idle + throttle.at(when.inside) * (p.high_idle - p.low_idle);
        double peak = 0;
        for (const auto& point : p.full_load) peak = std::max(peak, point.second);
        const double phi = p.turbo_instant_fraction;
        const double available = full(w) * (p.turbo_lag > 0 ? phi + (1 - phi) * boost : 1);
        return std::max(-friction(w), std::min({p.governor_slope * (no_load - w), available,
                                                limit.at(when.inside) * peak}));
    }
    double torque(When when, const Vector& z) const {
        if (mode(z) == stalled) return 0;
        if (mode(z) == cranking) return 0.5 * value_of(p.full_load, p.fade_from);
        return p.actuator_lag > 0 ? z[state] : demand(when, z[mass], z[state + 1]);
    }
    void rates(When when, const Vector& z, Eigen::Ref<Vector> rate) const {
        if (mode(z) != running) return;
        const double w = z[mass];
        if (p.actuator_lag > 0) rate[0] = (demand(when, w, z[state + 1]) - z[state]) / p.actuator_lag;
        if (p.turbo_lag > 0) {
            const double load = full(w) > 0 ? std::max(torque(when, z), 0.) / full(w) : 0;
            rate[1] = (std::min(load, 1.) - z[state + 1]) / p.turbo_lag;
        }
    }
    // As in steady running.
    void begin(Vector& z) const {
        const double w = z[mass];
        z[state + 2] = w < p.stall_speed - (p.stall_speed > 0 ? 0 : at_rest) ? stalled : running;
        if (mode(z) != running) return;
        const When now{0, 0};
        z[state] = demand(now, w, 1);
        z[state + 1] = full(w) > 0 ? std::clamp(z[state] / full(w), 0., 1.) : 0;
    }
    bool at_grid(When when, Vector& z) const {
        const int before = mode(z);
        int next = before;
        const double w = z[mass], asked = start.at(when.inside);
        if (before == running && w < p.stall_speed - at_rest) next = stalled;
        if (before == stalled) {
            z[state + 3] = 0;
            if (asked > 0.5 && z[state + 4] <= 0.5) next = cranking;
        }
        if (before == cranking) {
            z[state + 3] += 1e-3;
            next = w >= p.fade_from && w >= p.stall_speed ? running : z[state + 3] < 3 ? cranking : stalled;
        }
        z[state + 2] = next;
        z[state + 4] = asked;
        if (next != running) z[state] = z[state + 1] = 0;
        return next != before;
    }
};

struct Converter {
    TorqueConverter p;
    int pump, turbine;
    struct Torques {
        double pump, turbine;
    };
    Torques torques(const Vector& z) const {
        const double wp = z[pump], wt = z[turbine];
        if (wp == 0 && wt == 0) return {0, 0};
        const auto capacity = [this](double fast, double nu) {
            const double k = value_of(p.k_over_speed_ratio, nu);
            return fast * fast / (k * k) * std::min(1., (1 - nu) / 0.02);
        };
        if (std::abs(wp) >= std::abs(wt)) {
            const double nu = std::max(wt / wp, 0.);
            const double t = sign(wp) * capacity(wp, nu);
            return {t, value_of(p.torque_ratio_over_speed_ratio, nu) * t};
        }
        const double t = -sign(wt) * capacity(wt, std::max(wp / wt, 0.));
        const double against = std::max(-wp / wt, 0.);  // turned against one another
        return {t, t * (1 + (value_of(p.torque_ratio_over_speed_ratio, 0) - 1) * against)};
    }
};

struct Slope {  // a road
    int body;
    double weight, air;
    Told grade;
    double force(When when, const Vector& z) const {
        return -weight * std::sin(std::atan(grade.at(when.inside))) - air * z[body] * std::abs(z[body]);
    }
};

struct Draft {  // a plough
    Plough p;
    int body;
    Told share;
    double force(When when, const Vector& z) const {
        const double kmh = 3.6 * std::abs(z[body]);
        return share.at(when.inside) * p.soil_factor * (p.a + p.b * kmh + p.c * kmh * kmh) * p.width *
               (100 * p.depth);
    }
};

// Command 0…1 through a lag; its position is an extra state.
struct Lagged {
    double lag;
    int position;
    Told command;
    double at(When when, const Vector& z) const { return lag > 0 ? z[position] : command.at(when.inside); }
};

class Builder {
  public:
    Builder(const Description& d, const std::vector<InputChange>& inputs, double until)
        : d_(d), inputs_(inputs), until_(until), system_(plain(d)) {}

    System build() {
        next_ = system_.masses + system_.shafts;
        add_tyres();
        add_engines();
        add_actuators();
        add_wet_plates(
            system_, d_, [this](const std::string& input, double initial) { return told(input, initial); },
            until_);
        for (const auto& c : d_.converters)
            converters_.push_back({c, system_.mass(c.pump), system_.mass(c.turbine)});
        for (const auto& r : d_.roads)
            roads_.push_back(
                {system_.mass(r.body), r.mass * d_.gravity, r.air_coefficient, told("environment.grade", 0)});
        for (const auto& p : d_.ploughs)
            ploughs_.push_back({p, system_.mass(p.body), told("environment.draft", 0)});
        system_.extras = next_ - system_.masses - system_.shafts;
        add_resistances();
        close();
        show();
        return std::move(system_);
    }

  private:
    static bool is_lagged(const Clutch& c) {
        return std::holds_alternative<ActuationApply>(c.actuation) ||
               std::holds_alternative<ActuationRelease>(c.actuation);
    }
    static bool is_wet(const Clutch& c) { return std::holds_alternative<WetPlates>(c.friction); }
    // What System knows by itself. Lagged clutches keep their place among the pairs.
    static System plain(Description d) {
        d.engines.clear();
        d.tyres.clear();
        d.ploughs.clear();
        d.roads.clear();
        d.converters.clear();
        for (Clutch& c : d.clutches) {
            if (is_lagged(c) || is_wet(c)) c.actuation = ActuationConstant{};
            if (is_wet(c)) c.friction = DryFriction{.sliding_capacity = 1, .factor_over_slip = {}};
        }
        return System(d);
    }
    Told told(const std::string& input, double initial) {
        Told result{initial, {}};
        for (const auto& change : inputs_) {
            if (change.input != input) continue;
            result.changes.emplace_back(change.time, change.value);
            if (change.time > 0) system_.breaks.push_back(change.time);
        }
        return result;
    }
    void pair(const std::string& name, int mass, double nominal,
              const std::function<double(When, const Vector&)>& capacity) {
        Friction f;
        f.name = name;
        f.column = Vector::Unit(system_.masses, mass);
        f.nominal = nominal;
        f.sliding = [capacity](When when, const Vector& z, double) { return capacity(when, z); };
        f.holding = capacity;
        system_.frictions.push_back(f);
    }
    double inertia(int mass) const { return system_.inertia[mass]; }
    void answers(double rate) { system_.law_rate = std::max(system_.law_rate, rate); }

    void add_tyres() {
        for (const auto& t : d_.tyres) {
            Tyre tyre{.p = t,
                      .wheel = system_.mass(t.wheel),
                      .body = system_.mass(t.body),
                      .kappa = next_++,
                      .mobility = told("environment.mobility_number", d_.tyres.front().mobility_number),
                      .share = t.mobility_number / d_.tyres.front().mobility_number};
            const double mobility =
                t.radius * t.radius / inertia(tyre.wheel) + 1 / inertia(tyre.body);  // [1/kg]
            const double steepest = 7.5 * 0.88 * t.weight / t.relaxation_length;
            answers(std::sqrt(steepest * mobility));
            answers(steepest * t.slip_damping_time * mobility);
            if (t.rolling_coefficient > 0) {
                const double moment = t.rolling_coefficient * t.weight * t.radius;
                pair(t.name + ".rolling", tyre.wheel, moment,
                     [moment](When, const Vector&) { return moment; });
            }
            tyres_.push_back(std::move(tyre));
        }
    }
    void add_engines() {
        for (const auto& e : d_.engines) {
            const std::string prefix = "engine." + e.name + ".";
            const Motor motor{.p = e,
                              .mass = system_.mass(e.mass),
                              .state = std::exchange(next_, next_ + 5),
                              .throttle = told("driver.throttle", 0),
                              .start = told(prefix + "start", 0),
                              .request_enable = told(prefix + "speed_request_enable", 0),
                              .request = told(prefix + "speed_request", 0),
                              .limit = told(prefix + "torque_limit", 1),
                              .cut = told(prefix + "fuel_cut", 0)};
            const double slope = e.governor_slope / inertia(motor.mass);
            answers(e.actuator_lag > 0 ? std::sqrt(slope / e.actuator_lag) + 1 / e.actuator_lag : slope);
            if (e.turbo_lag > 0) answers(1 / e.turbo_lag);
            if (motor.friction(e.stall_speed) > 0) {
                pair(e.name + ".friction", motor.mass, motor.friction(e.stall_speed),
                     [motor](When, const Vector& z) {
                         return motor.mode(z) == Motor::stalled ? motor.friction(z[motor.mass]) : 0.;
                     });
            }
            motors_.push_back(motor);
        }
    }
    void add_actuators() {
        for (std::size_t i = 0; i < d_.clutches.size(); ++i) {
            const Clutch& c = d_.clutches[i];
            if (!is_lagged(c)) continue;
            const auto* release = std::get_if<ActuationRelease>(&c.actuation);
            const auto* apply = std::get_if<ActuationApply>(&c.actuation);
            const std::string input = release                  ? "clutch." + c.name + ".release_command"
                                      : apply->by_driver_brake ? "driver.brake"
                                                               : "clutch." + c.name + ".application_command";
            const Lagged actuator{.lag = release ? release->lag : apply->lag,
                                  .position = next_++,
                                  .command = told(input, release ? release->initial : apply->initial)};
            Friction& f = system_.frictions[i];
            const auto share = [actuator, closed_by_spring = release != nullptr](When when, const Vector& z) {
                const double y = actuator.at(when, z);
                return std::max(0., closed_by_spring ? 1 - y : y);
            };
            f.sliding = [share, full = f.sliding](When when, const Vector& z, double slip) {
                return share(when, z) * full(when, z, slip);
            };
            f.holding = [share, full = f.holding](When when, const Vector& z) {
                return share(when, z) * full(when, z);
            };
            if (actuator.lag > 0) answers(1 / actuator.lag);
            lagged_.push_back(actuator);
        }
    }
    // Whatever resists one body holds it at rest together.
    void add_resistances() {
        for (int body = 0; body < system_.masses; ++body) {
            std::vector<Tyre> rolls;
            std::vector<Draft> cuts;
            double nominal = 0;
            for (const auto& t : tyres_)
                if (t.body == body) {
                    rolls.push_back(t);
                    nominal += t.p.weight / t.p.mobility_number;
                }
            for (const auto& p : ploughs_)
                if (p.body == body) {
                    cuts.push_back(p);
                    nominal += p.p.soil_factor * p.p.a * p.p.width * 100 * p.p.depth;
                }
            if (nominal == 0) continue;
            pair(system_.mass_names[static_cast<std::size_t>(body)] + ".resistance", body, nominal,
                 [rolls, cuts](When when, const Vector& z) {
                     double sum = 0;
                     for (const auto& t : rolls) sum += t.resistance(when, z);
                     for (const auto& p : cuts) sum += p.force(when, z);
                     return sum;
                 });
        }
    }
    void close() {
        const int first = system_.masses + system_.shafts;
        for (const auto& c : converters_) {
            // T = (ω/K)²·50 (1 − ν) near synchronous speed.
            double k = 1e300, r = 1, fastest = 100;
            for (const auto& point : c.p.k_over_speed_ratio) k = std::min(k, point.second);
            for (const auto& point : c.p.torque_ratio_over_speed_ratio) r = std::max(r, point.second);
            for (const int side : {c.pump, c.turbine})
                fastest = std::max(fastest, 1.3 * std::abs(system_.start[side]));
            const double near = value_of(c.p.k_over_speed_ratio, 1);
            const double slope = fastest * std::max(50 / (near * near), 2 * r / (k * k));
            answers(slope / std::min(inertia(c.pump), inertia(c.turbine)));
        }
        system_.law = [=, tyres = tyres_, motors = motors_, converters = converters_, roads = roads_,
                       lagged = lagged_](When when, const Vector& z, Vector& force, Eigen::Ref<Vector> rate) {
            rate.setZero();
            for (const auto& t : tyres) {
                const double f = t.force(when, z);
                force[t.body] += f;
                force[t.wheel] -= f * t.p.radius;
                rate[t.kappa - first] = t.slip(z).rate;
            }
            for (const auto& m : motors) {
                force[m.mass] += m.torque(when, z);
                m.rates(when, z, rate.segment(m.state - first, 2));
            }
            for (const auto& c : converters) {
                const auto torques = c.torques(z);
                force[c.pump] -= torques.pump;
                force[c.turbine] += torques.turbine;
            }
            for (const auto& r : roads) force[r.body] += r.force(when, z);
            for (const auto& a : lagged)
                if (a.lag > 0) rate[a.position - first] = (a.command.at(when.inside) - z[a.position]) / a.lag;
        };
        system_.law_input = [motors = motors_, roads = roads_](When when, const Vector& z) {
            double power = 0;
            for (const auto& m : motors) power += m.torque(when, z) * z[m.mass];
            for (const auto& r : roads) power += r.force(when, z) * z[r.body];
            return power;
        };
        system_.at_grid = [motors = motors_](When when, Vector& z) {
            bool changed = false;
            for (const auto& m : motors) changed = m.at_grid(when, z) || changed;
            return changed;
        };
        system_.start.conservativeResizeLike(Vector::Zero(system_.size()));
        Vector& z = system_.start;
        for (const auto& t : tyres_) {
            const double rim = z[t.wheel] * t.p.radius, v = z[t.body];
            const double speed = std::max(std::abs(rim), std::abs(v));
            z[t.kappa] = speed > 0 ? (rim - v) / speed : 0;
        }
        for (const auto& m : motors_) m.begin(z);
        for (const auto& a : lagged_) z[a.position] = a.command.at(0);
        auto& breaks = system_.breaks;
        std::sort(breaks.begin(), breaks.end());
        breaks.erase(std::unique(breaks.begin(), breaks.end()), breaks.end());
    }
    void show() {
        const auto add = [this](const std::string& name, Unit unit, bool smooth, auto value) {
            system_.shown.push_back({name, unit, smooth, value});
        };
        for (const auto& t : tyres_) {
            const std::string name = "tyre." + t.p.name;
            add(name + ".force", Unit::newton, false,
                [t](When when, const Vector& z) { return t.force(when, z); });
            add(name + ".slip", Unit::slip, true, [t](When, const Vector& z) { return t.slip(z).effective; });
        }
        for (const auto& m : motors_)
            add("engine." + m.p.name + ".torque", Unit::newton_metre, false,
                [m](When when, const Vector& z) { return m.torque(when, z); });
        for (const auto& c : converters_) {
            const std::string name = "converter." + c.p.name;
            add(name + ".pump_torque", Unit::newton_metre, false,
                [c](When, const Vector& z) { return c.torques(z).pump; });
            add(name + ".turbine_torque", Unit::newton_metre, false,
                [c](When, const Vector& z) { return c.torques(z).turbine; });
        }
    }

    const Description& d_;
    const std::vector<InputChange>& inputs_;
    double until_;  // [s]
    System system_;
    int next_ = 0;
    std::vector<Tyre> tyres_;
    std::vector<Motor> motors_;
    std::vector<Converter> converters_;
    std::vector<Slope> roads_;
    std::vector<Draft> ploughs_;
    std::vector<Lagged> lagged_;
};

}  // namespace

System system_of(const Description& description, const std::vector<InputChange>& inputs, double until) {
    if (description.tyres.empty() && description.engines.empty() && description.converters.empty() &&
        description.roads.empty() && description.ploughs.empty() && inputs.empty())
        return System(description);
    return Builder(description, inputs, until).build();
}

}  // namespace shiftrig::reference
