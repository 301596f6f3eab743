// The program as a user runs it: exit codes, one-line errors, JSON, files.
#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <thread>

#include "support/sanitized.h"
#include "support/temporary_folder.h"

namespace {

struct Output {
    int code;
    std::string text;
};

/// Runs the program with standard output, or (errors = true) standard error, caught.
Output innerspring(const std::string& arguments, bool errors = false) {
    const std::string command =
        fmt::format("{} {} {}", INNERSPRING_PROGRAM, arguments, errors ? "2>&1 >/dev/null" : "2>/dev/null");
    FILE* pipe = popen(command.c_str(), "r");
    Output out{0, ""};
    char buffer[4096];
    for (std::size_t n; (n = fread(buffer, 1, sizeof buffer, pipe)) > 0;) out.text.append(buffer, n);
    out.code = WEXITSTATUS(pclose(pipe));
    return out;
}

/// Bad input: exit 2 and one line on standard error that says `what`.
void expect_refused(const std::string& arguments, const std::string& what) {
    const Output out = innerspring(arguments, true);
    EXPECT_EQ(out.code, 2) << arguments;
    EXPECT_NE(out.text.find(what), std::string::npos) << arguments << ": " << out.text;
    EXPECT_EQ(std::count(out.text.begin(), out.text.end(), '\n'), 1) << out.text;
}

nlohmann::json json(const std::string& arguments) {
    const Output out = innerspring(arguments);
    EXPECT_EQ(out.code, 0) << arguments;
    return nlohmann::json::parse(out.text);
}

/// What an OpenGL driver leaves behind is not ours; the tests of the study and of the window watch the rest.
void ignore_the_drivers_leaks() {
    ::setenv("ASAN_OPTIONS", "detect_leaks=0", 0);
}

/// Every key path of `expected` exists in `actual`.
void expect_keys(const nlohmann::json& actual, const std::vector<std::string>& pointers) {
    for (const std::string& p : pointers) EXPECT_TRUE(actual.contains(nlohmann::json::json_pointer(p))) << p;
}

}  // namespace

TEST(Cli, HelpNamesUnitsAndDefaults) {
    for (const char* command : {"", "check", "estimate", "simulate", "refine", "study", "bench"}) {
        const Output out = innerspring(fmt::format("{} --help", command));
        EXPECT_EQ(out.code, 0);
        EXPECT_NE(out.text.find("Usage"), std::string::npos);
    }
    const std::string help = innerspring("simulate --help").text;
    for (const char* word : {"[kg]", "[Pa]", "[N/m]", "default 0.01", "--resume", "liver"})
        EXPECT_NE(help.find(word), std::string::npos) << word;
    EXPECT_EQ(innerspring("--version").text, "innerspring 0.1.0\n");
}

TEST(Cli, UsageErrorsSayWhatWasMeant) {
    expect_refused("", "subcommand");
    expect_refused("simulat sphere", "did you mean simulate?");
    expect_refused("simulate sphere -o x --gravty 0,0,0", "did you mean --gravity?");
    expect_refused("estimate sphere --scheme D", "expected A, B or C");
    expect_refused("estimate sphere --centre nowhere", "expected auto, centroid, kernel, local or X,Y,Z");
    expect_refused("estimate sphere --material lver", "liver");
    expect_refused("estimate sphere --young -1", "must be positive");
    expect_refused("estimate sphere --mass 1 --density 1", "give one of them");
    expect_refused("estimate spher", "did you mean sphere");
    expect_refused("estimate sphere:vertice=100", "vertices");
    expect_refused("estimate sphere:seed=1 --seed 2", "already names its seed");
    expect_refused("check /nonexistent/mesh.stl", "no such file");
    expect_refused("check sphere --fix", "-o OUT");
    expect_refused("simulate sphere -o x --gravity 1,2", "expected X,Y,Z");
    expect_refused("simulate sphere -o x --force 'vertex=1, inwrd=2'", "inward");
    expect_refused("simulate sphere -o x --dt 0", "dt");
    expect_refused("simulate sphere -o x --free --equilibrium", "free body");
}

