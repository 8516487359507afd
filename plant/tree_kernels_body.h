// The loops of tree_kernels.h, included once per instruction set with SHIFTRIG_LANES, the numbers of one block, 4 or 8,
// SHIFTRIG_FMA(a, b, c) = a b + c of numbers and SHIFTRIG_BLOCK_FMA the same of blocks. No function of the standard library may be
// instantiated here: the linker would keep one copy for all instruction sets.
#include <cstdint>

#include "plant/tree_kernels.h"

namespace shiftrig::plant::detail {
namespace {

// All of it is inlined here: no other file ever passes a block by value.
#pragma GCC diagnostic ignored "-Wpsabi"

constexpr int lanes = SHIFTRIG_LANES;
#include "plant/lanes_body.h"
#include "plant/tree_lanes_body.h"
// What follows is made of those.
#include "plant/tree_across_body.h"
#include "plant/tree_along_body.h"

constexpr TreeKernel kernel{lanes,       shaft_torques, combine, solve, finish, middle,
                            swing_error, correct,       slips,   give,  spread};

}  // namespace
}  // namespace shiftrig::plant::detail
