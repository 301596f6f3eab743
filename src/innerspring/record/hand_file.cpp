#include "innerspring/record/hand_file.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>

#include "innerspring/mesh/error.h"

namespace innerspring {

namespace {

constexpr std::size_t most_numbers = 12;

struct Line {
    std::array<double, most_numbers> numbers{};
    std::size_t count = 0;
    std::string_view stranger;  ///< the first word that is no number
    bool too_many = false;
};

Line split(std::string_view text) {
    Line line;
    const auto parted = [](char c) { return c == ' ' || c == '\t' || c == ',' || c == ';' || c == '\r'; };
    while (true) {
        while (!text.empty() && parted(text.front())) text.remove_prefix(1);
        if (text.empty()) return line;
        std::size_t end = 0;
        while (end < text.size() && !parted(text[end])) ++end;
        const std::string_view word = text.substr(0, end);
        text.remove_prefix(end);
        if (line.count == most_numbers) {
            line.too_many = true;
            return line;
        }
        const auto [next, error] =
            std::from_chars(word.data(), word.data() + word.size(), line.numbers[line.count]);
        if (error != std::errc() || next != word.data() + word.size()) {
            line.stranger = word;
            return line;
        }
        ++line.count;
    }
}

std::string shown(std::string_view word) {
    std::string out;
    for (const char c : word.substr(0, 30)) out += c >= ' ' && c < 127 ? c : '?';
    return out;
}

}  // namespace

std::vector<HandSample> parse_hand(std::string_view text, std::string_view name) {
    std::vector<HandSample> samples;
    int number = 0;
    bool header = true;
    std::size_t columns = 0;
    const auto fail = [&](const std::string& what) {
        throw InputError(fmt::format("{}:{}: {}", name, number, what));
    };
    while (!text.empty()) {
        ++number;
        const std::size_t end = text.find('\n');
        std::string_view row = text.substr(0, end);
        const bool whole = end != std::string_view::npos;
        text.remove_prefix(whole ? end + 1 : text.size());
        row = row.substr(0, row.find('#'));
        const Line line = split(row);
        if (line.count == 0 && line.stranger.empty()) continue;
        if (!whole && !samples.empty() && line.count != columns) break;  // cut off
        const std::size_t n = line.count;
        if (!line.stranger.empty()) {
            if (header && n == 0) {
                header = false;
                continue;
            }
            fail(fmt::format("'{}' is not a number", shown(line.stranger)));
        }
        header = false;
        if (line.too_many || (n != 4 && n != 5 && n != 8 && n != 9 && n != 12))
            fail(
                fmt::format("{}{} numbers; expected time, x, y, z, or these and buttons, or time, x, y, z, "
                            "w, i, j, k, or these and buttons, and a force",
                            line.too_many ? "more than " : "", n));
        if (columns != 0 && n != columns)
            fail(fmt::format("{} numbers, where the lines before have {}", n, columns));
        columns = n;
        const auto& v = line.numbers;
        for (std::size_t k = 0; k < n; ++k)
            if (!std::isfinite(v[k])) fail("the numbers must be finite");
        HandSample sample{v[0], {{v[1], v[2], v[3]}, Eigen::Quaterniond::Identity()}};
        if (!samples.empty() && !(sample.time > samples.back().time))
            fail(fmt::format("time {:g} s does not come after {:g} s", sample.time, samples.back().time));
        if (n >= 8) {
            Eigen::Quaterniond q(v[4], v[5], v[6], v[7]);
            if (!(std::abs(q.norm() - 1) < 1e-3)) fail("the rotation w, i, j, k must have norm 1");
            sample.pose.rotation = q.normalized();
        }
        if (n == 5 || n >= 9) {
            const double b = v[n == 5 ? 4 : 8];
            if (!(b >= 0 && b <= 255 && b == std::floor(b)))
                fail("buttons must be a whole number from 0 to 255, a bit each");
            sample.buttons = static_cast<unsigned>(b);
        }
        if (n == 12) sample.force = Vector(v[9], v[10], v[11]);
        samples.push_back(sample);
    }
    if (samples.empty())
        throw InputError(fmt::format("{}: no poses in it; a line is time_s, x_m, y_m, z_m", name));
    return samples;
}

std::vector<HandSample> read_hand(const std::filesystem::path& file) {
    std::error_code error;
    std::ifstream in(file, std::ios::binary);
    if (!in || std::filesystem::is_directory(file, error))
        throw InputError(fmt::format("{}: cannot be read; is it there, and a file?", file.string()));
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    return parse_hand(text, file.string());
}

HandWriter::HandWriter(const std::filesystem::path& file)
    : path_(file), file_(std::fopen(file.c_str(), "wb")) {
    if (!file_) throw InputError(fmt::format("{}: cannot be written; does the folder exist?", file.string()));
    std::fputs("time_s, x_m, y_m, z_m, w, i, j, k, buttons, fx_n, fy_n, fz_n\n", file_);
    flush();
}

HandWriter::~HandWriter() {
    std::fclose(file_);
}

void HandWriter::add(const HandSample& s) {
    const Vector& x = s.pose.position;
    const Eigen::Quaterniond& q = s.pose.rotation;
    // The fewest digits that read back as the same bits.
    fmt::print(file_, "{}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}\n", s.time, x.x(), x.y(), x.z(), q.w(),
               q.x(), q.y(), q.z(), s.buttons, s.force.x(), s.force.y(), s.force.z());
}

void HandWriter::flush() {
    if (std::fflush(file_) != 0 || std::ferror(file_))
        throw RunError(fmt::format("{}: cannot be written to; is the disk full?", path_.string()));
}

}  // namespace innerspring
