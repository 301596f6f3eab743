#include <gtest/gtest.h>

#include "heap.h"
#include "innerspring/body/body.h"
#include "innerspring/mesh/shapes.h"

namespace innerspring {
namespace {

/// docs/performance.md: bytes per vertex at the peak and of the body, whatever the number of vertices.
TEST(Memory, BuildingABodyTakesLessThanAKilobyteAVertex) {
    for (const char* shape : {"sphere", "organ"})
        for (const char* vertices : {":vertices=3000", ":vertices=12000"}) {
            SurfaceMesh mesh = make_shape(std::string(shape) + vertices);
            const double n = double(mesh.positions.size());
            const std::size_t before = heap_now() - mesh.positions.size() * sizeof(Vector) -
                                       mesh.triangles.size() * sizeof(Triangle);
            reset_heap_peak();
            const Body body = build_body(std::move(mesh));
            EXPECT_LT(double(heap_peak() - before) / n, 700) << shape << vertices;
            EXPECT_LT(double(heap_now() - before) / n, 420) << shape << vertices;
        }
}

}  // namespace
}  // namespace innerspring
