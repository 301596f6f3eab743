#include "innerspring/sim/packed_simd.h"

const innerspring::PackedKernel* innerspring::avx2_kernel() {
#if defined(__AVX2__)
    return kernel_for<Avx2>("avx2");
#else
    return nullptr;
#endif
}
