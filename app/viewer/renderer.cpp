#include "renderer.h"

#include <algorithm>
#include <cmath>

#include "innerspring/record/colours.h"
#include "shaders.h"
#include "solids.h"

namespace innerspring::viewer {

namespace {

using Rgba = std::array<float, 4>;
constexpr Rgba plain_colour = {0.80f, 0.62f, 0.54f, 1}, arrow_colour = {0.85f, 0.20f, 0.12f, 1},
               tool_colour = {0.30f, 0.45f, 0.75f, 0.45f}, tool_edge_colour = {0.2f, 0.3f, 0.5f, 0.8f},
               pin_colour = {0.1f, 0.1f, 0.1f, 1}, wire_colour = {0, 0, 0, 0.35f},
               ground_colour = {0.45f, 0.47f, 0.50f, 0.55f}, home_colour = {0.9f, 0.3f, 0.1f, 0.9f},
               tetrahedra_colour = {0.15f, 0.25f, 0.45f, 0.5f}, fibre_colour = {1, 1, 1, 0.75f};

constexpr float see_through = 0.45f;  ///< opacity of a surface before what is inside

/// More lines than this only make a grey cloud.
constexpr std::size_t most_spokes = 4000;

void set(GLuint program, const char* name, float value) {
    glUniform1f(glGetUniformLocation(program, name), value);
}
void set(GLuint program, const char* name, const Rgba& colour) {
    glUniform4fv(glGetUniformLocation(program, name), 1, colour.data());
}
void set(GLuint program, const char* name, const Eigen::Matrix4f& matrix) {
    glUniformMatrix4fv(glGetUniformLocation(program, name), 1, GL_FALSE, matrix.data());
}

template <class T>
void upload(GLenum target, GLuint buffer, std::span<const T> values, GLenum use) {
    glBindBuffer(target, buffer);
    glBufferData(target, GLsizeiptr(values.size_bytes()), values.data(), use);
}

void attribute(GLuint index, int size, int stride, int offset) {
    glEnableVertexAttribArray(index);
    glVertexAttribPointer(index, size, GL_FLOAT, GL_FALSE, GLsizei(stride * sizeof(float)),
                          reinterpret_cast<const void*>(offset * sizeof(float)));
}

/// position, normal, value
constexpr int floats_per_vertex = 7;
void surface_attributes() {
    attribute(0, 3, floats_per_vertex, 0);
    attribute(1, 3, floats_per_vertex, 3);
    attribute(2, 1, floats_per_vertex, 6);
}

Texture make_map() {
    constexpr int steps = 256;
    std::vector<std::uint8_t> rgb;
    for (int n = 0; n < steps; ++n)
        for (double channel : map_colour((n + 0.5) / steps)) rgb.push_back(std::uint8_t(255 * channel + 0.5));
    GLuint name = 0;
    glGenTextures(1, &name);
    glBindTexture(GL_TEXTURE_2D, name);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, steps, 1, 0, GL_RGB, GL_UNSIGNED_BYTE, rgb.data());
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    return Texture(name);
}

}  // namespace

double ground_square(const Surface& surface) {
    const double wanted = surface.radius / 3, power = std::pow(10, std::floor(std::log10(wanted)));
    for (double digit : {5.0, 2.0})
        if (digit * power <= wanted) return digit * power;
    return power;
}

Renderer::Renderer()
    : surface_program_(make_program(surface_vertex_shader, surface_fragment_shader)),
      line_program_(make_program(line_vertex_shader, line_fragment_shader)),
      map_(make_map()),
      line_array_(make_array()),
      solid_array_(make_array()),
      line_buffer_(make_buffer()),
      solid_buffer_(make_buffer()) {
    glBindVertexArray(line_array_);
    glBindBuffer(GL_ARRAY_BUFFER, line_buffer_);
    attribute(0, 3, 7, 0);
    attribute(1, 4, 7, 3);
    glBindVertexArray(solid_array_);
    glBindBuffer(GL_ARRAY_BUFFER, solid_buffer_);
    surface_attributes();
    glBindVertexArray(0);
}

Point Renderer::place(const Vector& x) const {
    const Vector d = x - origin_;
    return {float(d.x()), float(d.y()), float(d.z())};
}

