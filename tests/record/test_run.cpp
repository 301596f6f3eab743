#include "innerspring/record/run.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "innerspring/mesh/error.h"
#include "innerspring/mesh/shapes.h"
#include "innerspring/mesh/write.h"
#include "innerspring/record/state_file.h"
#include "support/temporary_folder.h"

using namespace innerspring;

namespace {

Scene pushed_sphere() {
    Scene scene;
    scene.mesh = "sphere:vertices=200";
    scene.duration = 0.3;
    scene.every = 7;
    SceneForce push;
    push.name = "finger";
    push.near = Vector(0, 0, 1);
    push.inward = 0.05;
    push.radius = 0.5;
    push.ramp = 0.1;
    scene.forces.push_back(push);
    return scene;
}

/// Without plot and picture.
RunOptions bare(const std::filesystem::path& directory, bool resume = false) {
    return {.directory = directory, .resume = resume, .pictures = false};
}

std::string message(const auto& f) {
    try {
        f();
    } catch (const InputError& e) {
        return e.what();
    }
    return "no error";
}

}  // namespace

TEST(Run, WritesEveryFileAndTheyAgree) {
    TemporaryFolder folder("run");
    const Summary s = run(pushed_sphere(), {.directory = folder.path});
    EXPECT_EQ(s.failure, "");
    EXPECT_EQ(s.steps, 30u);
    EXPECT_DOUBLE_EQ(s.duration_s, 0.3);
    for (const char* file :
         {"summary.json", "series.csv", "frames.pvd", "picture.png", "scene.resolved.toml", "state.bin"})
        EXPECT_GT(std::filesystem::file_size(folder.path / file), 100u) << file;
    // A frame at steps 0, 7, 14, 21, 28 and the last.
    const std::string pvd = content(folder.path / "frames.pvd");
    for (int step : {0, 7, 14, 21, 28, 30}) {
        const std::string file = fmt::format("frames/frame_{:08d}.vtp", step);
        EXPECT_TRUE(std::filesystem::exists(folder.path / file)) << file;
        EXPECT_NE(pvd.find(file), std::string::npos) << file;
    }
    const std::string csv = content(folder.path / "series.csv");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 32);  // header, start, 30 steps
    EXPECT_TRUE(
        csv.starts_with("time_s,volume_m3,volume_variation_percent,kinetic_j,elastic_j,potential_j,max_"
                        "displacement_m,pressure_pa,force_finger_n\n"));
    EXPECT_NE(content(folder.path / "summary.json").find(fmt::format("{:016x}", s.state_hash)),
              std::string::npos);
    // Nothing half-written is left behind.
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder.path))
        EXPECT_EQ(entry.path().string().find(".tmp"), std::string::npos) << entry.path();
}

TEST(Run, TheResolvedSceneRunsToTheSameBits) {
    TemporaryFolder a("resolved-a"), b("resolved-b");
    const Summary first = run(pushed_sphere(), {.directory = a.path});
    const Summary again = run(read_scene(a.path / "scene.resolved.toml"), {.directory = b.path});
    EXPECT_EQ(first.state_hash, again.state_hash);
    EXPECT_EQ(content(a.path / "series.csv"), content(b.path / "series.csv"));
}

// Meshes of body and tool beside a scene in another folder; the resolved scene is read from a third.
TEST(Run, TheResolvedSceneFindsItsMeshes) {
    TemporaryFolder scenes("resolved-scenes"), a("resolved-c"), b("resolved-d");
    write(make_shape("icosphere:vertices=162"), scenes.path / "body.obj");
    write(make_shape("icosphere:vertices=42"), scenes.path / "tool.obj");
    write_whole(scenes.path / "scene.toml",
                "mesh = \"body.obj\"\nunit = \"m\"\n[simulation]\nduration_s = 0.05\n"
                "[[tool]]\nmesh = \"tool.obj\"\nscale = 0.3\nat = [0, 0, 1.2]\n");
    const auto relative = std::filesystem::relative(scenes.path / "scene.toml");
    const Summary first = run(read_scene(relative), {.directory = a.path});
    const Summary again = run(read_scene(a.path / "scene.resolved.toml"), {.directory = b.path});
    EXPECT_EQ(first.state_hash, again.state_hash);
    // The tool begins 0.1 m deep.
    const auto says_so = [](const std::string& s) { return s.find("inside the body") != std::string::npos; };
    EXPECT_TRUE(std::any_of(first.warnings.begin(), first.warnings.end(), says_so));
}

