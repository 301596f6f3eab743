#include "innerspring/sim/packed_simd.h"

const innerspring::PackedKernel* innerspring::sse2_kernel() {
#if defined(__x86_64__)
    return kernel_for<Sse2>("sse2");
#else
    return nullptr;
#endif
}
