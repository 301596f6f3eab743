#pragma once
#include <string>

#include "innerspring/body/body.h"
#include "innerspring/sim/tool.h"

namespace innerspring {

/// A factor over time: linear between points (time [s], factor), constant before the first and after the
/// last; empty means 1.
struct Profile {
    std::vector<std::pair<double, double>> points;
};
double at(const Profile& profile, double time);

/// A force spread over some vertices with weights that sum to 1.
struct Force {
    std::string name;
    std::vector<Index> vertices;
    std::vector<double> weights;
    Vector newton = Vector::Zero();  ///< the whole force [N], in space (it does not turn with the body)
    Profile profile;
    Index centre = no_index;  ///< the vertex it was spread around, and
    double radius = 0;        ///< how far [m]; 0: not spread
};

/// All of it on one vertex.
Force point_force(Index vertex, const Vector& newton);

/// Spread over the radius of influence r [m] around a vertex with weights (1 - (d/r)^2)^2 A_i, normalised; d
/// is the straight distance at rest, and only vertices connected to the first within the radius count, so
/// that it does not leak through a thin wall.
Force patch_force(const Body& body, Index vertex, double radius, const Vector& newton);

/// Vertices that do not answer to forces: they stay at rest position + offset(time).
struct Pin {
    std::vector<Index> vertices;
    std::vector<std::pair<double, Vector>>
        path;  ///< (time [s], offset [m]), linear between; empty: held at rest position
};
Vector offset_at(const Pin& pin, double time);

struct Loads {
    Vector gravity = Vector(0, -9.81, 0);  ///< [m/s^2]
    std::vector<Force> forces;
    std::vector<Pin> pins;
    std::vector<Tool> tools{};  ///< that touch the body; see contact.h
};

/// Throws InputError if a vertex is out of range, a number not finite, a profile or path not increasing in
/// time, a vertex pinned twice, or a tool is not valid.
void require_valid(const Body& body, const Loads& loads);

}  // namespace innerspring
