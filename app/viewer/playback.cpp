#include "playback.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "innerspring/mesh/error.h"
#include "innerspring/record/setup.h"
#include "innerspring/record/vtk_read.h"

namespace innerspring::viewer {

namespace {

std::filesystem::path collection_of(const std::filesystem::path& path) {
    std::error_code ignored;
    return std::filesystem::is_directory(path, ignored) ? path / "frames.pvd" : path;
}

std::vector<double> scalars(const VtpData& data, std::string_view name) {
    for (const auto& [field, values] : data.fields)
        if (field == name && values.size() == data.positions.size()) return values;
    return {};
}

}  // namespace

bool Playback::is_one(const std::filesystem::path& path) {
    std::error_code ignored;
    return std::filesystem::is_directory(path, ignored) || path.extension() == ".pvd";
}

Playback::Playback(const std::filesystem::path& path) {
    const std::filesystem::path file = collection_of(path);
    for (const Frame& frame : read_pvd(file))
        frames_.push_back({frame.time, file.parent_path() / frame.file});
    if (frames_.empty()) throw InputError(fmt::format("{}: names no frame", file.string()));
    try {
        const auto scene = file.parent_path() / "scene.resolved.toml";
        std::error_code ignored;
        if (std::filesystem::exists(scene, ignored))
            for (const SceneTool& tool : read_scene(scene).tools) tools_.push_back(to_tool(tool));
    } catch (const InputError& error) {  // the frames are shown without
        tools_.clear();
        note_ = fmt::format("tools are not shown: {}", error.what());
    }
    show(0);
}

void Playback::show(std::size_t frame) {
    at_ = std::min(frame, frames_.size() - 1);
    const VtpData data = read_vtp(frames_[at_].file);
    BodySnapshot body;
    std::vector<Vector> u(data.positions.size(), Vector::Zero());
    for (const auto& [field, values] : data.fields)
        if (field == "displacement_m" && values.size() == 3 * u.size())
            for (std::size_t i = 0; i < u.size(); ++i)
                u[i] = {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
    SurfaceMesh rest{frames_[at_].file.parent_path().parent_path().filename().string(), data.positions,
                     data.triangles};
    for (std::size_t i = 0; i < u.size(); ++i) rest.positions[i] -= u[i];
    const Surface* before = snapshot_.bodies.empty() ? nullptr : snapshot_.bodies[0].surface.get();
    if (before && before->triangles == rest.triangles && before->rest.size() == u.size()) {
        body.surface = snapshot_.bodies[0].surface;
    } else {
        Surface surface = surface_of(rest);
        surface.m = scalars(data, "m_kg"), surface.K = scalars(data, "K_n_m");
        surface.centre.position = (surface.lower + surface.upper) / 2;
        body.surface = std::make_shared<const Surface>(std::move(surface));
    }
    body.u.resize(u.size());
    for (std::size_t i = 0; i < u.size(); ++i) {
        for (int k = 0; k < 3; ++k) body.u[i][k] = float(u[i][k]);
        body.max_displacement = std::max(body.max_displacement, u[i].norm());
    }
    const double V = volume(body.surface->rest, body.surface->triangles);
    body.volume_variation_percent = 100 * (volume(data.positions, data.triangles) / V - 1);
    body.simulated = false;
    for (const Tool& tool : tools_) body.tools.push_back(tool_at(tool, frames_[at_].time));
    snapshot_.bodies = {std::move(body)};
    snapshot_.time = frames_[at_].time;
    ++snapshot_.taken;
}

void Playback::show_time(double time) {
    const auto after = std::upper_bound(frames_.begin(), frames_.end(), time,
                                        [](double t, const Known& f) { return t < f.time; });
    const std::size_t frame = after == frames_.begin() ? 0 : std::size_t(after - frames_.begin()) - 1;
    if (frame != at_) show(frame);
}

}  // namespace innerspring::viewer
