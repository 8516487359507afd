// Model, Operators, State, Inputs, Outputs and Scratch never mix: what may be dropped, copied or poisoned
// without changing a bit; and that stepping allocates nothing.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <new>

#include "io/model_file.h"
#include "plant/model_data.h"
#include "rig.h"

namespace {
thread_local long allocations = 0;
}

[[gnu::noinline]] void* operator new(std::size_t size) {
    ++allocations;
    if (void* memory = std::malloc(size)) return memory;
    throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
    ++allocations;
    return std::malloc(size);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
    std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
    std::free(memory);
}

namespace shiftrig::plant {
namespace {

Description tractor() {
    return io::read_model(SHIFTRIG_CONFIG "/tractor.yaml").description;
}

// A shift F2 → F3 under the plough, a lifted throttle, a stop with the brake: every kind of event.
struct Drive {
    explicit Drive(const BuildOptions& options = {1e-3, KernelKind::portable}) : rig(tractor(), options) {
        rig.in("driver.throttle") = 0.73;
        rig.in("environment.draft") = 1;
        rig.in("clutch.F2.pressure_command") = 18e5;
        start(rig.model, rig.state, {{"Fc", "F2"}, {{"engine", 188}}}, rig.inputs);
    }
    void step() {
        const auto n = rig.state.steps();
        if (n == 300) rig.in("clutch.F3.pressure_command") = 2e5;
        if (n == 450) rig.in("clutch.F3.pressure_command") = 11.5e5, rig.in("clutch.F2.pressure_command") = 0;
        if (n == 1000) rig.in("driver.throttle") = 0;
        if (n == 1200) rig.in("clutch.F3.pressure_command") = 0, rig.in("driver.brake") = 1;
        if (n == 1900) rig.in("environment.grade") = 0.15;
        rig.step();
    }
    Rig rig;
};
constexpr int drive_steps = 2500;

bool same(const Rig& a, const Rig& b) {
    return std::memcmp(a.state.bytes().data(), b.state.bytes().data(), a.state.bytes().size()) == 0 &&
           a.outputs.value.size() == b.outputs.value.size();
}
bool same_outputs(const Rig& a, const Rig& b) {
    for (std::size_t i = 0; i < a.outputs.value.size(); ++i) {
        if (a.model.outputs()[i].name == "certificate.mode_misses") continue;  // says what was rebuilt
        if (std::memcmp(&a.outputs.value[i], &b.outputs.value[i], sizeof(double)) != 0) return false;
    }
    const auto same = [](const Event& one, const Event& other) {
        return one.time == other.time && one.kind == other.kind && one.device == other.device &&
               one.torque == other.torque && one.capacity == other.capacity && one.slip == other.slip &&
               one.value == other.value && one.members == other.members;
    };
    const auto count = std::min(a.outputs.event_count, Outputs::event_capacity);
    return a.outputs.event_count == b.outputs.event_count &&
           std::equal(a.outputs.events.begin(), a.outputs.events.begin() + count, b.outputs.events.begin(),
                      same);
}

TEST(Roles, DroppedOperatorsAndPoisonedScratchChangeNoBit) {
    Drive plain, hard;
    for (int n = 0; n < drive_steps; ++n) {
        plain.step();
        if (n % 7 == 0) hard.rig.operators.drop();
        hard.rig.scratch.fill_with_nan();
        hard.step();
        ASSERT_TRUE(same(plain.rig, hard.rig)) << "step " << n;
        ASSERT_TRUE(same_outputs(plain.rig, hard.rig)) << "step " << n;
    }
    EXPECT_GT(plain.rig.times(EventKind::lock, "F3").size(), 0u);
    EXPECT_GT(plain.rig.times(EventKind::mesh_releases, "axle_drive").size(), 0u);
    EXPECT_EQ(plain.rig.fall_backs, 0);
}

TEST(Roles, ASnapshotContinuesBitForBitInAnotherMachine) {
    Drive first;
    for (int n = 0; n < 480; ++n) first.step();
    Drive second;
    ASSERT_TRUE(second.rig.state.restore(second.rig.model, first.rig.state.bytes()));
    second.rig.inputs = first.rig.inputs;
    for (int n = 480; n < drive_steps; ++n) {
        first.step();
        second.step();
        ASSERT_TRUE(same(first.rig, second.rig) && same_outputs(first.rig, second.rig)) << "step " << n;
    }
}

TEST(Roles, ASnapshotOfAnotherMachineIsRefused) {
    Drive drive;
    State& state = drive.rig.state;
    const Model& model = drive.rig.model;
    EXPECT_TRUE(state.is_of(model));
    const std::vector<std::byte> wrong(state.bytes().size() - 8);
    EXPECT_FALSE(state.restore(model, wrong));

    const std::vector<double> good = state.block;
    const auto& at = model.data().layout;
    const auto refuses = [&](int slot, double value) {
        std::vector<double> forged = good;
        forged[static_cast<std::size_t>(slot)] = value;
        return !state.restore(model, std::as_bytes(std::span<const double>(forged))) && state.block == good;
    };
    EXPECT_TRUE(refuses(1, 1e300));  // masses
    EXPECT_TRUE(refuses(3, 5e-4));   // step size
    EXPECT_TRUE(refuses(at.contact, 1e300));
    EXPECT_TRUE(refuses(at.engines, 7));
    for (const auto byte : std::to_array<unsigned char>({2, 4, 6, 8})) {  // of no mesh
        std::vector<double> forged = good;
        reinterpret_cast<unsigned char*>(forged.data() + at.contact)[model.data().pairs] = byte;
        EXPECT_FALSE(state.restore(model, std::as_bytes(std::span<const double>(forged)))) << int{byte};
    }
    EXPECT_FALSE(refuses(at.speeds, 100));
}

TEST(Roles, SteppingAllocatesNothing) {
    Drive drive;
    drive.rig.events.reserve(10000);
    std::string sink;
    long during = 0;
    for (int n = 0; n < drive_steps; ++n) {
        const long before = allocations;
        plant::step(drive.rig.model, drive.rig.operators, drive.rig.state, drive.rig.inputs,
                    drive.rig.outputs, drive.rig.scratch);
        during += allocations - before;
        if (n == 300) drive.rig.in("clutch.F3.pressure_command") = 2e5;
        if (n == 450)
            drive.rig.in("clutch.F3.pressure_command") = 11.5e5,
            drive.rig.in("clutch.F2.pressure_command") = 0;
        if (n == 1200) drive.rig.in("clutch.F3.pressure_command") = 0, drive.rig.in("driver.brake") = 1;
    }
    EXPECT_EQ(during, 0);
    const long before = allocations;
    observe(drive.rig.model, drive.rig.operators, drive.rig.state, drive.rig.inputs, drive.rig.outputs,
            drive.rig.scratch);
    EXPECT_EQ(allocations - before, 0);
}

TEST(Roles, ObservingChangesNothingAndShowsWhatTheStepEndedWith) {
    Drive drive;
    for (int n = 0; n < 200; ++n) drive.step();
    const std::vector<std::byte> before(drive.rig.state.bytes().begin(), drive.rig.state.bytes().end());
    const std::vector<double> values = drive.rig.outputs.value;
    observe(drive.rig.model, drive.rig.operators, drive.rig.state, drive.rig.inputs, drive.rig.outputs,
            drive.rig.scratch);
    EXPECT_EQ(std::memcmp(before.data(), drive.rig.state.bytes().data(), before.size()), 0);
    for (std::size_t i = 0; i < values.size(); ++i) {
        const std::string& name = drive.rig.model.outputs()[i].name;
        if (name.rfind("certificate.", 0) == 0) continue;
        EXPECT_NEAR(drive.rig.outputs.value[i], values[i], 1e-6 * (1 + std::fabs(values[i]))) << name;
    }
}

// In a look the brake goes first and the clutch follows it, in the step it is the other way round: that is what is told.
TEST(Roles, AStepAfterALookTellsNothingOfIt) {
    Description d;
    d.masses = {mass("a", 1), mass("b", 1)};
    d.clutches = {clutch("brake", "b", "", 50), clutch("clutch", "a", "b", 100)};
    for (Clutch& c : d.clutches) c.initially_locked = true;
    for (const char* name : {"a", "b"}) {
        TorqueSource& torque = d.sources.emplace_back();
        torque.name = torque.mass = name;
        torque.input = true;
    }
    Rig looked(d), fresh(d);
    looked.in("source.b.torque") = 500;
    observe(looked.model, looked.operators, looked.state, looked.inputs, looked.outputs, looked.scratch);
    for (Rig* rig : {&looked, &fresh}) {
        rig->in("source.a.torque") = 500;
        rig->in("source.b.torque") = -490;
        rig->step();
    }
    EXPECT_EQ(fresh.events.size(), 2u);
    EXPECT_TRUE(same(looked, fresh) && same_outputs(looked, fresh));
}

TEST(Kernels, AgreeWithThePortableOneToRounding) {
    for (const KernelKind kind : {KernelKind::avx2, KernelKind::avx512}) {
        try {
            Drive portable, other({1e-3, kind});
            for (int n = 0; n < drive_steps; ++n) {
                portable.step();
                other.step();
            }
            for (std::size_t j = 0; j < portable.rig.state.speeds().size(); ++j) {
                // Events branch on rounding, so errors may grow; engine speed is of the order of 100 rad/s.
                EXPECT_NEAR(portable.rig.state.speeds()[j], other.rig.state.speeds()[j], 1e-7);
            }
        } catch (const ModelError& error) {
            std::cout << error.what() << ": nothing to compare\n";
        }
    }
}

TEST(Ledger, ClosesInEveryStepOfAShiftAndAStop) {
    Drive drive;
    double worst = 0;
    for (int n = 0; n < drive_steps; ++n) {
        drive.step();
        worst = std::max(worst, std::fabs(drive.rig.outputs.certificate.energy_defect));
    }
    EXPECT_LT(worst, 0.2);  // [J] of tens of kilojoules
    EXPECT_LT(std::fabs(drive.rig.out("energy.defect")), 0.5);
    EXPECT_GT(drive.rig.out("energy.dissipated"), 1e5);
}

// Followers come from their coordinates in every step: one unit in the last place of the speeds, however long it runs
// (shiftrig_long_run takes 10⁸ steps).
void expect_no_drift(const Description& d, std::string_view engine) {
    Rig rig(d);
    EXPECT_EQ(rig.model.engine(), engine);
    double worst = 0;
    for (int n = 0; n < 1000000; ++n) {
        plant::step(rig.model, rig.operators, rig.state, rig.inputs, rig.outputs, rig.scratch);
        worst = std::max(worst, rig.outputs.certificate.constraint_violation);
    }
    EXPECT_LT(worst, 3 * 6e-14);
    EXPECT_GT(std::fabs(rig.state.speeds()[0]), 10);
}

Description locked_train() {
    Description d;
    d.name = "locked train";
    d.masses = {mass("engine", 2, 188), mass("pinion", 0.02), mass("sun", 0.1), mass("ring", 0.3),
                mass("out", 4)};
    Gear g;
    g.name = "g", g.a = "pinion", g.b = "sun", g.ratio = -1.37, g.efficiency = 0.97;
    d.gears = {g};
    d.clutches = {clutch("c", "engine", "pinion", 500)};
    d.sources = {source("engine", sine(40, 3)), source("out", constant(0))};
    return d;
}

TEST(Constraints, DoNotDriftInAMillionSteps) {
    Description d = locked_train();
    Planetary p;
    p.name = "p", p.sun = "sun", p.ring = "ring", p.carrier = "out", p.ratio = -2.4, p.efficiency = 0.97;
    d.planetaries = {p};
    d.clutches.push_back(clutch("b", "ring", "", 500));
    for (Clutch& c : d.clutches) c.initially_locked = true;
    expect_no_drift(d, "etd3");
}

TEST(Constraints, DoNotDriftInAMillionStepsAlongTheTree) {
    Description d = locked_train();
    d.method = Method::ark3;
    Gear g = d.gears[0];
    g.name = "f", g.a = "sun", g.b = "ring", g.ratio = 2.4;
    d.gears.push_back(g);
    d.clutches.push_back(clutch("b", "ring", "out", 500));
    for (Clutch& c : d.clutches) c.initially_locked = true;
    expect_no_drift(d, "ark3");
}

// An engine turns its pump; the vehicle stands, joined to them by nothing. Speeds are brought onto the gears all at once, and
// what stands is to stand exactly: at 1e-25 rad/s its tyre would slip by 1.
TEST(InitialSpeeds, LeaveWhatStandsAlone) {
    Description d;
    d.masses = {mass("engine", 2.6, 94.2477796),
                mass("pump", 0.255, 50.1317977),
                mass("axle", 5),
                mass("wheel", 550),
                {"body", 14000, Motion::translating, 0}};
    d.gears = {lossy_gear("pto", "engine", "pump", 1.88, 1, 0),
               lossy_gear("final", "axle", "wheel", 2.79, 1, 0)};
    d.tyres = {{.name = "tyre",
                .wheel = "wheel",
                .body = "body",
                .radius = 0.9,
                .mobility_number = 55,
                .relaxation_length = 0.6,
                .slip_damping_time = 0.05,
                .weight = 137293,
                .rolling_coefficient = 0.04}};
    Rig rig(d);
    EXPECT_EQ(rig.state.speeds()[2], 0);
    EXPECT_EQ(rig.state.speeds()[3], 0);
    rig.run(0.05);
    EXPECT_EQ(rig.out("mass.body.speed"), 0);
    EXPECT_EQ(rig.out("tyre.tyre.force"), 0);
    EXPECT_NEAR(rig.out("mass.pump.speed"), 94.2477796 / 1.88, 1e-6);
}

}  // namespace
}  // namespace shiftrig::plant
