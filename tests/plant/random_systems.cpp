#include "tests/plant/random_systems.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/plant/random_builder.h"
#include "tests/plant/random_forests.h"

namespace shiftrig {
namespace {

using namespace plant;

class Builder : RandomBuilder {
  public:
    Builder(std::uint64_t seed, double seconds) : RandomBuilder(seed, seconds) {
        system_.description.name = "random " + std::to_string(seed);
    }

    RandomSystem build() {
        torque_level_ = dice_.logarithmic(5, 200);
        many_clutch_paths_ = dice_.chance(0.35);
        for (int i = dice_.integer(1, 3); i > 0; --i) instants_.push_back(instant());
        grow();
        close_loops();
        ground();
        drive();
        set_in_motion();
        system_.momentum_is_conserved = !grounded_ && d().gears.empty() && d().planetaries.empty();
        return finish();
    }

  private:
    std::string add_mass() {
        double j = dice_.logarithmic(0.03, 3);
        if (dice_.chance(0.08)) {
            j = dice_.logarithmic(1e-4, 1e-3);
            trait("light");
        } else if (dice_.chance(0.08)) {
            j = dice_.logarithmic(10, 100);
            trait("heavy");
        }
        d().masses.push_back({.name = name("m"), .inertia = j});
        return d().masses.back().name;
    }
    std::string any_mass() {
        return d()
            .masses[static_cast<std::size_t>(dice_.integer(0, static_cast<int>(d().masses.size()) - 1))]
            .name;
    }

    void add_shaft(const std::string& a, const std::string& b) {
        const double j = std::min(inertia(a), inertia(b));
        const bool stiff = dice_.chance(0.15);
        const double omega =
            2 * std::numbers::pi * (stiff ? dice_.logarithmic(200, 1500) : dice_.logarithmic(2, 100));
        const double damping_ratio = stiff ? dice_.logarithmic(0.05, 1) : dice_.logarithmic(0.003, 0.3);
        if (stiff) trait("stiff");
        Shaft shaft{.name = name("s"), .a = a, .b = b};
        shaft.stiffness = j * omega * omega;
        shaft.damping = 2 * damping_ratio * j * omega;
        shaft.initial_twist =
            dice_.chance(0.3) ? dice_.uniform(-0.5, 0.5) * torque_level_ / shaft.stiffness : 0;
        d().shafts.push_back(shaft);
    }

    // 0…1 over the run: always on, or jumps, ramps and waves that begin and end on whole milliseconds.
    Waveform engagement() {
        Waveform w;
        const double a = dice_.uniform(0.3, 1), b = dice_.uniform(0.3, 1);
        const double t1 = dice_.chance(0.7) ? instants_[static_cast<std::size_t>(
                                                  dice_.integer(0, static_cast<int>(instants_.size()) - 1))]
                                            : instant();
        const double t2 = t1 + 1e-3 * dice_.integer(2, 60);
        switch (dice_.integer(0, 6)) {
            case 0:
                w.pieces = {{.from = t1, .offset = a}};
                break;  // closes
            case 1:
                w.pieces = {{.until = t1, .offset = a}};
                break;  // opens
            case 2:
                w.pieces = {{.until = t1, .offset = a}, {.from = t2, .offset = b}};
                break;  // opens, closes
            case 3:
                w.pieces = {{.from = t1, .until = t2, .slope = a / (t2 - t1)}, {.from = t2, .offset = a}};
                break;
            case 4:
                w.pieces = {{.until = t1, .offset = a},
                            {.from = t1, .until = t2, .offset = a, .slope = -a / (t2 - t1)}};
                break;
            case 5:
                w.pieces = {{.until = t1, .offset = a}, {.from = t1, .offset = b}};
                break;  // steps
            default:
                w.pieces = {{.offset = 0.5 * a,
                             .amplitude = 0.5 * b,
                             .frequency = dice_.uniform(2, 15),
                             .phase_time = dice_.uniform(0, 0.1)}};
        }
        return w;
    }