TEST(Cli, CheckAsJsonHasItsKeys) {
    const auto j = json("check torus --json");
    expect_keys(j, {"/version",
                    "/mesh/name",
                    "/mesh/vertices",
                    "/mesh/triangles",
                    "/mesh/volume_m3",
                    "/verdict",
                    "/edges",
                    "/components",
                    "/genus",
                    "/area_m2",
                    "/centroid_m",
                    "/bounding_box_m/lower",
                    "/edge_length_m/mean",
                    "/negative_tetrahedra/by_count",
                    "/self_intersections",
                    "/findings/0/what",
                    "/findings/0/verdict",
                    "/findings/0/count",
                    "/findings/0/first",
                    "/findings/0/advice"});
    EXPECT_EQ(j["genus"], 1);
}

TEST(Cli, EstimateAsJsonHasItsKeysAndFiles) {
    TemporaryFolder folder("estimate");
    const auto j = json(fmt::format("estimate icosphere:vertices=162 --json --csv {0}/a.csv --vtp {0}/a.vtp",
                                    folder.path.string()));
    expect_keys(j, {"/version",
                    "/mesh/name",
                    "/scheme",
                    "/centre/kind",
                    "/centre/position_m",
                    "/centre/reason",
                    "/material/mass_kg",
                    "/groups/weight",
                    "/groups/surface",
                    "/m_kg/min",
                    "/K_n_m/lower",
                    "/k_n_m/median",
                    "/L_m/upper",
                    "/L_m/max",
                    "/mass_sum_kg",
                    "/stiffness_sum_n_m",
                    "/stiffness_theory_n_m",
                    "/mass_shift_m",
                    "/sag_m",
                    "/largest_stable_step_s",
                    "/warnings"});
    EXPECT_NEAR(j["mass_sum_kg"].get<double>(), 0.05, 1e-15);
    const std::string csv = content(folder.path / "a.csv");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 163);
    EXPECT_NE(content(folder.path / "a.vtp").find("K_n_m"), std::string::npos);
}

TEST(Cli, SimulateAsJsonHasItsKeysAndEqualsItsSummary) {
    TemporaryFolder folder("simulate");
    const std::string out = folder.path.string();
    const auto j =
        json(fmt::format("simulate sphere:vertices=200 -o {} --duration 0.1 --json --threads 2", out));
    expect_keys(j, {"/version",
                    "/mesh/name",
                    "/mesh/vertices",
                    "/mesh/triangles",
                    "/mesh/volume_m3",
                    "/scheme",
                    "/centre/kind",
                    "/centre/position_m",
                    "/centre/reason",
                    "/material/young_pa",
                    "/groups/weight",
                    "/groups/force",
                    "/integrator",
                    "/precision",
                    "/dt_s",
                    "/substeps",
                    "/duration_s",
                    "/volume_variation_percent/final",
                    "/volume_variation_percent/max",
                    "/volume_variation_percent/mean",
                    "/max_displacement_m",
                    "/displacement_mean_m/2",
                    "/displacement_std_m/2",
                    "/energy/kinetic_j",
                    "/equilibrium/reached",
                    "/equilibrium/residual_n",
                    "/steps",
                    "/seconds",
                    "/ns_per_vertex_step",
                    "/state_hash",
                    "/warnings"});
    EXPECT_EQ(j, nlohmann::json::parse(content(folder.path / "summary.json")));
    EXPECT_EQ(j["duration_s"], 0.1);
    const auto again = json(fmt::format("simulate sphere:vertices=200 -o {} --duration 0.1 --json", out));
    EXPECT_EQ(j["state_hash"], again["state_hash"]);
}

