#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "innerspring/body/material.h"
#include "innerspring/mesh/error.h"
#include "innerspring/mesh/nearest_name.h"

namespace innerspring {

namespace {

// Means of healthy tissue; subjects and methods scatter about them by half. What elastography prints in kPa
// is E = 3 rho c^2, which takes the tissue as incompressible, isotropic and linear.
#define ARDA "Arda et al. 2011, Am J Roentgenol 197:532 (shear-wave elastography, 127 volunteers"
#define ICRP "; density: ICRP Publication 110 (2009)"
constexpr std::array<Tissue, 13> table{{
    {"liver", 5490, 1050,
     "Roulot et al. 2008, J Hepatol 48:606 (transient elastography, 429 healthy subjects)" ICRP},
    {"kidney", 5000, 1050, ARDA ", renal cortex)" ICRP},
    {"spleen", 2900, 1040, ARDA ")" ICRP},
    {"pancreas", 4800, 1050, ARDA ")" ICRP},
    {"thyroid", 10970, 1040, ARDA ")" ICRP},
    {"parotid_gland", 10380, 1030, ARDA "); density: ICRU Report 46 (1992), average soft tissue"},
    {"submandibular_gland", 10920, 1030, ARDA "); density: ICRU Report 46 (1992), average soft tissue"},
    {"muscle", 11100, 1050, ARDA ", gastrocnemius)" ICRP},
    {"masseter", 10400, 1050, ARDA ")" ICRP},
    {"breast_fat", 3250, 950, "Samani et al. 2007, Phys Med Biol 52:1565 (ex vivo)" ICRP},
    {"breast_gland", 3240, 1020, "Samani et al. 2007, Phys Med Biol 52:1565 (ex vivo)" ICRP},
    {"brain_grey", 1389, 1040,
     "Budday et al. 2015, J Mech Behav Biomed Mater 46:318 (bovine, indentation); density: ICRU Report 44 "
     "(1989)"},
    {"brain_white", 1895, 1040,
     "Budday et al. 2015, J Mech Behav Biomed Mater 46:318 (bovine, indentation); density: ICRU Report 44 "
     "(1989)"},
}};
#undef ARDA
#undef ICRP

/// E_s / (E R) of the paper's constants.
constexpr double paper_surface_ratio = 0.1;

}  // namespace

std::span<const Tissue> tissues() {
    return table;
}

Material tissue_material(std::string_view name) {
    if (name == "paper") return {};
    const auto tissue = std::ranges::find(table, name, &Tissue::name);
    if (tissue != table.end()) {
        Material material;
        material.young = tissue->young;
        material.density = tissue->density;
        material.surface_ratio = paper_surface_ratio;
        return material;
    }
    std::vector<std::string_view> known{"paper"};
    for (const Tissue& t : table) known.push_back(t.name);
    const std::string nearest = nearest_name(name, known);
    if (!nearest.empty())
        throw InputError(fmt::format("unknown material '{}'; did you mean '{}'?", name, nearest));
    throw InputError(fmt::format("unknown material '{}'; known are {}", name, fmt::join(known, ", ")));
}

}  // namespace innerspring