    Clutch& add_clutch(const std::string& a, const std::string& b) {
        Clutch clutch;
        clutch.name = name(b.empty() ? "b" : "c");
        clutch.a = a;
        clutch.b = b;
        DryFriction law;
        law.sliding_capacity = torque_level_ * dice_.logarithmic(0.3, 5);
        // Where torque can take several closed ways at once, the instant of break-away would depend on how it
        // is split; with equal static and sliding capacity the motion does not.
        law.static_ratio = many_clutch_paths_ || dice_.chance(0.4) ? 1 : dice_.uniform(1, 1.4);
        const double lightest = b.empty() ? inertia(a) : std::min(inertia(a), inertia(b));
        if (dice_.chance(0.15)) {
            // Falling friction drives slip apart at the rate slope/J, which no step longer than its inverse resolves.
            law.falling = dice_.uniform(0.05, 0.3);
            law.falling_speed = std::max(1.0, law.sliding_capacity * law.falling / (lightest * 150));
            trait("falling");
        }
        clutch.friction = law;
        if (dice_.chance(0.25))
            clutch.actuation = ActuationConstant{};
        else
            clutch.actuation = ActuationDirect{.profile = engagement()};
        d().clutches.push_back(clutch);
        return d().clutches.back();
    }

    double efficiency(bool lossless) {
        if (lossless || dice_.chance(0.4)) return 1;
        trait("lossy");
        return dice_.chance(0.8) ? dice_.uniform(0.9, 0.995) : dice_.uniform(0.6, 0.9);
    }

    void add_gear(const std::string& a, const std::string& b, double ratio) {
        Gear gear;
        gear.name = name("g");
        gear.a = a;
        gear.b = b;
        gear.ratio = ratio;
        gear.efficiency = efficiency(lossy_ >= 4);
        if (gear.efficiency < 1 && dice_.chance(0.2)) {
            gear.bearing_torque = torque_level_ * dice_.logarithmic(0.003, 0.05);
            trait("bearing");
        }
        lossy_ += gear.efficiency < 1;
        d().gears.push_back(gear);
    }
    double ratio() { return dice_.logarithmic(0.4, 2.5) * (dice_.chance(0.2) ? -1 : 1); }

    void add_row() {
        Planetary row;
        row.name = name("r");
        std::string links[] = {any_mass(), add_mass(), add_mass()};
        for (int i = 2; i > 0; --i) std::swap(links[i], links[dice_.integer(0, i)]);
        row.sun = links[0];
        row.ring = links[1];
        row.carrier = links[2];
        row.ratio = -dice_.uniform(1.4, 3.5);
        row.efficiency = efficiency(lossy_ >= 4);
        lossy_ += row.efficiency < 1;
        d().planetaries.push_back(row);
        trait("row");
    }

    // Two clutches to two gears of different ratio on one output: any pair of gears of a powershift box.
    void add_powershift() {
        const std::string input = any_mass(), output = add_mass();
        for (int i = 0; i < 2; ++i) {
            const std::string pinion = add_mass();
            add_clutch(input, pinion);
            add_gear(pinion, output, dice_.logarithmic(0.5, 2));
        }
        trait("shift");
    }

    void grow() {
        add_mass();
        const auto target = static_cast<std::size_t>(dice_.integer(2, 8));
        const bool plain = dice_.chance(0.2);  // no gears: momentum can be checked
        while (d().masses.size() < target) {
            const double kind = plain ? dice_.uniform(0, 0.65) : dice_.uniform(0, 1);
            if (kind < 0.3) {
                const std::string a = any_mass();
                add_shaft(a, add_mass());
            } else if (kind < 0.65) {
                const std::string a = any_mass();
                add_clutch(a, add_mass());
            } else if (kind < 0.83) {
                const std::string a = any_mass();
                add_gear(a, add_mass(), ratio());
            } else if (kind < 0.92) {
                add_row();
            } else {
                add_powershift();
            }
        }
    }

