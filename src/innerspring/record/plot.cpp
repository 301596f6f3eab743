#include "innerspring/record/plot.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <string_view>

#include "innerspring/mesh/write.h"
#include "innerspring/record/program.h"
#include "innerspring/record/xml.h"

namespace innerspring {
namespace {

constexpr int patience_s = 20;

// Okabe and Ito's colours, told apart by colour-blind eyes as well (their yellow is too faint on white).
constexpr std::array colours = {"#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"};

// A literal of gnuplot that shows the text as it is: all but letters and spaces as octal escapes, so that no
// quote, backquote or backslash is left to be read as anything else, and no digit is taken into the escape
// before it (gnuplot reads four). (Within single quotes
// gnuplot 5.4 stumbles over a quote in front.)
std::string literal(std::string_view text) {
    std::string quoted = "\"";
    for (const char c : clean_text(text)) {
        const bool plain = c == ' ' || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
        quoted += plain ? std::string(1, c) : fmt::format("\\{:03o}", static_cast<unsigned char>(c));
    }
    return quoted + '"';
}

bool drawable(const Plot& plot, double x, double y) {
    return std::isfinite(x) && std::isfinite(y) && (!plot.log_x || x > 0) && (!plot.log_y || y > 0);
}

// The points as a data block: a blank line, a gap in the curve, where one cannot be drawn. Of a long curve,
// of every so many points only the lowest and the highest, which looks the same. Returns how many points are
// drawn.
std::size_t add_data(const Curve& curve, const Plot& plot, std::string& script) {
    const std::size_t size = std::min(curve.x.size(), curve.y.size()), stride = 1 + size / 4000;
    std::size_t drawn = 0;
    const auto add = [&](std::size_t i) {
        script += fmt::format("{} {}\n", curve.x[i], curve.y[i]);
        ++drawn;
    };
    for (std::size_t begin = 0, end = 0; begin < size; begin = end) {
        if (!drawable(plot, curve.x[begin], curve.y[begin])) {
            script += "\n";
            end = begin + 1;
            continue;
        }
        std::size_t low = begin, high = begin;
        for (; end < std::min(begin + stride, size) && drawable(plot, curve.x[end], curve.y[end]); ++end) {
            if (curve.y[end] < curve.y[low]) low = end;
            if (curve.y[end] > curve.y[high]) high = end;
        }
        add(std::min(low, high));
        if (low != high) add(std::max(low, high));
    }
    return drawn;
}

/// What gnuplot is asked for, and how a whole file of it ends.
struct Format {
    std::string_view terminal, end;
};
constexpr Format svg = {"svg size 800,480 noenhanced font 'sans-serif,14' background '#ffffff'", "</svg>"};
constexpr Format png = {
    "pngcairo size 1600,960 noenhanced font 'sans-serif,14' fontscale 2 linewidth 2 pointscale 2 background "
    "'#ffffff'",
    "IEND"};

std::string script_of(const Plot& plot, const Format& format) {
    std::string script = "set encoding utf8\n", commands;
    std::size_t longest = 0, shown = 0;
    for (std::size_t i = 0; i < plot.curves.size(); ++i) {
        const Curve& curve = plot.curves[i];
        script += fmt::format("$curve{} << EOD\n", i);
        const std::size_t points = add_data(curve, plot, script);
        script += "EOD\n";
        if (points == 0) continue;
        const std::size_t colour = curve.colour > 0 ? std::size_t(curve.colour - 1) : shown;
        const std::size_t dash = curve.dash > 0 ? std::size_t(curve.dash) : shown / colours.size() % 5 + 1;
        commands += fmt::format("{} $curve{} using 1:2 with {} lc rgb '{}' dt {} lw 2 pt 7 ps 0.45 {}",
                                shown == 0 ? "plot" : ",", i, points <= 40 ? "linespoints" : "lines",
                                colours[colour % colours.size()], dash,
                                curve.label.empty() ? "notitle" : "title " + literal(curve.label));
        longest = std::max(longest, curve.label.size());
        ++shown;
    }
    script += fmt::format("set terminal {}\n", format.terminal);
    script += "set border 3 lw 1 lc rgb '#606060'\nset tics nomirror out scale 0.6 textcolor rgb '#303030'\n";
    script += "set grid lc rgb '#dcdcdc' lw 1 lt 1\n";
    // Long labels beside the axes would leave no room for the curves.
    script +=
        longest > 24 ? "set key outside bottom center horizontal\n" : "set key outside right top vertical\n";
    script += "set key Left reverse samplen 2 spacing 1.2 noenhanced textcolor rgb '#303030'\n";
    script += fmt::format("set title {} noenhanced font ',17'\n", literal(plot.title));
    script += fmt::format("set xlabel {} noenhanced\nset ylabel {} noenhanced\n", literal(plot.x_label),
                          literal(plot.y_label));
    script += "set autoscale xfix\n";
    // Powers of ten as 1e-05, not as rows of zeros.
    if (plot.log_x) script += "set logscale x\nset format x \"%g\"\n";
    if (plot.log_y) script += "set logscale y\nset format y \"%g\"\n";
    if (shown == 0) {
        script +=
            "set xrange [1:10]\nset yrange [1:10]\nunset tics\nset label 'no data' at graph 0.5,0.5 center\n";
        commands = "plot NaN notitle";
    }
    return script + commands + "\n";
}

// Runs gnuplot on the script; `end` is in the last bytes of a whole picture. Returns why it failed, or an
// empty string. "-d": no start-up file of the user.
std::string run_gnuplot(const std::string& script, std::string_view end, std::string& picture) {
    ProgramOutput output = run_program({"gnuplot", "-d"}, script, patience_s);
    if (!output.failure.empty()) return output.failure;
    picture = std::move(output.out);
    if (output.status != 0 || picture.rfind(end) == std::string::npos)
        return "gnuplot failed: " + last_line(output.err);
    return {};
}

std::string write_plot(const Plot& plot, const Format& format, const std::filesystem::path& file) {
    std::string picture;
    if (std::string failure = run_gnuplot(script_of(plot, format), format.end, picture); !failure.empty())
        return failure;
    try {
        write_whole(file, picture);
    } catch (const std::exception& error) {
        return last_line(error.what());
    }
    return {};
}

}  // namespace

std::string write_svg(const Plot& plot, const std::filesystem::path& file) {
    return write_plot(plot, svg, file);
}

std::string write_png(const Plot& plot, const std::filesystem::path& file) {
    return write_plot(plot, png, file);
}

}  // namespace innerspring
