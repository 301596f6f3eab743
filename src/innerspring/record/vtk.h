#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <variant>

#include "innerspring/mesh/geometry.h"

namespace innerspring {

/// A named array per vertex; the unit belongs in the name ("displacement_m").
struct VertexField {
    std::string name;
    std::variant<std::span<const double>, std::span<const Vector>> values;
};

/// VTK XML PolyData (.vtp), raw appended binary, double precision; opens in ParaView.
std::string to_vtp(Positions x, Triangles triangles, std::span<const VertexField> fields);

/// Collection file (.pvd) of frames with their times.
struct Frame {
    double time;       ///< [s]
    std::string file;  ///< relative to the .pvd
};
std::string to_pvd(std::span<const Frame> frames);

}  // namespace innerspring
