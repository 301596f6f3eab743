#pragma once
#include <filesystem>
#include <optional>

#include "panel.h"
#include "playback.h"
#include "rig.h"

namespace innerspring::viewer {

struct PictureRequest {
    int width = 1280, height = 720;  ///< [pixel]
    double after = 0;                ///< simulated time of the picture, or the end of the movie [s]
    double rate = 25;                ///< movie: frames per simulated second
    double scale = 1;                ///< of the text
    Look look;
    CameraOption camera;
    bool panel = false;                ///< the window's panel at the right
    std::filesystem::path screenshot;  ///< PNG; empty: none
    std::filesystem::path movie;       ///< folder for frame_000000.png ...; empty: none
};

/// Steps the rig in simulated time, so that the same request gives the same picture however fast the machine
/// is, and draws it with the window's renderer, without a display. Returns how many pictures were written.
/// Throws RunError without OpenGL 3.3, if a file cannot be written, or if a body left the numbers.
int take_pictures(Rig& rig, const PictureRequest& request);

/// The frames of a simulation instead: `after` is the time of the picture; the movie has every frame up to
/// it.
int take_pictures(Playback& playback, const PictureRequest& request);

/// Draws snapshots without a display.
class Studio {
  public:
    explicit Studio(const PictureRequest& request);
    ~Studio();
    Image picture(const Snapshot& snapshot, const History& history);

  private:
    struct Parts;
    PictureRequest request_;
    std::unique_ptr<Parts> parts_;
};

}  // namespace innerspring::viewer
