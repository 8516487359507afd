#include "tests/plant/random_vehicles.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "tests/plant/random_builder.h"

namespace shiftrig {
namespace {

using namespace plant;

enum class Manoeuvre { start, drive, coast, brake, roll_back, stand, spin, lug };
constexpr const char* manoeuvres[] = {"start",     "drive", "coast", "brake",
                                      "roll-back", "stand", "spin",  "lug"};

class Builder : RandomBuilder {
  public:
    Builder(std::uint64_t seed, double seconds) : RandomBuilder(seed + 0x7e41c1e, seconds) {
        d().name = "vehicle " + std::to_string(seed);
    }

    RandomSystem build() {
        manoeuvre_ = static_cast<Manoeuvre>(dice_.integer(0, 7));
        trait(manoeuvres[static_cast<int>(manoeuvre_)]);
        peak_ = dice_.logarithmic(80, 1300);
        rated_ = dice_.uniform(180, 320);
        body_mass_ = peak_ * dice_.logarithmic(5, 20);
        radius_ = dice_.uniform(0.3, 1);
        drive();
        launch();
        branch();
        gearbox();
        final_drive();
        wheels();
        resist();
        trail();
        damp();
        command();
        set_in_motion();
        auto& inputs = system_.inputs;
        std::stable_sort(inputs.begin(), inputs.end(),
                         [](const auto& a, const auto& b) { return a.time < b.time; });
        return finish();
    }

  private:
    void tell(double time, const std::string& input, double value) {
        system_.inputs.push_back({time, input, value});
    }
    void later(const std::string& input, double low, double high) {
        const double time = instant();
        tell(time, input, dice_.uniform(low, high));
    }

    // ---- the chain of masses from the engine on: `here_` is its end, turning `ratio_` times slower than the engine in the
    // gear it is in, under torques of about torque()

    double torque() const { return peak_ * std::abs(ratio_); }
    std::string mass(double inertia) {
        d().masses.push_back({.name = name("m"), .inertia = inertia});
        turns_.push_back(ratio_);
        return d().masses.back().name;
    }
    std::string drum() {
        const bool light = dice_.chance(0.2);
        if (light) trait("light");
        return mass(torque() * (light ? dice_.logarithmic(2e-6, 1e-5) : dice_.logarithmic(2e-5, 6e-4)));
    }

    void shaft(const std::string& a, const std::string& b) {
        const double j = std::min(inertia(a), inertia(b));
        const double omega = 2 * std::numbers::pi * dice_.logarithmic(4, 80);
        d().shafts.push_back({.name = name("s"),
                              .a = a,
                              .b = b,
                              .stiffness = j * omega * omega,
                              .damping = 2 * dice_.logarithmic(0.005, 0.3) * j * omega});
    }
    void maybe_shaft(double probability) {
        if (!dice_.chance(probability)) return;
        const std::string next = drum();
        shaft(here_, next);
        here_ = next;
    }

    // Closes, opens, stays or waves, beginning and ending on whole milliseconds.
    Waveform engagement(bool closed_first) {
        const double a = dice_.uniform(0.3, 1), t1 = instant(), t2 = t1 + 1e-3 * dice_.integer(5, 120);
        if (dice_.chance(0.15))
            return {{{.offset = 0.5 * a, .amplitude = 0.4 * a, .frequency = dice_.uniform(2, 15)}}};
        if (closed_first) {
            if (dice_.chance(0.5)) return {{{.until = t1, .offset = a}}};
            return {{{.until = t1, .offset = a},
                     {.from = t1, .until = t2, .offset = a, .slope = -a / (t2 - t1)}}};
        }
        if (dice_.chance(0.3)) return {{{.from = t1, .offset = a}}};
        return {{{.from = t1, .until = t2, .slope = a / (t2 - t1)}, {.from = t2, .offset = a}}};
    }

