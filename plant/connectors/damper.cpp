#include "plant/connectors/damper.h"

#include "plant/assembly.h"
#include "plant/check.h"

namespace shiftrig::plant {

void check_parameters(const Check& check, const Damper& k) {
    check.positive("damping", k.damping);
}

void assemble(Assembly& assembly, const Damper& k) {
    assembly.structure.dampers.push_back({k.name, assembly.between(k.a, k.b), 0, k.damping, 0, 0});
}

}  // namespace shiftrig::plant
