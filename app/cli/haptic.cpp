#include <fmt/format.h>

#include <atomic>
#include <csignal>
#include <memory>
#include <tuple>

#include "commands.h"
#include "innerspring/haptic/forcedimension.h"
#include "innerspring/haptic/hand.h"
#include "innerspring/haptic/loop.h"
#include "innerspring/haptic/openhaptics.h"
#include "innerspring/haptic/pointed.h"
#include "innerspring/haptic/press_script.h"
#include "innerspring/haptic/spacenavigator.h"
#include "innerspring/mesh/write.h"
#include "options.h"

#ifdef INNERSPRING_VIEWER
#include "feeling.h"
#include "offscreen.h"
#include "window.h"
#endif

using namespace innerspring;

namespace {

struct Arguments {
    MeshOptions mesh;
    BodyArguments body;
    OutputOptions output;
    std::vector<std::string> tools, refine;
    std::optional<std::string> device, gravity;
    std::optional<double> rate, body_rate, metres, newtons, stiffness, tool_radius, friction;
    std::optional<int> threads;
    std::string record, library, device_name, press = "0,0,-1", screenshot, size, camera;
    std::optional<double> duration;
    double depth = 0.2, tremor = 0, grip = 10;
    std::optional<double> max_force;
    unsigned clutch = 0;
    bool view = false, no_controller = false, lockstep = false, no_realtime = false, empty_loop = false;
};

std::atomic<bool> interrupted{false};

std::unique_ptr<Device> make_device(const Arguments& a, const SceneHaptic& haptic) {
    if (haptic.device == "openhaptics") return make_openhaptics({a.device_name, a.library});
    if (haptic.device == "spacenavigator") return make_spacenavigator({a.library, haptic.rate});
    if (haptic.device == "forcedimension") return make_forcedimension({a.library});
    if (haptic.device == "mouse") return std::make_unique<PointedDevice>("mouse", haptic.rate);
    if (haptic.device.starts_with("replay:"))
        return std::make_unique<ReplayDevice>(read_hand(haptic.device.substr(7)), haptic.rate);
    return nullptr;  // the simulated hand: its script depends on the mapping
}

void print(const LoopReport& r, const Setup& setup, bool lockstep) {
    const ServoStatistics& s = r.servo;
    const auto row = [](const Histogram& h) {
        return fmt::format("p50 {:.4g}, p99 {:.4g}, p99.9 {:.4g}, max {:.4g} ms", h.quantile_ms(0.5),
                           h.quantile_ms(0.99), h.quantile_ms(0.999), h.max_ms());
    };
    fmt::print("{}: {} vertices\n", setup.body.rest.name, setup.body.vertices());
    print_row("device",
              fmt::format("{}: {:g} N peak, {:g} N for long, {:g} N/m", r.device.name, r.device.max_force,
                          r.device.max_continuous_force, r.device.max_stiffness));
    print_row("scale",
              fmt::format("1 m of the hand is {:.4g} m of the scene; 1 N of the body is {:.4g} N at the hand",
                          r.mapping.metres, r.mapping.newtons));
    print_row("coupling", fmt::format("{:.4g} N/m, {:.3g} N s/m; felt up to {:.4g} N/m", r.gains.stiffness,
                                      r.gains.damping, s.stiffness_max));
    print_row("servo", fmt::format("{:.2f} Hz, {} periods in {:.3g} s{}", r.rate_hz, s.ticks, r.seconds,
                                   lockstep ? ", in lockstep" : ""));
    if (!lockstep) {
        print_row("period error", row(s.period_error));
        print_row("work", row(s.work));
        print_row("missed",
                  fmt::format("{} ({} by our own work{})", s.missed, s.missed_by_us,
                              r.has_empty ? fmt::format("; an empty loop beside: {}", r.missed_empty) : ""));
    }
    print_row("body",
              fmt::format("{:.1f} steps/s, {:.4g} s of its time{}", r.body_steps_per_second, r.body_time,
                          r.body_resets ? fmt::format("; left the numbers {} times", r.body_resets) : ""));
    if (!lockstep) print_row("body work", row(r.body_work));
    if (r.refinements > 0)
        print_row("refinement", fmt::format("{} changes; {} vertices at the end", r.refinements, r.vertices));
    print_row("force", fmt::format("largest {:.4g} N; {} clamped, {} by the passivity controller",
                                   s.force_max, s.clamped, s.braked));
    print_row("observer", fmt::format("least {:.3g} J; {:.3g} J from the hand, {:.3g} J lent",
                                      s.observer_least, s.observer_total, s.observer_lent));
    print_row("faults", fmt::format("{} of the device, {} stalls of the body, opened again {} times",
                                    s.faults, s.stalls, r.reopened));
}

#ifdef INNERSPRING_VIEWER

/// With the window beside, until it is closed.
LoopReport run_in_window(const Arguments& a, BodySide& body, double dt, Device& device, PointedDevice* mouse,
                         const LoopOptions& options) {
    viewer::WindowOptions window;
    window.camera = viewer::parse_camera(a.camera);
    if (!a.size.empty()) {
        const auto [width, height] = parse_size(a.size);
        window.size = {width, height};
    }
    viewer::Feeling feeling(body, 0, dt, device, options, interrupted, mouse);
    window.feeling = &feeling;
    viewer::run_window(window);
    return feeling.finish();
}

/// And a picture of the end, without a display.
LoopReport run_and_draw(const Arguments& a, BodySide& body, double dt, Device& device, LoopOptions options) {
    viewer::PictureRequest request;
    request.camera = viewer::parse_camera(a.camera);
    request.panel = true;
    if (!a.size.empty()) std::tie(request.width, request.height) = parse_size(a.size);
    viewer::Studio studio(request);
    viewer::FeltView view(body, 0, dt);
    view.see_every_step();
    view.attach(options);
    viewer::History history;
    history.add(view.latest());
    options.after_step = [&, told = std::move(options.after_step)](const HandState& hand,
                                                                   const Touch& touch) {
        told(hand, touch);
        if (view.update()) history.add(view.latest());
    };
    const LoopReport report = run_haptic(body, dt, body.mapping(), device, options);
    write_whole(a.screenshot, to_png(studio.picture(view.latest(), history)));
    return report;
}

#else

LoopReport run_in_window(const Arguments&, BodySide&, double, Device&, PointedDevice*, const LoopOptions&) {
    throw RunError("this program was built without the window; leave --view out");
}
LoopReport run_and_draw(const Arguments&, BodySide&, double, Device&, const LoopOptions&) {
    throw RunError("this program was built without the window; leave --screenshot out");
}

#endif

int run(Arguments a) {
    Scene scene;
    if (a.mesh.mesh.ends_with(".toml"))
        scene = read_scene(a.mesh.mesh);
    else
        scene.mesh = a.mesh.mesh, scene.gravity = Vector::Zero();
    apply(a.mesh, scene);
    apply(a.body, scene);
    SceneHaptic& h = scene.haptic;
    if (a.device) h.device = *a.device;
    if (a.gravity) scene.gravity = parse_vector(*a.gravity, "--gravity");
    for (const auto& [given, to] :
         {std::pair(&a.rate, &h.rate), std::pair(&a.body_rate, &h.body_rate), std::pair(&a.metres, &h.metres),
          std::pair(&a.newtons, &h.newtons), std::pair(&a.stiffness, &h.stiffness)})
        if (*given) *to = **given;
    if (a.no_controller) h.controller = false;
    if (a.threads) scene.step.threads = *a.threads;
    for (const std::string& t : a.tools) scene.tools.push_back(parse_tool(t));
    for (const std::string& r : a.refine) scene.refine.push_back(parse_refine(r));
    scene = scene_from_text(to_toml(scene), "command line");

    Setup setup = set_up(scene);
    if (h.device == "mouse" && !a.view) throw InputError("--device mouse is one in the window; add --view");
    if (a.view && (a.lockstep || !a.screenshot.empty()))
        throw InputError(
            "--view goes by the clock, and shows what --screenshot would; leave one of them out");
    if (setup.loads.tools.empty())
        setup.loads.tools.push_back(
            sphere_tool(a.tool_radius.value_or(0.2 * setup.body.radius), Vector::Zero()));
    Tool& tool = setup.loads.tools.front();
    if (a.tool_radius) tool.radius = *a.tool_radius;
    if (a.friction) tool.friction = *a.friction;
    tool.path = {{0,
                  {setup.body.rest.positions.front() + Vector::Constant(1e3 * setup.body.radius),
                   tool.path.front().pose.rotation}}};
    require_valid(setup.body, setup.loads);

    LoopOptions options;
    options.servo.rate = h.rate;
    options.servo.stiffness = h.stiffness;
    options.servo.controller = h.controller;
    options.servo.safety.peak = a.max_force.value_or(0);
    if (a.camera.empty())
        a.camera = h.device == "simulated" || h.device.starts_with("replay:") ? "30,20" : "0,20";
    const bool by_hand = h.device == "mouse" || h.device == "spacenavigator";
    options.duration = a.duration.value_or(by_hand ? 0 : 10);
    options.lockstep = a.lockstep;
    options.realtime = !a.no_realtime;
    options.empty_loop = a.empty_loop;
    options.record = a.record;
    options.stop = &interrupted;
    std::signal(SIGINT, [](int) { interrupted = true; });
    std::signal(SIGTERM, [](int) { interrupted = true; });

    std::unique_ptr<Device> device = make_device(a, h);
    if (device) device->open();
    const DeviceInfo info = device ? device->info() : DeviceInfo{};
    const double stiffness = h.stiffness > 0 ? h.stiffness : passive_gains(info, 1 / h.rate, 0).stiffness;
    const HandMapping mapping = fit_mapping(setup.body, tool, info, stiffness, h.metres, h.newtons);
    if (!device) {
        PressScript press;
        press.direction = parse_vector(a.press, "--press");
        press.depth = a.depth;
        press.duration = options.duration > 0 ? options.duration : 4;
        HandOptions hand;
        hand.tremor = a.tremor, hand.grip = a.grip;
        device =
            std::make_unique<SimulatedHand>(press_script(setup.body, tool, mapping, press), h.rate, hand);
    }
    std::optional<ClutchedDevice> clutched;
    if (a.clutch != 0) clutched.emplace(*device, a.clutch);
    Device& held = clutched ? static_cast<Device&>(*clutched) : *device;

    StepOptions step = scene.step;
    step.dt = 1 / h.body_rate;
    BodySide body(setup.body, setup.loads, 0, step, mapping, setup.refine);
    PointedDevice* mouse = h.device == "mouse" ? static_cast<PointedDevice*>(device.get()) : nullptr;
    LoopReport report = a.view                  ? run_in_window(a, body, step.dt, held, mouse, options)
                        : !a.screenshot.empty() ? run_and_draw(a, body, step.dt, held, options)
                                                : run_haptic(body, step.dt, mapping, held, options);
    held.close();
    if (report.body_steps_per_second < 0.95 * h.body_rate && !a.lockstep)
        report.notes.push_back(
            fmt::format("the body makes {:.0f} of {:.0f} steps a second, so it moves slower than the "
                        "hand; fewer vertices, --threads or a lower --body-rate help",
                        report.body_steps_per_second, h.body_rate));
    if (report.lost_samples > 0)
        report.notes.push_back(fmt::format("{} samples of the recording were lost", report.lost_samples));
    report.notes.insert(report.notes.begin(), setup.notes.begin(), setup.notes.end());
    print_notes(report.notes, a.output.quiet);
    if (a.output.json)
        fmt::print("{}", to_json(report));
    else
        print(report, setup, a.lockstep);
    if (!report.failure.empty()) {
        fmt::print(stderr, "innerspring: {}\n", report.failure);
        return 1;
    }
    return 0;
}

}  // namespace