void Renderer::draw(std::size_t slot, const BodySnapshot& body, const Drawn& drawn, const Look& look,
                    const ValueRange& range, const Camera& camera, const Viewport& viewport) {
    const Surface& surface = *body.surface;
    origin_ = (surface.lower + surface.upper) / 2;
    Camera moved = camera;
    moved.focus -= origin_;
    view_ = moved.view().cast<float>();
    view_projection_ = (moved.projection(viewport.aspect()) * moved.view()).cast<float>();

    glViewport(viewport.x, viewport.y, viewport.width, viewport.height);
    glScissor(viewport.x, viewport.y, viewport.width, viewport.height);
    glEnable(GL_SCISSOR_TEST);
    glEnable(GL_DEPTH_TEST);
    glDepthMask(GL_TRUE);
    glDisable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    glClearColor(0.93f, 0.94f, 0.95f, 1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);

    if (meshes_.size() <= slot) meshes_.resize(slot + 1);
    // What is inside is seen through the surface: that comes last then.
    const bool through = look.homes || look.tetrahedra;
    if (!through) draw_surface(slot, body, drawn, look, range);
    glEnable(GL_BLEND);
    if (look.ground) draw_ground(surface);
    if (through) {
        draw_springs(body, drawn, look);
        draw_surface(slot, body, drawn, look, range);
    }
    if (look.fibres && !surface.fibre.empty()) draw_fibres(body, drawn);
    if (!body.pinned.empty()) {
        lines_.clear();
        for (Index i : body.pinned) {
            const double size = 0.012 * surface.radius;
            for (int axis = 0; axis < 3; ++axis)
                for (double end : {-size, size})
                    lines_.push_back({place(drawn.x[i] + end * Vector::Unit(axis)), pin_colour});
        }
        draw_coloured(GL_LINES, lines_);
    }
    for (const Pull& pull : body.pulls) draw_arrow(pull.newton, pull.place, body);
    for (const TouchingTool& tool : body.tools) draw_arrow(tool.newton, tool.place, body);
    for (const Pull& pull : body.pulls) draw_hand(pull, body, camera);
    for (const TouchingTool& tool : body.tools) draw_tool(tool, body);
    glBindVertexArray(0);
    glDisable(GL_SCISSOR_TEST);
}

void Renderer::draw_surface(std::size_t slot, const BodySnapshot& body, const Drawn& drawn, const Look& look,
                            const ValueRange& range) {
    Mesh& mesh = meshes_[slot];
    const Surface& surface = *body.surface;
    if (!mesh.array) {
        mesh.array = make_array(), mesh.edges_array = make_array();
        mesh.vertices = make_buffer(), mesh.triangles = make_buffer(), mesh.edges = make_buffer();
        for (const auto& [array, indices] : {std::pair<GLuint, GLuint>{mesh.array, mesh.triangles},
                                             std::pair<GLuint, GLuint>{mesh.edges_array, mesh.edges}}) {
            glBindVertexArray(array);
            glBindBuffer(GL_ARRAY_BUFFER, mesh.vertices);
            glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices);
            surface_attributes();
        }
    }
    if (mesh.surface != body.surface) {
        glBindVertexArray(mesh.array);
        upload(GL_ELEMENT_ARRAY_BUFFER, mesh.triangles, std::span(surface.triangles), GL_STATIC_DRAW);
        glBindVertexArray(mesh.edges_array);
        upload(GL_ELEMENT_ARRAY_BUFFER, mesh.edges, std::span(surface.edges), GL_STATIC_DRAW);
        mesh.surface = body.surface;
    }

    const bool coloured = drawn.values.size() == drawn.x.size() && range.low < range.high;
    const double per = coloured ? 1 / (range.high - range.low) : 0;
    stream_.resize(floats_per_vertex * drawn.x.size());
    float* out = stream_.data();
    for (std::size_t i = 0; i < drawn.x.size(); ++i) {
        for (float c : place(drawn.x[i])) *out++ = c;
        for (int k = 0; k < 3; ++k) *out++ = float(drawn.normals[i][k]);
        *out++ = coloured ? float((drawn.values[i] - range.low) * per) : 0.0f;
    }
    upload(GL_ARRAY_BUFFER, mesh.vertices, std::span<const float>(stream_), GL_STREAM_DRAW);

    glUseProgram(surface_program_);
    set(surface_program_, "view", view_);
    set(surface_program_, "view_projection", view_projection_);
    set(surface_program_, "coloured", coloured ? 1.0f : 0.0f);
    set(surface_program_, "flat_shading", look.flat ? 1.0f : 0.0f);
    const bool through = look.homes || look.tetrahedra;
    Rgba base = plain_colour;
    if (through) base[3] = see_through;
    set(surface_program_, "base", base);
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, map_);
    glEnable(GL_CULL_FACE);  // closed and outward oriented: the far side is never seen
    if (look.wireframe) glEnable(GL_POLYGON_OFFSET_FILL);
    glPolygonOffset(1, 1);
    glBindVertexArray(mesh.array);
    const auto count = GLsizei(3 * surface.triangles.size());
    if (through) {  // its depth first, so that only the near side is blended
        glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
        glDrawElements(GL_TRIANGLES, count, GL_UNSIGNED_INT, nullptr);
        glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
        glDepthFunc(GL_LEQUAL);
        glEnable(GL_BLEND);
    }
    glDrawElements(GL_TRIANGLES, count, GL_UNSIGNED_INT, nullptr);
    glDepthFunc(GL_LESS);
    glDisable(GL_POLYGON_OFFSET_FILL);
    glDisable(GL_CULL_FACE);
    glEnable(GL_BLEND);
    if (look.wireframe) {
        set(surface_program_, "coloured", -1.0f);  // the base colour as it is, unlit
        set(surface_program_, "base", wire_colour);
        glBindVertexArray(mesh.edges_array);
        glDrawElements(GL_LINES, GLsizei(2 * surface.edges.size()), GL_UNSIGNED_INT, nullptr);
    }
}

