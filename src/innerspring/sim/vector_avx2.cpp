#include "innerspring/sim/net_simd.h"
#include "innerspring/sim/packed_simd.h"
#include "innerspring/sim/panel_simd.h"
#include "innerspring/sim/settle_simd.h"

namespace innerspring {

const VectorKernels* avx2_kernels() {
#if defined(__AVX2__)
    static const VectorKernels kernels{"avx2",
                                       advance_slices<Avx2>,
                                       press_slices<Avx2>,
                                       volume_of_slices<Avx2>,
                                       multiply_panel<Avx2>,
                                       stretch_avx2,
                                       pull_avx2,
                                       tangent_avx2,
                                       settle_groups<FourDoubles>};
    return &kernels;
#else
    return nullptr;
#endif
}

}  // namespace innerspring