    void close_loops() {
        if (d().masses.size() < 3) return;
        const auto pair = [this] {
            std::string a = any_mass(), b = any_mass();
            while (b == a) b = any_mass();
            return std::pair{a, b};
        };
        if (dice_.chance(0.25)) {
            const auto [a, b] = pair();
            add_shaft(a, b);
            trait("loop");
        }
        if (many_clutch_paths_) {
            const auto [a, b] = pair();
            add_clutch(a, b);
            trait("clutch-loop");
        }
        if (dice_.chance(0.2)) {
            const auto [a, b] = pair();
            d().dampers.push_back(
                {.name = name("k"), .a = a, .b = b, .damping = torque_level_ * dice_.logarithmic(1e-3, 0.1)});
        }
    }

    void ground() {
        if (dice_.chance(0.4)) return;
        grounded_ = true;
        const int brakes = many_clutch_paths_ ? dice_.integer(0, 2) : dice_.integer(0, 1);
        for (int i = 0; i < brakes; ++i) add_clutch(any_mass(), "");
        if (brakes > 0) trait("brake");
        if (dice_.chance(0.3))
            d().dampers.push_back({.name = name("k"),
                                   .a = any_mass(),
                                   .b = "",
                                   .damping = torque_level_ * dice_.logarithmic(1e-4, 0.01)});
    }

    void drive() {
        // A torque on a body that is both light and free would only race it.
        std::vector<std::string> solid;
        for (const auto& m : d().masses)
            if (m.inertia > 0.02) solid.push_back(m.name);
        if (solid.empty()) solid.push_back(d().masses[0].name);
        for (int i = dice_.integer(1, 3); i > 0; --i) {
            TorqueSource source;
            source.name = name("t");
            source.mass =
                solid[static_cast<std::size_t>(dice_.integer(0, static_cast<int>(solid.size()) - 1))];
            Waveform::Piece piece{.offset = torque_level_ * dice_.uniform(-1, 1)};
            if (dice_.chance(0.4)) {
                piece.amplitude = torque_level_ * dice_.uniform(0.2, 1);
                piece.frequency = dice_.logarithmic(1, 20);
            }
            if (dice_.chance(0.3)) piece.from = instants_[0];
            source.waveform.pieces = {piece};
            if (grounded_ && dice_.chance(0.3)) source.quadratic = torque_level_ * 1e-4 * dice_.uniform(0, 1);
            d().sources.push_back(source);
        }
    }

