#include <fmt/format.h>

#include <cstdio>
#include <new>

#include "commands.h"
#include "innerspring/mesh/error.h"
#include "innerspring/mesh/nearest_name.h"
#include "innerspring/version.h"

namespace {

/// CLI11 says what it did not expect; we add what may have been meant.
std::string suggestion(const CLI::App& program, int argc, char** argv) {
    std::vector<std::string> names;
    const CLI::App* scope = &program;
    for (const CLI::App* command : program.get_subcommands()) scope = command;
    for (const CLI::Option* option : scope->get_options())
        for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const CLI::App* command : scope->get_subcommands([](const CLI::App*) { return true; }))
        names.push_back(command->get_name());
    const std::vector<std::string_view> views(names.begin(), names.end());
    for (int n = 1; n < argc; ++n) {
        const std::string word = std::string(argv[n]).substr(0, std::string(argv[n]).find('='));
        const bool known = std::find(names.begin(), names.end(), word) != names.end();
        if (known || (scope != &program && !word.starts_with("--"))) continue;
        if (const std::string nearest = innerspring::nearest_name(word, views); !nearest.empty())
            return fmt::format("; did you mean {}?", nearest);
    }
    return fmt::format("; see innerspring {}--help", scope == &program ? "" : scope->get_name() + " ");
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App program("innerspring: soft solid bodies from surface meshes. All numbers in SI units.");
    program.set_version_flag("--version", std::string("innerspring ") + innerspring::version);
    program.require_subcommand(1);
    program.get_formatter()->column_width(34);
    program.footer(
        "Examples:\n"
        "  innerspring check organ.stl\n"
        "  innerspring estimate organ.stl --unit mm --material liver\n"
        "  innerspring simulate breast -o out --force 'near=[0,0,2], inward=0.05, radius=0.4'\n"
        "  innerspring study all -o out\n"
        "Exit code: 0 done, 1 unstable or failed, 2 bad input or usage.");
    const Command commands[] = {add_check(program),  add_estimate(program), add_simulate(program),
                                add_refine(program), add_study(program),    add_bench(program),
                                add_view(program),   add_haptic(program)};
    try {
        program.parse(argc, argv);
        for (const Command& command : commands)
            if (command.app->parsed()) return command.run();
    } catch (const CLI::Success& e) {  // --help, --version
        return program.exit(e);
    } catch (const CLI::ParseError& e) {
        std::string what = e.what();
        std::replace(what.begin(), what.end(), '\n', ' ');
        fmt::print(stderr, "innerspring: {}{}\n", what, suggestion(program, argc, argv));
        return 2;
    } catch (const innerspring::InputError& e) {
        fmt::print(stderr, "innerspring: {}\n", e.what());
        return 2;
    } catch (const std::bad_alloc&) {
        fmt::print(stderr, "innerspring: out of memory\n");
        return 1;
    } catch (const std::exception& e) {
        fmt::print(stderr, "innerspring: {}\n", e.what());
        return 1;
    }
    return 2;
}