TEST(Run, AToolsForceIsInTheSeriesAndARunWithToolsResumes) {
    Scene scene = pushed_sphere();
    scene.forces.clear();
    SceneTool ball;
    ball.name = "ball, red";
    ball.radius = 0.3;
    ball.path = {{0, 0, 0, 1.4, 1, 0, 0, 0}, {0.2, 0, 0, 1.1, 1, 0, 0, 0}};
    scene.tools.push_back(ball);
    TemporaryFolder whole("tool-whole"), parts("tool-parts");
    const Summary s = run(scene, bare(whole.path));
    EXPECT_EQ(s.failure, "");
    ASSERT_EQ(s.last.tool_force.size(), 1u);
    EXPECT_GT(s.last.tool_force[0].z(), 0.01);
    EXPECT_NE(content(whole.path / "series.csv")
                  .find(",tool_ball_ red_x_n,tool_ball_ red_y_n,tool_ball_ red_z_n\n"),
              std::string::npos);
    EXPECT_NE(content(whole.path / "summary.json").find("tool_force_n"), std::string::npos);
    const double duration = scene.duration;
    scene.duration = duration / 2;
    run(scene, bare(parts.path));
    scene.duration = duration;
    const Summary resumed = run(scene, bare(parts.path, true));
    EXPECT_EQ(resumed.state_hash, s.state_hash);
    EXPECT_EQ(content(parts.path / "series.csv"), content(whole.path / "series.csv"));
}

TEST(Run, ResumedRunsGiveTheSameBitsAsOnesThatWentOn) {
    for (const auto& [integrator, free, poisson] :
         {std::tuple{Integrator::symplectic, false, 0.0}, std::tuple{Integrator::symplectic, true, 0.0},
          std::tuple{Integrator::implicit, false, 0.0}, std::tuple{Integrator::implicit, true, 0.0},
          std::tuple{Integrator::symplectic, false, 0.3}, std::tuple{Integrator::implicit, false, 0.3},
          std::tuple{Integrator::symplectic, true, 0.5}, std::tuple{Integrator::implicit, true, 0.5}}) {
        TemporaryFolder whole("whole"), parts("parts");
        Scene scene = pushed_sphere();
        scene.step.integrator = integrator;
        scene.free = free;
        scene.material.poisson = poisson;
        if (poisson > 0) {
            scene.material.anisotropy.kind = Anisotropy::Kind::fibres;
            scene.material.anisotropy.along = 30, scene.material.anisotropy.direction = Vector(1, 2, 0);
        }
        const Summary through = run(scene, bare(whole.path));
        EXPECT_EQ(through.last.pressure != 0, poisson > 0);
        scene.duration = 0.11;
        run(scene, bare(parts.path));
        scene.duration = 0.3;
        scene.step.threads = 2;  // threads may change
        const Summary resumed = run(scene, bare(parts.path, true));
        EXPECT_EQ(through.state_hash, resumed.state_hash) << free << ' ' << poisson;
        EXPECT_EQ(content(whole.path / "series.csv"), content(parts.path / "series.csv"));
        EXPECT_EQ(content(whole.path / "frames.pvd"), content(parts.path / "frames.pvd"));
        EXPECT_EQ(content(whole.path / "frames/frame_00000028.vtp"),
                  content(parts.path / "frames/frame_00000028.vtp"));
    }
}

// The mesh of a resumed run is found again from the scene alone.
TEST(Run, RefinedRunsResumeToTheSameBits) {
    for (const char* scheme : {"C", "A"}) {
        TemporaryFolder whole("refined-whole"), parts("refined-parts");
        Scene scene = pushed_sphere();
        scene.scheme = parse_scheme(scheme);
        scene.forces[0].start = 0.04;
        scene.forces[0].end = 0.2;
        scene.forces[0].ramp = 0.02;
        scene.refine = {parse_refine("edge_share = 0.25"),
                        parse_refine("at = 0.08, near = [1, 0, 0], radius = 0.3, levels = 2")};
        const Summary through = run(scene, bare(whole.path));
        EXPECT_EQ(through.failure, "");
        EXPECT_GE(through.refinements, 3);  // for the force, at the time, and back after the force
        EXPECT_GT(through.vertices_last, 220u);
        for (double pause : {0.05, 0.11, 0.25}) {
            scene.duration = pause;
            run(scene, bare(parts.path));
            scene.duration = 0.3;
            const Summary resumed = run(scene, bare(parts.path, true));
            EXPECT_EQ(through.state_hash, resumed.state_hash) << pause;
            EXPECT_EQ(content(whole.path / "series.csv"), content(parts.path / "series.csv"));
            EXPECT_EQ(content(whole.path / "frames/frame_00000028.vtp"),
                      content(parts.path / "frames/frame_00000028.vtp"));
        }
        // Another scene's refinement is another scene.
        Scene other = scene;
        other.refine.pop_back();
        EXPECT_THROW(run(other, bare(parts.path, true)), InputError);
    }
}

