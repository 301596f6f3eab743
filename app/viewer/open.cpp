#include "open.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>

#include "innerspring/mesh/error.h"

namespace innerspring::viewer {

namespace {

constexpr std::uintmax_t largest_recording = 512u << 20;  ///< [byte]

Scene scene_of(const std::string& what, const std::function<void(Scene&)>& adjust) {
    Scene scene;
    if (what.ends_with(".toml"))
        scene = read_scene(what);
    else
        scene.mesh = what;
    if (adjust) adjust(scene);
    // A recording or a saved scene is opened from elsewhere, too.
    rename_files(scene, [](const std::string& name) {
        std::error_code ignored;
        return std::filesystem::exists(name, ignored) ? std::filesystem::absolute(name).string() : name;
    });
    // What was adjusted must hold as much as what a file says.
    return scene_from_text(to_toml(scene), what);
}

}  // namespace

bool is_recording_file(const std::filesystem::path& file) {
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(file, ignored)) return false;
    std::ifstream in(file, std::ios::binary);
    std::string start(64, '\0');
    in.read(start.data(), 64);
    return is_recording(start.substr(0, std::size_t(in.gcount())));
}

Recording read_recording(const std::filesystem::path& file) {
    std::error_code failed;
    const auto size = std::filesystem::file_size(file, failed);
    if (failed) throw InputError(fmt::format("{}: cannot be read: {}", file.string(), failed.message()));
    if (size > largest_recording) throw InputError(fmt::format("{}: too big for a recording", file.string()));
    std::ifstream in(file, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    return recording_from_text(text, file.string());
}

std::unique_ptr<Rig> open_rig(const OpenRequest& request) {
    if (request.what.empty() || request.what.size() > 2)
        throw InputError("expected one mesh, scene or recording, or two side by side");
    if (request.what.size() == 1 && is_recording_file(request.what[0])) {
        if (!request.compare.empty()) throw InputError("a recording knows its bodies; leave --compare out");
        return std::make_unique<Rig>(read_recording(request.what[0]));
    }
    std::vector<Scene> scenes;
    for (const std::string& what : request.what) scenes.push_back(scene_of(what, request.adjust));
    if (!request.compare.empty()) {
        if (scenes.size() > 1) throw InputError("two bodies are compared already; leave --compare out");
        const Scene one = scenes[0];
        scenes.clear();
        for (Scheme scheme : request.compare) {
            scenes.push_back(one);
            scenes.back().scheme = scheme;
        }
    }
    return std::make_unique<Rig>(scenes);
}

}  // namespace innerspring::viewer
