#include <algorithm>
#include <cmath>

#include "innerspring/study/truth.h"

namespace innerspring {

TruthRow compare(const TruthSubject& s, const TruthLoad& load, std::span<const Vector> nodal,
                 std::span<const Vector> reference, std::span<const Vector> answer) {
    TruthRow row;
    row.subject = s.name;
    row.load = load.name;
    const auto& q = s.mesh.positions;
    const std::vector<double> A = vertex_areas(q, s.mesh.triangles);
    double difference2 = 0, reference2 = 0, peak = 0, worst = 0, work = 0, reference_work = 0, forces = 0;
    std::size_t at = 0;
    for (std::size_t i = 0; i < q.size(); ++i) {
        const Vector d = answer[i] - reference[i];
        difference2 += A[i] * d.squaredNorm();
        reference2 += A[i] * reference[i].squaredNorm();
        worst = std::max(worst, d.norm());
        if (reference[i].norm() > peak) peak = reference[i].norm(), at = i;
        work += nodal[i].dot(answer[i]);
        reference_work += nodal[i].dot(reference[i]);
        forces += nodal[i].norm();
    }
    row.force_group = forces / (s.material.young * s.radius * s.radius);
    row.l2_error = std::sqrt(difference2 / reference2);
    row.peak_error = worst / peak;
    row.peak_ratio = answer[at].dot(reference[at]) / (peak * peak);
    row.work_ratio = work / reference_work;

    // dV = sum dV/dx_i . u_i, Eq. 4's exact derivative: a third of the area vectors around i.
    double volume = 0, reference_volume = 0, swept = 0;
    for (const Triangle& t : s.mesh.triangles) {
        const Vector area = double_area_vector(q, t) / 2;
        volume += area.dot(answer[t[0]] + answer[t[1]] + answer[t[2]]) / 3;
        const double moved = area.dot(reference[t[0]] + reference[t[1]] + reference[t[2]]) / 3;
        reference_volume += moved;
        swept += std::abs(moved);
    }
    row.swept_share = (volume - reference_volume) / swept;
    row.volume_percent = 100 * volume / s.volume;
    row.reference_volume_percent = 100 * reference_volume / s.volume;

    if (load.kind == TruthLoad::Kind::squeeze) {
        const double unit = s.material.young * s.radius / load.force_n;
        const auto pole = [&](std::span<const Vector> u) {
            const Index a = nearest_vertex(q, s.radius * s.axis), b = nearest_vertex(q, -s.radius * s.axis);
            return unit * (u[b] - u[a]).dot(s.axis) / 2;
        };
        const auto equator = [&](std::span<const Vector> u) {
            double sum = 0, area = 0;
            for (std::size_t i = 0; i < q.size(); ++i)
                if (std::abs(q[i].dot(s.axis)) < 0.05 * s.radius)
                    sum += A[i] * u[i].dot(q[i].normalized()), area += A[i];
            return unit * sum / area;
        };
        row.pole = pole(answer), row.reference_pole = pole(reference);
        row.equator = equator(answer), row.reference_equator = equator(reference);
    }
    return row;
}

}  // namespace innerspring
