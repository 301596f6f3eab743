#include "innerspring/record/program.h"

#include <fmt/core.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <memory>

#include "innerspring/record/xml.h"

extern char** environ;

namespace innerspring {
namespace {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

std::string text_of(std::FILE* file) {
    std::string text;
    std::array<char, 65536> buffer;
    std::rewind(file);
    while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), file))
        text.append(buffer.data(), n);
    return text;
}

bool ended(pid_t child, int& status) {
    const pid_t pid = waitpid(child, &status, WNOHANG);
    return pid == child || (pid < 0 && errno != EINTR);  // ECHILD: the host program ignores SIGCHLD
}

ProgramOutput failed(std::string why) {
    return {std::move(why), {}, {}, 0};
}

}  // namespace

std::string last_line(const std::string& text) {
    const std::size_t end = text.find_last_not_of(" \t\r\n");
    if (end == std::string::npos) return "no reason given";
    const std::size_t before = text.find_last_of("\r\n", end),
                      begin = text.find_first_not_of(" \t", before + 1);
    return clean_text(std::string_view(text).substr(begin, end + 1 - begin));
}

ProgramOutput run_program(const std::vector<std::string>& command, std::string_view input, int patience_s) {
    std::array<File, 3> files = {File(std::tmpfile(), std::fclose), File(std::tmpfile(), std::fclose),
                                 File(std::tmpfile(), std::fclose)};
    for (const File& file : files)
        if (!file) return failed(fmt::format("no temporary file: {}", std::strerror(errno)));
    if (std::fwrite(input.data(), 1, input.size(), files[0].get()) != input.size() ||
        std::fflush(files[0].get()) != 0)
        return failed(fmt::format("temporary file: {}", std::strerror(errno)));
    std::rewind(files[0].get());

    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    for (int i = 0; i < 3; ++i)
        posix_spawn_file_actions_adddup2(&actions, fileno(files[std::size_t(i)].get()), i);
    std::vector<std::string> words = command;
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    pid_t child = 0;
    const int error = posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (error == ENOENT) return failed(command[0] + " is not installed");
    if (error != 0) return failed(fmt::format("cannot run {}: {}", command[0], std::strerror(error)));

    int status = 0;
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(patience_s);
    while (!ended(child, status)) {
        if (std::chrono::steady_clock::now() > deadline) {
            kill(child, SIGKILL);
            waitpid(child, &status, 0);
            return failed(fmt::format("{} took longer than {} s", command[0], patience_s));
        }
        usleep(2000);
    }
    ProgramOutput result{{}, text_of(files[1].get()), text_of(files[2].get()), -1};
    if (WIFEXITED(status)) result.status = WEXITSTATUS(status);
    if (result.status == 127 && result.out.empty()) result.failure = command[0] + " is not installed";
    return result;
}

}  // namespace innerspring
