#include <fmt/core.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <csetjmp>

#include "innerspring/mesh/error.h"
#include "innerspring/record/picture.h"

namespace innerspring {
namespace {

struct Sink {
    std::string bytes;
    bool no_memory = false;
    std::array<char, 256> reason{};
};

void append(png_structp png, png_bytep data, png_size_t size) {
    auto& sink = *static_cast<Sink*>(png_get_io_ptr(png));
    try {
        sink.bytes.append(reinterpret_cast<const char*>(data), size);
    } catch (...) {  // must not pass through libpng's C frames
        sink.no_memory = true;
    }
    if (sink.no_memory) png_error(png, "out of memory");
}

[[noreturn]] void fail(png_structp png, png_const_charp message) {
    auto& reason = static_cast<Sink*>(png_get_error_ptr(png))->reason;
    for (std::size_t i = 0; i + 1 < reason.size() && message[i] != '\0'; ++i) reason[i] = message[i];
    png_longjmp(png, 1);
}

void ignore(png_structp, png_const_charp) {}

// libpng leaves by longjmp: nothing with a destructor lives in this frame, and nothing changes after setjmp.
bool encode(const Image& image, Sink& sink) {
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &sink, fail, ignore);
    if (png == nullptr) return false;
    png_infop info = png_create_info_struct(png);
    if (info == nullptr || setjmp(png_jmpbuf(png))) {
        png_destroy_write_struct(&png, &info);
        return false;
    }
    png_set_write_fn(png, &sink, append, nullptr);
    png_set_user_limits(png, 0x7FFFFFFF, 0x7FFFFFFF);
    const auto width = static_cast<png_uint_32>(image.width), height = static_cast<png_uint_32>(image.height);
    png_set_IHDR(png, info, width, height, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png, info);
    for (png_uint_32 row = 0; row < height; ++row)
        png_write_row(png, image.rgb.data() + std::size_t{3} * width * row);
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    return true;
}

}  // namespace

std::string to_png(const Image& image) {
    if (image.width < 1 || image.height < 1 ||
        image.rgb.size() !=
            std::size_t{3} * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height))
        throw RunError(fmt::format("cannot write a PNG of {} x {} pixels from {} bytes", image.width,
                                   image.height, image.rgb.size()));
    Sink sink;
    if (!encode(image, sink))
        throw RunError(
            fmt::format("cannot write a PNG: {}", sink.reason[0] != '\0' ? sink.reason.data() : "libpng"));
    return std::move(sink.bytes);
}

}  // namespace innerspring
