#include "innerspring/mesh/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "innerspring/mesh/connectivity.h"
#include "innerspring/mesh/error.h"
#include "innerspring/mesh/self_intersection.h"
#include "innerspring/mesh/team.h"
#include "innerspring/mesh/weld.h"

namespace innerspring {

namespace {

constexpr auto fix_advice = "usable with --fix (innerspring check MESH --fix -o OUT)";
constexpr double no_volume = 1e-12;          // |V| below this part of area times diagonal is rounding error
constexpr double nearly_the_same = 1e-6;     // of the diagonal: vertices that were surely meant to be one
constexpr std::size_t max_tests = 50000000;  // pairs of triangles looked at for crossings, some seconds

/// The mesh as repair() would leave it; check() looks for the rest of the faults there, so that none is
/// reported twice.
struct Tidy {
    std::vector<Flaw> flaws;
    std::vector<Index> old;           // per kept triangle its number in the mesh
    std::vector<Triangle> triangles;  // kept, as they stand
    Topology topology;
    Pieces pieces;
    std::vector<Triangle> oriented;
    std::vector<Index> starts;  // see component_starts()
    std::vector<Index> joints;  // see non_manifold_vertices()
};

Tidy make_tidy(const SurfaceMesh& mesh) {
    Tidy tidy;
    // Two things at a time; waking another thread is not worth it for a few.
    Team team(mesh.triangles.size() < 16000 ? 1 : 2);
    team.run(2, [&](std::size_t part) {
        if (part == 0)
            tidy.flaws = find_flaws(mesh.positions, mesh.triangles);
        else
            tidy.topology = build_topology(mesh.positions.size(), mesh.triangles);
    });
    for (Index t = 0; t < mesh.triangles.size(); ++t)
        if (tidy.flaws[t] == Flaw::none || tidy.flaws[t] == Flaw::flat) {
            tidy.old.push_back(t);
            tidy.triangles.push_back(mesh.triangles[t]);
        }
    if (tidy.triangles.size() < mesh.triangles.size())
        tidy.topology = build_topology(mesh.positions.size(), tidy.triangles);
    team.run(2, [&](std::size_t part) {
        if (part == 0) {
            tidy.pieces = find_pieces(mesh.positions, tidy.triangles, tidy.topology);
            tidy.oriented = oriented(tidy.triangles, tidy.pieces);
        } else {
            tidy.starts = component_starts(tidy.triangles, tidy.topology);
            tidy.joints = non_manifold_vertices(tidy.triangles, tidy.topology);
        }
    });
    return tidy;
}

Finding fine(const char* what) {
    Finding f;
    f.what = what;
    return f;
}

std::string some(std::size_t count, const char* one, const char* many) {
    return count == 1 ? fmt::format("1 {}", one) : fmt::format("{} {}", count, many);
}

std::string edge_text(const Tidy& tidy, Index e) {
    const auto at = tidy.topology.edge_triangles[e];
    const Edge& edge = tidy.topology.edges[e];
    return fmt::format("edge {}-{} of triangle {}, used by {}", edge.a, edge.b, tidy.old[at[0]],
                       some(at.size(), "triangle", "triangles"));
}

std::string triangle_text(const SurfaceMesh& mesh, Index t) {
    const auto& [i, j, k] = mesh.triangles[t];
    return fmt::format("triangle {} (vertices {}, {}, {})", t, i, j, k);
}

/// Edges of which `bad(number of triangles)`: their count and the first one.
template <class Bad>
Finding edge_finding(const char* what, const Tidy& tidy, Bad bad) {
    Finding f = fine(what);
    for (Index e = 0; e < tidy.topology.edges.size(); ++e)
        if (bad(tidy.topology.edge_triangles[e].size()) && f.count++ == 0) f.first = edge_text(tidy, e);
    if (f.count > 0) f.verdict = Verdict::unusable;
    return f;
}

Finding find_closed(const SurfaceMesh& mesh, const Tidy& tidy, double diagonal) {
    Finding f = edge_finding("closed", tidy, [](std::size_t n) { return n == 1; });
    if (f.count == 0) return f;
    f.advice =
        "close the holes in a mesh editor (MeshLab: Close Holes; Blender: Fill Holes) or mesh the shape anew";
    SurfaceMesh rim{{}, mesh.positions, {}};
    for (Index e = 0; e < tidy.topology.edges.size(); ++e)
        if (const auto& [a, b] = tidy.topology.edges[e]; tidy.topology.edge_triangles[e].size() == 1)
            rim.triangles.push_back({a, b, a});
    if (diagonal > 0 && std::isfinite(diagonal) &&
        weld(rim, {.tolerance = nearly_the_same * diagonal}).merged > 0)
        f.advice = fmt::format("vertices at the holes nearly coincide: try --weld {:.1g}; otherwise {}",
                               nearly_the_same * diagonal, f.advice);
    return f;
}

Finding find_manifold_edges(const Tidy& tidy) {
    Finding f = edge_finding("manifold_edges", tidy, [](std::size_t n) { return n > 2; });
    if (f.count > 0)
        f.advice =
            "remove inner walls and fins in a mesh editor (MeshLab: Repair non Manifold Edges), or unite the "
            "parts and remesh";
    return f;
}

Finding find_manifold_vertices(const SurfaceMesh& mesh, const Tidy& tidy) {
    Finding f = fine("manifold_vertices");
    const std::vector<Index>& bad = tidy.joints;
    if (bad.empty()) return f;
    const Vector& p = mesh.positions[bad[0]];
    f.verdict = Verdict::unusable;
    f.count = bad.size();
    f.first = fmt::format("vertex {} at ({:g}, {:g}, {:g}), where parts meet in a point only", bad[0], p[0],
                          p[1], p[2]);
    f.advice = "split the vertex in a mesh editor (MeshLab: Repair non Manifold Vertices), or remesh";
    return f;
}

Finding find_oriented(const SurfaceMesh& mesh, const Tidy& tidy) {
    Finding f = fine("oriented");
    for (const Piece& piece : tidy.pieces.pieces)
        if (piece.one_sided && f.count++ == 0)
            f.first = fmt::format("the piece of triangle {} has one side only", tidy.old[piece.first]);
    if (f.count > 0) {
        f.verdict = Verdict::unusable;
        f.advice = "no orientation fits (as on a Klein bottle): give a surface with an inside";
        return f;
    }
    for (std::size_t t = 0; t < tidy.triangles.size(); ++t)
        if (tidy.pieces.against[t] && f.count++ == 0)
            f.first = triangle_text(mesh, tidy.old[t]) + " faces against its neighbours";
    if (f.count > 0) {
        f.verdict = Verdict::usable;
        f.advice = fix_advice;
    }
    return f;
}

Finding find_inside_out(const Tidy& tidy) {
    Finding f = fine("inside_out");
    for (const Piece& piece : tidy.pieces.pieces)
        if (inside_out(piece) && f.count++ == 0)
            f.first = fmt::format("the piece of triangle {} ({}, volume {:.4g} m^3)", tidy.old[piece.first],
                                  some(piece.triangles, "triangle", "triangles"), piece.volume);
    if (f.count == 0) return f;
    f.verdict = Verdict::usable;
    f.advice = fix_advice;
    return f;
}

Finding find_components(const Tidy& tidy, const std::vector<Index>& starts) {
    Finding f = fine("components");
    if (starts.size() <= 1) return f;
    f.verdict = Verdict::usable;
    f.count = starts.size();
    f.first = fmt::format("triangle {} begins the second of {} pieces", tidy.old[starts[1]], starts.size());
    f.advice =
        "usable with --centre local: separate pieces with no spring between them would share one centre";
    for (const Piece& piece : tidy.pieces.pieces) {
        if (!piece.nested) continue;
        const Index first = tidy.old[piece.first];
        if (piece.volume < 0)
            f.advice += fmt::format("; the piece of triangle {} is a cavity", first);
        else
            f.advice +=
                fmt::format("; the piece of triangle {} lies inside another: its volume counts twice", first);
        break;
    }
    return f;
}

Finding find_degenerate(const SurfaceMesh& mesh, const Tidy& tidy) {
    Finding f = fine("degenerate");
    bool droppable = false;
    for (Index t = 0; t < tidy.flaws.size(); ++t) {
        if (tidy.flaws[t] != Flaw::degenerate && tidy.flaws[t] != Flaw::flat) continue;
        droppable = droppable || tidy.flaws[t] == Flaw::degenerate;
        if (f.count++ == 0) f.first = triangle_text(mesh, t) + " has no area";
    }
    if (f.count == 0) return f;
    f.verdict = Verdict::usable;
    f.advice =
        droppable ? fix_advice : "usable; to be rid of them collapse their shortest edges in a mesh editor";
    const auto only_flat = [&](Index v) {
        const auto fan = tidy.topology.vertex_triangles[v];
        return !fan.empty() &&
               std::ranges::all_of(fan, [&](Index t) { return tidy.flaws[tidy.old[t]] == Flaw::flat; });
    };
    for (Index v = 0; v < mesh.positions.size(); ++v)
        if (only_flat(v)) {
            f.verdict = Verdict::unusable;
            f.first = fmt::format("no triangle of vertex {} has an area, it would get no mass", v);
            f.advice =
                "collapse the edges of no length in a mesh editor, or weld with a tolerance (--weld TOL)";
            break;
        }
    return f;
}

Finding find_duplicate(const SurfaceMesh& mesh, const Tidy& tidy) {
    Finding f = fine("duplicate");
    for (Index t = 0; t < tidy.flaws.size(); ++t) {
        if (tidy.flaws[t] != Flaw::duplicate && tidy.flaws[t] != Flaw::folded) continue;
        if (f.count++ == 0)
            f.first =
                triangle_text(mesh, t) + (tidy.flaws[t] == Flaw::folded ? " lies back to back with another"
                                                                        : " has the vertices of another");
    }
    if (f.count == 0) return f;
    f.verdict = Verdict::usable;
    f.advice = fix_advice;
    return f;
}

Finding find_self_intersections(const SurfaceMesh& mesh, const Tidy& tidy, const CheckOptions& options) {
    Finding f = fine("self_intersections");
    const SelfIntersections found =
        search_self_intersections({{}, mesh.positions, tidy.triangles}, options.max_pairs, max_tests);
    f.count = found.pairs.size();
    if (f.count > 0) {
        f.verdict = Verdict::usable;
        f.first = fmt::format("triangles {} and {} cross", tidy.old[found.pairs[0].first],
                              tidy.old[found.pairs[0].second]);
        f.advice =
            "usable, but volume and mass count overlaps twice; unite the parts in a mesh editor to be rid of "
            "them";
    }
    if (!found.complete) {
        f.verdict = Verdict::usable;
        f.advice += fmt::format("{}not all pairs of triangles were looked at, there may be more",
                                f.count > 0 ? "; " : "");
    }
    return f;
}

/// V_t > 0 about the centroid for every triangle?
Finding find_star_shaped(const SurfaceMesh& mesh, const Tidy& tidy, CheckReport& report) {
    Finding f = fine("star_shaped");
    double negative = 0, sum = 0;
    for (std::size_t t = 0; t < tidy.oriented.size(); ++t) {
        const auto& [i, j, k] = tidy.oriented[t];
        const Vector &a = mesh.positions[i] - report.centroid, b = mesh.positions[j] - report.centroid,
                     c = mesh.positions[k] - report.centroid;
        const double v = a.dot(b.cross(c)) / 6;
        sum += std::abs(v);
        if (v > 0) continue;
        negative -= v;
        if (f.count++ == 0)
            f.first = triangle_text(mesh, tidy.old[t]) + " is not seen from the centroid from within";
    }
    if (f.count == 0) return f;
    report.negative_tetrahedra_by_count = double(f.count) / double(tidy.oriented.size());
    report.negative_tetrahedra_by_volume = sum > 0 ? negative / sum : 0;
    f.verdict = Verdict::usable;
    f.advice = fmt::format(
        "usable with --centre local or auto: {:.1f} % of the virtual tetrahedra about the centroid are "
        "negative",
        100 * report.negative_tetrahedra_by_count);
    return f;
}

/// Fills in what is measured and returns the finding about it.
Finding measure(const SurfaceMesh& mesh, const Tidy& tidy, bool closed, CheckReport& report) {
    Finding f = fine("size");
    f.verdict = Verdict::unusable;
    f.count = 1;
    if (mesh.triangles.empty()) {
        f.first = "the mesh has no triangle";
        f.advice = "give a closed triangle surface";
        return f;
    }
    std::vector<bool> used(mesh.positions.size(), false);
    for (const Triangle& t : mesh.triangles)
        for (Index v : t) used[v] = true;
    std::vector<Vector> corners;
    for (Index v = 0; v < used.size(); ++v) {
        if (!used[v]) continue;
        corners.push_back(mesh.positions[v]);
        if (corners.back().allFinite()) continue;
        f.first = fmt::format("vertex {} at ({}, {}, {}) is not finite", v, corners.back()[0],
                              corners.back()[1], corners.back()[2]);
        f.advice = "correct the coordinates in the file";
        return f;
    }
    std::tie(report.lower, report.upper) = bounding_box(corners);
    const double diagonal = (report.upper - report.lower).norm();
    report.centroid = vertex_mean(corners);
    report.volume_m3 = volume(mesh);
    for (double a : triangle_areas(mesh.positions, mesh.triangles)) report.area_m2 += a;
    double sum = 0;
    report.edge_min_m = tidy.topology.edges.empty() ? 0 : INFINITY;
    for (const Edge& e : tidy.topology.edges) {
        const double length = (mesh.positions[e.a] - mesh.positions[e.b]).norm();
        report.edge_min_m = std::min(report.edge_min_m, length);
        report.edge_max_m = std::max(report.edge_max_m, length);
        sum += length;
    }
    if (!tidy.topology.edges.empty()) report.edge_mean_m = sum / double(tidy.topology.edges.size());

    const double tidy_volume = volume(mesh.positions, tidy.oriented);
    const double rounding = no_volume * report.area_m2 * diagonal;
    if (diagonal == 0) {
        f.first = "all vertices are at one point";
        f.advice = "look at the file and at --unit";
    } else if (!std::isfinite(report.area_m2 * diagonal) || !std::isfinite(tidy_volume)) {
        f.first = fmt::format("the bounding box has a diagonal of {:g} m", diagonal);
        f.advice = "scale the mesh down: its volume is too large for a number";
    } else if (tidy.triangles.empty() || (closed && std::abs(tidy_volume) <= rounding)) {
        f.first = "the surface encloses no volume";
        f.advice = "give the surface a thickness, or look at the file and at --unit";
    } else if (closed && tidy_volume < 0) {
        f.first = fmt::format(
            "the enclosed volume is negative ({:.4g} m^3): cavities are larger than what they lie in",
            tidy_volume);
        f.advice = "turn the surface round or take it apart in a mesh editor";
    } else {
        f = fine("size");
    }
    if (f.verdict == Verdict::fine && std::abs(tidy_volume) > rounding)
        report.centroid = volume_centroid(mesh.positions, tidy.oriented);
    return f;
}

/// What an unusable or repairable finding means, in words.
std::string problem(const Finding& f) {
    if (f.what == "closed")
        return fmt::format("the surface is not closed ({})", some(f.count, "open edge", "open edges"));
    if (f.what == "manifold_edges")
        return some(f.count, "edge has", "edges have") + " more than two triangles";
    if (f.what == "manifold_vertices")
        return some(f.count, "vertex joins", "vertices join") + " parts that share nothing else";
    if (f.what == "oriented" && f.verdict == Verdict::unusable)
        return some(f.count, "piece has", "pieces have") + " no inside";
    if (f.what == "oriented") return some(f.count, "triangle is", "triangles are") + " turned the wrong way";
    if (f.what == "inside_out") return some(f.count, "piece is", "pieces are") + " inside out";
    if (f.what == "degenerate") return some(f.count, "triangle has", "triangles have") + " no area";
    if (f.what == "duplicate") return some(f.count, "triangle is", "triangles are") + " there twice";
    return "the size is not usable";
}

}  // namespace

namespace {

CheckReport judge(const SurfaceMesh& mesh, const Tidy& tidy, const CheckOptions& options) {
    CheckReport report;
    const std::vector<Index>& starts = tidy.starts;
    report.vertices = mesh.positions.size();
    report.triangles = mesh.triangles.size();
    report.edges = tidy.topology.edges.size();
    report.components = starts.size();

    const bool closed = std::ranges::all_of(tidy.pieces.pieces, &Piece::closed);
    const Finding size = measure(mesh, tidy, closed, report);
    const bool measurable = report.area_m2 > 0 && std::isfinite(report.area_m2);
    auto& findings = report.findings;
    findings.push_back(find_closed(mesh, tidy, (report.upper - report.lower).norm()));
    findings.push_back(find_manifold_edges(tidy));
    findings.push_back(find_manifold_vertices(mesh, tidy));
    const bool manifold = std::ranges::all_of(findings, [](const Finding& f) { return f.count == 0; });
    findings.push_back(find_oriented(mesh, tidy));
    findings.push_back(find_inside_out(tidy));
    findings.push_back(find_components(tidy, starts));
    findings.push_back(find_degenerate(mesh, tidy));
    findings.push_back(find_duplicate(mesh, tidy));
    findings.push_back(options.self_intersections && measurable ? find_self_intersections(mesh, tidy, options)
                                                                : fine("self_intersections"));
    report.self_intersections = findings.back().count;
    findings.push_back(closed && size.verdict == Verdict::fine ? find_star_shaped(mesh, tidy, report)
                                                               : fine("star_shaped"));
    findings.push_back(size);
    for (const Finding& f : findings) report.verdict = std::max(report.verdict, f.verdict);

    // V - E + F = 2 (components - genus)
    if (manifold && !tidy.triangles.empty() && std::ranges::none_of(tidy.pieces.pieces, &Piece::one_sided)) {
        const auto& fans = tidy.topology.vertex_triangles;
        std::ptrdiff_t euler = std::ptrdiff_t(tidy.triangles.size()) - std::ptrdiff_t(report.edges);
        for (std::size_t v = 0; v < fans.size(); ++v) euler += !fans[v].empty();
        report.genus = int(std::ptrdiff_t(starts.size()) - euler / 2);
    }
    return report;
}

}  // namespace

CheckReport check(const SurfaceMesh& mesh, const CheckOptions& options) {
    return judge(mesh, make_tidy(mesh), options);
}

Topology require_usable(const SurfaceMesh& mesh) {
    Tidy tidy = make_tidy(mesh);
    const CheckReport report = judge(mesh, tidy, {.self_intersections = false});
    const auto refuse = [&](const Finding& f) {
        throw InputError(fmt::format("{}: {}; {}; {}", mesh.name, problem(f), f.first, f.advice));
    };
    for (const Finding& f : report.findings)
        if (f.verdict == Verdict::unusable) refuse(f);
    for (const Finding& f : report.findings)
        if (f.advice == fix_advice) refuse(f);
    return std::move(tidy.topology);  // no triangle was left out, or there would be something to fix
}

}  // namespace innerspring
