#pragma once
// The product of a panel and its vectors over the vector operations of an instruction set. Each row is summed
// in the order of the columns, whatever the lanes: the same bits from all of them.
#include "innerspring/sim/simd.h"
#include "innerspring/sim/vector_kernels.h"

namespace innerspring {
namespace {

/// `count` vectors of rows from row i on. What lies past the last row is read and comes to nothing.
template <class S, int count>
inline void panel_rows(const PanelProduct<float>& m, int i) {
    using F = typename S::F;
    F x[count], y[count], z[count];
    for (int g = 0; g < count; ++g) x[g] = y[g] = z[g] = S::all(0);
    const float* p = m.P + i;
    for (int j = 0; j < m.columns; ++j, p += m.rows) {
        const float* const from = m.w + 4 * std::ptrdiff_t(m.places[j]);
        const F u = S::all(from[0]), v = S::all(from[1]), t = S::all(from[2]);
        for (int g = 0; g < count; ++g) {
            const F q = S::load_anywhere(p + int(S::width) * g);
            x[g] = x[g] + q * u, y[g] = y[g] + q * v, z[g] = z[g] + q * t;
        }
    }
    for (int g = 0; g < count; ++g) S::put(m.out + 4 * (i + int(S::width) * g), 4, x[g], y[g], z[g]);
}

template <class S>
void multiply_panel(const PanelProduct<float>& m) {
    constexpr int width = int(S::width);
    int i = 0;
    for (; i + width < m.rows; i += 2 * width) panel_rows<S, 2>(m, i);
    if (i < m.rows) panel_rows<S, 1>(m, i);
}

/// The same in plain C++.
template <class Real>
void multiply_plain(const PanelProduct<Real>& m) {
    for (int i = 0; i < 4 * m.rows; ++i) m.out[i] = 0;
    const Real* p = m.P;
    for (int j = 0; j < m.columns; ++j, p += m.rows) {
        const Real* const from = m.w + 4 * std::ptrdiff_t(m.places[j]);
        for (int i = 0; i < m.rows; ++i)
            for (int a = 0; a < 4; ++a) m.out[4 * i + a] += p[i] * from[a];
    }
}

}  // namespace
}  // namespace innerspring
