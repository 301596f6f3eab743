#include "innerspring/sim/packed_simd.h"
#include "innerspring/sim/panel_simd.h"

namespace innerspring {

const VectorKernels* portable_kernels() {
    static const VectorKernels kernels{"portable", advance_slices<Portable>, multiply_plain<float>};
    return &kernels;
}

}  // namespace innerspring
