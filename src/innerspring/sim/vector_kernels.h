#pragma once
// What the vector kernels read and write, and nothing else: the files compiled for one instruction set
// include only this, so that no shared code of the library is ever compiled for a processor that may not be
// there.
#include <cstddef>
#include <cstdint>
#include <span>

namespace innerspring {

/// Vertices side by side in a slice. The same for every instruction set, and with it the layout, the order of
/// every sum and every bit of the result.
inline constexpr std::size_t slice_width = 16;

/// A vertex as its neighbours read it: rest position and displacement from home.
struct alignas(32) PackedRow {
    float q[4], u[4];
};

/// The n-th spoke of each vertex of a slice, in the order of the fan of triangles.
struct alignas(64) PackedSlot {
    std::uint32_t offset[slice_width];  ///< of the neighbour's row [bytes]
    float k[slice_width];               ///< 0: no spoke, and the neighbour is the vertex's first
};

/// Slots of a slice: as many as its vertices have spokes at most.
struct SlotRange {
    std::uint32_t first, count;
};

struct alignas(64) PackedVectors {
    float x[slice_width], y[slice_width], z[slice_width];
};

struct alignas(64) PackedCoefficients {
    float inverse_m[slice_width], K_m[slice_width], c_m[slice_width];  ///< 1/m, K/m, c/m
};

/// Of an anisotropic body: K_i + N_i over m_i, in place of K/m.
struct alignas(64) PackedStiffness {
    float xx[slice_width], xy[slice_width], xz[slice_width], yy[slice_width], yz[slice_width],
        zz[slice_width];
};

/// One symplectic Euler step of a held body (kernel.h's advance_held), in units of packed.h.
struct PackedStep {
    const PackedSlot* slots;
    const SlotRange* ranges;                 ///< per slice
    const PackedCoefficients* coefficients;  ///< per slice
    const PackedRow* in;
    PackedRow* out;    ///< another array, with q as in `in`; u is written, but where a pressure is to come
    PackedVectors* v;  ///< per slice, in place
    float h;
    float hg[3];                                 ///< h times gravity
    PackedVectors* response = nullptr;           ///< per slice: r_i, written; for the volume term (volume.h)
    const PackedStiffness* stiffness = nullptr;  ///< per slice, where the body is anisotropic
};

/// Over a block of slices, at the positions read and the velocities written.
struct PackedSums {
    double volume = 0;  ///< sum_i x_i . a_i / 3, the vertices' share of Eq. 4
    double flow = 0;    ///< sum_i 6 a_i . v'_i
    double give = 0;    ///< sum_i 6 a_i . r_i
};

/// What a pressure does after the step (volume.h), r_i = 6 a_i / (m_i + h c_i):
///     v_i += to_v r_i, u_i = (u_i of `in`) + to_u v_i;   or, where v is null, u_i = (u_i of `in`) + to_u
///     r_i.
struct PackedPress {
    const PackedVectors* response;
    const PackedRow* in;
    PackedRow* out;  ///< with q as in `in`
    PackedVectors* v;
    float to_v, to_u;
};

/// A dense panel times what lies at places of an array of fours (x, y, z, 0), for the three together:
/// out_i = sum_j P_ij w[places[j]], summed in the order of j.
template <class Real>
struct PanelProduct {
    /// Columns one after the other. So much after the last is read, and so much of `out` may be written.
    static constexpr int beyond = 32;
    const Real* P;
    int rows, columns;
    const int* places;  ///< per column
    const Real* w;
    Real* out;  ///< fours, aligned to 16 B
};

/// A neighbour and the edge to it.
struct NetSpoke {
    std::uint32_t neighbour, edge;
};
struct NetRow {
    std::uint32_t first, count;  ///< of the spokes
};

/// What Net::evaluate reads and writes (net.h), in double.
struct NetPass {
    const std::uint32_t* ends;  ///< two per edge
    const double *k, *rest;     ///< per edge
    double* s;                  ///< per edge
    const NetRow* rows;         ///< per vertex
    const NetSpoke* spokes;
    const double *x, *z;  ///< three per vertex
    const double* d;      ///< per vertex
    double* g;            ///< three per vertex
};
/// What Net::multiply reads and writes: q = H p.
struct TangentPass {
    const double* edges;  ///< four per edge: sqrt(k l/|d|) u and k (1 - l/|d|)
    const NetRow* rows;   ///< per vertex
    const NetSpoke* spokes;
    const double* d;  ///< per vertex
    const double* p;  ///< three per vertex
    double* q;        ///< three per vertex
};
/// Per axis: sum of d_i (x_i - z_i)^2 and of g_i^2.
struct NetSums {
    double places[3] = {0, 0, 0}, gradient2[3] = {0, 0, 0};
};

/// Vertices that are no neighbours of each other, side by side, for Net::settle. Offsets are three times the
/// vertex, below 2^31.
inline constexpr std::size_t settle_width = 8;
struct SettleGroup {
    std::uint32_t offset[settle_width];
    std::uint32_t vertices;      ///< those after are the last again, and are not moved
    std::uint32_t first, count;  ///< of the slots
    double d[settle_width], z[3][settle_width];
};
/// The n-th spoke of each.
struct SettleSlot {
    std::uint32_t offset[settle_width];  ///< of the neighbour
    double k[settle_width], rest[settle_width];
};
struct SettlePass {
    const SettleGroup* groups;
    const SettleSlot* slots;
    double* x;  ///< three per vertex, in place
};

/// The inner loops for one instruction set. Null pointers to these where the library was built for another
/// processor.
struct VectorKernels {
    const char* name;

    /// Slices [first, last) of an explicit step. False if anything left the numbers. `sums`, if not null: the
    /// volume, from one component of a_i, as the three sums are equal on a closed surface; where
    /// step.response is given from all three, and the other sums too.
    bool (*advance)(const PackedStep& step, std::size_t first, std::size_t last, PackedSums* sums);

    /// False if anything left the numbers.
    bool (*press)(const PackedPress& press, std::size_t first, std::size_t last);

    /// The sum `volume` of advance() with the response, to the same bits, at the rows `in` alone.
    double (*volume)(const PackedStep& step, std::size_t first, std::size_t last);

    void (*multiply)(const PanelProduct<float>& product);

    /// Edges [first, last): s = k (1 - l/|d|); returns sum k (|d| - l)^2.
    double (*stretch)(const NetPass& pass, std::size_t first, std::size_t last);

    /// Vertices [first, last): g_i = d_i (x_i - z_i) + sum_j s_ij (x_i - x_j), adding to the sums.
    void (*pull)(const NetPass& pass, std::size_t first, std::size_t last, NetSums& sums);

    /// Vertices [first, last): q_i = d_i p_i + sum_j across (p_i - p_j) + along along.(p_i - p_j), adding
    /// p_i q_i to `sums`, per axis.
    void (*tangent)(const TangentPass& pass, std::size_t first, std::size_t last, double* sums);

    /// Groups [first, last): each vertex a step towards its least energy.
    void (*settle)(const SettlePass& pass, std::size_t first, std::size_t last);
};

const VectorKernels* avx512_kernels();
const VectorKernels* avx2_kernels();
const VectorKernels* sse2_kernels();
const VectorKernels* portable_kernels();

/// Those this processor has, the fastest first; the last is plain C++. They give the same bits.
std::span<const VectorKernels* const> vector_kernels();

}  // namespace innerspring
