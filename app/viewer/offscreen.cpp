#include "offscreen.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "gui.h"
#include "innerspring/mesh/error.h"
#include "innerspring/mesh/write.h"
#include "stage.h"

namespace innerspring::viewer {

struct Studio::Parts {
    Offscreen context;
    Canvas canvas;
    Gui gui;
    Stage stage;
    PanelState panel;
    std::optional<Camera> camera;
    explicit Parts(const PictureRequest& r) : canvas(r.width, r.height), gui(r.scale) { panel.look = r.look; }
};

Studio::Studio(const PictureRequest& request) : request_(request), parts_(std::make_unique<Parts>(request)) {}
Studio::~Studio() = default;

Image Studio::picture(const Snapshot& snapshot, const History& history) {
    Parts& p = *parts_;
    if (!p.camera) {
        p.camera.emplace();
        p.camera->azimuth = request_.camera.azimuth, p.camera->elevation = request_.camera.elevation;
        fit(*p.camera, snapshot);
        zoom(*p.camera, request_.camera.zoom);
    }
    const double width = request_.width, height = request_.height, side = panel_width(request_.scale);
    const double left = request_.panel && width > 1.5 * side ? width - side : width;
    make_room(*p.camera, snapshot, p.panel.look.colour, {0, 0, left, height}, request_.scale);
    // The first frame of a panel measures its text; what is read is drawn after that.
    for (int pass = 0; pass < (request_.panel ? 2 : 1); ++pass) {
        p.canvas.bind();
        p.gui.begin(width, height, 1, 1.0 / 60, {});
        p.stage.draw(snapshot, p.panel.look, *p.camera, {0, 0, left, height}, height, 1, request_.scale, 0);
        if (left < width)
            draw_panel(snapshot, history, p.panel, {left, 0, side, height}, true, request_.scale);
        p.gui.end();
    }
    return p.canvas.read();
}

namespace {

void make_folder(const std::filesystem::path& folder) {
    if (folder.empty()) return;
    std::error_code failed;
    std::filesystem::create_directories(folder, failed);
    if (failed) throw RunError(fmt::format("{}: cannot be made: {}", folder.string(), failed.message()));
}

std::string frame_name(int frame) {
    return fmt::format("frame_{:06d}.png", frame);
}

}  // namespace

int take_pictures(Playback& playback, const PictureRequest& request) {
    Studio studio(request);
    make_folder(request.movie);
    History history;
    int written = 0;
    std::size_t frame = 0;
    do {
        playback.show(frame);
        history.add(playback.snapshot());
        if (!request.movie.empty())
            write_whole(request.movie / frame_name(written++),
                        to_png(studio.picture(playback.snapshot(), history)));
    } while (++frame < playback.frames() && playback.time_of(frame) <= request.after * (1 + 1e-9));
    if (request.screenshot.empty()) return written;
    write_whole(request.screenshot, to_png(studio.picture(playback.snapshot(), history)));
    return written + 1;
}

int take_pictures(Rig& rig, const PictureRequest& request) {
    const double dt = rig[0].dt();
    const double steps = std::round(request.after / dt);
    if (!(steps >= 0 && steps <= 1e8))
        throw InputError(
            fmt::format("--after {:g}: expected a time from 0 to {:g} s", request.after, 1e8 * dt));
    Studio studio(request);
    make_folder(request.movie);
    Capture capture;
    Snapshot snapshot;
    History history;
    int written = 0, frames = 0;
    const auto every = std::uint64_t(std::max(1.0, std::round(1 / (request.rate * dt))));
    for (std::uint64_t tick = 0;; ++tick) {
        const bool last = tick >= std::uint64_t(steps),
                   in_movie = !request.movie.empty() && tick % every == 0;
        const bool sampled =
            request.panel && tick % std::max<std::uint64_t>(1, std::uint64_t(steps) / 400) == 0;
        if (last || in_movie || sampled) {
            capture(rig, snapshot);
            history.add(snapshot);
        }
        if (in_movie) {
            write_whole(request.movie / frame_name(frames++), to_png(studio.picture(snapshot, history)));
            ++written;
        }
        if (last) break;
        if (!rig.advance())
            for (std::size_t n = 0; n < rig.size(); ++n)
                if (!rig[n].failure().empty()) throw RunError(rig[n].failure());
    }
    if (!request.screenshot.empty()) {
        write_whole(request.screenshot, to_png(studio.picture(snapshot, history)));
        ++written;
    }
    return written;
}

}  // namespace innerspring::viewer
