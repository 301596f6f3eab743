#pragma once
#include <functional>
#include <memory>

#include "innerspring/body/body.h"
#include "innerspring/study/elasticity.h"

namespace innerspring {

/// A load on a surface.
struct TruthLoad {
    enum class Kind { mode, squeeze, gravity, patch };
    std::string name;
    Kind kind = Kind::gravity;
    std::vector<SurfaceForce> surface;
    Vector gravity = Vector::Zero();  ///< [m/s^2]
    double force_n = 0;               ///< that u is measured by: a squeeze's per cap [N]
};

/// A solid and how it is held: what a model gets to know. Models and reference share it.
struct TruthSubject {
    std::string name;
    SurfaceMesh mesh;
    double volume = 0, radius = 0;  ///< V [m^3] and R = (3V/4pi)^(1/3) [m]
    Material material;              ///< resolved; E is the reference's too
    CentreOption centre;
    double poisson = 0;             ///< nu of the reference
    std::vector<double> mass;       ///< share of each vertex of M [kg], Eqs. 1-2
    std::vector<Index> held;        ///< vertices that do not move
    Vector axis = Vector::UnitZ();  ///< of a sphere's loads
    std::vector<TruthLoad> loads;
    TetrahedraOptions filling;  ///< of the elements
};

/// Displacement of every vertex [m]; `note` says what went wrong, if anything did.
struct TruthAnswer {
    std::vector<Vector> u;
    std::string note = {};
};

/// What is judged.
struct TruthModel {
    std::string name;   ///< one or two words
    std::string about;  ///< one line
    std::function<TruthAnswer(const TruthSubject&, const TruthLoad&)> answer;
    bool needs_hold = false;  ///< makes no sense where nothing is held
};

/// The models that are judged. A new one is one more entry here.
std::vector<TruthModel> truth_models();

/// The work-equivalent forces on the vertices [N]: each force by its barycentric coordinates. Gravity is not
/// in them: which vertex bears what of it is the model's own affair (Eq. 1).
std::vector<Vector> nodal_forces(const TruthSubject& subject, const TruthLoad& load);

/// The elements on a subject, ready for its loads.
class ElementReference {
  public:
    explicit ElementReference(const TruthSubject& subject);  ///< throws as fill_with_tetrahedra
    std::vector<Vector> answer(const TruthSubject& subject, const TruthLoad& load) const;  ///< per vertex
    std::size_t tetrahedra() const { return solid_.mesh().elements.size(); }
    std::size_t nodes() const { return solid_.mesh().nodes.size(); }

  private:
    ElasticSolid solid_;
};

}  // namespace innerspring
