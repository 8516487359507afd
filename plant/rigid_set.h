// The devices that act as rigid ones when a set of clutches and brakes is closed, and the motions they leave.
// Statics, gear ratios and natural frequencies all start here.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "plant/structure.h"

namespace shiftrig::plant {

// Gears and planetary rows always belong to it, closed clutches, brakes and freewheels as named.
struct RigidOptions {
    bool stiff_shafts = true;    // shafts are untwistable, with the play of backlashes taken up
    bool rolling_tyres = true;   // tyres roll without slip
    bool wheel_contacts = true;  // are closed
};
// What is rigid in a step: shafts, plays and tyres give.
inline constexpr RigidOptions rigid_alone{.stiff_shafts = false, .rolling_tyres = false};
inline constexpr RigidOptions meshes_alone{
    .stiff_shafts = false, .rolling_tyres = false, .wheel_contacts = false};
inline constexpr RigidOptions slipping_tyres{.rolling_tyres = false};

struct RigidSet {
    enum class Kind { mesh, pair, shaft, tyre };
    struct Member {
        std::string name;
        Kind kind{};
        int index = -1;             // into structure.meshes, .pairs, .shafts or description.tyres
        std::array<Link, 3> links;  // its SDM column, unused links have mass −1
    };
    std::vector<Member> members;
    Eigen::MatrixXd columns;  // masses × members, kinematic (A, with u)
};

// A clutch, brake or freewheel: not what resists motion by itself.
bool can_be_closed(const FrictionPair& pair) noexcept;

// Throws ModelError where `closed` names no clutch, brake or freewheel.
RigidSet rigid_set(const Description& description, const Structure& structure,
                   const std::vector<std::string>& closed, const RigidOptions& options = {});

// All speeds that the set allows: the columns of the result span {ω : Cᵀω = 0} and are J-orthonormal.
// Zero columns: the set locks everything.
Eigen::MatrixXd motions(const RigidSet& set, const std::vector<double>& inertia);

// By mass, the members that together keep it from moving; none: it can move.
std::vector<std::vector<int>> held_by(const RigidSet& set, const std::vector<double>& inertia);

// All torques of the devices that balance on their own: the columns of the result span {M : CM = 0}. None without loops.
Eigen::MatrixXd self_stresses(const RigidSet& set, const std::vector<double>& inertia);

// A loop of rigid devices whose rows depend on each other: the split of their torques is not unique.
struct TieUp {
    std::vector<std::string> devices;
};
std::vector<TieUp> tie_ups(const RigidSet& set, const std::vector<double>& inertia);
// The loop that this member closes with the others; none: it is in none.
std::optional<TieUp> loop_through(const RigidSet& set, const std::vector<double>& inertia,
                                  const std::string& member);

}  // namespace shiftrig::plant
