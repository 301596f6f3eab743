#pragma once
#include "camera.h"
#include "fields.h"
#include "graphics.h"

namespace innerspring::viewer {

struct Look {
    ColourBy colour = ColourBy::displacement;
    bool flat = false;        ///< shading by triangle, not smooth
    bool wireframe = false;   ///< the edges over the surface
    bool homes = false;       ///< home positions and the way to them, through the surface
    bool tetrahedra = false;  ///< the edges of the virtual tetrahedra, through the surface
    bool fibres = true;       ///< of an anisotropic body, a line at each vertex along what is stiffest
    bool ground = true;       ///< a plane of squares below the body
};

/// Part of the picture [pixel of the framebuffer], from the lower left.
struct Viewport {
    int x = 0, y = 0, width = 1, height = 1;
    double aspect() const { return double(width) / std::max(1, height); }
};

/// The side of the ground's squares [m]: a round number near a third of the body's radius.
double ground_square(const Surface& surface);

/// Draws bodies with OpenGL 3.3. Everything it needs is made with the context that is current.
class Renderer {
  public:
    Renderer();
    /// Clears the viewport and draws one body into it; `slot` tells the bodies of a frame apart.
    void draw(std::size_t slot, const BodySnapshot& body, const Drawn& drawn, const Look& look,
              const ValueRange& range, const Camera& camera, const Viewport& viewport);

  private:
    struct Mesh {
        VertexArray array, edges_array;
        Buffer vertices, triangles, edges;
        std::shared_ptr<const Surface> surface;
    };
    struct Coloured {
        Point at;
        std::array<float, 4> colour;
    };
    void draw_surface(std::size_t slot, const BodySnapshot& body, const Drawn& drawn, const Look& look,
                      const ValueRange& range);
    void draw_ground(const Surface& surface);
    void draw_springs(const BodySnapshot& body, const Drawn& drawn, const Look& look);
    void draw_fibres(const BodySnapshot& body, const Drawn& drawn);
    void draw_arrow(const Vector& newton, const Vector& place, const BodySnapshot& body);
    void draw_hand(const Pull& pull, const BodySnapshot& body, const Camera& camera);
    void draw_tool(const TouchingTool& tool, const BodySnapshot& body);
    void draw_solid(std::span<const Vector> corners, std::span<const Vector> normals,
                    const std::array<float, 4>& colour);
    void draw_coloured(GLenum kind, std::span<const Coloured> vertices);
    Point place(const Vector& x) const;

    Program surface_program_, line_program_;
    Texture map_;
    std::vector<Mesh> meshes_;
    VertexArray line_array_, solid_array_;
    Buffer line_buffer_, solid_buffer_;
    std::vector<float> stream_;
    std::vector<Coloured> lines_;
    Vector origin_ = Vector::Zero();  ///< floats are relative to it [m]
    Eigen::Matrix4f view_, view_projection_;
};

}  // namespace innerspring::viewer
