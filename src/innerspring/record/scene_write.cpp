#include <fmt/format.h>

#include "innerspring/record/scene.h"

namespace innerspring {

namespace {

/// The fewest digits that read back as the same bits, and always a TOML float, never an integer.
std::string real(double value) {
    std::string s = fmt::format("{}", value);
    if (s.find_first_not_of("-0123456789") == std::string::npos) s += ".0";
    return s;
}

std::string list(const Vector& v) {
    return fmt::format("[{}, {}, {}]", real(v.x()), real(v.y()), real(v.z()));
}

/// Length of the well-formed UTF-8 character that `text` begins with; 0 if it is none.
std::size_t character_length(std::string_view text) {
    const auto byte = [&](std::size_t i) {
        return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
    };
    const unsigned first = byte(0);
    if (first < 0x80) return 1;
    const std::size_t length = first < 0xC2 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : first < 0xF5 ? 4 : 0;
    for (std::size_t i = 1; i < length; ++i)
        if ((byte(i) & 0xC0) != 0x80) return 0;
    const bool overlong = (first == 0xE0 && byte(1) < 0xA0) || (first == 0xF0 && byte(1) < 0x90);
    const bool surrogate = first == 0xED && byte(1) > 0x9F;
    const bool beyond = first == 0xF4 && byte(1) > 0x8F;
    return overlong || surrogate || beyond ? 0 : length;
}

/// A TOML basic string. Bytes that are not UTF-8 (a file name may hold them) become U+FFFD, as TOML cannot
/// hold them.
std::string toml_string(std::string_view text) {
    std::string out = "\"";
    while (!text.empty()) {
        const std::size_t length = character_length(text);
        const char c = text[0];
        if (length == 0)
            out += "\\uFFFD";
        else if (length == 1 && (c == '"' || c == '\\'))
            out += {'\\', c};
        else if (length == 1 && (static_cast<unsigned char>(c) < 0x20 || c == 0x7F))
            out += fmt::format("\\u{:04X}", static_cast<unsigned>(c));
        else
            out += text.substr(0, length);
        text.remove_prefix(length == 0 ? 1 : length);
    }
    return out + "\"";
}

void write(std::string& out, const SceneForce& f) {
    out += fmt::format("\n[[force]]\nname = {}\n", toml_string(f.name));
    if (f.vertex) out += fmt::format("vertex = {}\n", *f.vertex);
    if (f.near) out += fmt::format("near = {}\n", list(*f.near));
    if (f.newton) out += fmt::format("newton = {}\n", list(*f.newton));
    if (f.inward) out += fmt::format("inward = {}\n", real(*f.inward));
    out += fmt::format("radius = {}\n", real(f.radius));
    if (f.profile.empty()) {
        out += fmt::format("start = {}\n", real(f.start));
        if (f.end) out += fmt::format("end = {}\n", real(*f.end));
        out += fmt::format("ramp = {}\n", real(f.ramp));
        return;
    }
    out += "profile = [";
    for (std::size_t i = 0; i < f.profile.size(); ++i)
        out += fmt::format("{}[{}, {}]", i ? ", " : "", real(f.profile[i].first), real(f.profile[i].second));
    out += "]\n";
}

void write(std::string& out, const ScenePin& p) {
    out += "\n[[pin]]\n";
    if (p.near)
        out += fmt::format("near = {}\nradius = {}\n", list(*p.near), real(p.radius));
    else
        out += fmt::format("vertices = [{}]\n", fmt::join(p.vertices, ", "));
    if (p.path.empty()) return;
    out += "path = [";
    for (std::size_t i = 0; i < p.path.size(); ++i) {
        const auto& [time, d] = p.path[i];
        out += fmt::format("{}[{}, {}, {}, {}]", i ? ", " : "", real(time), real(d.x()), real(d.y()),
                           real(d.z()));
    }
    out += "]\n";
}

void write(std::string& out, const SceneRefine& r) {
    out += "\n[[refine]]\n";
    if (r.at) {
        out += fmt::format("at = {}\n", real(*r.at));
        if (r.vertex) out += fmt::format("vertex = {}\n", *r.vertex);
        if (r.near) out += fmt::format("near = {}\n", list(*r.near));
        out += fmt::format("radius = {}\n", real(r.radius));
    } else if (r.tool_share) {
        out += fmt::format("tool_share = {}\n", real(*r.tool_share));
    } else {
        out += fmt::format("edge_share = {}\n", real(r.edge_share.value_or(0)));
    }
    out += fmt::format("levels = {}\n", r.levels);
}

void write(std::string& out, const SceneTool& t) {
    out += fmt::format("\n[[tool]]\nname = {}\n", toml_string(t.name));
    if (t.radius)
        out += fmt::format("radius = {}\nlength = {}\n", real(*t.radius), real(t.length));
    else if (!t.mesh.empty())
        out += fmt::format("mesh = {}\nscale = {}\n", toml_string(t.mesh), real(t.scale));
    if (t.normal) out += fmt::format("normal = {}\n", list(*t.normal));
    if (t.axis) out += fmt::format("axis = {}\n", list(*t.axis));
    out += fmt::format("friction = {}\n", real(t.friction));
    if (t.at) out += fmt::format("at = {}\n", list(*t.at));
    if (t.path.empty()) return;
    out += "path = [";
    for (std::size_t i = 0; i < t.path.size(); ++i) {
        out += i ? ", [" : "[";
        for (std::size_t n = 0; n < t.path[i].size(); ++n) out += (n ? ", " : "") + real(t.path[i][n]);
        out += "]";
    }
    out += "]\n";
}

void write(std::string& out, const Anisotropy& a) {
    using Course = Anisotropy::Course;
    out += fmt::format("\n[anisotropy]\nkind = \"{}\"\n", to_string(a.kind));
    if (a.kind == Anisotropy::Kind::fibres) {
        out += fmt::format("along_pa = {}\n", real(a.along));
        if (a.across) out += fmt::format("across_pa = {}\n", real(*a.across));
        if (a.course == Course::straight) out += fmt::format("direction = {}\n", list(a.direction));
        if (a.course == Course::around)
            out += fmt::format("around = {}\nthrough = {}\npitch_deg = {}\n", list(a.direction),
                               list(a.through), real(a.pitch_deg));
        if (a.course == Course::outward) out += fmt::format("outward = {}\n", list(a.through));
        if (a.course == Course::field) out += fmt::format("field = {}\n", toml_string(a.file));
    }
    if (a.kind == Anisotropy::Kind::orthotropic)
        out += fmt::format("moduli_pa = {}\naxes = [{}, {}]\n", list(a.moduli), list(a.axes.col(0)),
                           list(a.axes.col(1)));
}

}  // namespace

std::string to_toml(const Scene& scene) {
    const Material& m = scene.material;
    const StepOptions& step = scene.step;
    std::string out = fmt::format("mesh = {}\n", toml_string(scene.mesh));
    if (!scene.unit.empty()) out += fmt::format("unit = {}\n", toml_string(scene.unit));
    if (scene.normalize) out += fmt::format("normalize = {}\n", *scene.normalize);
    out += fmt::format("weld = {}\n", real(scene.weld));

    out += fmt::format("\n[material]\nname = {}\n", toml_string(scene.material_name));
    out += m.density ? fmt::format("density_kg_m3 = {}\n", real(*m.density))
                     : fmt::format("mass_kg = {}\n", real(m.mass));
    out += fmt::format("young_pa = {}\n", real(m.young));
    out += m.surface_ratio ? fmt::format("surface_ratio = {}\n", real(*m.surface_ratio))
                           : fmt::format("surface_n_m = {}\n", real(m.surface));
    out += fmt::format("damping_ratio = {}\npoisson = {}\n", real(m.damping), real(m.poisson));

    write(out, m.anisotropy);

    out += fmt::format("\n[body]\nscheme = \"{}\"\n", to_string(scene.scheme));
    if (scene.centre.kind == CentreKind::given)
        out += fmt::format("centre = {}\n", list(scene.centre.position));
    else
        out += fmt::format("centre = \"{}\"\n", to_string(scene.centre.kind));
    out += fmt::format("free = {}\n", scene.free);

    out += fmt::format("\n[simulation]\ngravity_m_s2 = {}\nduration_s = {}\ndt_s = {}\nintegrator = \"{}\"\n",
                       list(scene.gravity), real(scene.duration), real(step.dt), to_string(step.integrator));
    out += fmt::format("precision = \"{}\"\n", to_string(step.precision));
    out += fmt::format("threads = {}\nmax_substeps = {}\ntolerance = {}\nmax_iterations = {}\n", step.threads,
                       step.max_substeps, real(step.tolerance), step.max_iterations);
    out += fmt::format("linearised = {}\n", step.linearised);
    out += fmt::format("equilibrium = {}\nresidual_n = {}\nevery = {}\n", scene.equilibrium,
                       real(scene.residual_n), scene.every);

    const SceneHaptic& h = scene.haptic;
    out += fmt::format("\n[haptic]\ndevice = {}\nrate_hz = {}\nbody_rate_hz = {}\n", toml_string(h.device),
                       real(h.rate), real(h.body_rate));
    out += fmt::format("workspace_scale = {}\nforce_scale = {}\ncoupling_n_m = {}\ncontroller = {}\n",
                       real(h.metres), real(h.newtons), real(h.stiffness), h.controller);

    for (const SceneForce& f : scene.forces) write(out, f);
    for (const ScenePin& p : scene.pins) write(out, p);
    for (const SceneRefine& r : scene.refine) write(out, r);
    for (const SceneTool& t : scene.tools) write(out, t);
    return out;
}

}  // namespace innerspring