    DryFriction friction(double capacity, double lightest, bool may_hold_more) {
        DryFriction law;
        law.sliding_capacity = capacity;
        if (may_hold_more && dice_.chance(0.6)) law.static_ratio = dice_.uniform(1, 1.4);
        const double kind = dice_.uniform(0, 1);
        if (kind < 0.3) {  // Stribeck
            law.falling = dice_.uniform(0.05, 0.4);
            law.falling_speed =
                std::max(dice_.logarithmic(0.3, 20), capacity * law.falling / (lightest * 300));
            trait("stribeck");
        } else if (kind < 0.45) {
            double slip = 0;
            law.factor_over_slip.emplace_back(0, dice_.uniform(0.8, 1.1));
            for (int points = dice_.integer(1, 3); points > 0; --points) {
                slip += dice_.logarithmic(3, 50);
                law.factor_over_slip.emplace_back(slip, dice_.uniform(0.7, 1.2));
            }
            slip += 100;
            law.factor_over_slip.emplace_back(slip,
                                              law.factor_over_slip.back().second + dice_.uniform(0, 0.2));
            trait("table");
        }
        return law;
    }

    Clutch& clutch(const std::string& a, const std::string& b, double capacity) {
        Clutch c;
        c.name = name(b.empty() ? "b" : "c");
        c.a = a;
        c.b = b;
        const double lightest = b.empty() ? inertia(a) : std::min(inertia(a), inertia(b));
        c.friction = friction(capacity, lightest, !b.empty());
        c.actuation = ActuationConstant{};
        d().clutches.push_back(c);
        return d().clutches.back();
    }
    // By a waveform, or by a command through a lag.
    void actuate(Clutch& c, bool closed_first) {
        const double lag = dice_.chance(0.2) ? 0 : dice_.logarithmic(0.005, 0.2);
        const double now = dice_.uniform(0, 1), later = dice_.uniform(0, 1);
        const double kind = dice_.uniform(0, 1);
        if (kind < 0.6) {
            c.actuation = ActuationDirect{.profile = engagement(closed_first)};
        } else if (kind < 0.8) {
            c.actuation = ActuationRelease{.lag = lag};
            tell(0, "clutch." + c.name + ".release_command", closed_first ? 0 : now);
            tell(instant(), "clutch." + c.name + ".release_command", later);
            trait("release");
        } else {
            c.actuation = ActuationApply{.lag = lag};
            tell(0, "clutch." + c.name + ".application_command", closed_first ? 1 : now);
            tell(instant(), "clutch." + c.name + ".application_command", later);
            trait("apply");
        }
    }

    double efficiency() {
        if (lossy_ >= 4 || dice_.chance(0.35)) return 1;
        ++lossy_;
        return dice_.chance(0.85) ? dice_.uniform(0.92, 0.995) : dice_.uniform(0.7, 0.92);
    }
    void gear(const std::string& a, const std::string& b, double ratio) {
        Gear g;
        g.name = name("g");
        g.a = a;
        g.b = b;
        g.ratio = ratio;
        g.efficiency = efficiency();
        if (g.efficiency < 1 && dice_.chance(0.15))
            g.bearing_torque = torque() * dice_.logarithmic(0.002, 0.02);
        d().gears.push_back(g);
    }
    // From here on everything turns `ratio` times slower.
    void reduce(double ratio) { ratio_ *= ratio; }

    // ---- what it is made of

    void drive() {
        here_ = crank_ = mass(peak_ * dice_.logarithmic(8e-4, 5e-3));
        if (dice_.chance(0.35)) {
            TorqueSource motor;
            motor.name = "motor";
            motor.mass = crank_;
            Waveform::Piece piece{.offset = peak_ * dice_.uniform(-1, 1)};
            if (manoeuvre_ == Manoeuvre::coast) piece.offset *= 0.05;
            if (dice_.chance(0.4)) {
                piece.amplitude = peak_ * dice_.uniform(0.05, 0.6);
                piece.frequency = dice_.logarithmic(1, 30);
            }
            motor.waveform.pieces = {piece};
            if (dice_.chance(0.4)) motor.quadratic = peak_ * dice_.logarithmic(1e-7, 5e-6);
            d().sources.push_back(motor);
            trait("motor");
        } else {
            engine();
        }
        maybe_shaft(0.35);
    }