void Renderer::draw_ground(const Surface& surface) {
    const double square = ground_square(surface), size = (surface.upper - surface.lower).norm();
    const int count = int(std::ceil(1.2 * size / square));
    const Vector middle = (surface.lower + surface.upper) / 2;
    const double y = surface.lower.y() - 0.04 * size, reach = count * square;
    lines_.clear();
    for (int n = -count; n <= count; ++n) {
        // Fading with the distance from the middle, drawn in pieces so that it does so along a line too.
        for (int m = -count; m < count; ++m)
            for (bool along : {false, true}) {
                for (int end : {m, m + 1}) {
                    const double s = n * square, t = end * square;
                    Rgba colour = ground_colour;
                    colour[3] *= float(std::clamp(1 - std::hypot(s, t) / reach, 0.0, 1.0));
                    lines_.push_back(
                        {place({middle.x() + (along ? s : t), y, middle.z() + (along ? t : s)}), colour});
                }
            }
    }
    draw_coloured(GL_LINES, lines_);
}

/// Each as long as the edges around it, just above the surface.
void Renderer::draw_fibres(const BodySnapshot& body, const Drawn& drawn) {
    const Surface& surface = *body.surface;
    const std::size_t stride = 1 + drawn.x.size() / most_spokes;
    lines_.clear();
    for (std::size_t i = 0; i < drawn.x.size(); i += stride) {
        const double size = 0.4 * surface.spacing[i] * std::sqrt(double(stride));
        const Vector above = drawn.x[i] + 0.1 * surface.spacing[i] * drawn.normals[i],
                     along = size * (body.frame.R * surface.fibre[i]);
        for (const double end : {-1.0, 1.0}) lines_.push_back({place(above + end * along), fibre_colour});
    }
    draw_coloured(GL_LINES, lines_);
}

void Renderer::draw_springs(const BodySnapshot& body, const Drawn& drawn, const Look& look) {
    const Surface& surface = *body.surface;
    const std::size_t stride = 1 + drawn.x.size() / most_spokes;
    if (look.tetrahedra) {
        lines_.clear();
        for (std::size_t i = 0; i < drawn.x.size(); i += stride) {
            // About one centre its sides meet there; local ones end in the centre of the vertex's medial
            // ball.
            Vector centre = surface.centre.position;
            if (surface.centre.kind == CentreKind::local) {
                if (surface.L.empty()) break;
                centre = surface.rest[i] - surface.L[i] * drawn.normals[i];
            }
            lines_.push_back({place(body.frame.R * centre + body.frame.t), tetrahedra_colour});
            lines_.push_back({place(drawn.x[i]), tetrahedra_colour});
        }
        draw_coloured(GL_LINES, lines_);
    }
    if (look.homes) {
        lines_.clear();
        std::vector<Coloured> points;
        for (std::size_t i = 0; i < drawn.x.size(); i += stride) {
            const Point home = place(body.frame.R * surface.rest[i] + body.frame.t);
            points.push_back({home, home_colour});
            lines_.push_back({home, home_colour});
            lines_.push_back({place(drawn.x[i]), home_colour});
        }
        glPointSize(3);
        draw_coloured(GL_POINTS, points);
        draw_coloured(GL_LINES, lines_);
    }
}