    // From rest in a quarter of the systems. Otherwise speeds that gears and rows allow and that turn the ends
    // of a shaft together, plus a swing whose shaft torques stay within a few times the machine's own: two
    // masses that meet a stiff shaft at 100 rad/s of difference are a crash, not a driveline.
    void set_in_motion() {
        if (dice_.chance(0.25)) {
            trait("rest");
            return;
        }
        const auto n = static_cast<Eigen::Index>(d().masses.size());
        const auto index = [this](const std::string& mass_name) {
            Eigen::Index i = 0;
            while (d().masses[static_cast<std::size_t>(i)].name != mass_name) ++i;
            return i;
        };
        Eigen::VectorXd motion(n), swing(n), root(n);
        for (Eigen::Index i = 0; i < n; ++i) {
            motion[i] = dice_.chance(0.2) ? 0 : dice_.uniform(-100, 100);
            swing[i] = dice_.uniform(-1, 1);
            root[i] = std::sqrt(d().masses[static_cast<std::size_t>(i)].inertia);
        }
        const auto rigid = static_cast<Eigen::Index>(d().gears.size() + d().planetaries.size());
        const auto shafts = static_cast<Eigen::Index>(d().shafts.size());
        Eigen::MatrixXd c = Eigen::MatrixXd::Zero(n, rigid + shafts);
        Eigen::Index column = 0;
        for (const auto& g : d().gears) {
            c(index(g.a), column) = 1;
            c(index(g.b), column++) = -g.ratio;
        }
        for (const auto& r : d().planetaries) {
            c(index(r.sun), column) = 1;
            c(index(r.ring), column) = -r.ratio;
            c(index(r.carrier), column++) = r.ratio - 1;
        }
        for (const auto& s : d().shafts) {
            c(index(s.a), column) = 1;
            c(index(s.b), column++) = -1;
        }
        const auto allowed = [&](const Eigen::VectorXd& omega, Eigen::Index columns) -> Eigen::VectorXd {
            if (columns == 0) return omega;
            const Eigen::MatrixXd scaled = root.cwiseInverse().asDiagonal() * c.leftCols(columns);
            const Eigen::VectorXd v = root.cwiseProduct(omega);
            const Eigen::VectorXd kept = v - scaled * scaled.completeOrthogonalDecomposition().solve(v);
            return root.cwiseInverse().cwiseProduct(kept);
        };
        motion = allowed(motion, rigid + shafts);
        swing = allowed(swing, rigid);
        double torque = 1e-9 * torque_level_;  // that the swing brings to the hardest shaft [Nm]
        for (Eigen::Index e = 0; e < shafts; ++e) {
            const auto& shaft = d().shafts[static_cast<std::size_t>(e)];
            const double j = std::min(inertia(shaft.a), inertia(shaft.b));
            torque = std::max(torque, std::abs(c.col(rigid + e).dot(swing)) *
                                          (std::sqrt(shaft.stiffness * j) + shaft.damping));
        }
        motion += swing * std::min(30.0, dice_.uniform(0, 3) * torque_level_ / torque);
        const double largest = motion.lpNorm<Eigen::Infinity>();
        if (largest > 300) motion *= 300 / largest;
        for (Eigen::Index i = 0; i < n; ++i)
            d().masses[static_cast<std::size_t>(i)].initial_speed = motion[i];
    }

