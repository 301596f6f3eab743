#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "innerspring/mesh/error.h"
#include "innerspring/record/colours.h"
#include "innerspring/record/font.h"
#include "innerspring/record/picture.h"

namespace innerspring {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

SurfaceMesh sphere(double radius, Index rings = 60, Index sectors = 120) {
    SurfaceMesh mesh;
    mesh.positions.push_back({0, 0, radius});
    for (Index r = 1; r < rings; ++r) {
        for (Index s = 0; s < sectors; ++s) {
            const double a = std::numbers::pi * r / rings, b = 2 * std::numbers::pi * s / sectors;
            mesh.positions.push_back(
                radius * Vector(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)));
        }
    }
    mesh.positions.push_back({0, 0, -radius});
    const auto vertex = [&](Index r, Index s) {
        return r == 0 ? 0 : r == rings ? (rings - 1) * sectors + 1 : 1 + (r - 1) * sectors + s % sectors;
    };
    for (Index r = 0; r < rings; ++r) {
        for (Index s = 0; s < sectors; ++s) {
            if (r + 1 < rings)
                mesh.triangles.push_back({vertex(r, s), vertex(r + 1, s), vertex(r + 1, s + 1)});
            if (r > 0) mesh.triangles.push_back({vertex(r, s), vertex(r + 1, s + 1), vertex(r, s + 1)});
        }
    }
    return mesh;
}

std::vector<double> heights(const SurfaceMesh& mesh) {
    std::vector<double> values;
    for (const Vector& p : mesh.positions) values.push_back(p.y());
    return values;
}

// Adds a square of the given half side, facing the eye that looks along -z.
void add_square(SurfaceMesh& mesh, double half, double z) {
    const auto i = static_cast<Index>(mesh.positions.size());
    for (const auto& [x, y] : {std::pair{-half, -half}, {half, -half}, {half, half}, {-half, half}})
        mesh.positions.push_back({x, y, z});
    mesh.triangles.push_back({i, i + 1, i + 2});
    mesh.triangles.push_back({i, i + 2, i + 3});
}

std::array<int, 3> pixel(const Image& image, int row, int column) {
    const std::uint8_t* p = &image.rgb[3 * (static_cast<std::size_t>(row) * image.width + column)];
    return {p[0], p[1], p[2]};
}

bool white(const std::array<int, 3>& p) {
    return p == std::array{255, 255, 255};
}

double luminance(const std::array<int, 3>& p) {
    const auto linear = [](int v) { return std::pow(v / 255.0, 2.2); };
    return 0.2126 * linear(p[0]) + 0.7152 * linear(p[1]) + 0.0722 * linear(p[2]);
}

int covered(const Image& image) {
    int count = 0;
    for (int row = 0; row < image.height; ++row)
        for (int column = 0; column < image.width; ++column) count += !white(pixel(image, row, column));
    return count;
}

const std::vector<Vector> frame = {{-1.5, -1.5, -1.5}, {1.5, 1.5, 1.5}};

PictureOptions front(int width = 400, int height = 300) {
    PictureOptions options;
    options.width = width;
    options.height = height;
    options.look = {0, 0, -1};
    return options;
}

TEST(Picture, SilhouetteOfASphereIsADisc) {
    // A square of side 2 in the same frame tells the pixels per metre.
    SurfaceMesh square;
    add_square(square, 1, 0);
    for (const auto& [width, height] : {std::pair{400, 300}, {300, 500}, {1000, 800}}) {
        const double scale =
            std::sqrt(covered(draw(square.positions, square.triangles, {}, front(width, height), frame))) / 2;
        for (const double radius : {1.0, 0.5}) {
            const SurfaceMesh ball = sphere(radius);
            PictureOptions options = front(width, height);
            for (const Vector& look : {Vector(0, 0, -1), Vector(0, 0, 1)}) {
                options.look = look;
                const double area = covered(draw(ball.positions, ball.triangles, {}, options, frame));
                const double expected = std::numbers::pi * radius * radius * scale * scale;
                EXPECT_NEAR(area, expected, 0.02 * expected) << width << " " << radius;
            }
        }
    }
}