void Renderer::draw_arrow(const Vector& force, const Vector& place, const BodySnapshot& body) {
    const double newton = force.norm();
    if (!(newton > 0)) return;
    // It ends where the force acts.
    const Vector along = force / newton;
    const double R = body.surface->radius, length = arrow_length(body, newton), thick = 0.02 * R,
                 head = std::min(0.15 * R, 0.5 * length);
    const std::pair<double, double> arrow[] = {
        {0, 0}, {0, thick}, {length - head, thick}, {length - head, 2.6 * thick}, {length, 0}};
    std::vector<Vector> corners, normals;
    revolve(place - length * along, along, arrow, corners, normals);
    draw_solid(corners, normals, arrow_colour);
}

/// A ball where a hand without a tool is.
void Renderer::draw_hand(const Pull& pull, const BodySnapshot& body, const Camera& camera) {
    if (!pull.hand) return;
    std::vector<Vector> corners, normals;
    revolve(pull.place, camera.back(), capsule(std::max(0.15 * pull.radius, 0.01 * body.surface->radius), 0),
            corners, normals);
    draw_solid(corners, normals, tool_colour);
}

void Renderer::draw_tool(const TouchingTool& touching, const BodySnapshot& body) {
    const Tool& tool = touching.tool;
    const Pose& pose = touching.pose();
    std::vector<Vector> corners, normals;
    if (tool.shape == ToolShape::plane) {
        // The part of it under the body.
        const Vector middle = (body.surface->lower + body.surface->upper) / 2,
                     normal = pose.rotation * Vector::UnitZ(), side = pose.rotation * Vector::UnitX(),
                     other = pose.rotation * Vector::UnitY();
        const Vector foot = middle - normal.dot(middle - pose.position) * normal;
        const double size = 0.7 * (body.surface->upper - body.surface->lower).norm();
        const Vector square[] = {foot - size * (side + other), foot + size * (side - other),
                                 foot + size * (side + other), foot - size * (side - other)};
        for (int n : {0, 1, 2, 0, 2, 3}) corners.push_back(square[n]), normals.push_back(normal);
        lines_.clear();
        for (int n = 0; n < 4; ++n)
            for (int end : {n, (n + 1) % 4}) lines_.push_back({place(square[end]), tool_edge_colour});
        draw_coloured(GL_LINES, lines_);
    } else if (tool.shape == ToolShape::mesh) {
        const SurfaceMesh& mesh = tool.mesh->mesh;
        for (const Triangle& t : mesh.triangles) {
            Vector x[3];
            for (int k = 0; k < 3; ++k) x[k] = pose.position + pose.rotation * mesh.positions[t[k]];
            const Vector normal = (x[1] - x[0]).cross(x[2] - x[0]).stableNormalized();
            for (const Vector& corner : x) corners.push_back(corner), normals.push_back(normal);
        }
    } else {
        revolve(pose.position, pose.rotation * Vector::UnitZ(), capsule(tool.radius, tool.length), corners,
                normals);
    }
    // Its depth first, so that only its near side is seen, and the body through it.
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    draw_solid(corners, normals, tool_colour);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDepthFunc(GL_LEQUAL);
    draw_solid(corners, normals, tool_colour);
    glDepthFunc(GL_LESS);
}

void Renderer::draw_solid(std::span<const Vector> corners, std::span<const Vector> normals,
                          const Rgba& colour) {
    stream_.clear();
    for (std::size_t n = 0; n < corners.size(); ++n) {
        for (float c : place(corners[n])) stream_.push_back(c);
        for (int k = 0; k < 3; ++k) stream_.push_back(float(normals[n][k]));
        stream_.push_back(0);
    }
    upload(GL_ARRAY_BUFFER, solid_buffer_, std::span<const float>(stream_), GL_STREAM_DRAW);
    glUseProgram(surface_program_);
    set(surface_program_, "view", view_);
    set(surface_program_, "view_projection", view_projection_);
    set(surface_program_, "coloured", 0.0f);
    set(surface_program_, "flat_shading", 0.0f);
    set(surface_program_, "base", colour);
    glBindVertexArray(solid_array_);
    glDrawArrays(GL_TRIANGLES, 0, GLsizei(corners.size()));
}

void Renderer::draw_coloured(GLenum kind, std::span<const Coloured> vertices) {
    upload(GL_ARRAY_BUFFER, line_buffer_, vertices, GL_STREAM_DRAW);
    glUseProgram(line_program_);
    set(line_program_, "view_projection", view_projection_);
    glBindVertexArray(line_array_);
    glDrawArrays(kind, 0, GLsizei(vertices.size()));
}

}  // namespace innerspring::viewer