    void engine() {
        Engine e;
        e.name = "engine";
        e.mass = crank_;
        double speed = 0.3 * rated_;
        const double rise = dice_.uniform(0.4, 0.9), fall = dice_.uniform(0.5, 1);
        const int points = dice_.integer(3, 9);
        for (int i = 0; i < points; ++i) {
            const double x = static_cast<double>(i) / (points - 1);
            const double shape = x < 0.6 ? rise + (1 - rise) * x / 0.6 : 1 - (1 - fall) * (x - 0.6) / 0.4;
            e.full_load.emplace_back(speed, peak_ * shape);
            speed += 0.75 * rated_ / (points - 1) * dice_.uniform(0.7, 1.3);
        }
        e.governor_slope = peak_ / (rated_ * dice_.uniform(0.03, 0.2));
        e.low_idle = rated_ * dice_.uniform(0.33, 0.45);
        e.high_idle = rated_ * dice_.uniform(1, 1.15);
        e.friction_constant = peak_ * dice_.uniform(0.02, 0.1);
        e.friction_per_speed = peak_ * dice_.uniform(0, 6e-4);
        e.actuator_lag = dice_.chance(0.12) ? 0 : dice_.logarithmic(0.01, 0.15);
        if (dice_.chance(0.6)) {
            e.turbo_instant_fraction = dice_.uniform(0.4, 0.9);
            e.turbo_lag = dice_.logarithmic(0.05, 1);
        }
        if (dice_.chance(0.85)) {
            e.fade_from = 0.3 * rated_;
            e.fade_to = rated_ * dice_.uniform(0.18, 0.25);
            e.stall_speed = rated_ * dice_.uniform(0.12, 0.25);
        }
        d().engines = {e};
        system_.turns_round = false;
        tell(0, "driver.throttle", manoeuvre_ == Manoeuvre::coast ? 0 : dice_.uniform(0.2, 1));
        if (dice_.chance(0.4)) later("driver.throttle", 0, 1);
        if (dice_.chance(0.15)) tell(instant(), "engine.engine.fuel_cut", 1);
        if (dice_.chance(0.15)) later("engine.engine.torque_limit", 0.2, 0.9);
        if (dice_.chance(0.1)) {
            tell(0, "engine.engine.speed_request", rated_ * dice_.uniform(0.4, 1));
            tell(instant(), "engine.engine.speed_request_enable", 1);
        }
        if (dice_.chance(0.3)) tell(instant(), "engine.engine.start", 1);
    }

    void launch() {
        const double kind = dice_.uniform(0, 1);
        if (kind < 0.25) return;
        const std::string next = drum();
        const bool apart = manoeuvre_ == Manoeuvre::start || manoeuvre_ == Manoeuvre::roll_back ||
                           manoeuvre_ == Manoeuvre::stand || dice_.chance(0.3);
        if (kind < 0.65) {
            Clutch& c = clutch(here_, next, peak_ * dice_.logarithmic(0.4, 2.5));
            if (!dice_.chance(0.3)) actuate(c, !apart);
        } else {
            TorqueConverter c;
            c.name = "converter";
            c.pump = here_;
            c.turbine = next;
            const double k = rated_ * dice_.uniform(0.6, 1.1) / std::sqrt(peak_);
            for (const auto& [ratio, factor] : std::vector<std::pair<double, double>>{{0, 1},
                                                                                      {0.21, 1},
                                                                                      {0.44, 1.03},
                                                                                      {0.65, 1.08},
                                                                                      {0.79, 1.11},
                                                                                      {0.89, 1.14},
                                                                                      {0.93, 1.44},
                                                                                      {1, 1.88}})
                if (ratio == 0 || ratio == 1 || dice_.chance(0.8))
                    c.k_over_speed_ratio.emplace_back(ratio, k * factor * dice_.uniform(0.99, 1.01));
            const double coupling = dice_.uniform(0.8, 0.9), stall = dice_.uniform(1.6, 2.5);
            c.torque_ratio_over_speed_ratio = {{0, stall}, {coupling, 1}, {1, 1}};
            d().converters = {c};
            trait("converter");
            if (dice_.chance(0.5)) {
                actuate(clutch(here_, next, peak_ * dice_.logarithmic(0.3, 2)), !apart);
                trait("lock-up");
            }
        }
        split_ = apart;
        before_split_ = static_cast<int>(d().masses.size()) - 1;  // masses on the engine's side
        here_ = next;
    }

