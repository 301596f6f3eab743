#include "innerspring/body/material.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <vector>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/geometry.h"
#include "innerspring/mesh/nearest_name.h"

namespace innerspring {

double bulk_modulus(const Material& m) {
    const double E = m.anisotropy.kind == Anisotropy::Kind::radial ? m.young : mean_modulus(m);
    return 2 * m.poisson * E / (3 * (1 - 2 * m.poisson));
}

Material resolve(const Material& material, double volume_m3) {
    auto positive = [](double value, const char* what, const char* unit) {
        if (!(value > 0 && std::isfinite(value)))
            throw InputError(fmt::format("{} is {:g} {}; it must be positive", what, value, unit));
    };
    auto not_negative = [](double value, const char* what, const char* unit) {
        if (!(value >= 0 && std::isfinite(value)))
            throw InputError(fmt::format("{} is {:g}{}; it must not be negative", what, value, unit));
    };
    Material r = material;
    if (material.density) {
        positive(*material.density, "density", "kg/m^3");
        r.mass = *material.density * volume_m3;
    }
    positive(r.mass, "mass", "kg");
    positive(r.young, "young (E)", "Pa");
    if (!(r.poisson >= 0 && r.poisson <= 0.5))
        throw InputError(fmt::format("poisson (nu) is {:g}; it must be from 0 to 0.5", r.poisson));
    // Nearer to 1/2 rounding of V times kappa would be the pressure.
    if (1 - 2 * r.poisson < 1e-5) r.poisson = 0.5;
    resolve_anisotropy(r);
    if (material.surface_ratio) {
        not_negative(*material.surface_ratio, "surface ratio (E_s / E R)", "");
        r.surface = *material.surface_ratio * mean_modulus(r) * volume_radius(volume_m3);
    }
    not_negative(r.surface, "surface (E_s)", " N/m");
    not_negative(r.damping, "damping (zeta)", "");
    r.density.reset();
    r.surface_ratio.reset();
    return r;
}

}  // namespace innerspring
