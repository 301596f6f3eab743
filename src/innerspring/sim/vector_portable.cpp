#include "innerspring/sim/net_simd.h"
#include "innerspring/sim/packed_simd.h"
#include "innerspring/sim/panel_simd.h"
#include "innerspring/sim/settle_simd.h"

namespace innerspring {

const VectorKernels* portable_kernels() {
    static const VectorKernels kernels{"portable",
                                       advance_slices<Portable>,
                                       press_slices<Portable>,
                                       volume_of_slices<Portable>,
                                       multiply_plain<float>,
                                       stretch_plain,
                                       pull_plain,
                                       tangent_plain,
                                       settle_groups<OneDouble>};
    return &kernels;
}

}  // namespace innerspring
