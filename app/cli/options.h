#pragma once
#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "innerspring/record/setup.h"

/// Options shared by the commands; unset means "as the scene or the default says".
struct MeshOptions {
    std::string mesh;
    std::string unit;
    bool normalize = false;
    std::optional<double> weld;
    std::optional<std::uint64_t> seed;
};
void add_mesh_options(CLI::App& app, MeshOptions& o, const std::string& mesh_help);

struct BodyArguments {
    std::optional<std::string> material, anisotropy, scheme, centre;
    std::optional<double> mass, density, young, surface, damping, poisson;
};
void add_body_options(CLI::App& app, BodyArguments& o);

/// What acts on a body and how it is stepped.
struct MotionArguments {
    std::optional<std::string> gravity, integrator, precision;
    std::vector<std::string> forces, pins, refine, tools;
    std::optional<double> dt;
    std::optional<int> threads;
    bool free = false, linearised = false;
};
void add_motion_options(CLI::App& app, MotionArguments& o);

struct OutputOptions {
    bool json = false, quiet = false;
};
void add_output_options(CLI::App& app, OutputOptions& o);

/// Puts what was given on the command line over what the scene says.
void apply(const MeshOptions& o, innerspring::Scene& scene);
void apply(const BodyArguments& o, innerspring::Scene& scene);
void apply(const MotionArguments& o, innerspring::Scene& scene);

/// The built-in shapes, for help texts.
std::string shape_list();

/// "X,Y,Z" to a vector. Throws InputError naming `option`.
innerspring::Vector parse_vector(const std::string& text, const char* option);

/// "WIDTHxHEIGHT" [pixel]. Throws InputError.
std::pair<int, int> parse_size(const std::string& text);

/// Notes to standard error, one line each, unless quiet.
void print_notes(const std::vector<std::string>& notes, bool quiet);

/// "label   value" lines of a table, aligned.
void print_row(std::string_view label, const std::string& value);
