// The kernels that this processor runs: of the others there is nothing to see.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "plant/kernels.h"

namespace shiftrig::plant::detail {

inline std::vector<KernelKind> offered_kernels() {
    std::vector<KernelKind> offered;
    for (const KernelKind kind : {KernelKind::portable, KernelKind::avx2, KernelKind::avx512}) {
        try {
            choose_kernel(kind);
            offered.push_back(kind);
        } catch (const ModelError&) {
        }
    }
    return offered;
}

inline std::string kernel_name(const testing::TestParamInfo<KernelKind>& kind) {
    return choose_kernel(kind.param).name;
}

}  // namespace shiftrig::plant::detail