TEST(Picture, NearerHidesFarther) {
    SurfaceMesh near, far;
    add_square(near, 0.5, 1);
    add_square(far, 1, -1);
    const PictureOptions options = front();
    PictureOptions ranged = options;
    ranged.low = 0, ranged.high = 1;
    const std::vector<double> near_values(4, 1.0), far_values(4, 0.0);
    const Image near_only = draw(near.positions, near.triangles, near_values, ranged, frame);
    const Image far_only = draw(far.positions, far.triangles, far_values, ranged, frame);

    for (const bool near_first : {true, false}) {
        SurfaceMesh both;
        if (near_first) add_square(both, 0.5, 1);
        add_square(both, 1, -1);
        if (!near_first) add_square(both, 0.5, 1);
        std::vector<double> values(8, 0.0);
        std::fill_n(values.begin() + (near_first ? 0 : 4), 4, 1.0);
        const Image image = draw(both.positions, both.triangles, values, ranged, frame);
        int inside = 0, around = 0;
        for (int row = 0; row < image.height; ++row) {
            for (int column = 0; column < image.width * 2 / 3; ++column) {
                const auto alone = pixel(near_only, row, column), seen = pixel(image, row, column);
                if (white(alone)) {
                    EXPECT_EQ(seen, pixel(far_only, row, column));
                    around += !white(seen);
                } else if (luminance(alone) < 0.8) {  // not half a pixel on the rim
                    inside += seen == alone;
                }
            }
        }
        EXPECT_GT(inside, 1000);
        EXPECT_GT(around, 1000);
    }
    // From behind it is the other way about.
    ranged.look = {0, 0, 1};
    SurfaceMesh both = near;
    add_square(both, 1, -1);
    std::vector<double> values(8, 0.0);
    std::fill_n(values.begin(), 4, 1.0);
    EXPECT_EQ(draw(both.positions, both.triangles, values, ranged, frame).rgb,
              draw(far.positions, far.triangles, far_values, ranged, frame).rgb);
}

TEST(Picture, UpIsUpAndRightIsRight) {
    SurfaceMesh square;
    add_square(square, 0.3, 0);
    for (Vector& p : square.positions) p += Vector(1, 0.7, 0);
    const Image image = draw(square.positions, square.triangles, {}, front(), frame);
    for (int row = 0; row < image.height; ++row) {
        for (int column = 0; column < image.width; ++column) {
            if (white(pixel(image, row, column))) continue;
            EXPECT_LT(row, image.height / 2);
            EXPECT_GT(column, image.width / 2);
        }
    }
    EXPECT_GT(covered(image), 500);
}

TEST(Picture, ColoursGetLighterUpTheBar) {
    const SurfaceMesh ball = sphere(1);
    PictureOptions options = front(800, 600);
    options.title = "title";
    options.legend = "height [m]";
    const Image image = draw(ball.positions, ball.triangles, heights(ball), options);
    // The bar is the column of the right quarter with the most colour.
    const auto coloured = [&](int row, int column) {
        const auto p = pixel(image, row, column);
        return std::max({p[0], p[1], p[2]}) - std::min({p[0], p[1], p[2]}) > 30;
    };
    int bar = 0, most = 0;
    for (int column = image.width * 3 / 4; column < image.width; ++column) {
        int count = 0;
        for (int row = 0; row < image.height; ++row) count += coloured(row, column);
        if (count > most) most = count, bar = column;
    }
    ASSERT_GT(most, 200);
    std::vector<double> up;
    for (int row = image.height - 1; row >= 0; --row)
        if (coloured(row, bar)) up.push_back(luminance(pixel(image, row, bar)));
    for (std::size_t i = 1; i < up.size(); ++i)
        EXPECT_GT(up[i], up[i - 1] - 0.002) << i;  // rounding to bytes
    EXPECT_GT(up.back(), up.front() + 0.5);
}

