#pragma once
#include <Eigen/SparseCore>
#include <memory>
#include <span>
#include <unordered_map>

#include "innerspring/mesh/geometry.h"
#include "innerspring/record/tetrahedra.h"

namespace innerspring {

// Linear elasticity of a solid of tetrahedra, quadratic in each (10 nodes: corners, then the middles of the
// edges; straight edges). What the surface-only body is judged by.

/// Small strains, isotropic.
struct ElasticMaterial {
    double young = 10;     ///< E [Pa]; > 0
    double poisson = 0.3;  ///< nu; -1 < nu <= largest_element_poisson
};

/// Quadratic tetrahedra take volume well up to here; nearer to 1/2 they lock and the equations get ill
/// conditioned.
inline constexpr double largest_element_poisson = 0.495;

/// A force at a point of a surface triangle. A load on a surface is many of them: the points of a quadrature.
/// Body and elements take the same ones, each with its own shape functions, so that both do the same work.
struct SurfaceForce {
    Index triangle;
    Vector at;     ///< barycentric, sums to 1
    Vector force;  ///< [N]
};

struct QuadraticMesh {
    std::vector<Vector> nodes;  ///< the tetrahedra's vertices, then the middles of edges [m]
    std::size_t corners = 0;    ///< so many of them are vertices
    std::vector<std::array<Index, 10>> elements;  ///< corners 0..3, then middles of 01, 02, 03, 12, 13, 23

    Index middle(Index a, Index b) const { return middles.at(key(a, b)); }
    static std::uint64_t key(Index a, Index b) {
        return std::uint64_t(std::min(a, b)) << 32 | std::max(a, b);
    }
    std::unordered_map<std::uint64_t, Index> middles;  ///< by key(); only looked up, never walked
};
QuadraticMesh quadratic(const TetMesh& mesh);

/// The corners given, and the middles between two of them.
std::vector<bool> held_nodes(const QuadraticMesh& mesh, std::span<const Index> corners);

/// Adds the work-equivalent forces at the nodes [N]: of a force per volume [N/m^3], and of forces on the
/// surface (its vertices are the mesh's first corners).
void add_body_force(const QuadraticMesh& mesh, const Vector& per_volume, std::span<Vector> f);
void add_surface_forces(const QuadraticMesh& mesh, Triangles surface, std::span<const SurfaceForce> forces,
                        std::span<Vector> f);

/// The equations of one mesh, material and set of held nodes, ready for any number of loads.
class ElasticSolid {
  public:
    /// Throws InputError: a flat or inverted tetrahedron, or a material out of range.
    ElasticSolid(QuadraticMesh mesh, const ElasticMaterial& material, std::vector<bool> held);
    ~ElasticSolid();
    ElasticSolid(ElasticSolid&&) noexcept;

    const QuadraticMesh& mesh() const { return mesh_; }

    /// The displacement of each node [m] under forces at the nodes [N]; held nodes take `prescribed` (empty:
    /// zero). If no node is held the forces are first freed of what would move the solid as a rigid body, and
    /// the answer is freed of rigid motion (mean displacement and rotation over the nodes are zero). Throws
    /// RunError if the equations cannot be solved.
    std::vector<Vector> solve(std::vector<Vector> f, std::span<const Vector> prescribed = {}) const;

    /// Energy of a displacement: u K u / 2 [J], with what is held counted in.
    double energy(std::span<const Vector> u) const;

  private:
    struct Solver;
    QuadraticMesh mesh_;
    std::vector<bool> held_;
    bool floating_ = false;
    std::vector<Index> unknown_;         ///< per node: its place among the unknowns, or no_index
    Eigen::SparseMatrix<double> whole_;  ///< K over all nodes, lower half [N/m]
    std::unique_ptr<Solver> solver_;
};

/// Takes the rigid motion out of `u`: the best fitting translation and (small) rotation, with `weight` per
/// point.
void remove_rigid_motion(std::span<const Vector> x, std::span<const double> weight, std::span<Vector> u);

}  // namespace innerspring