    void branch() {  // power take-off
        if (!dice_.chance(0.15)) return;
        const std::string load = drum();
        Clutch& c = clutch(here_, load, peak_ * dice_.logarithmic(0.1, 0.8));
        actuate(c, dice_.chance(0.5));
        d().sources.push_back({.name = "implement",
                               .mass = load,
                               .waveform = {{{.offset = 0}}},
                               .quadratic = peak_ * dice_.logarithmic(1e-7, 1e-5)});
        trait("branch");
    }

    void freewheel(const std::string& a, const std::string& b, double rated) {
        Freewheel f{.name = name("f"), .a = a, .b = b};
        f.blocks = dice_.chance(0.7) ? Sense::forward : Sense::backward;
        f.rated_torque = rated * dice_.logarithmic(1, 8);
        f.sliding_share = dice_.uniform(0.6, 1);
        f.drag_torque = dice_.chance(0.5) ? 0 : rated * dice_.logarithmic(1e-3, 0.05);
        d().freewheels.push_back(f);
        trait("freewheel");
    }

    void gearbox() {
        const double kind = dice_.uniform(0, 1);
        if (kind < 0.35) {
            const double first = dice_.logarithmic(0.8, 2.5);
            const std::string pinions[] = {drum(), drum()};
            for (int i = 0; i < 2; ++i) {
                if (i == 1 && dice_.chance(0.25))
                    freewheel(here_, pinions[i], torque());
                else
                    actuate(clutch(here_, pinions[i], torque() * dice_.logarithmic(0.4, 2.5)), i == 0);
            }
            reduce(first);
            const std::string output = drum();
            gear(pinions[0], output, first);
            gear(pinions[1], output, first * dice_.uniform(0.5, 0.95));
            here_ = output;
            trait("shift");
        } else if (kind < 0.55) {
            const double u = -dice_.uniform(1.5, 3.5);
            const std::string ring = drum(), sun = here_;
            const double force = torque();
            reduce(1 - u);
            const std::string carrier = drum();

            d().planetaries.push_back({.name = name("r"),
                                       .sun = sun,
                                       .ring = ring,
                                       .carrier = carrier,
                                       .ratio = u,
                                       .efficiency = efficiency()});
            actuate(clutch(ring, "", force * -u * dice_.logarithmic(0.4, 2.5)), true);
            if (dice_.chance(0.6))
                actuate(clutch(sun, ring, force * dice_.logarithmic(0.4, 2)), false);
            else if (dice_.chance(0.3))
                freewheel(ring, "", force * 3);
            here_ = carrier;
            trait("row");
        } else if (kind < 0.8) {
            const double ratio = dice_.logarithmic(0.6, 3) * (dice_.chance(0.2) ? -1 : 1);
            reduce(ratio);
            const std::string next = drum();
            gear(here_, next, ratio);
            here_ = next;
        }
    }

    void final_drive() {
        maybe_shaft(0.4);
        const double weight = body_mass_ * 9.80665;
        const double overall = dice_.uniform(0.1, 0.7) * weight * radius_ / peak_;
        const double ratio = overall / std::abs(ratio_) * (dice_.chance(0.3) ? -1 : 1);
        reduce(ratio);
        const std::string next = mass(body_mass_ * radius_ * radius_ * dice_.logarithmic(2e-4, 3e-3));
        gear(here_, next, ratio);
        here_ = next;
        if (dice_.chance(0.5)) {
            const std::string hub = mass(body_mass_ * radius_ * radius_ * dice_.logarithmic(1e-3, 1e-2));
            shaft(here_, hub);
            here_ = hub;
        }
    }