TEST(Cli, RefineWritesAClosedSurfaceAndItsMap) {
    TemporaryFolder folder("cli-refine");
    const std::string out = (folder.path / "fine.ply").string(), map = (folder.path / "map.csv").string();
    const auto j = json(fmt::format(
        "refine sphere:vertices=300 --near 0,0,1 --radius 0.5 --levels 2 -o {} --map {} --json", out, map));
    EXPECT_EQ(j["mesh"]["vertices"], 300);
    EXPECT_EQ(j["volume_change_percent"], 0);
    const std::size_t vertices = j["refined"]["vertices"];
    EXPECT_GT(vertices, 400u);
    const std::string text = content(map);
    EXPECT_TRUE(text.starts_with("new_vertex,end_a,end_b\n300,"));
    EXPECT_EQ(std::size_t(std::count(text.begin(), text.end(), '\n')), vertices - 300 + 1);
    const auto check = json(fmt::format("check {} --json", out));
    EXPECT_EQ(check["verdict"], "fine");
    EXPECT_EQ(check["mesh"]["vertices"], vertices);
    // Other regions.
    for (const char* region : {"--vertex 7 --rings 2", "--vertex 7 --radius 0.4 --along", "--longer-than 0.2",
                               "--near 0,0,1 --rings 1 --smooth"})
        EXPECT_GT(
            json(fmt::format("refine sphere:vertices=300 {} -o {} --json", region, out))["chosen_triangles"],
            3)
            << region;
    expect_refused("refine sphere -o x.obj", "say what");
    expect_refused("refine sphere -o x.obj --radius 1", "say where");
    expect_refused("refine sphere -o x.obj --near 0,0,9 --radius 0.1", "the nearest vertex is at");
    expect_refused("refine sphere -o x.obj --vertex 99999 --rings 1", "has 0 to");
    expect_refused("refine sphere -o x.xyz --vertex 0 --rings 1", "x.xyz");
    expect_refused("refine sphere -o x.obj --vertex 0 --rings 1 --levels 99", "levels");
}

TEST(Cli, StudyWritesItsReportAndResumesOnlyItself) {
    ignore_the_drivers_leaks();  // of Fig. 7's pictures
    const TemporaryFolder folder("cli-study");
    const std::string out = "-o " + folder.path.string();
    const auto all = json("study all sphere:vertices=150 --quick --json --vertices 2 " + out);
    expect_keys(all, {"/refinement/rows/0/ratio", "/refinement/means/0/mean_deviation_m",
                      "/gravity/rows/0/volume_variation_percent/max", "/force/rows/0/density_class",
                      "/volume/rows/0/pressure_pa", "/volume/bulge/4/equator", "/claims/0/verdict"});
    EXPECT_EQ(all["command"], "innerspring study all sphere:vertices=150 --vertices 2 --quick -o DIR");
    EXPECT_TRUE(std::filesystem::exists(folder.path / "report.html"));
    const auto again = json("study volume sphere:vertices=150 --quick --json --vertices 2 --resume " + out);
    EXPECT_EQ(again["rows"], all["volume"]["rows"]);
    expect_refused("study all sphere:vertices=160 --quick --vertices 2 --resume " + out,
                   "cases of another study");
    expect_refused("study al " + out, "expected refinement, gravity, force, volume, all or truth");
    expect_refused("study truth --levels 2 " + out, "--forces and --levels belong to the other studies");
    expect_refused("study gravity --nu 0.3 " + out, "--nu belongs to the studies volume, all and truth");
    expect_refused("study volume --tetrahedra 9 " + out, "--tetrahedra belongs to study truth");
    expect_refused("study truth --nu 0.3,0.4 " + out, "--nu is one Poisson's ratio");
    expect_refused("study volume --nu 0.3,0.6 " + out, "it must be from 0 to 0.5");
    expect_refused("study volume --nu 0.3,0.3 " + out, "each once");
    expect_refused("study gravity --poisson 0.3 " + out, "are about poisson = 0");
    expect_refused("study truth --nu 0.5 " + out, "from 0 to 0.495");
    expect_refused("study all sphere --scheme B " + out, "--scheme");
}

TEST(Cli, BenchMeasuresAMesh) {
    const auto j = json("bench sphere:vertices=300 --seconds 0.02 --json");
    expect_keys(j, {"/machine/processor", "/ns_per_vertex_step/threads_2", "/step_us/threads_1/p99_9",
                    "/bounds_ns_per_vertex_step/threads_1/applies", "/vertices_sustained/at_60_hz",
                    "/phases_s/build the body"});
    EXPECT_EQ(j["mesh"]["vertices"], 300);
    for (const char* threads : {"threads_1", "threads_2"}) {
        EXPECT_GT(j["ns_per_vertex_step"][threads], 0);
        EXPECT_GE(j["step_us"][threads]["p99"], j["step_us"][threads]["p50"]);
    }
    // Sixteen times and two thirds as many at 60 Hz as at 1 kHz.
    EXPECT_NEAR(double(j["vertices_sustained"]["at_60_hz"]),
                double(j["vertices_sustained"]["at_1000_hz"]) * 1000 / 60, 20);
    EXPECT_NE(innerspring("bench sphere:vertices=300 --seconds 0.01").text.find("vertices at 1 kHz"),
              std::string::npos);
    expect_refused("bench sphere --seconds 0", "--seconds");
}

