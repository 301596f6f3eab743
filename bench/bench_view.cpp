// Frames a second of the window, with the body at rest and while it is stepped in its own thread; and at rest
// without filling pixels, which a graphics card does beside the processor: what is left to that. Needs a
// display:
//   xvfb-run -a build/release/bench/bench_view [VERTICES]
#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <epoxy/gl.h>

#include "window.h"

using namespace innerspring;
using namespace innerspring::viewer;

int main(int argc, char** argv) {
    const int vertices = argc > 1 ? std::atoi(argv[1]) : 50002;
    WindowOptions options;
    options.open = {{fmt::format("icosphere:vertices={}", vertices)}};
    options.size = {{1280, 720}};
    options.remember = false;
    Window window(options);
    glfwSwapInterval(0);
    const Surface& surface = *window.snapshot().bodies[0].surface;
    fmt::print("{}, {} triangles, 1280 x 720\n", reinterpret_cast<const char*>(glGetString(GL_RENDERER)),
               surface.triangles.size());
    struct Way {
        const char* name;
        bool paused, filled;
    };
    for (const Way& way :
         {Way{"at rest", true, true}, {"stepping", false, true}, {"no pixels", true, false}}) {
        window.session()->pause(way.paused);
        (way.filled ? glDisable : glEnable)(GL_RASTERIZER_DISCARD);
        for (int n = 0; n < 5; ++n) window.frame();
        const double start = glfwGetTime();
        const auto ticks = window.snapshot().ticks;
        int frames = 0;
        while (glfwGetTime() - start < 5) window.frame(), ++frames;
        const double seconds = glfwGetTime() - start;
        fmt::print("{}: {:.1f} frames a second, {:.0f} steps a second, real-time factor {:.2f}\n", way.name,
                   frames / seconds, double(window.snapshot().ticks - ticks) / seconds,
                   window.snapshot().real_time_factor);
    }
}
