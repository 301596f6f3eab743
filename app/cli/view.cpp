#include <fmt/format.h>

#include <memory>
#include <tuple>

#include "commands.h"
#include "innerspring/mesh/error.h"
#include "options.h"

#ifdef INNERSPRING_VIEWER
#include "offscreen.h"
#include "open.h"
#include "window.h"
#endif

using namespace innerspring;

namespace {

struct Arguments {
    MeshOptions mesh;
    BodyArguments body;
    MotionArguments motion;
    std::string beside, compare, colour, camera, size, screenshot, movie;
    double after = 0, rate = 25, scale = 1;
    bool flat = false, edges = false, homes = false, tetrahedra = false, no_ground = false, panel = false;
    bool replay = false;
};

#ifdef INNERSPRING_VIEWER

std::vector<Scheme> parse_schemes(const std::string& text) {
    const std::size_t comma = text.find(',');
    if (comma == std::string::npos)
        throw InputError(fmt::format("--compare '{}': expected two schemes, as in B,C", text));
    return {parse_scheme(text.substr(0, comma)), parse_scheme(text.substr(comma + 1))};
}

int run(const Arguments& a) {
    viewer::OpenRequest open;
    open.what = {a.mesh.mesh.empty() ? "breast" : a.mesh.mesh};
    if (!a.beside.empty()) open.what.push_back(a.beside);
    if (!a.compare.empty()) open.compare = parse_schemes(a.compare);
    open.adjust = [&a](Scene& scene) {
        apply(a.mesh, scene);
        apply(a.body, scene);
        apply(a.motion, scene);
    };
    viewer::PictureRequest picture;
    viewer::Look& look = picture.look;
    if (!a.colour.empty()) look.colour = viewer::parse_colour(a.colour);
    look.flat = a.flat, look.wireframe = a.edges, look.homes = a.homes, look.tetrahedra = a.tetrahedra;
    look.ground = !a.no_ground;
    if (!a.camera.empty()) picture.camera = viewer::parse_camera(a.camera);
    if (!a.size.empty()) std::tie(picture.width, picture.height) = parse_size(a.size);

    if (a.replay) {
        const viewer::Recording recording = viewer::read_recording(a.mesh.mesh);
        const std::uint64_t hash = viewer::replay(recording)->hash();
        fmt::print("{}: {} inputs, {} steps, state hash {:016x}, {}\n", a.mesh.mesh, recording.inputs.size(),
                   recording.ticks, hash, hash == recording.hash ? "as recorded" : "NOT AS RECORDED");
        return hash == recording.hash ? 0 : 1;
    }
    if (!a.screenshot.empty() || !a.movie.empty()) {
        picture.after = a.after, picture.rate = a.rate, picture.scale = a.scale, picture.panel = a.panel;
        picture.screenshot = a.screenshot, picture.movie = a.movie;
        if (!(picture.rate > 0 && picture.scale >= 0.5 && picture.scale <= 4))
            throw InputError("--fps must be positive, --text-scale from 0.5 to 4");
        const bool frames = open.what.size() == 1 && viewer::Playback::is_one(open.what[0]);
        if (frames && !open.compare.empty())
            throw InputError("recorded frames are of one body; leave --compare out");
        int written = 0;
        if (frames) {
            viewer::Playback playback(open.what[0]);
            written = viewer::take_pictures(playback, picture);
        } else {
            written = viewer::take_pictures(*viewer::open_rig(open), picture);
        }
        fmt::print("{} picture{} of {} x {} written to {}\n", written, written == 1 ? "" : "s", picture.width,
                   picture.height, a.screenshot.empty() ? a.movie : a.screenshot);
        return 0;
    }
    viewer::WindowOptions window;
    window.open = open;
    window.look = look;
    if (!a.camera.empty()) window.camera = picture.camera;
    if (!a.size.empty()) window.size = {picture.width, picture.height};
    viewer::run_window(window);
    return 0;
}

#else

int run(const Arguments&) {
    throw RunError(
        "this program was built without the window (libglfw3-dev, libepoxy-dev, libimgui-dev, libstb-dev); "
        "'innerspring simulate' writes frames and pictures");
}

#endif

}  // namespace

Command add_view(CLI::App& program) {
    CLI::App* app =
        program.add_subcommand("view", "The window: touch the body; or pictures of it without a display");
    auto a = std::make_shared<Arguments>();
    add_mesh_options(*app, a->mesh,
                     "surface, scene file (.toml), recording of a session, or the folder of a simulation "
                     "(default breast)");
    app->get_option("mesh")->required(false);
    app->add_option("--beside", a->beside, "another surface or scene, side by side under the same hand")
        ->type_name("MESH");
    app->add_option("--compare", a->compare, "the body twice, in two schemes side by side, as in B,C")
        ->type_name("S,S");
    app->add_option("--colour,--color", a->colour,
                    "plain, displacement, m, K, strain, pressure, contact or spacing (default displacement)")
        ->type_name("NAME");
    app->add_option("--camera", a->camera,
                    "from where: azimuth, elevation [degree] and zoom [1] (default 30,20,1)")
        ->type_name("A,E[,Z]");
    app->add_flag("--flat", a->flat, "shaded by triangle");
    app->add_flag("--edges", a->edges, "with the mesh's edges");
    app->add_flag("--homes", a->homes, "with the home positions");
    app->add_flag("--tetrahedra", a->tetrahedra, "with the edges of the virtual tetrahedra");
    app->add_flag("--no-ground", a->no_ground, "without the ground");
    app->add_option("--screenshot", a->screenshot, "no window: a picture, after --after")
        ->type_name("FILE.png");
    app->add_option("--movie", a->movie, "no window: frame_000000.png ... until --after")->type_name("DIR");
    app->add_option("--after", a->after, "simulated time of the picture [s] (default 0)")->type_name("S");
    app->add_option("--fps", a->rate, "frames of a movie per simulated second (default 25)")->type_name("N");
    app->add_option("--size", a->size, "of window or picture [pixel] (default 1280x720)")->type_name("WxH");
    app->add_option("--text-scale", a->scale, "size of text in pictures (default 1)")->type_name("X");
    app->add_flag("--panel", a->panel, "pictures with the window's panel");
    app->add_flag("--replay", a->replay, "no window: play a recording of a session, compare the state hash");
    add_body_options(*app, a->body);
    add_motion_options(*app, a->motion);
    app->footer(
        "In the window, ? shows keys and mouse. docs/viewer.md shows pictures and how they were made.");
    return {app, [a] { return run(*a); }};
}
