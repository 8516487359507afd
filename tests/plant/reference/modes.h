// Contact modes and the accelerations they imply, by the kinematic method of [Algin] eq. (9): one dense
// linear system for accelerations and internal torques together,
//
//     | J   Ĉ | | ω̇ |   | M̃ |        C  kinematic columns of meshes and held devices
//     | Cᵀ  0 | | M  | = | 0  |        Ĉ  their force columns (û in place of u)
//
// Where the rows of Cᵀ depend on one another the torques are not unique: of all solutions the one with
// the least Σ T²/nominal over the held friction devices is taken; meshes cost nothing.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "tests/plant/reference/system.h"

namespace shiftrig::reference {

enum class Hold : std::int8_t { minus = -1, held = 0, plus = 1, free = 2 };
inline double sign_of(Hold hold) {
    return hold == Hold::plus ? 1 : hold == Hold::minus ? -1 : 0;
}

struct Mode {
    std::vector<Hold> friction;  // minus/plus: slipping with that sign
    std::vector<Hold> mesh;      // sign of the relative motion, or held (lossless meshes: always plus)
    std::vector<int> x;          // loss direction of each mesh
    std::vector<bool> at_rest;   // mesh whose relative speed is exactly 0, whatever its loss torque does
    std::vector<int> flank;      // closed flank of each shaft with play, 0: none
    auto operator<=>(const Mode&) const = default;
};

// Everything is linear in M̃, the torques on the masses from all but meshes and held devices.
struct Response {
    Matrix acceleration;     // ω̇ = acceleration·M̃
    Matrix mesh_torque;      // M on link 1 of every mesh
    Matrix loss_torque;      // L of every mesh, without s·offset(x) of the moving ones
    Matrix friction_torque;  // T of held devices, zero rows for the others
    Matrix projector;        // J-orthogonal projector of speeds onto the constraints
    int redundancy = 0;      // dependent rows among meshes and held friction devices
    bool sound =
        true;  // held meshes are independent of everything else that is held: their loss torque is unique
    // Where not: changes of the torques that no mass feels, one a column.
    Matrix mesh_freedom, loss_freedom, friction_freedom;
};

// Where mechanics does not determine how devices at rest share a load, it is assumed to be shared in the way that
// spares the fullest of them.
enum class Sharing : std::int8_t {
    free,  // by any split that no mass feels
    by_loss,  // by the losses of meshes at rest alone; friction devices share in proportion to what they can carry
};

class Responses {
  public:
    Responses(const System& system, Sharing sharing) : system_(system), sharing_(sharing) {}
    const Response& of(const Mode& mode);

  private:
    Response build(const Mode& mode) const;
    const System& system_;
    Sharing sharing_;
    std::map<std::vector<int>, Response> cache_;
    Mode last_mode_;
    const Response* last_ = nullptr;
};

}  // namespace shiftrig::reference
