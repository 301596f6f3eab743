#pragma once
#include <memory>

#include "innerspring/sim/contact.h"
#include "innerspring/sim/refine.h"
#include "innerspring/sim/vector_kernels.h"

namespace innerspring {

enum class Integrator {
    automatic,   ///< explicit where its sub-steps are cheaper, else implicit
    symplectic,  ///< symplectic Euler, sub-stepped to stay within the body's own stability bound
    implicit     ///< implicit Euler, stable at any dt and stiffness
};

std::string_view to_string(Integrator integrator);
Integrator parse_integrator(std::string_view text);  ///< "auto", "symplectic", "implicit"; throws InputError

/// Of symplectic Euler. Single: the vector kernels of packed.h, for held bodies; the state is rounded to it
/// in every step of dt. Full: double throughout; for studies, and what the vector kernels are compared with.
enum class Precision { single, full };

std::string_view to_string(Precision precision);
Precision parse_precision(std::string_view text);  ///< "single", "double"; throws InputError

struct StepOptions {
    double dt = 0.01;  ///< [s]
    Integrator integrator = Integrator::automatic;
    Precision precision = Precision::single;
    int threads = 1;            ///< any number gives the same bits; 0: all cores
    int max_substeps = 100000;  ///< symplectic: more than this is refused
    /// implicit: residual relative to the forces of the step, the larger of the loads and of what is out of
    /// balance where each vertex keeps its velocity (at most what would stop it in one step). The default
    /// leaves an error well below that of the step.
    double tolerance = 1e-3;
    int max_iterations = 500;  ///< implicit: per step
    /// implicit: one Newton step with the true tangent from where each vertex flies on (as Baraff & Witkin
    /// 1998, but never to more energy than standing still), its linear system solved to `tolerance`. For
    /// comparison with solvers that do so; the default is closer and mostly faster.
    bool linearised = false;
    bool volume = false;                    ///< report Eq. 4's volume before each step
    const VectorKernels* kernel = nullptr;  ///< single precision: null is the fastest this processor has
};

/// What a step did.
struct StepReport {
    int substeps = 0;             ///< symplectic Euler steps taken
    int iterations = 0;           ///< implicit: evaluations of the forces
    double residual = 0;          ///< implicit: Euclidean norm of what is left [N]
    bool converged = true;        ///< implicit: residual below the tolerance; linearised: a step was found
    double volume = 0;            ///< with StepOptions::volume: Eq. 4 before the step [m^3]
    double pressure = 0;          ///< of the volume term, mean over the step [Pa]; see VolumeTerm
    Index not_finite = no_index;  ///< first vertex that left the numbers; the state is then the last good one
};

/// Scratch memory, threads and factorisations for stepping one body with one set of options. May be thrown
/// away between steps. Keeps a reference to the body, which must stay where it is.
class Workspace {
  public:
    /// Throws InputError if dt is not positive and finite, or if symplectic Euler was asked for and would
    /// need more than max_substeps.
    Workspace(const Body& body, const StepOptions& options);
    ~Workspace();
    Workspace(Workspace&&) noexcept;
    Workspace& operator=(Workspace&&) noexcept;

    Integrator integrator() const;  ///< never automatic
    Precision precision()
        const;  ///< full where single is not possible: free bodies, implicit, numbers too far apart
    int substeps() const;                  ///< per step of dt; 1 when implicit
    const ContactReport& contact() const;  ///< of the last step with tools

    /// Goes on with the body, refined or coarsened in place: as costly as the change while symplectic Euler
    /// is used; implicit: a part of the factorisation is made anew. Throws InputError as the constructor
    /// does.
    void adapt(const Body& body, const Transfer& transfer);

    /// Room for so many more vertices.
    void reserve(std::size_t vertices);

    struct Data;
    std::unique_ptr<Data> data;
};

/// Advances `state` by `count` steps of dt. For a held body nothing is allocated after the first
/// step, but in implicit steps where a tool meets the inside of triangles. The same bits for any number of
/// threads. In single precision `state` is read at the start and written at the end, so that many steps at a
/// time cost less than each alone; their bits may differ from it in what rounding does to positions in
/// double. The report is of the last step. `loads` must be valid (require_valid). With tools `automatic` goes
/// implicit at more sub-steps than without: at the first step that has any it may change over, and allocate.
StepReport step(const Body& body, const Loads& loads, State& state, Workspace& workspace, int count = 1);

}  // namespace innerspring