// Where the mesh follows a tool it depends on the motion; what was seen of it is saved with the state.
TEST(Run, RefinementFollowsAToolAndResumesToTheSameBits) {
    for (bool free : {false, true}) {
        TemporaryFolder whole("tool-whole"), parts("tool-parts");
        Scene scene = pushed_sphere();
        scene.free = free;
        scene.gravity = Vector::Zero();
        scene.forces.clear();
        scene.tools = {
            parse_tool("radius = 0.3, friction = 0.3, path = [[0, 0, 0, 1.6], [0.1, 0, 0, 1.15], "
                       "[0.2, 0.1, 0, 1.15], [0.25, 0.1, 0, 2]]")};
        scene.refine = {parse_refine("tool_share = 0.3")};
        scene.duration = 0.3;
        const Summary through = run(scene, bare(whole.path));
        EXPECT_EQ(through.failure, "");
        EXPECT_GE(through.refinements, 3);
        EXPECT_EQ(through.vertices_last, through.subject.vertices);
        for (double pause : {0.05, 0.13, 0.25}) {
            scene.duration = pause;
            run(scene, bare(parts.path));
            scene.duration = 0.3;
            const Summary resumed = run(scene, bare(parts.path, true));
            EXPECT_EQ(through.state_hash, resumed.state_hash) << pause;
            EXPECT_EQ(content(whole.path / "series.csv"), content(parts.path / "series.csv"));
        }
    }
}

// Refined while the force acts: no edge around it is longer than asked for; as it was once it has gone.
TEST(Run, RefinementFollowsAForceAndIsUndone) {
    TemporaryFolder folder("refine-follow");
    Scene scene = pushed_sphere();
    scene.refine = {parse_refine("edge_share = 0.2, levels = 3")};
    innerspring::Setup setup = set_up(scene);
    State state = rest_state(setup.body);
    Refiner refiner(setup.body, setup.refine);
    const std::size_t before = setup.body.vertices();
    refiner.before_step(0, 0.01, setup.body, setup.loads, state, [](const Transfer&) {});
    const Force& force = setup.loads.forces[0];
    EXPECT_TRUE(coarse_triangles(setup.body, force.centre, force.radius, 0.2 * force.radius).empty());
    EXPECT_GT(setup.body.vertices(), before + 20);

    scene.forces[0].end = 0.15;
    const Summary s = run(scene, bare(folder.path));
    EXPECT_GT(s.refinements, 1);
    EXPECT_EQ(s.vertices_last, before);
    scene.equilibrium = true;
    scene.forces[0] = pushed_sphere().forces[0];
    scene.forces[0].ramp = 0;
    const Summary balance = run(scene, bare(folder.path));
    EXPECT_TRUE(balance.equilibrium_reached);
    EXPECT_GT(balance.vertices_last, before + 20);
}

// About one centre a refinement may be impossible: the run stops there, with all it had.
TEST(Run, ARefusedRefinementKeepsTheRun) {
    TemporaryFolder folder("refine-refused");
    SurfaceMesh mesh = make_shape("icosphere:vertices=642");
    const Vector up = mesh.positions[100], side = up.cross(Vector(0.3, 0.5, 0.1)).normalized();
    mesh.positions[100] += 0.25 * side + 0.15 * up;
    write(mesh, folder.path / "overhang.obj");
    Scene scene;
    scene.mesh = (folder.path / "overhang.obj").string();
    scene.unit = "m";
    scene.centre = {CentreKind::given, Vector::Zero()};
    scene.duration = 0.1;
    scene.refine = {parse_refine("at = 0.05, vertex = 100, radius = 0.3")};
    const Summary s = run(scene, {.directory = folder.path / "out"});
    EXPECT_NE(s.failure.find("not positive"), std::string::npos) << s.failure;
    EXPECT_EQ(s.steps, 5u);
    EXPECT_TRUE(std::filesystem::exists(folder.path / "out/summary.json"));
}

