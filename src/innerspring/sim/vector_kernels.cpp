#include "innerspring/sim/vector_kernels.h"

#include <vector>

namespace innerspring {

std::span<const VectorKernels* const> vector_kernels() {
    static const std::vector<const VectorKernels*> kernels = [] {
        std::vector<const VectorKernels*> found;
        auto add = [&found](const VectorKernels* kernel, bool runs) {
            if (kernel && runs) found.push_back(kernel);
        };
#if defined(__x86_64__)
        add(avx512_kernels(), __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq"));
        add(avx2_kernels(), __builtin_cpu_supports("avx2"));
        add(sse2_kernels(), true);
#endif
        add(portable_kernels(), true);
        return found;
    }();
    return kernels;
}

}  // namespace innerspring
