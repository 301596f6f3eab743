#include "innerspring/sim/net_simd.h"
#include "innerspring/sim/packed_simd.h"
#include "innerspring/sim/panel_simd.h"
#include "innerspring/sim/settle_simd.h"

namespace innerspring {

const VectorKernels* avx512_kernels() {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
    static const VectorKernels kernels{"avx512",
                                       advance_slices<Avx512>,
                                       press_slices<Avx512>,
                                       volume_of_slices<Avx512>,
                                       multiply_panel<Avx512>,
                                       stretch_avx2,
                                       pull_avx2,
                                       tangent_avx2,
                                       settle_groups<EightDoubles>};
    return &kernels;
#else
    return nullptr;
#endif
}

}  // namespace innerspring