TEST(Run, ARunThatWasKilledAnywhereCanBeResumed) {
    TemporaryFolder whole("unkilled"), killed("killed");
    Scene scene = pushed_sphere();
    scene.duration = 20;
    scene.every = 50;
    const Summary through = run(scene, {.directory = whole.path});
    // Make a state to resume from, then kill runs that go on from it at different moments.
    Scene start = scene;
    start.duration = 1;
    run(start, {.directory = killed.path});
    for (int round = 0; round < 4; ++round) {
        const pid_t child = fork();
        if (child == 0) {
            try {
                run(scene, {.directory = killed.path, .resume = true});
            } catch (...) {
            }
            _exit(0);
        }
        usleep(useconds_t(3000 + 17000 * round));
        kill(child, SIGKILL);
        waitpid(child, nullptr, 0);
        EXPECT_NO_THROW(read_state(killed.path / "state.bin")) << round;
    }
    const Summary resumed = run(scene, {.directory = killed.path, .resume = true});
    EXPECT_EQ(resumed.state_hash, through.state_hash);
    EXPECT_EQ(content(whole.path / "series.csv"), content(killed.path / "series.csv"));
}

TEST(Run, StoppingSavesAndResumesToTheSameBits) {
    TemporaryFolder whole("unstopped"), stopped("stopped");
    Scene scene = pushed_sphere();
    const Summary through = run(scene, bare(whole.path));
    const std::atomic<bool> now{true};
    const Summary early = run(scene, {.directory = stopped.path, .stop = &now, .pictures = false});
    EXPECT_TRUE(early.stopped);
    EXPECT_EQ(early.steps, 1u);
    EXPECT_EQ(run(scene, bare(stopped.path, true)).state_hash, through.state_hash);
}

TEST(Run, ResumeRefusesWhatIsNotItsOwn) {
    TemporaryFolder folder("refuse");
    Scene scene = pushed_sphere();
    EXPECT_NE(message([&] { run(scene, bare(folder.path, true)); }).find("no saved state"),
              std::string::npos);
    run(scene, bare(folder.path));
    Scene other = scene;
    other.material.young = 11;
    EXPECT_NE(message([&] { run(other, bare(folder.path, true)); }).find("another scene"), std::string::npos);
    other = scene;
    other.mesh = "sphere:vertices=300";
    EXPECT_NE(message([&] { run(other, bare(folder.path, true)); }).find("state.bin"), std::string::npos);
    // What a file it names holds counts as well.
    const TemporaryFolder fibres("refuse-fibres");
    const auto field = [&](const char* direction) {
        std::ofstream(fibres.path / "f.csv")
            << "x_m,y_m,z_m,fibre_x,fibre_y,fibre_z\n0,0,0," << direction << '\n';
    };
    other = scene;
    other.material.anisotropy = parse_directions("kind = 'fibres', along_pa = 30, field = '" +
                                                 (fibres.path / "f.csv").string() + "'");
    field("1,0,0");
    run(other, bare(fibres.path));
    run(other, bare(fibres.path, true));
    field("0,1,0");
    EXPECT_NE(message([&] { run(other, bare(fibres.path, true)); }).find("files that have changed"),
              std::string::npos);
    std::string bytes = content(folder.path / "state.bin");
    bytes[bytes.size() / 2] ^= 1;
    write_whole(folder.path / "state.bin", bytes);
    EXPECT_NE(message([&] { run(scene, bare(folder.path, true)); }).find("checksum"), std::string::npos);
    write_whole(folder.path / "state.bin", "nonsense");
    EXPECT_NE(message([&] { run(scene, bare(folder.path, true)); }).find("not a saved state"),
              std::string::npos);
}

TEST(Run, ABlowUpKeepsTheLastGoodStateAndSaysWhere) {
    TemporaryFolder folder("blowup");
    Scene scene = pushed_sphere();
    scene.forces[0].inward = 1e300;
    scene.forces[0].ramp = 0;
    scene.forces[0].start = 0.1;
    const Summary s = run(scene, {.directory = folder.path});
    EXPECT_NE(s.failure.find("vertex"), std::string::npos) << s.failure;
    EXPECT_NE(s.failure.find("t = 0.1"), std::string::npos) << s.failure;
    const SavedState saved = read_state(folder.path / "state.bin");
    for (const Vector& x : saved.state.x) ASSERT_TRUE(x.allFinite());
    EXPECT_EQ(saved.state.steps, s.steps);
    EXPECT_EQ(content(folder.path / "series.csv").find("nan"), std::string::npos);
}

