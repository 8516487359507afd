#define SHIFTRIG_LANES 4
#define SHIFTRIG_FMA(a, b, c) ((a) * (b) + (c))
#define SHIFTRIG_BLOCK_FMA(a, b, c) ((a) * (b) + (c))
#include "plant/tree_kernels_body.h"

namespace shiftrig::plant::detail {

TreeKernel tree_kernel_portable() noexcept {
    return kernel;
}

TreeKernel choose_tree_kernel([[maybe_unused]] KernelKind kind) {
#if defined(SHIFTRIG_X86_KERNELS)
    if (kind == KernelKind::avx512) return tree_kernel_avx512();
    if (kind == KernelKind::avx2) return tree_kernel_avx2();
#endif
    return tree_kernel_portable();
}

}  // namespace shiftrig::plant::detail
