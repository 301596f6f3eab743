#include "innerspring/sim/stability.h"

#include <algorithm>
#include <cmath>

namespace innerspring {

double largest_eigenvalue_bound(const Body& body, int iterations) {
    std::vector<double> w(body.vertices(), 1.0), Bw(body.vertices());
    double bound = INFINITY;
    for (int n = 0; n <= iterations; ++n) {
        double ratio = 0;
        for (std::size_t i = 0; i < w.size(); ++i) {
            double sum = body.K[i] * w[i];
            for (Index s = body.spoke_start[i]; s < body.spoke_start[i + 1]; ++s)
                sum += body.spokes[s].k * (w[i] + w[body.spokes[s].neighbour]);
            Bw[i] = sum / body.m[i];
            ratio = std::max(ratio, Bw[i] / w[i]);
        }
        bound = std::min(bound, ratio);
        // Scaled so that no entry overflows or vanishes over the iterations.
        const double top = *std::max_element(Bw.begin(), Bw.end());
        for (std::size_t i = 0; i < w.size(); ++i) w[i] = std::max(Bw[i] / top, 1e-100);
    }
    return bound;
}

double largest_stable_step(const Body& body) {
    return 2 / std::sqrt(largest_eigenvalue_bound(body));
}

}  // namespace innerspring
