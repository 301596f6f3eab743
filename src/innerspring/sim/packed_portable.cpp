#include "innerspring/sim/packed_simd.h"

const innerspring::PackedKernel* innerspring::portable_kernel() {
    return kernel_for<Portable>("portable");
}
