#include "display.h"

#include <GLFW/glfw3.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <link.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>

#include "support/sanitized.h"

#if INNERSPRING_SANITIZED
// Mesa's own: its software driver, with threads that these tools cannot see into, and the compiler in it.
extern "C" const char* __lsan_default_suppressions() {
    return "leak:_dri.so\nleak:libLLVM\nleak:libEGL_mesa\nleak:libGLX_mesa\n";
}
extern "C" const char* __tsan_default_suppressions() {
    return "race:_dri.so\n";
}
#endif

namespace {

/// What is loaded stays so, that what it leaks is known by its name: drivers come and go with their windows.
int keep(dl_phdr_info* object, std::size_t, void*) {
    if (*object->dlpi_name) dlopen(object->dlpi_name, RTLD_NOW | RTLD_NOLOAD | RTLD_NODELETE);
    return 0;
}

void keep_drivers() {
    if (!INNERSPRING_SANITIZED || !glfwInit()) return;
    glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
    if (GLFWwindow* window = glfwCreateWindow(64, 64, "", nullptr, nullptr)) {
        glfwMakeContextCurrent(window);
        dl_iterate_phdr(keep, nullptr);
        glfwDestroyWindow(window);
    }
    glfwTerminate();
}

struct Server {
    std::string why;
    pid_t pid = 0;

    Server() {
        // Remembered windows of the user are none of the tests' business.
        setenv("XDG_CONFIG_HOME", "/nonexistent", 1);
        if (const char* display = std::getenv("DISPLAY"); display && *display) {
            keep_drivers();
            return;
        }
        int ends[2];
        if (pipe(ends) != 0) {
            why = "no pipe";
            return;
        }
        pid = fork();
        if (pid == 0) {
            close(ends[0]);
            const int nowhere = open("/dev/null", O_WRONLY);
            dup2(nowhere, 2);
            const std::string fd = std::to_string(ends[1]);
            execlp("Xvfb", "Xvfb", "-displayfd", fd.c_str(), "-screen", "0", "1600x1200x24", "-nolisten",
                   "tcp", "-noreset", nullptr);
            _exit(1);
        }
        close(ends[1]);
        std::string number;
        char c;
        while (pid > 0 && read(ends[0], &c, 1) == 1 && c != '\n') number += c;
        close(ends[0]);
        if (number.empty())
            why = "Xvfb does not start";
        else
            setenv("DISPLAY", (":" + number).c_str(), 1);
        keep_drivers();
    }
    ~Server() {
        if (pid <= 0) return;
        kill(pid, SIGTERM);
        waitpid(pid, nullptr, 0);
    }
};

}  // namespace

std::string have_display() {
    static const Server server;
    return server.why;
}
