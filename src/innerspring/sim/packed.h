#pragma once
#include <Eigen/Core>
#include <span>

#include "innerspring/body/refine.h"
#include "innerspring/mesh/team.h"
#include "innerspring/sim/large_pages.h"
#include "innerspring/sim/state.h"
#include "innerspring/sim/vector_kernels.h"

namespace innerspring {

/// A held body and its motion in single precision, laid out for the vector kernels: slices of vertices, in
/// the order of a walk over the surface, so that neighbours lie near each other in memory.
///
/// Lengths are from `origin` and in units of 1/scale metres, a power of two near the body's radius; forces in
/// units that make the stiffest spring near 1. Displacements are from home: what rounding of positions does
/// changes the shape at rest by 6e-8 of the radius, but no displacement, which has its own 24 bits.
///
/// Per vertex with six neighbours: 2 x 32 B of rows, 12 B of v, 12 B of coefficients, 48 B of slots, 8 B of
/// maps: 144 B, of which a step reads 104 B and writes 28 B. Flops: 6 x 40 + 40 with 6 roots and 7 divisions.
/// An anisotropic body has 24 B more, and 12 flops.
struct Packed {
    LargeArray<PackedRow> rows[2];  ///< what was read last, and what is written next
    LargeArray<PackedVectors> v;
    LargeArray<PackedCoefficients> coefficients;
    LargeArray<PackedSlot> slots;
    LargeArray<PackedStiffness> stiffness_matrix;  ///< of an anisotropic body; else empty
    LargeArray<PackedVectors> response;  ///< r_i of the last step, for the volume term; empty without
    double rest_volume = 0;              ///< Eq. 4 at rest as the kernels find it
    std::vector<SlotRange> ranges;
    std::vector<Index> vertex_at;  ///< per place; no_index: a lane that stands still
    std::vector<Index> place_of;   ///< per vertex
    Vector origin = Vector::Zero();
    double scale = 1, stiffness = 1;
    std::vector<Index> vacant;      ///< places of vertices that are gone
    std::vector<PackedSums> parts;  ///< per block, for advance()
};

/// Whether the body's numbers fit: some would overflow where masses and stiffnesses differ by 1e30.
bool packable(const Body& body);
Packed pack(const Body& body);

/// Follows a refinement or coarsening in place; as costly as the change. The motion must be loaded anew.
void adapt(Packed& packed, const Body& body, const SurfaceChange& surface, const BodyChange& change);

/// The largest displacement [m] and speed [m/s], by block of the loop that looks for them.
struct LargestMotion {
    std::vector<std::array<float, 2>> blocks;  ///< squares, in units of Packed
    double displacement = 0, speed = 0;
};
/// The volume term's arrays, and the volume from which it counts: for pack() and adapt(), once the rest is
/// there.
void prepare_volume(Packed& packed, const Body& body);

/// The motion in and out, rounded to single precision on the way in. `largest`: as find_largest(), if asked
/// for.
void load(Packed& packed, const Body& body, const State& state, Team& team, LargestMotion* largest = nullptr);
void store(const Packed& packed, const Body& body, State& state, Team& team);

/// Adds to velocities [m/s]: to one vertex; to each of `vertices` what `impulse` [N s] gives its mass when it
/// is spread with `weights`.
void push(Packed& packed, Index vertex, const Vector& velocity);
void push(Packed& packed, const Body& body, std::span<const Index> vertices, std::span<const double> weights,
          const Vector& impulse);

/// Sets displacement [m] and velocity of one vertex.
void place(Packed& packed, Index vertex, const Vector& displacement, const Vector& velocity);

/// Displacement from home of one vertex [m], and before the last step; its velocity [m/s].
Vector displacement(const Packed& packed, Index vertex);
Vector displacement_before(const Packed& packed, Index vertex);
Vector velocity(const Packed& packed, Index vertex);

/// The same by place, for those who look often.
void place_at(Packed& packed, Index place, const Vector& displacement, const Vector& velocity);
Vector displacement_before_at(const Packed& packed, Index place);
Vector velocity_at(const Packed& packed, Index place);

void find_largest(const Packed& packed, Team& team, LargestMotion& largest);

/// What the volume term needs of a step, in SI units.
struct VolumeFlow {
    double excess =
        0;            ///< V - V_0 before the step, to some 1e-7/sqrt(N) of V [m^3]; V without the volume term
    double flow = 0;  ///< sum_i a_i . v'_i [m^3/s]; only with the volume term
    double give = 0;  ///< sum_i |a_i|^2 / (m_i + h c_i) [m^4/kg]; only with the volume term
};

/// One symplectic Euler step of h [s] under gravity [m/s^2]; with the volume term only its velocities, but
/// for the pressure, and press() is to follow. False if something left the numbers. `volume` is filled in if
/// not null, as it must not be with the volume term. The same bits for any number of threads.
bool advance(Packed& packed, const VectorKernels& kernel, double h, const Vector& gravity, Team& team,
             VolumeFlow* volume = nullptr);

/// dv_i / d(h P) = a_i / (m_i + h c_i) [m^2/kg] at the positions before the last step.
Vector response(const Packed& packed, Index vertex);

/// Ends a step of h [s] with the volume term: with r_i the responses, v_i += h P r_i and u_i += h v_i. False
/// if something left the numbers.
bool press(Packed& packed, const VectorKernels& kernel, double h, double P, Team& team);

/// u_i += to_u r_i, to_u [kg m] without a speed.
bool shift(Packed& packed, const VectorKernels& kernel, double to_u, Team& team);

/// V - V_0 [m^3] as things are now, with the volume term.
double volume_excess(Packed& packed, const VectorKernels& kernel, Team& team);

}  // namespace innerspring