TEST(Run, EquilibriumIsReportedAsSuch) {
    TemporaryFolder folder("equilibrium");
    Scene scene = pushed_sphere();
    scene.equilibrium = true;
    const Summary s = run(scene, {.directory = folder.path});
    EXPECT_TRUE(s.equilibrium_reached);
    EXPECT_LE(s.residual_n, s.tolerance_n);
    EXPECT_GT(s.last.max_displacement, 0.002);
    scene.residual_n = 1e-30;  // below rounding
    const Summary never = run(scene, {.directory = folder.path});
    EXPECT_FALSE(never.equilibrium_reached);
    EXPECT_NE(never.failure.find("no equilibrium"), std::string::npos);
    EXPECT_LT(never.residual_n, 1e-12);
}

TEST(Run, AFolderThatCannotBeMadeIsNamed) {
    TemporaryFolder folder("blocked");
    write_whole(folder.path / "file", "x");
    try {
        run(pushed_sphere(), {.directory = folder.path / "file" / "out"});
        FAIL();
    } catch (const RunError& e) {
        EXPECT_NE(std::string(e.what()).find("file/out"), std::string::npos);
    }
}

TEST(Run, TooManyStepsAreRefused) {
    TemporaryFolder folder("steps");
    Scene scene = pushed_sphere();
    scene.duration = 1e6;
    scene.step.dt = 1e-4;
    EXPECT_NE(message([&] { run(scene, {.directory = folder.path}); }).find("steps"), std::string::npos);
}

TEST(Series, ReadsBackToTheSameBits) {
    TemporaryFolder folder("series");
    Loads loads;
    loads.forces.push_back(point_force(0, Vector(1, 0, 0)));
    std::vector<Measures> rows(3);
    rows[1].time = 0.1;
    rows[1].volume = 1.0 / 3;
    rows[2].kinetic = 5e-324;
    rows[2].potential = -1.7976931348623157e308;
    for (Measures& r : rows) r.force = {std::sqrt(2.0)};
    write_whole(folder.path / "series.csv", to_csv(rows, loads));
    EXPECT_EQ(to_csv(read_series(folder.path / "series.csv", 3, loads), loads), to_csv(rows, loads));
    EXPECT_NE(message([&] { read_series(folder.path / "series.csv", 4, loads); }).find("3 rows"),
              std::string::npos);
    EXPECT_NE(message([&] { read_series(folder.path / "series.csv", 3, {}); }).find("cannot be resumed"),
              std::string::npos);
    write_whole(folder.path / "series.csv", to_csv(rows, loads) + "1,2,x\n");
    EXPECT_NE(message([&] { read_series(folder.path / "series.csv", 4, loads); }).find(":5:"),
              std::string::npos);
}

TEST(Setup, UnitsScaleAndUnknownSizesAreNormalized) {
    TemporaryFolder folder("units");
    SurfaceMesh cube = load_mesh("icosphere:vertices=42", "", {}, 0).mesh;
    for (Vector& p : cube.positions) p = 50 * p + Vector(10, 0, 0);
    const std::string file = (folder.path / "ball.obj").string();
    write(cube, file);
    const LoadedMesh mm = load_mesh(file, "mm", {}, 0), free_size = load_mesh(file, "", {}, 0);
    EXPECT_NEAR(volume(mm.mesh), 1e-9 * volume(cube), 1e-12 * volume(mm.mesh) + 1e-18);
    EXPECT_NEAR(volume_radius(volume(free_size.mesh)), 1, 1e-12);
    EXPECT_NE(free_size.notes.back().find("no unit given"), std::string::npos);
    EXPECT_NE(message([&] { load_mesh(file, "inch", {}, 0); }).find("mm, cm or m"), std::string::npos);
    EXPECT_NE(message([&] { load_mesh("sphere", "mm", {}, 0); }).find("in metres"), std::string::npos);
    EXPECT_NE(message([&] { load_mesh("spher", "", {}, 0); }).find("did you mean sphere"), std::string::npos);
}
