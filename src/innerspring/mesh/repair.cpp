#include "innerspring/mesh/repair.h"

#include <fmt/format.h>

#include <algorithm>

#include "innerspring/mesh/connectivity.h"

namespace innerspring {

namespace {

void tell(std::vector<std::string>& actions, std::size_t count, const char* verb, const char* one,
          const char* many) {
    if (count > 0) actions.push_back(fmt::format("{} {} {}", verb, count, count == 1 ? one : many));
}

}  // namespace

Repaired repair(const SurfaceMesh& mesh, const WeldOptions& options) {
    Welded welded = weld(mesh, options);
    SurfaceMesh& m = welded.mesh;
    Repaired repaired;
    auto& actions = repaired.actions;
    tell(actions, welded.merged, "merged", "vertex into another at its place",
         "vertices into others at their places");

    const std::vector<Flaw> flaws = find_flaws(m.positions, m.triangles);
    std::vector<Triangle> kept;
    for (std::size_t t = 0; t < flaws.size(); ++t)
        if (flaws[t] == Flaw::none || flaws[t] == Flaw::flat) kept.push_back(m.triangles[t]);
    const auto count = [&](Flaw f) { return std::size_t(std::ranges::count(flaws, f)); };
    tell(actions, count(Flaw::degenerate), "dropped", "triangle without area", "triangles without area");
    tell(actions, count(Flaw::duplicate), "dropped", "duplicate triangle", "duplicate triangles");
    tell(actions, count(Flaw::folded), "dropped", "triangle folded onto another",
         "triangles folded onto one another");

    const Pieces found = find_pieces(m.positions, kept, build_topology(m.positions.size(), kept));
    m.triangles = oriented(kept, found);
    std::size_t turned = 0, turned_pieces = 0, in_pieces = 0;
    for (const Piece& piece : found.pieces) {
        turned += piece.against;
        if (!inside_out(piece)) continue;
        ++turned_pieces;
        in_pieces += piece.triangles;
    }
    tell(actions, turned, "turned", "triangle round to face as its neighbours do",
         "triangles round to face as their neighbours do");
    if (turned_pieces > 0)
        actions.push_back(
            fmt::format("turned {} right side out ({} triangles)",
                        turned_pieces == 1 ? "1 piece" : fmt::format("{} pieces", turned_pieces), in_pieces));

    Welded used = weld(m);  // all that it can find now is vertices that lost their last triangle
    tell(actions, welded.unused + used.unused, "dropped", "unused vertex", "unused vertices");
    repaired.mesh = std::move(used.mesh);
    repaired.new_from_old = std::move(welded.new_from_old);
    for (Index& v : repaired.new_from_old)
        if (v != no_index) v = used.new_from_old[v];
    return repaired;
}

}  // namespace innerspring