    void wheel(const std::string& hub, const std::string& body, double weight, double radius) {
        const std::string number = std::to_string(++wheels_);
        if (dice_.chance(0.12)) {
            Clutch contact;
            contact.name = "contact" + number;
            contact.a = hub;
            contact.b = body;
            contact.radius = radius;
            contact.friction = DryFriction{.sliding_capacity = weight * radius * dice_.uniform(0.3, 0.7),
                                           .static_ratio = dice_.uniform(1, 1.2),
                                           .factor_over_slip = {}};
            contact.actuation = ActuationConstant{};
            d().clutches.push_back(contact);
            trait("coulomb");
            return;
        }
        d().tyres.push_back({.name = "tyre" + number,
                             .wheel = hub,
                             .body = body,
                             .radius = radius,
                             .mobility_number = dice_.logarithmic(15, 100),
                             .relaxation_length = dice_.logarithmic(0.1, 0.8),
                             .slip_damping_time = dice_.chance(0.2) ? 0 : dice_.logarithmic(0.005, 0.1),
                             .weight = weight,
                             .rolling_coefficient = dice_.chance(0.2) ? 0 : dice_.uniform(0.01, 0.06)});
    }

    void brake(const std::string& hub, double weight) {
        if (manoeuvre_ != Manoeuvre::brake && !dice_.chance(0.2)) return;
        Clutch& b = clutch(hub, "", weight * radius_ * dice_.logarithmic(0.2, 1.2));
        if (dice_.chance(0.5)) {
            b.actuation = ActuationDirect{.profile = engagement(dice_.chance(0.5))};
        } else {
            b.actuation = ActuationApply{.lag = dice_.logarithmic(0.02, 0.2), .by_driver_brake = true};
            pedal_ = true;
        }
        trait("brake");
    }

    void wheels() {
        d().masses.push_back({.name = "body", .inertia = body_mass_, .motion = Motion::translating});
        const double weight = body_mass_ * d().gravity;
        const double kind = dice_.uniform(0, 1);
        if (kind < 0.5) {
            wheel(here_, "body", weight * dice_.uniform(0.5, 1), radius_);
            brake(here_, weight);
        } else if (kind < 0.85) {  // a differential, the two sides on different ground
            const auto hub = [this] {
                return mass(body_mass_ * radius_ * radius_ * dice_.logarithmic(2e-3, 2e-2));
            };
            const std::string left = hub(), right = hub();
            d().planetaries.push_back({.name = name("r"),
                                       .sun = left,
                                       .ring = right,
                                       .carrier = here_,
                                       .ratio = -1,
                                       .efficiency = efficiency()});
            for (const auto& side : {left, right}) {
                wheel(side, "body", weight * dice_.uniform(0.2, 0.5), radius_);
                brake(side, 0.5 * weight);
            }
            if (dice_.chance(0.25)) clutch(left, right, weight * radius_ * dice_.uniform(0.02, 0.2));
            trait("differential");
        } else {  // a second axle by a clutch, a little faster
            wheel(here_, "body", weight * 0.6, radius_);
            brake(here_, 0.6 * weight);
            const std::string drum = mass(body_mass_ * radius_ * radius_ * dice_.logarithmic(1e-3, 1e-2));
            const std::string front = mass(body_mass_ * radius_ * radius_ * dice_.logarithmic(1e-3, 1e-2));
            Clutch& c = clutch(here_, drum, weight * radius_ * dice_.logarithmic(0.05, 0.5));
            actuate(c, dice_.chance(0.5));
            const double ratio = dice_.uniform(0.6, 0.9);
            gear(drum, front, ratio);
            wheel(front, "body", weight * 0.4, radius_ * ratio * dice_.uniform(1, 1.04));
            trait("axles");
        }
        if (dice_.chance(0.15)) {  // and one that nothing drives
            const std::string hub = mass(body_mass_ * radius_ * radius_ * dice_.logarithmic(2e-3, 2e-2));
            wheel(hub, "body", weight * 0.3, radius_);
            brake(hub, 0.3 * weight);
            loose_ = hub;
        }
    }

