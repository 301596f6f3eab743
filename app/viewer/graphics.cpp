#include "graphics.h"

#include <GLFW/glfw3.h>
#include <epoxy/egl.h>
#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "innerspring/mesh/error.h"

namespace innerspring::viewer {

std::string no_graphics(const std::string& why) {
    return fmt::format(
        "no OpenGL 3.3 here ({}); 'innerspring simulate' needs none and writes frames and pictures, "
        "'innerspring "
        "view --screenshot FILE.png' needs no display but Mesa (libegl1, libgl1-mesa-dri)",
        why);
}

bool drawn_by_software() {
    const char* name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    const std::string_view renderer = name ? name : "";
    for (std::string_view software : {"llvmpipe", "softpipe", "swrast", "SWR"})
        if (renderer.find(software) != std::string_view::npos) return true;
    return false;
}

Buffer make_buffer() {
    GLuint name = 0;
    glGenBuffers(1, &name);
    return Buffer(name);
}

VertexArray make_array() {
    GLuint name = 0;
    glGenVertexArrays(1, &name);
    return VertexArray(name);
}

namespace {

void compile(GLuint program, GLenum kind, const char* source) {
    const GLuint shader = glCreateShader(kind);
    glShaderSource(shader, 1, &source, nullptr);
    glCompileShader(shader);
    GLint well = 0;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &well);
    if (!well) {
        char log[512] = "";
        glGetShaderInfoLog(shader, sizeof log, nullptr, log);
        glDeleteShader(shader);
        std::string text(log);
        std::replace(text.begin(), text.end(), '\n', ' ');
        throw RunError(fmt::format("this OpenGL does not take a shader: {}", text));
    }
    glAttachShader(program, shader);
    glDeleteShader(shader);  // lives on with the program
}

}  // namespace

Program make_program(const char* vertex, const char* fragment) {
    Program program(glCreateProgram());
    compile(program, GL_VERTEX_SHADER, vertex);
    compile(program, GL_FRAGMENT_SHADER, fragment);
    glLinkProgram(program);
    GLint well = 0;
    glGetProgramiv(program, GL_LINK_STATUS, &well);
    if (!well) throw RunError("this OpenGL does not link a shader");
    return program;
}

namespace {

int on_the_display = 0;  ///< contexts: the display ends with the last

}  // namespace

bool Offscreen::try_egl() {
    if (!epoxy_has_egl()) return false;
    if (!epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless")) return false;
    EGLDisplay display =
        eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, nullptr, nullptr)) return false;
    const EGLint wanted[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, 0, EGL_NONE};
    const EGLint version[] = {EGL_CONTEXT_MAJOR_VERSION,
                              3,
                              EGL_CONTEXT_MINOR_VERSION,
                              3,
                              EGL_CONTEXT_OPENGL_PROFILE_MASK,
                              EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                              EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (eglBindAPI(EGL_OPENGL_API) && eglChooseConfig(display, wanted, &config, 1, &count) && count > 0) {
        EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, version);
        if (context != EGL_NO_CONTEXT && eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
            display_ = display, context_ = context;
            ++on_the_display;
            return true;
        }
        if (context != EGL_NO_CONTEXT) eglDestroyContext(display, context);
    }
    if (on_the_display == 0) eglTerminate(display);
    return false;
}

Offscreen::Offscreen() {
    if (try_egl()) return;
    if (!glfwInit()) throw RunError(no_graphics("neither EGL without a surface nor a display"));
    glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    hidden_ = glfwCreateWindow(64, 64, "innerspring", nullptr, nullptr);
    if (!hidden_) {
        const char* why = nullptr;
        glfwGetError(&why);
        const std::string words = why ? why : "no context";
        glfwTerminate();
        throw RunError(no_graphics(words));
    }
    glfwMakeContextCurrent(hidden_);
}

void Offscreen::make_current() {
    if (context_) eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_);
    if (hidden_) glfwMakeContextCurrent(hidden_);
}

Offscreen::~Offscreen() {
    if (context_) {
        eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        eglDestroyContext(display_, context_);
        if (--on_the_display == 0) eglTerminate(display_);
    }
    if (hidden_) {
        glfwDestroyWindow(hidden_);
        glfwTerminate();
    }
}

namespace {

RenderBuffer make_store(int samples, GLenum format, int width, int height) {
    GLuint name = 0;
    glGenRenderbuffers(1, &name);
    glBindRenderbuffer(GL_RENDERBUFFER, name);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, format, width, height);
    return RenderBuffer(name);
}

FrameBuffer make_frame() {
    GLuint name = 0;
    glGenFramebuffers(1, &name);
    return FrameBuffer(name);
}

}  // namespace

Canvas::Canvas(int width, int height) : width_(width), height_(height) {
    GLint most_samples = 0;
    glGetIntegerv(GL_MAX_SAMPLES, &most_samples);
    const int samples = std::min(4, int(most_samples));
    colour_ = make_store(samples, GL_RGBA8, width, height);
    depth_ = make_store(samples, GL_DEPTH_COMPONENT24, width, height);
    plain_ = make_store(0, GL_RGBA8, width, height);
    sampled_ = make_frame(), resolved_ = make_frame();
    glBindFramebuffer(GL_FRAMEBUFFER, resolved_);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, plain_);
    glBindFramebuffer(GL_FRAMEBUFFER, sampled_);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, colour_);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth_);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        throw RunError(fmt::format("this OpenGL cannot draw a picture of {} x {}", width, height));
}

void Canvas::bind() {
    glBindFramebuffer(GL_FRAMEBUFFER, sampled_);
    glViewport(0, 0, width_, height_);
}

Image Canvas::read() {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, sampled_);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, resolved_);
    glBlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, resolved_);
    return read_pixels(width_, height_);
}

Image read_pixels(int width, int height) {
    Image image{width, height, {}};
    const std::size_t row = std::size_t{3} * width;
    std::vector<std::uint8_t> bytes(row * height);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, bytes.data());
    image.rgb.reserve(bytes.size());
    for (int y = height; y-- > 0;)
        image.rgb.insert(image.rgb.end(), bytes.begin() + y * row, bytes.begin() + (y + 1) * row);
    return image;
}

}  // namespace innerspring::viewer
