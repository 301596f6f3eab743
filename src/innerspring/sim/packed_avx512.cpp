#include "innerspring/sim/packed_simd.h"

const innerspring::PackedKernel* innerspring::avx512_kernel() {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
    return kernel_for<Avx512>("avx512");
#else
    return nullptr;
#endif
}
