#include "innerspring/sim/net_simd.h"
#include "innerspring/sim/packed_simd.h"
#include "innerspring/sim/panel_simd.h"
#include "innerspring/sim/settle_simd.h"

namespace innerspring {

const VectorKernels* sse2_kernels() {
#if defined(__x86_64__)
    static const VectorKernels kernels{"sse2",
                                       advance_slices<Sse2>,
                                       press_slices<Sse2>,
                                       volume_of_slices<Sse2>,
                                       multiply_panel<Sse2>,
                                       stretch_plain,
                                       pull_plain,
                                       tangent_plain,
                                       settle_groups<OneDouble>};
    return &kernels;
#else
    return nullptr;
#endif
}

}  // namespace innerspring
