#pragma once
#include <functional>

#include "rig.h"

namespace innerspring::viewer {

/// What to open: a mesh, a built-in shape, a scene (.toml), a recording of a session, or the folder that
/// `simulate` wrote.
struct OpenRequest {
    std::vector<std::string> what;  ///< one, or two to see side by side
    std::function<void(Scene&)> adjust =
        {};                            ///< what the command line says over meshes and scenes; may be empty
    std::vector<Scheme> compare = {};  ///< the first body once for each of these, side by side
};

/// Throws InputError. A recording is taken as it is: nothing is adjusted.
std::unique_ptr<Rig> open_rig(const OpenRequest& request);

/// Throws InputError if the file is missing, too big or not a recording.
Recording read_recording(const std::filesystem::path& file);
bool is_recording_file(const std::filesystem::path& file);

}  // namespace innerspring::viewer
