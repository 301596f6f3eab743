#include "display.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>

namespace {

struct Server {
    std::string why;
    pid_t pid = 0;

    Server() {
        // Remembered windows of the user are none of the tests' business.
        const std::string folder = "/tmp/innerspring-viewer-test-" + std::to_string(getpid());
        setenv("XDG_CONFIG_HOME", folder.c_str(), 1);
        if (const char* display = std::getenv("DISPLAY"); display && *display) return;
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
                   "tcp", nullptr);
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
