#pragma once
#include <epoxy/gl.h>

#include <memory>
#include <string>
#include <utility>

#include "innerspring/record/picture.h"

struct GLFWwindow;

namespace innerspring::viewer {

/// A name that OpenGL gave, and how it is given back.
template <void (*destroy)(GLuint)>
class Handle {
  public:
    Handle() = default;
    explicit Handle(GLuint name) : name_(name) {}
    ~Handle() {
        if (name_) destroy(name_);
    }
    Handle(Handle&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
    Handle& operator=(Handle&& other) noexcept {
        std::swap(name_, other.name_);
        return *this;
    }
    operator GLuint() const { return name_; }

  private:
    GLuint name_ = 0;
};
inline void delete_buffer(GLuint n) {
    glDeleteBuffers(1, &n);
}
inline void delete_array(GLuint n) {
    glDeleteVertexArrays(1, &n);
}
inline void delete_texture(GLuint n) {
    glDeleteTextures(1, &n);
}
inline void delete_frame(GLuint n) {
    glDeleteFramebuffers(1, &n);
}
inline void delete_store(GLuint n) {
    glDeleteRenderbuffers(1, &n);
}
inline void delete_program(GLuint n) {
    glDeleteProgram(n);
}
using Buffer = Handle<delete_buffer>;
using VertexArray = Handle<delete_array>;
using Texture = Handle<delete_texture>;
using FrameBuffer = Handle<delete_frame>;
using RenderBuffer = Handle<delete_store>;
using Program = Handle<delete_program>;

Buffer make_buffer();
VertexArray make_array();
/// Throws RunError with the driver's words.
Program make_program(const char* vertex, const char* fragment);

/// A current OpenGL 3.3 core context without a window: EGL without a surface, which needs no display; else a
/// hidden window. Throws RunError naming what to do instead.
class Offscreen {
  public:
    Offscreen();
    ~Offscreen();
    Offscreen(const Offscreen&) = delete;
    Offscreen& operator=(const Offscreen&) = delete;
    /// Again, where there is another.
    void make_current();

  private:
    bool try_egl();
    void* display_ = nullptr;
    void* context_ = nullptr;
    GLFWwindow* hidden_ = nullptr;
};

/// A picture to draw into, 4 samples a pixel.
class Canvas {
  public:
    /// Throws RunError if this OpenGL cannot hold it.
    Canvas(int width, int height);
    void bind();
    Image read();

  private:
    int width_, height_;
    RenderBuffer colour_, depth_, plain_;
    FrameBuffer sampled_, resolved_;
};

/// What is in the framebuffer bound for reading, whose lower left part it is.
Image read_pixels(int width, int height);

/// Whether the context that is current draws on the processor.
bool drawn_by_software();

/// What to say where there is no display or no OpenGL 3.3.
std::string no_graphics(const std::string& why);

}  // namespace innerspring::viewer
