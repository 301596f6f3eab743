#pragma once
#include <cstdio>
#include <filesystem>
#include <string_view>
#include <vector>

#include "innerspring/sim/tool.h"

namespace innerspring {

/// One line of a recorded hand: what a device said and what it was told.
struct HandSample {
    double time = 0;                ///< [s]
    Pose pose;                      ///< [m], device frame
    unsigned buttons = 0;           ///< a bit each
    Vector force = Vector::Zero();  ///< [N] on the hand
};

/// Lines of numbers parted by commas or white space: time_s, x_m, y_m, z_m, then optionally w, i, j, k, then
/// buttons, then fx_n, fy_n, fz_n (so 4, 5, 8, 9 or 12 numbers); '#' begins a comment and a first line of
/// words is a header. Throws InputError "NAME:LINE: ...". A last line without its end is left out: a
/// recording that was cut off is good up to there.
std::vector<HandSample> parse_hand(std::string_view text, std::string_view name);
std::vector<HandSample> read_hand(const std::filesystem::path& file);

/// Writes such a file as it comes, in blocks; what was flushed can be read whatever happens next. Throws
/// RunError if the disk does not take it.
class HandWriter {
  public:
    explicit HandWriter(const std::filesystem::path& file);
    ~HandWriter();
    HandWriter(const HandWriter&) = delete;
    HandWriter& operator=(const HandWriter&) = delete;
    void add(const HandSample& sample);
    void flush();

  private:
    std::filesystem::path path_;
    std::FILE* file_;
};

}  // namespace innerspring