Command add_haptic(CLI::App& program) {
    CLI::App* app =
        program.add_subcommand("haptic", "Feel a soft body: haptic devices, simulated hands, replays");
    auto a = std::make_shared<Arguments>();
    add_mesh_options(*app, a->mesh, "surface, or a scene file (.toml, docs/formats.md)");
    app->add_option(
           "--device", a->device,
           "simulated (a hand that presses and feels), openhaptics (Phantom, Touch), forcedimension (omega, "
           "delta, sigma, Falcon), spacenavigator or mouse (which feel nothing; mouse with --view), or "
           "replay:FILE of poses (default simulated)")
        ->type_name("NAME");
    app->add_option(
           "--duration", a->duration,
           "time to run [s]; 0: until Ctrl-C, the window is closed, or the end of a replay (default 10; "
           "0 with mouse, spacenavigator)")
        ->check(CLI::NonNegativeNumber)
        ->type_name("S");
    app->add_option("--rate", a->rate, "of the servo [Hz], 30 to 4000 (default 1000)")->type_name("HZ");
    app->add_option("--body-rate", a->body_rate, "steps of the body [Hz] (default 200)")->type_name("HZ");
    app->add_option("--record", a->record, "write poses and forces to a file, which replay:FILE plays")
        ->type_name("FILE");
    app->add_flag("--view", a->view,
                  "a window: body, tool, device, proxy, force, and the report as it goes on");
    app->add_option("--screenshot", a->screenshot, "no window: a picture of the end, with the report")
        ->type_name("FILE.png");
    app->add_option("--size", a->size, "of window or picture [pixel] (default 1280x720)")->type_name("WxH");
    app->add_option(
           "--camera", a->camera,
           "from where: azimuth, elevation [degree] and zoom [1]; at azimuth 0 right, up and towards "
           "you are the device's (default 0,20,1; simulated and replay 30,20,1)")
        ->type_name("A,E[,Z]");
    app->add_option("--workspace-scale", a->metres,
                    "metres of the scene per metre of the hand; 0: auto (default)")
        ->type_name("X");
    app->add_option("--force-scale", a->newtons,
                    "newtons at the hand per newton of the body; 0: auto (default)")
        ->type_name("X");
    app->add_option("--coupling", a->stiffness,
                    "stiffness of the coupling [N/m]; 0: what is passive (default)")
        ->type_name("N/M");
    app->add_flag("--no-controller", a->no_controller,
                  "without the passivity controller: for experiments only");
    app->add_option("--max-force", a->max_force, "clamp below the device's own peak [N]")
        ->check(CLI::PositiveNumber)
        ->type_name("N");
    app->add_option("--tool", a->tools, "the tool in the hand, as in simulate; its place is the hand's")
        ->type_name("SPEC");
    app->add_option("--refine", a->refine,
                    "refine during the run, as in simulate: 'tool_share=0.3, levels=2' under the tool")
        ->type_name("SPEC");
    app->add_option("--tool-radius", a->tool_radius,
                    "of the ball in the hand [m] (default: a fifth of the body's)")
        ->check(CLI::PositiveNumber)
        ->type_name("M");
    app->add_option("--friction", a->friction, "Coulomb's coefficient of the tool (default 0)")
        ->check(CLI::NonNegativeNumber)
        ->type_name("MU");
    app->add_option("--press", a->press, "simulated hand: direction of its press (default 0,0,-1)")
        ->type_name("X,Y,Z");
    app->add_option("--depth", a->depth,
                    "simulated hand: how deep it wants, of the body's radius (default 0.2)")
        ->type_name("SHARE");
    app->add_option("--tremor", a->tremor,
                    "simulated hand: amplitude [m of the hand] at 8 to 12 Hz (default 0)")
        ->type_name("M");
    app->add_option("--grip", a->grip, "simulated hand: gives way beyond this force [N] (default 10)")
        ->type_name("N");
    app->add_option("--clutch", a->clutch, "button (1, 2, 4, 8) that lets the hand move without the tool")
        ->type_name("BIT");
    app->add_option("--library", a->library,
                    "path of the vendor's library: libHD.so, libdhd.so.3, libspnav.so.0 (default: where the "
                    "system looks)")
        ->type_name("FILE");
    app->add_option("--device-name", a->device_name,
                    "openhaptics: as set up with the vendor's tool (default: the default one)")
        ->type_name("NAME");
    app->add_option("--gravity", a->gravity, "acceleration [m/s^2] (default: none, or the scene's)")
        ->type_name("X,Y,Z");
    app->add_option("--threads", a->threads, "of the body's step, 0 for all cores (default 1)")
        ->type_name("N");
    app->add_flag("--lockstep", a->lockstep, "no clock: the same device gives the same forces to the bit");
    app->add_flag("--no-realtime", a->no_realtime, "do not ask for real-time priority and locked memory");
    app->add_flag("--empty-loop", a->empty_loop,
                  "run a loop that does nothing beside, to see what the machine misses");
    add_body_options(*app, a->body);
    add_output_options(*app, a->output);
    app->footer("Safety: docs/haptics.md. Not tested on a real device.");
    return {app, [a] { return run(*a); }};
}