    double torque_level_ = 0;
    bool many_clutch_paths_ = false, grounded_ = false;
    std::vector<double> instants_;
    int lossy_ = 0;
};

}  // namespace

RandomSystem random_system(std::uint64_t seed, double seconds) {
    return Builder(seed, seconds).build();
}

RandomSystem random_system_with_freewheels(std::uint64_t seed, double seconds) {
    RandomSystem system = random_system(seed, seconds);
    Dice dice(seed + 0x5eed);
    std::vector<Clutch> kept;
    for (const Clutch& c : system.description.clutches) {
        if (!dice.chance(0.6)) {
            kept.push_back(c);
            continue;
        }
        const double capacity = std::get<DryFriction>(c.friction).sliding_capacity;
        Freewheel f{.name = c.name, .a = c.a, .b = c.b};
        f.blocks = dice.chance(0.5) ? Sense::forward : Sense::backward;
        f.rated_torque = capacity * (dice.chance(0.3) ? 1 : 20);
        f.sliding_share = dice.chance(0.5) ? 1 : dice.uniform(0.6, 1);
        f.drag_torque = dice.chance(0.5) ? 0 : capacity * dice.logarithmic(1e-3, 0.1);
        system.description.freewheels.push_back(f);
    }
    system.description.clutches = kept;
    return system;
}

RandomSystem random_system_with_backlashes(std::uint64_t seed, double seconds) {
    RandomSystem system = random_system(seed, seconds);
    Dice dice(seed + 0x9a9);
    std::vector<Shaft> kept;
    double torque = 0;
    for (const TorqueSource& source : system.description.sources)
        torque = std::max(torque, std::abs(source.waveform.pieces[0].offset));
    for (const Shaft& shaft : system.description.shafts) {
        if (!dice.chance(0.7)) {
            kept.push_back(shaft);
            continue;
        }
        const double twist = torque / shaft.stiffness;  // that the machine's own torque gives
        Backlash b{.name = shaft.name, .a = shaft.a, .b = shaft.b};
        b.stiffness = shaft.stiffness;
        b.damping = dice.chance(0.3) ? 0 : shaft.damping;
        b.gap = twist * dice.logarithmic(0.03, 3);
        b.initial_twist = shaft.initial_twist;
        system.description.backlashes.push_back(b);
    }
    system.description.shafts = kept;
    return system;
}

RandomSystem random_system_with_friction_tables(std::uint64_t seed, double seconds) {
    RandomSystem system = random_system(seed, seconds);
    Dice dice(seed + 0x7ab1e);
    for (Clutch& c : system.description.clutches) {
        if (!dice.chance(0.7)) continue;
        auto& law = std::get<DryFriction>(c.friction);
        law.falling = 0;
        double slip = 0;
        law.factor_over_slip.emplace_back(0, dice.uniform(0.6, 1.2));
        for (int points = dice.integer(1, 3); points > 0; --points) {
            slip += dice.logarithmic(0.3, 30);
            law.factor_over_slip.emplace_back(slip, dice.uniform(0.5, 1.5));
        }
        slip += dice.logarithmic(3, 30);  // the last slope goes on: upwards
        law.factor_over_slip.emplace_back(slip, law.factor_over_slip.back().second + dice.uniform(0, 0.5));
    }
    return system;
}

RandomSystem random_system_of_brakes(std::uint64_t seed, double seconds) {
    Dice dice(seed + 0xb4a);
    RandomSystem system;
    Description& d = system.description;
    d.name = "brakes " + std::to_string(seed);
    const int masses = dice.integer(1, 5);
    const auto any = [&](int before) { return "m" + std::to_string(dice.integer(0, before - 1)); };
    const auto pair = [&](const std::string& name, const std::string& a, const std::string& b) {
        Clutch c;
        c.name = name;
        c.a = a;
        c.b = b;
        DryFriction friction;
        friction.sliding_capacity = dice.logarithmic(5, 60);
        friction.static_ratio = dice.chance(0.7) ? dice.uniform(1, 2) : 1;
        if (dice.chance(0.25)) {
            friction.falling = dice.uniform(0.1, 0.5);
            friction.falling_speed = dice.uniform(0.5, 5);
        }
        c.friction = friction;
        c.actuation = ActuationConstant{};
        if (dice.chance(0.3)) {  // lets go slowly
            const double from = dice.uniform(0.1, 0.4) * seconds, slope = -dice.uniform(0.4, 1.8) / seconds;
            c.actuation =
                ActuationDirect{{{{.until = from, .offset = 1},
                                  {.from = from, .until = from + 0.5 * seconds, .offset = 1, .slope = slope},
                                  {.from = from + 0.5 * seconds, .offset = 1 + 0.5 * seconds * slope}}}};
        }
        c.initially_locked = true;
        d.clutches.push_back(c);
    };
    for (int i = 0; i < masses; ++i) {
        const std::string here = "m" + std::to_string(i), number = std::to_string(i);
        d.masses.push_back({.name = here, .inertia = dice.logarithmic(0.01, 2)});
        if (i == 0) continue;
        if (dice.chance(0.2)) {
            pair("k" + number, any(i), here);
        } else if (i >= 2 && dice.chance(0.25)) {
            // Its other two links are free of one another, or it closes a loop of gears.
            d.planetaries.push_back({.name = "r" + number,
                                     .sun = here,
                                     .ring = "m" + std::to_string(i - 1),
                                     .carrier = "m" + std::to_string(i - 2),
                                     .ratio = -dice.uniform(1.5, 4),
                                     .efficiency = dice.chance(0.6) ? dice.uniform(0.85, 1) : 1});
        } else {
            Gear gear;
            gear.name = "g" + number;
            gear.a = any(i);
            gear.b = here;
            gear.ratio = dice.logarithmic(0.3, 4) * (dice.chance(0.5) ? 1 : -1);
            gear.efficiency = dice.chance(0.7) ? dice.uniform(0.7, 1) : 1;
            gear.bearing_torque = dice.chance(0.5) ? dice.uniform(0, 3) : 0;
            d.gears.push_back(gear);
        }
    }
    for (int k = dice.integer(1, 4); k > 0; --k) {
        const std::string a = any(masses), b = dice.chance(0.25) ? any(masses) : "";
        pair("B" + std::to_string(k), a, a == b ? "" : b);
    }
    for (int k = dice.integer(1, 3); k > 0; --k) {
        const double torque = dice.logarithmic(10, 200) * (dice.chance(0.5) ? 1 : -1);
        TorqueSource source;
        source.name = "t" + std::to_string(k);
        source.mass = any(masses);
        if (dice.chance(0.4))
            source.waveform = {{{.from = 0, .slope = torque / (0.5 * seconds)}}};
        else if (dice.chance(0.5))
            source.waveform = {{{.amplitude = torque, .frequency = dice.uniform(1, 12)}}};
        else
            source.waveform = {{{.offset = 0.3 * torque}}};
        d.sources.push_back(source);
    }
    system.traits = "n=" + std::to_string(masses);
    return system;
}

plant::Description mirrored(plant::Description d) {
    for (auto& mass : d.masses) mass.initial_speed = -mass.initial_speed;
    for (auto& shaft : d.shafts) shaft.initial_twist = -shaft.initial_twist;
    for (auto& play : d.backlashes) play.initial_twist = -play.initial_twist;
    for (auto& source : d.sources) {
        for (auto& piece : source.waveform.pieces) {
            piece.offset = -piece.offset;
            piece.slope = -piece.slope;
            piece.amplitude = -piece.amplitude;
        }
    }
    for (auto& freewheel : d.freewheels)
        freewheel.blocks =
            freewheel.blocks == plant::Sense::forward ? plant::Sense::backward : plant::Sense::forward;
    return d;
}

std::vector<reference::InputChange> mirrored(std::vector<reference::InputChange> inputs) {
    for (auto& change : inputs)
        if (change.input == "environment.grade") change.value = -change.value;
    return inputs;
}

plant::Description side_by_side(plant::Description a, const plant::Description& b) {
    const auto add = [](auto& to, const auto& from, const auto&... ends) {
        for (auto device : from) {
            device.name = "b." + device.name;
            for (auto end : {ends...}) {
                if (!(device.*end).empty()) device.*end = "b." + device.*end;
            }
            to.push_back(std::move(device));
        }
    };
    for (Mass mass : b.masses) {
        mass.name = "b." + mass.name;
        a.masses.push_back(std::move(mass));
    }
    add(a.shafts, b.shafts, &Shaft::a, &Shaft::b);
    add(a.dampers, b.dampers, &Damper::a, &Damper::b);
    add(a.clutches, b.clutches, &Clutch::a, &Clutch::b);
    add(a.gears, b.gears, &Gear::a, &Gear::b);
    add(a.planetaries, b.planetaries, &Planetary::sun, &Planetary::ring, &Planetary::carrier);
    add(a.sources, b.sources, &TorqueSource::mass);
    return a;
}

double impulse(const Waveform& waveform, double until) {
    double sum = 0;
    for (const auto& p : waveform.pieces) {
        const double a = std::max(0.0, p.from), b = std::min(until, p.until);
        if (b <= a) continue;
        sum += p.offset * (b - a);
        if (p.slope != 0) sum += p.slope * ((b - p.from) * (b - p.from) - (a - p.from) * (a - p.from)) / 2;
        if (p.amplitude != 0) {
            const double w = 2 * std::numbers::pi * p.frequency;
            sum += p.amplitude / w * (std::cos(w * (a - p.phase_time)) - std::cos(w * (b - p.phase_time)));
        }
    }
    return sum;
}

RandomSystem with_mounts(RandomSystem system, std::uint64_t seed) {
    plant::add_mounts(system.description, seed);
    system.momentum_is_conserved = false;
    return system;
}

}  // namespace shiftrig