TEST(Cli, AnEmptyRunIsARun) {
    TemporaryFolder folder("empty");
    const auto j =
        json(fmt::format("simulate sphere:vertices=100 -o {} --duration 0 --json", folder.path.string()));
    EXPECT_EQ(j["steps"], 0);
}

TEST(Cli, ABlowUpExitsWithOneAndOneLine) {
    TemporaryFolder folder("cli-blowup");
    const Output out =
        innerspring(fmt::format("simulate sphere:vertices=100 -o {} --quiet --force 'vertex=0, inward=1e300'",
                                folder.path.string()),
                    true);
    EXPECT_EQ(out.code, 1);
    EXPECT_EQ(std::count(out.text.begin(), out.text.end(), '\n'), 1) << out.text;
    EXPECT_NE(out.text.find("vertex"), std::string::npos);
}

TEST(Cli, ScenesRunAndErrorsNameTheLine) {
    TemporaryFolder folder("scene");
    std::ofstream(folder.path / "good.toml")
        << "mesh = 'sphere:vertices=100'\n[simulation]\nduration_s = 0.05\n";
    std::ofstream(folder.path / "bad.toml") << "mesh = 'sphere'\n[material]\nyoung = 3\n";
    const std::string at = folder.path.string();
    EXPECT_EQ(json(fmt::format("simulate {0}/good.toml -o {0}/out --json", at))["steps"], 5);
    expect_refused(fmt::format("simulate {0}/bad.toml -o {0}/out", at), "bad.toml:3: ");
    expect_refused(fmt::format("simulate {0}/bad.toml -o {0}/out", at), "young_pa");
}

TEST(Cli, FixMakesABrokenMeshWhole) {
    TemporaryFolder folder("fix");
    // A tetrahedron with one triangle turned round, a duplicate and an unused vertex.
    std::ofstream(folder.path / "bad.obj")
        << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 9 9 9\nf 1 3 2\nf 1 4 2\nf 1 4 3\nf 2 3 4\nf 2 3 4\n";
    const std::string at = folder.path.string();
    expect_refused(fmt::format("simulate {0}/bad.obj -o {0}/out", at), "--fix");
    EXPECT_EQ(innerspring(fmt::format("check {0}/bad.obj --fix -o {0}/good.off", at)).code, 0);
    EXPECT_EQ(json(fmt::format("check {0}/good.off --json", at))["verdict"], "fine");
    EXPECT_EQ(innerspring(fmt::format("simulate {0}/good.off -o {0}/out --duration 0.05", at)).code, 0);
}

TEST(Cli, BrokenRealMeshesAreRefusedWithTheElementNamed) {
    const std::filesystem::path meshes = SHARED_MESHES;
    if (!std::filesystem::exists(meshes)) GTEST_SKIP() << "no real meshes beside the checkout";
    TemporaryFolder folder("real");
    for (const char* file : {"dragon.stl", "suzanne.obj"}) {
        expect_refused(fmt::format("simulate {}/{} -o {}", meshes.string(), file, folder.path.string()),
                       "edge ");
        EXPECT_EQ(innerspring(fmt::format("check {}/{}", meshes.string(), file)).code, 1);
    }
}

// Law: under the paper's gravity scheme C keeps the volume to 0.03 % throughout, on shapes and on real
// meshes.
TEST(Cli, GravityKeepsTheVolumeOfShapesAndRealMeshes) {
    TemporaryFolder folder("gravity");
    std::vector<std::string> meshes{"sphere", "breast", "ellipsoid", "organ"};
    if (const std::filesystem::path real = SHARED_MESHES; std::filesystem::exists(real))
        for (const char* file : {"liver.obj", "liver2.obj", "Bunny.stl", "torus.obj", "spot.obj"})
            meshes.push_back((real / file).string());
    if (INNERSPRING_SANITIZED) meshes.resize(3);  // the slower ones in the plain build only
    for (const std::string& mesh : meshes) {
        const auto j = json(fmt::format("simulate {} -o {} --duration 0.5 --normalize --json --every 0", mesh,
                                        folder.path.string()));
        EXPECT_LE(j["volume_variation_percent"]["max"].get<double>(), 0.03) << mesh;
        EXPECT_GT(j["max_displacement_m"].get<double>(), 1e-4) << mesh;
    }
}

