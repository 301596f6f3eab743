#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "innerspring/record/plot.h"

namespace innerspring {
namespace {

namespace fs = std::filesystem;

// A directory of the test's own, which is also the working directory, so that a stray file is seen.
class PlotTest : public testing::Test {
  protected:
    void SetUp() override {
        const auto* test = testing::UnitTest::GetInstance()->current_test_info();
        before = fs::current_path();
        directory =
            fs::temp_directory_path() / ("innerspring_plot_" + std::to_string(getpid()) + test->name());
        fs::create_directories(directory);
        fs::current_path(directory);
    }
    void TearDown() override {
        fs::current_path(before);
        fs::remove_all(directory);
    }

    // The SVG, or nothing where the test is to be skipped.
    std::string svg_of(const Plot& plot) {
        failure = write_svg(plot, "plot.svg");
        if (!failure.empty()) return "";
        std::ifstream in("plot.svg", std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    bool missing() const { return failure.find("not installed") != std::string::npos; }

    fs::path before, directory;
    std::string failure;
};

#define SKIP_WITHOUT_GNUPLOT() \
    if (missing()) GTEST_SKIP() << failure

Curve wave(const std::string& label, double frequency, std::size_t points = 200) {
    Curve curve{label, {}, {}};
    for (std::size_t i = 0; i < points; ++i) {
        curve.x.push_back(0.01 * static_cast<double>(i));
        curve.y.push_back(std::sin(frequency * curve.x.back()));
    }
    return curve;
}

std::size_t count(const std::string& text, const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
    return found;
}

// Elements nest and close, and every ampersand begins an entity.
void expect_well_formed(const std::string& xml) {
    std::vector<std::string> open;
    for (std::size_t i = 0; i < xml.size(); ++i) {
        if (xml[i] == '&') {
            EXPECT_LT(xml.find(';', i), i + 8) << xml.substr(i, 20);
        }
        if (xml[i] != '<') continue;
        if (xml.compare(i, 4, "<!--") == 0) {
            i = xml.find("-->", i);
            ASSERT_NE(i, std::string::npos);
            continue;
        }
        if (xml.compare(i, 9, "<![CDATA[") == 0) {
            i = xml.find("]]>", i);
            ASSERT_NE(i, std::string::npos);
            continue;
        }
        std::size_t end = i;
        for (char quote = 0; end < xml.size() && (quote != 0 || xml[end] != '>'); ++end) {
            if (quote != 0 && xml[end] == quote) {
                quote = 0;
            } else if (quote == 0 && (xml[end] == '"' || xml[end] == '\'')) {
                quote = xml[end];
            }
        }
        ASSERT_LT(end, xml.size());
        const std::string tag = xml.substr(i + 1, end - i - 1);
        i = end;
        if (tag[0] == '?' || tag[0] == '!' || tag.back() == '/') continue;
        std::size_t letters = tag[0] == '/' ? 1 : 0;
        while (letters < tag.size() && !std::isspace(static_cast<unsigned char>(tag[letters]))) ++letters;
        if (tag[0] != '/') {
            open.push_back(tag.substr(0, letters));
            continue;
        }
        ASSERT_FALSE(open.empty());
        EXPECT_EQ(open.back(), tag.substr(1, letters - 1));
        open.pop_back();
    }
    EXPECT_TRUE(open.empty());
}

TEST_F(PlotTest, OnePathPerCurveAndEveryLabel) {
    const Plot plot{
        "Volume under gravity", "time [s]", "volume [%]", {wave("one", 3), wave("two", 4), wave("three", 5)}};
    const std::string svg = svg_of(plot);
    SKIP_WITHOUT_GNUPLOT();
    ASSERT_EQ(failure, "");
    expect_well_formed(svg);
    for (const char* label : {"Volume under gravity", "time [s]", "volume [%]", ">one<", ">two<", ">three<"})
        EXPECT_NE(svg.find(label), std::string::npos) << label;
    EXPECT_EQ(count(svg, "id=\"gnuplot_plot_"), 3u);
    for (int i = 1; i <= 3; ++i) {
        const std::size_t begin = svg.find("id=\"gnuplot_plot_" + std::to_string(i));
        const std::size_t end = std::min(svg.find("id=\"gnuplot_plot_" + std::to_string(i + 1)), svg.size());
        // After the last curve comes the frame.
        if (i < 3) {
            EXPECT_EQ(count(svg.substr(begin, end - begin), "<path"), 1u) << i;
        }
    }
}

TEST_F(PlotTest, NoTextBecomesACommand) {
    const std::vector<std::string> hostile = {"\"; system \"touch x\"",
                                              "'; system 'touch x'; '",
                                              "a\nsystem \"touch x\"\n",
                                              "a\r!touch x\r\n!touch x",
                                              "`touch x`",
                                              "$(touch x) @x {/=50 a}",
                                              "\\",
                                              "'\\",
                                              "\\'\n!touch x",
                                              "\nEOD\n!touch x\n",
                                              "# { [ ( <b>&amp;]]>",
                                              std::string("nul\0!touch x", 12),
                                              "\xff\xc3 \xed\xa0\x80",
                                              "%s%n\t\x1b[2J"};
    for (const std::string& text : hostile) {
        const std::string svg = svg_of({text, text, text, {wave(text, 3), wave("after", 4)}});
        SKIP_WITHOUT_GNUPLOT();
        EXPECT_EQ(failure, "") << text;
        expect_well_formed(svg);
        EXPECT_NE(svg.find(">after<"), std::string::npos) << text;
        EXPECT_EQ(count(svg, "id=\"gnuplot_plot_"), 2u) << text;
        std::size_t files = 0;
        for ([[maybe_unused]] const auto& entry : fs::directory_iterator(directory)) ++files;
        ASSERT_EQ(files, 1u) << text;
    }
}

TEST_F(PlotTest, LabelsAreShownLiterally) {
    const std::string svg = svg_of({"it's a_b^2 {x} \\n", "a:b=2000,c=7", "", {wave("`q` \"r\"", 3)}});
    SKIP_WITHOUT_GNUPLOT();
    EXPECT_NE(svg.find(">a:b=2000,c=7<"), std::string::npos);
    EXPECT_NE(svg.find(">it's a_b^2 {x} \\n<"), std::string::npos);
    EXPECT_NE(svg.find(">`q` \"r\"<"), std::string::npos);
}

TEST_F(PlotTest, WhatCannotBeDrawnIsSkipped) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                     infinity = std::numeric_limits<double>::infinity();
    const std::vector<Plot> plots = {
        {},
        {"empty curve", "", "", {{"none", {}, {}}}},
        {"nothing finite", "", "", {{"nan", {1, nan}, {infinity, 2}}}},
        {"one point", "", "", {{"point", {1}, {1}}}},
        {"constant", "", "", {{"constant", {1, 2, 3}, {5, 5, 5}}}},
        {"negative on log axes", "", "", {{"log", {-1, 1, 2, 0}, {1, -1, 3, 2}}}, true, true},
        {"nothing for log axes", "", "", {{"log", {-1, 1}, {1, -1}}}, true, true},
        {"unequal", "", "", {{"x longer", {1, 2, 3}, {1, 2}}, {"y longer", {1}, {1, 2}}}},
        {"gaps", "", "", {{"gaps", {1, nan, 2, 3, nan, nan, 4}, {1, 2, 3, infinity, 1, 1, 1}}}}};
    for (const Plot& plot : plots) {
        const std::string svg = svg_of(plot);
        SKIP_WITHOUT_GNUPLOT();
        EXPECT_EQ(failure, "") << plot.title;
        expect_well_formed(svg);
    }
}

// The y of every point of the first curve on the page.
std::vector<double> page_heights(const std::string& svg) {
    std::vector<double> heights;
    const std::size_t begin = svg.find("d='M", svg.find("<path", svg.find("id=\"gnuplot_plot_1")));
    const std::string path = svg.substr(begin, svg.find('\'', begin + 3) - begin);
    for (std::size_t comma = path.find(','); comma != std::string::npos; comma = path.find(',', comma + 1))
        heights.push_back(std::stod(path.substr(comma + 1)));
    return heights;
}

TEST_F(PlotTest, LongCurvesKeepTheirPeaks) {
    Curve curve{"", {}, {}};
    for (int i = 0; i < 300000; ++i) {
        curve.x.push_back(i);
        curve.y.push_back(i == 123456 ? 3 : i == 234567 ? -3 : 0.1 * std::sin(i * 1e-4));
    }
    const std::vector<double> long_curve = page_heights(svg_of({"", "", "", {curve}}));
    SKIP_WITHOUT_GNUPLOT();
    const std::vector<double> peaks = page_heights(svg_of({"", "", "", {{"", {0, 3e5}, {-3, 3}}}}));
    ASSERT_GE(peaks.size(), 2u);
    EXPECT_LT(long_curve.size(), 10000u);
    const auto [low, high] = std::minmax_element(long_curve.begin(), long_curve.end());
    EXPECT_EQ(*low, *std::min_element(peaks.begin(), peaks.end()));
    EXPECT_EQ(*high, *std::max_element(peaks.begin(), peaks.end()));
}

TEST_F(PlotTest, WithoutGnuplotThereIsAReasonAndNoFile) {
    const char* const path = std::getenv("PATH");
    const std::string old = path != nullptr ? path : "";
    setenv("PATH", directory.c_str(), 1);
    const std::string reason = write_svg({"title", "", "", {wave("one", 3)}}, "plot.svg");
    setenv("PATH", old.c_str(), 1);
    EXPECT_NE(reason.find("gnuplot"), std::string::npos);
    EXPECT_EQ(reason.find('\n'), std::string::npos);
    EXPECT_FALSE(fs::exists("plot.svg"));
}

TEST_F(PlotTest, AFailingProgramLeavesNoFile) {
    {
        std::ofstream program("gnuplot");
        program << "#!/bin/sh\necho 'line 1: no such thing' >&2\necho '<svg>'\nexit 1\n";
    }
    fs::permissions("gnuplot", fs::perms::owner_all);
    const char* const path = std::getenv("PATH");
    const std::string old = path != nullptr ? path : "";
    setenv("PATH", (directory.string() + ":" + old).c_str(), 1);
    // More than a pipe holds: a program that does not read its input must not hang or kill us.
    const std::string reason = write_svg({"title", "", "", {wave("one", 3, 20000)}}, "plot.svg");
    setenv("PATH", old.c_str(), 1);
    EXPECT_EQ(reason, "gnuplot failed: line 1: no such thing");
    EXPECT_FALSE(fs::exists("plot.svg"));
}

TEST_F(PlotTest, UnwritableFileIsAReason) {
    const std::string reason = write_svg({"title", "", "", {wave("one", 3)}}, "no/such/directory/plot.svg");
    EXPECT_NE(reason, "");
    EXPECT_EQ(reason.find('\n'), std::string::npos);
}

TEST_F(PlotTest, PngIsAPicture) {
    failure = write_png({"PNG", "x [m]", "y [m]", {wave("a", 1), wave("b", 2)}, false, false}, "plot.png");
    SKIP_WITHOUT_GNUPLOT();
    ASSERT_EQ(failure, "");
    std::ifstream in("plot.png", std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    EXPECT_EQ(bytes.substr(0, 8), "\x89PNG\r\n\x1a\n");
    EXPECT_NE(bytes.find("IEND"), std::string::npos);
}

TEST_F(PlotTest, CurvesTakeTheirColourAndDash) {
    Plot plot{"", "", "", {wave("a", 1), wave("b", 2)}, false, false};
    plot.curves[0].colour = 3, plot.curves[1].colour = 3, plot.curves[1].dash = 2;
    const std::string svg = svg_of(plot);
    SKIP_WITHOUT_GNUPLOT();
    EXPECT_NE(svg.find("0, 158, 115"), std::string::npos);  // the third colour
    EXPECT_EQ(svg.find("0, 114, 178"), std::string::npos);  // not the first
    EXPECT_NE(svg.find("stroke-dasharray"), std::string::npos);
}

}  // namespace
}  // namespace innerspring
