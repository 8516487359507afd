// AVX-512 with fused multiply-add.
#if defined(SHIFTRIG_X86_KERNELS)
#include <immintrin.h>
#define SHIFTRIG_LANES 8
#define SHIFTRIG_FMA(a, b, c) __builtin_fma(a, b, c)
#define SHIFTRIG_BLOCK_FMA(a, b, c) _mm512_fmadd_pd(a, b, c)
#include "plant/tree_kernels_body.h"

namespace shiftrig::plant::detail {

TreeKernel tree_kernel_avx512() noexcept {
    return kernel;
}

}  // namespace shiftrig::plant::detail
#endif
