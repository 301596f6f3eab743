#pragma once
#include "innerspring/sim/forces.h"
#include "innerspring/sim/vector_kernels.h"

namespace innerspring {

/// Some vertices of a net, each with a spring of d_i to a place z_i, in colours: vertices of one colour are
/// no neighbours, so that their order is of no matter and they move side by side.
class Settling {
  public:
    Settling(const Body& body, std::span<const Index> vertices, std::span<const double> d,
             const std::vector<Vector>& z);

    /// Each vertex once, its neighbours held where they are by then; colour by colour, or back.
    void sweep(const VectorKernels& kernels, std::vector<Vector>& x, bool back) const;

    std::size_t colours() const { return starts_.size() - 1; }

  private:
    std::vector<std::size_t> starts_;  ///< per colour, its first group; and the end
    std::vector<SettleGroup> groups_;
    std::vector<SettleSlot> slots_;
};

}  // namespace innerspring