    void resist() {
        if (dice_.chance(0.85)) {
            d().roads.push_back({.name = "road",
                                 .body = "body",
                                 .mass = body_mass_,
                                 .air_coefficient = dice_.chance(0.3) ? 0 : dice_.logarithmic(0.3, 20)});
            if (dice_.chance(0.6)) tell(0, "environment.grade", dice_.uniform(-0.2, 0.2));
            if (dice_.chance(0.2)) later("environment.grade", -0.3, 0.3);
        }
        if (dice_.chance(0.25)) {
            d().ploughs.push_back({.name = "plough",
                                   .body = "body",
                                   .soil_factor = 0.7,
                                   .a = dice_.uniform(100, 652),
                                   .b = dice_.chance(0.5) ? 0 : dice_.uniform(0, 20),
                                   .c = dice_.uniform(0, 8),
                                   .width = body_mass_ / 14000 * dice_.uniform(0.5, 4),
                                   .depth = dice_.uniform(0.1, 0.3)});
            tell(0, "environment.draft", dice_.chance(0.7) ? dice_.uniform(0.3, 1) : 0);
            if (dice_.chance(0.4)) later("environment.draft", 0, 1);
            trait("plough");
        }
        if (!d().tyres.empty() && dice_.chance(0.12))
            later("environment.mobility_number", 0.3 * d().tyres.front().mobility_number,
                  2 * d().tyres.front().mobility_number);
    }

    void trail() {
        if (!dice_.chance(0.12)) return;
        d().masses.push_back({.name = "trailer",
                              .inertia = body_mass_ * dice_.logarithmic(0.1, 2),
                              .motion = Motion::translating});
        shaft("body", "trailer");
        if (dice_.chance(0.5))
            d().roads.push_back(
                {.name = "behind", .body = "trailer", .mass = inertia("trailer"), .air_coefficient = 0});
        if (dice_.chance(0.5)) {
            Clutch& drag = clutch("trailer", "", inertia("trailer") * 9.80665 * dice_.uniform(0.02, 0.3));
            drag.friction =
                DryFriction{.sliding_capacity = std::get<DryFriction>(drag.friction).sliding_capacity,
                            .factor_over_slip = {}};
        }
        trait("trailer");
    }

    void damp() {
        if (dice_.chance(0.3))
            d().dampers.push_back({.name = "k1",
                                   .a = d().masses[static_cast<std::size_t>(dice_.integer(0, 1))].name,
                                   .b = "",
                                   .damping = peak_ * dice_.logarithmic(1e-5, 1e-3)});
        if (!d().shafts.empty() && dice_.chance(0.2))
            d().dampers.push_back({.name = "k2",
                                   .a = d().shafts.front().b,
                                   .b = d().shafts.front().a,
                                   .damping = peak_ * dice_.logarithmic(1e-4, 1e-2)});
    }

    void command() {
        if (!pedal_) return;
        tell(0, "driver.brake", dice_.chance(0.4) ? dice_.uniform(0, 1) : 0);
        later("driver.brake", 0.3, 1);
        if (dice_.chance(0.3)) tell(instant(), "driver.brake", 0);
    }