TEST(Picture, MapIsMonotoneAndTicksAreRound) {
    double last = -1;
    for (int i = 0; i <= 1000; ++i) {
        const Colour c = map_colour(i / 1000.0);
        const double light =
            0.2126 * std::pow(c[0], 2.2) + 0.7152 * std::pow(c[1], 2.2) + 0.0722 * std::pow(c[2], 2.2);
        EXPECT_GT(light, last) << i;
        last = light;
    }
    for (const auto& [low, high] : {std::pair{0.0, 1.0},
                                    {-1.0, 1.0},
                                    {0.0, 12.0},
                                    {-3.3e-7, 8.1e-7},
                                    {1000.001, 1000.002},
                                    {-5e9, -1e9},
                                    {0.0, 99.9},
                                    {1e299, 9e299},
                                    {1e-270, 3e-270},
                                    {0.07, 0.13}}) {
        const Ticks ticks = round_ticks(low, high);
        ASSERT_GE(ticks.values.size(), 4u) << low;
        EXPECT_LE(ticks.values.size(), 7u) << low;
        const double step = ticks.values[1] - ticks.values[0], tolerance = 1e-6 * (high - low);
        for (std::size_t i = 0; i < ticks.values.size(); ++i) {
            EXPECT_GE(ticks.values[i], low - tolerance);
            EXPECT_LE(ticks.values[i], high + tolerance);
            EXPECT_NEAR(ticks.values[i], ticks.values[0] + static_cast<double>(i) * step, tolerance);
            EXPECT_NEAR(std::stod(ticks.labels[i]) * std::pow(10.0, ticks.exponent), ticks.values[i],
                        tolerance);
            EXPECT_LE(ticks.labels[i].size(), 10u);
        }
    }
}

TEST(Picture, SameBitsTwiceAndFromTheFrameOnly) {
    const SurfaceMesh ball = sphere(1);
    PictureOptions options;
    options.title = "twice";
    options.legend = "y [m]";
    const Image once = draw(ball.positions, ball.triangles, heights(ball), options);
    EXPECT_EQ(once.rgb, draw(ball.positions, ball.triangles, heights(ball), options).rgb);
    EXPECT_EQ(once.rgb, draw(ball.positions, ball.triangles, heights(ball), options, ball.positions).rgb);
    EXPECT_EQ(to_png(once), to_png(once));
}

TEST(Picture, PlainAndColouredShareTheScale) {
    const SurfaceMesh ball = sphere(1);
    PictureOptions options = front();
    options.low = -1, options.high = 1;
    const Image plain = draw(ball.positions, ball.triangles, {}, options);
    const Image coloured = draw(ball.positions, ball.triangles, heights(ball), options);
    for (int row = 0; row < plain.height; ++row)
        for (int column = 0; column < plain.width * 2 / 3; ++column)
            EXPECT_EQ(white(pixel(plain, row, column)), white(pixel(coloured, row, column)));
}

TEST(Picture, BrokenCornersAreLeftOut) {
    SurfaceMesh broken = sphere(1, 20, 40);
    const SurfaceMesh whole = broken;
    broken.positions[100].y() = nan;
    broken.positions[300].x() = std::numeric_limits<double>::infinity();
    broken.positions[500].z() = 1e300;
    broken.triangles.push_back({0, 1, 999999});
    std::vector<Triangle> kept;
    for (const Triangle& t : whole.triangles)
        if (std::none_of(t.begin(), t.end(), [](Index i) { return i == 100 || i == 300 || i == 500; }))
            kept.push_back(t);
    EXPECT_EQ(draw(broken.positions, broken.triangles, {}, front(), frame).rgb,
              draw(whole.positions, kept, {}, front(), frame).rgb);
    // Fitted to itself it is still a picture.
    broken.positions[500] = whole.positions[500];
    EXPECT_GT(covered(draw(broken.positions, broken.triangles, {}, front())), 10000);
}

TEST(Picture, BrokenValuesAreDrawnPlain) {
    const SurfaceMesh ball = sphere(1, 20, 40);
    std::vector<double> values = heights(ball);
    values[10] = nan;
    values[20] = std::numeric_limits<double>::infinity();
    const Image image = draw(ball.positions, ball.triangles, values, front());
    EXPECT_GT(covered(image), 10000);
    const std::vector<double> none(values.size(), nan);
    EXPECT_EQ(draw(ball.positions, ball.triangles, none, front()).rgb,
              draw(ball.positions, ball.triangles, {}, front()).rgb);
    for (const double v : {0.0, 5.0, -1e300, 1e-320, 1.7e308})
        EXPECT_GT(covered(draw(ball.positions, ball.triangles, std::vector(values.size(), v), front())),
                  10000)
            << v;
    std::vector<double> wide = values;
    wide[0] = 1.7e308, wide[1] = -1.7e308;
    EXPECT_GT(covered(draw(ball.positions, ball.triangles, wide, front())), 10000);
}

