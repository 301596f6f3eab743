#include "innerspring/record/vtk.h"

#include <fmt/core.h>

#include <bit>
#include <cstdint>
#include <limits>
#include <string_view>
#include <vector>

#include "innerspring/mesh/error.h"
#include "innerspring/record/xml.h"

namespace innerspring {
namespace {

static_assert(sizeof(Vector) == 3 * sizeof(double) && sizeof(Triangle) == 3 * sizeof(Index));

constexpr const char* byte_order = std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian";

// The arrays one after another as they lie in memory, each with its number of bytes in front.
struct Appended {
    std::string bytes;

    // Returns the element that describes the block.
    template <class T>
    std::string add(std::span<const T> values, std::string_view name, int components) {
        constexpr const char* type = std::is_floating_point_v<T> ? "Float64"
                                     : sizeof(T) == 4            ? "Int32"
                                                                 : "Int64";
        const auto offset = bytes.size();
        const std::uint64_t count = values.size_bytes();
        bytes.append(reinterpret_cast<const char*>(&count), sizeof count);
        if (count > 0) bytes.append(reinterpret_cast<const char*>(values.data()), count);
        return fmt::format(
            R"(        <DataArray type="{}" Name="{}" NumberOfComponents="{}" format="appended" offset="{}"/>)"
            "\n",
            type, escape_xml(name), components, offset);
    }

    std::string add(std::span<const Vector> values, std::string_view name) {
        return add(std::span(values.empty() ? nullptr : values[0].data(), 3 * values.size()), name, 3);
    }
};

template <class Int>
std::string add_polygons(Triangles triangles, Appended& appended) {
    std::vector<Int> corners, ends;
    corners.reserve(3 * triangles.size());
    ends.reserve(triangles.size());
    for (const Triangle& t : triangles) {
        for (const Index i : t) corners.push_back(static_cast<Int>(i));
        ends.push_back(static_cast<Int>(corners.size()));
    }
    return appended.add(std::span<const Int>(corners), "connectivity", 1) +
           appended.add(std::span<const Int>(ends), "offsets", 1);
}

std::string add_field(const VertexField& field, std::size_t vertices, Appended& appended) {
    const auto size = std::visit([](auto values) { return values.size(); }, field.values);
    if (size != vertices)
        throw RunError(
            fmt::format("field '{}' has {} values for {} vertices", clean_text(field.name), size, vertices));
    if (const auto* scalars = std::get_if<std::span<const double>>(&field.values))
        return appended.add(*scalars, field.name, 1);
    return appended.add(std::get<std::span<const Vector>>(field.values), field.name);
}

}  // namespace

std::string to_vtp(Positions x, Triangles triangles, std::span<const VertexField> fields) {
    Appended appended;
    const std::string points = appended.add(x, "Points");
    constexpr auto int32_max = static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max());
    const bool narrow = x.size() <= int32_max && triangles.size() <= int32_max / 3;
    const std::string polygons = narrow ? add_polygons<std::int32_t>(triangles, appended)
                                        : add_polygons<std::int64_t>(triangles, appended);
    std::string point_data;
    for (const VertexField& field : fields) point_data += add_field(field, x.size(), appended);

    std::string file = fmt::format(R"(<?xml version="1.0" encoding="UTF-8"?>
<VTKFile type="PolyData" version="1.0" byte_order="{}" header_type="UInt64">
  <PolyData>
    <Piece NumberOfPoints="{}" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="{}">
      <PointData>
{}      </PointData>
      <Points>
{}      </Points>
      <Polys>
{}      </Polys>
    </Piece>
  </PolyData>
  <AppendedData encoding="raw">
_)",
                                   byte_order, x.size(), triangles.size(), point_data, points, polygons);
    return file.append(appended.bytes).append("\n  </AppendedData>\n</VTKFile>\n");
}

std::string to_pvd(std::span<const Frame> frames) {
    std::string file = fmt::format(R"(<?xml version="1.0" encoding="UTF-8"?>
<VTKFile type="Collection" version="1.0" byte_order="{}">
  <Collection>
)",
                                   byte_order);
    for (const Frame& frame : frames)
        file += fmt::format(R"(    <DataSet timestep="{}" group="" part="0" file="{}"/>)"
                            "\n",
                            frame.time, escape_xml(frame.file));
    return file + "  </Collection>\n</VTKFile>\n";
}

}  // namespace innerspring
