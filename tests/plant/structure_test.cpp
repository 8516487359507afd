// The order in which a structure holds its devices, whatever the order they came in.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "plant/assembly.h"
#include "tests/plant/machines.h"

namespace shiftrig::plant {
namespace {

using namespace machines;

template <typename Devices>
std::vector<std::string> names(const Devices& devices) {
    std::vector<std::string> list;
    for (const auto& device : devices) list.push_back(device.name);
    return list;
}

Description masses_only() {
    Description d;
    d.masses = {mass("1", 1), mass("2", 2), mass("3", 3), mass("4", 4)};
    return d;
}

// A kind behind backlashes in the list of connectors may be a shaft without play, one behind rows a gear.
TEST(Assembly, ShaftsWithoutPlayComeBeforeThoseWithIt) {
    const Description d = masses_only();
    Assembly assembly(d);
    assemble(assembly, Backlash{"spline", "1", "2", 100, 0, 0.02});
    assemble(assembly, shaft("late", "2", "3", 200, 0));
    assemble(assembly, Backlash{"dogs", "3", "4", 300, 0, 0.01});
    assemble(assembly, shaft("later", "1", "4", 400, 0));
    const Structure s = assembly.finish();
    EXPECT_EQ(names(s.shafts), (std::vector<std::string>{"late", "later", "spline", "dogs"}));
    EXPECT_EQ(s.shafts[0].stiffness, 200);
    EXPECT_EQ(s.shafts[0].links[1].mass, 2);
    EXPECT_EQ(s.shafts[2].gap, 0.02);
}

TEST(Assembly, PlanetaryRowsComeAfterAllOtherMeshes) {
    const Description d = masses_only();
    Assembly assembly(d);
    assemble(assembly, row("row1", "1", "2", "3", -2));
    assemble(assembly, gear("late", "1", "4", 3));
    assemble(assembly, row("row2", "2", "3", "4", -4));
    assemble(assembly, gear("later", "3", "4", 5));
    const Structure s = assembly.finish();
    EXPECT_EQ(names(s.meshes), (std::vector<std::string>{"late", "later", "row1", "row2"}));
    EXPECT_EQ(s.meshes[0].ratio, 3);
    EXPECT_EQ(s.meshes[2].carrier, 2);
}

TEST(Assembly, PairsOfOneKindStandSideBySide) {
    const Description d = masses_only();
    Assembly assembly(d);
    assemble(assembly, Freewheel{"sprag", "1", "", Sense::forward, 100, 1, 0});
    assemble(assembly, clutch("F", "1", "2"));
    assemble(assembly, Freewheel{"stator", "2", "", Sense::forward, 100, 1, 0});
    assemble(assembly, clutch("B", "3", ""));
    const Structure s = assembly.finish();
    EXPECT_EQ(names(s.pairs), (std::vector<std::string>{"F", "B", "sprag", "stator"}));
}

// Statics and modes share what is open by the same weights.
TEST(Structure, MeshesWeighTenMillionTimesTheHeaviestPair) {
    Structure s;
    EXPECT_EQ(s.mesh_weight(), 1e7);
    s.pairs.resize(2);
    s.pairs[0].nominal_capacity = 0.2;
    s.pairs[1].nominal_capacity = 0.5;
    EXPECT_EQ(s.mesh_weight(), 5e6);
}

// Loss lines of a gear: (1 − η) M + o where the first link drives, (1 − 1/η') M + o' where it is driven.
TEST(Mesh, LossLinesCrossWhereBothDirectionsAgree) {
    Mesh mesh;
    mesh.ratio = 2;
    EXPECT_EQ(mesh.loss_kink(), 0);
    mesh.forward_efficiency = 0.9;
    mesh.backward_efficiency = 0.8;
    mesh.forward_bearing = 3;
    mesh.backward_bearing = 1;
    const double kink = mesh.loss_kink();
    EXPECT_NEAR((1 - 0.9) * kink + 3, (1 - 1 / 0.8) * kink + 1, 1e-14);
    mesh.forward_efficiency = mesh.backward_efficiency = 1;
    mesh.backward_bearing = 3;
    EXPECT_EQ(mesh.loss_kink(), 1.5);
}

}  // namespace
}  // namespace shiftrig::plant
