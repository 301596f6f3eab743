#pragma once
#include <optional>
#include <span>
#include <string_view>

#include "innerspring/body/anisotropy.h"

namespace innerspring {

/// What the solid is made of. The defaults are the paper's constants (section 4); they make sense for a body
/// of about 1 m radius.
struct Material {
    double mass = 0.05;             ///< M, total mass [kg]; not used when density is given
    std::optional<double> density;  ///< [kg/m^3]; M = density * V
    double young = 10;              ///< E, modulus of the inner volume [Pa]; > 0
    double surface =
        1;  ///< E_s, modulus times thickness of the surface [N/m]; >= 0. The paper's "1 N/m^2" is read so.
    std::optional<double> surface_ratio;  ///< E_s / (E R); takes the place of surface when given. The paper's
                                          ///< constants make it 0.1.
    double damping = 1;  ///< zeta of each vertex on its inner spring [1]; 1 is critical, 0 none
    double poisson =
        0;  ///< nu, 0 (the paper) to 0.5 (no change of volume), from 0.499995 on 0.5; see bulk_modulus()
    Anisotropy anisotropy;  ///< of the inner volume; where it is, E of the groups is mean_modulus()
};

/// kappa = 2 nu E / (3 (1 - 2 nu)) [Pa], ours: what the volume of the whole body resists with beside the
/// inner springs, which carry E/3 of the bulk modulus E / (3 (1 - 2 nu)) already. Infinite at nu = 1/2. Of an
/// anisotropic material E is the mean of n^T D n, n the direction to the centre: mean_modulus(), or E itself
/// if it is radial.
double bulk_modulus(const Material& material);

/// The same with mass and surface made concrete for a body of volume `volume_m3`: density and surface_ratio
/// are gone. Throws InputError naming the property that is not finite, not positive, (surface, damping)
/// negative or (poisson) not from 0 to 0.5, and as resolve_anisotropy().
Material resolve(const Material& material, double volume_m3);

/// A published material: elasticity and density with where they were read.
struct Tissue {
    std::string_view name;
    double young;    ///< [Pa]
    double density;  ///< [kg/m^3]
    std::string_view source;
};

std::span<const Tissue> tissues();

/// The material of a tissue by name ("paper" gives the defaults). E_s keeps the paper's ratio 0.1 E R, as no
/// thickness is published with it. Throws InputError naming the nearest known one.
Material tissue_material(std::string_view name);

}  // namespace innerspring