TEST(Cli, HapticFeelsRecordsAndReplaysToTheSameBits) {
    TemporaryFolder folder("cli-haptic");
    const std::string first = folder.path / "first.csv", a = folder.path / "a.csv", b = folder.path / "b.csv";
    const auto result = json(fmt::format(
        "haptic sphere:vertices=300 --lockstep --duration 2 --record {} --json --no-realtime", first));
    expect_keys(result,
                {"/rate_hz", "/period_error_ms/p50", "/period_error_ms/p99_9", "/work_ms/max", "/missed",
                 "/clamped", "/observer_energy_min_j", "/force_max_n", "/body_steps_per_second"});
    EXPECT_EQ(result["ticks"], 2000);
    EXPECT_GT(result["force_max_n"], 0.1);
    EXPECT_GE(result["observer_energy_min_j"], 0.0);
    for (const std::string& file : {a, b})
        json(fmt::format(
            "haptic sphere:vertices=300 --device replay:{} --lockstep --duration 2 --record {} --json", first,
            file));
    EXPECT_EQ(content(a), content(b));
    EXPECT_GT(content(a).size(), 50000u);
}

// Killed in the middle of it: what was flushed until then is a recording that can be played.
TEST(Cli, HapticRecordingOutlivesAKill) {
    TemporaryFolder folder("cli-killed");
    const std::string file = folder.path / "hand.csv";
    const pid_t child = fork();
    if (child == 0) {
        const int nowhere = open("/dev/null", O_WRONLY);
        dup2(nowhere, 1), dup2(nowhere, 2);
        execl(INNERSPRING_PROGRAM, INNERSPRING_PROGRAM, "haptic", "sphere:vertices=300", "--duration", "120",
              "--no-realtime", "--record", file.c_str(), nullptr);
        _exit(127);
    }
    ASSERT_GT(child, 0);
    const auto size = [&] {
        std::error_code none;
        const auto bytes = std::filesystem::file_size(file, none);
        return none ? std::uintmax_t(0) : bytes;
    };
    for (int n = 0; n < 3000 && size() < 50000; ++n)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    const std::uintmax_t flushed = size();
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL);
    ASSERT_GE(flushed, 50000u);
    const std::string text = content(file);
    EXPECT_GE(text.size(), flushed);
    const auto lines = std::count(text.begin(), text.end(), '\n') - 1;  // without the header
    EXPECT_GT(lines, 300);
    const auto result = json(fmt::format(
        "haptic sphere:vertices=300 --device replay:{} --lockstep --duration 0 --json --quiet", file));
    EXPECT_NEAR(result["ticks"].get<double>(), double(lines), 3);  // whole lines, all of them, and a cut one
}

TEST(Cli, HapticDrawsThePictureOfTheEnd) {
    TemporaryFolder folder("cli-felt");
    const std::string file = folder.path / "felt.png";
    ignore_the_drivers_leaks();
    const Output out = innerspring(
        fmt::format("haptic sphere:vertices=300 --lockstep --duration 1 --screenshot {} --size 640x400",
                    file),
        true);
    if (out.code != 0) {
        EXPECT_NE(out.text.find("OpenGL"), std::string::npos) << out.text;
        GTEST_SKIP() << out.text;
    }
    EXPECT_EQ(content(file).substr(1, 3), "PNG");
}

TEST(Cli, HapticRefusesInOneLine) {
    expect_refused("haptic sphere --device fork",
                   "simulated, openhaptics, forcedimension, spacenavigator, mouse or replay:FILE");
    expect_refused("haptic sphere --device mouse", "add --view");
    expect_refused("haptic sphere --view --lockstep", "leave one of them out");
    expect_refused("haptic sphere --device replay:/nowhere.csv", "cannot be read");
    expect_refused("haptic sphere --rate 9000", "30 to 4000");
    expect_refused("haptic sphere --workspace-scale -1", "workspace_scale");
    expect_refused("haptic sphere --press 0,0,0", "direction");
    const Output out = innerspring("haptic sphere --device openhaptics --library /nowhere/libHD.so", true);
    EXPECT_EQ(out.code, 1);
    EXPECT_NE(out.text.find("looked for /nowhere/libHD.so"), std::string::npos) << out.text;
}