    // As gears, rows and untwisted shafts allow, nearest to what the manoeuvre asks for.
    void set_in_motion() {
        double engine = rated_ * dice_.uniform(0.45, 1), v = engine * radius_ / std::abs(ratio_);
        double rim = 1 + dice_.uniform(-0.02, 0.1);
        switch (manoeuvre_) {
            case Manoeuvre::start:
            case Manoeuvre::stand:
                v = 0;
                if (!split_) engine = 0;
                if (!split_ && !d().engines.empty())
                    engine = rated_ * 0.4, v = engine * radius_ / std::abs(ratio_);
                break;
            case Manoeuvre::brake:
                v = dice_.uniform(0.2, 4) * seconds_;
                if (!split_) engine = v * std::abs(ratio_) / radius_;
                break;
            case Manoeuvre::roll_back:
                v = -dice_.uniform(0.05, 2) * seconds_;
                if (!split_) engine = v * std::abs(ratio_) / radius_;
                break;
            case Manoeuvre::spin:
                rim = dice_.uniform(1.2, 3);
                v /= rim;
                break;
            case Manoeuvre::lug:
                engine = rated_ * dice_.uniform(0.2, 0.35);
                v = engine * radius_ / std::abs(ratio_);
                break;
            default:
                if (split_) v *= dice_.uniform(0.2, 1.2);
        }
        if (ratio_ < 0) v = -v;
        const auto n = static_cast<Eigen::Index>(d().masses.size());
        Eigen::VectorXd wanted(n);
        std::size_t rotating = 0;
        const double wheels = v * rim / radius_;
        for (Eigen::Index i = 0; i < n; ++i) {
            const Mass& m = d().masses[static_cast<std::size_t>(i)];
            if (m.motion == Motion::translating) {
                wanted[i] = v;
                continue;
            }
            const double turns = turns_[rotating++];
            wanted[i] = m.name == loose_              ? v / radius_
                        : split_ && i < before_split_ ? engine
                                                      : wheels * ratio_ / turns;
        }
        settle(wanted);
    }

    void settle(const Eigen::VectorXd& wanted) {
        const auto n = wanted.size();
        const auto index = [this](const std::string& mass_name) {
            Eigen::Index i = 0;
            while (d().masses[static_cast<std::size_t>(i)].name != mass_name) ++i;
            return i;
        };
        std::vector<Eigen::VectorXd> rows;
        const auto row = [&](std::initializer_list<std::pair<std::string, double>> links) {
            rows.emplace_back(Eigen::VectorXd::Zero(n));
            for (const auto& [mass_name, factor] : links) rows.back()[index(mass_name)] = factor;
        };
        for (const auto& g : d().gears) row({{g.a, 1}, {g.b, -g.ratio}});
        for (const auto& r : d().planetaries) row({{r.sun, 1}, {r.ring, -r.ratio}, {r.carrier, r.ratio - 1}});
        for (const auto& s : d().shafts) row({{s.a, 1}, {s.b, -1}});
        Eigen::MatrixXd c(static_cast<Eigen::Index>(rows.size()), n);
        for (std::size_t i = 0; i < rows.size(); ++i)
            c.row(static_cast<Eigen::Index>(i)) = rows[i].transpose();
        Eigen::VectorXd root(n);
        for (Eigen::Index i = 0; i < n; ++i)
            root[i] = std::sqrt(d().masses[static_cast<std::size_t>(i)].inertia);
        const Eigen::MatrixXd scaled = c * root.cwiseInverse().asDiagonal();
        Eigen::VectorXd speeds = wanted;
        for (int pass = 0; pass < 2; ++pass)  // the second for rounding
            speeds -= root.cwiseInverse().cwiseProduct(
                scaled.completeOrthogonalDecomposition().solve(Eigen::VectorXd(c * speeds)));
        for (Eigen::Index i = 0; i < n; ++i)
            d().masses[static_cast<std::size_t>(i)].initial_speed =
                std::abs(speeds[i]) < 1e-12 ? 0 : speeds[i];
    }

    Manoeuvre manoeuvre_{};
    double peak_ = 0, rated_ = 0, body_mass_ = 0, radius_ = 0;
    double ratio_ = 1;
    std::vector<double> turns_;  // ratio_ where each rotating mass stands
    std::string here_, crank_, loose_;
    int lossy_ = 0, wheels_ = 0, before_split_ = 0;
    bool split_ = false, pedal_ = false;
};

}  // namespace

RandomSystem random_vehicle(std::uint64_t seed, double seconds) {
    return Builder(seed, seconds).build();
}

}  // namespace shiftrig
