#pragma once
#include "innerspring/study/setting.h"
#include "innerspring/study/truth_models.h"
#include "innerspring/study/truth_sphere.h"

namespace innerspring {

/// The traction p P_n(cos theta) outward on a sphere about the origin, p = E.
TruthLoad mode_load(const TruthSubject& sphere, int n);

/// Two caps pressed inward, F = E R^2 on each.
TruthLoad squeeze_load(const TruthSubject& sphere, double alpha);

/// What the series says to them, at the vertices.
std::vector<Vector> mode_answer(const TruthSubject& sphere, int n);
std::vector<Vector> squeeze_answer(const TruthSubject& sphere, double alpha);

/// A solid ready for loads. Throws InputError if no body can be built from it.
TruthSubject make_subject(SurfaceMesh mesh, const Material& material, const CentreOption& centre,
                          double poisson);

/// Holds what lies in the lowest `share` of the height along gravity. Throws InputError if that is not a
/// whole triangle.
void hold_base(TruthSubject& subject, const Vector& gravity, double share);

/// Gravity of 1 m/s^2, and tractions (1 - (d/r)^2)^2 of 1 N in all against the normal of each of `count`
/// vertices (as patch_force has them): the highest, then others away from what is held, spread over the
/// surface; within `radius` [m] and within half of it.
void add_loads_of(TruthSubject& subject, const Vector& gravity, int count, double radius);

/// The load times a factor.
void scale(TruthLoad& load, double factor);

}  // namespace innerspring
