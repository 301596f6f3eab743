#pragma once
#include <CLI/CLI.hpp>
#include <functional>

/// Adds a subcommand; when it is given, `run` returns the exit code: 0 done, 1 unstable or failed. Bad input
/// throws (exit 2).
struct Command {
    CLI::App* app;
    std::function<int()> run;
};

Command add_check(CLI::App& program);
Command add_estimate(CLI::App& program);
Command add_simulate(CLI::App& program);
Command add_refine(CLI::App& program);
Command add_study(CLI::App& program);
Command add_bench(CLI::App& program);
Command add_view(CLI::App& program);
Command add_haptic(CLI::App& program);