TEST(Picture, NothingGivesABlankImage) {
    EXPECT_EQ(covered(draw({}, {}, {}, front())), 0);
    const std::vector<Vector> point(3, Vector(1, 2, 3));
    const std::vector<Triangle> flat = {{0, 1, 2}, {0, 0, 0}};
    const std::vector<double> values = {1, 2, 3};
    EXPECT_EQ(covered(draw(point, {}, values, front())), 0);
    EXPECT_EQ(covered(draw(point, flat, values, front())), 0);
    const std::vector<Vector> lost(3, Vector(nan, nan, nan));
    EXPECT_EQ(covered(draw(lost, flat, values, front())), 0);
}

TEST(Picture, AnyOptionsDraw) {
    const SurfaceMesh ball = sphere(1, 10, 20);
    for (const int width : {-5, 0, 1, 17, 50, 130, 100000}) {
        PictureOptions options;
        options.width = width;
        options.height = 40;
        options.title = "a title much too long for so small a picture \xc2\xb5m";
        options.legend = "a legend that is too long as well";
        const Image image = draw(ball.positions, ball.triangles, heights(ball), options);
        EXPECT_EQ(image.width, std::clamp(width, 16, 8192));
        EXPECT_EQ(image.rgb.size(), std::size_t{3} * image.width * image.height);
        options.height = 130;
        EXPECT_EQ(draw(ball.positions, ball.triangles, heights(ball), options).height, 130);
    }
    for (const Vector& look :
         {Vector(0, 0, 0), Vector(0, 1, 0), Vector(0, -1e-300, 0), Vector(nan, 0, 0), Vector(1e300, 0, 0)}) {
        PictureOptions options = front();
        options.look = look;
        options.low = 3, options.high = nan;
        EXPECT_GT(covered(draw(ball.positions, ball.triangles, heights(ball), options)), 5000)
            << look.transpose();
    }
}

TEST(Picture, BesideKeepsEveryPixel) {
    const SurfaceMesh ball = sphere(1, 10, 20);
    const std::vector<Image> images = {draw(ball.positions, ball.triangles, {}, front(40, 60)),
                                       draw(ball.positions, ball.triangles, {}, front(70, 30))};
    const Image row = beside(images);
    ASSERT_EQ(row.width, 110);
    ASSERT_EQ(row.height, 60);
    for (int y = 0; y < 60; ++y) {
        for (int x = 0; x < 40; ++x) EXPECT_EQ(pixel(row, y, x), pixel(images[0], y, x));
        for (int x = 0; x < 70; ++x)
            EXPECT_EQ(pixel(row, y, 40 + x), y < 30 ? pixel(images[1], y, x) : (std::array{255, 255, 255}));
    }
    EXPECT_TRUE(beside({}).rgb.empty());
}

TEST(Picture, PngDecodesToTheSamePixels) {
    const SurfaceMesh ball = sphere(1);
    PictureOptions options;
    options.title = "PNG";
    const Image image = draw(ball.positions, ball.triangles, heights(ball), options);
    const std::string bytes = to_png(image);
    png_image reader{};
    reader.version = PNG_IMAGE_VERSION;
    ASSERT_TRUE(png_image_begin_read_from_memory(&reader, bytes.data(), bytes.size()));
    reader.format = PNG_FORMAT_RGB;
    ASSERT_EQ(static_cast<int>(reader.width), image.width);
    ASSERT_EQ(static_cast<int>(reader.height), image.height);
    std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(reader));
    ASSERT_TRUE(png_image_finish_read(&reader, nullptr, pixels.data(), 0, nullptr));
    EXPECT_EQ(pixels, image.rgb);
}

TEST(Picture, ImpossiblePngIsRefused) {
    EXPECT_THROW(to_png(Image{}), RunError);
    EXPECT_THROW(to_png(Image{2, 2, std::vector<std::uint8_t>(11)}), RunError);
    EXPECT_THROW(to_png(Image{-2, -2, std::vector<std::uint8_t>(12)}), RunError);
}

TEST(Picture, EveryCharacterHasItsGlyph) {
    std::set<std::string> shapes;
    for (char c = 32; c < 127; ++c) {
        std::string shape;
        for (int row = 0; row < glyph_height; ++row)
            for (int column = 0; column < glyph_width; ++column) shape += ink(c, column, row) ? '#' : ' ';
        EXPECT_EQ(shape.find('#') == std::string::npos, c == ' ') << c;
        EXPECT_TRUE(shapes.insert(shape).second) << c;
    }
}

}  // namespace
}  // namespace innerspring
