#include <render/image_file.hpp>

#include <hooke/error.hpp>

#include <png.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <system_error>

namespace hooke::render {

namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const std::string& reason) {
  throw OutputError("write_png: cannot write " + path.string() + ": " + reason);
}

// libpng must not print, and its default error handler uses longjmp over C++ frames;
// throwing through libpng is sound because Debian, like most, builds it with unwind tables,
// but we need not rely on that: the callbacks only record, and longjmp stays inside `encode`.
struct PngFailure {
  std::string reason;
};

void on_error(png_structp png, png_const_charp message) {
  auto* failure = static_cast<PngFailure*>(png_get_error_ptr(png));
  if (failure->reason.empty()) failure->reason = message;
  png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}

void on_write(png_structp png, png_bytep bytes, size_t count) {
  auto* file = static_cast<std::FILE*>(png_get_io_ptr(png));
  if (std::fwrite(bytes, 1, count, file) != count) png_error(png, std::strerror(errno));
}

void on_flush(png_structp) {}

// Only trivially destructible locals here: on_error jumps back into this frame.
bool encode(png_structp png, png_infop info, const Image& image, std::FILE* file) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_write_fn(png, file, on_write, on_flush);
  png_set_IHDR(png, info, static_cast<png_uint_32>(image.width), static_cast<png_uint_32>(image.height), 8,
               PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_set_compression_level(png, 4);
  png_write_info(png, info);
  for (int y = 0; y < image.height; ++y) png_write_row(png, image.at(0, y));
  png_write_end(png, info);
  return true;
}

// Removes the part file unless it was renamed away.
struct PartFile {
  fs::path path;
  std::FILE* file = nullptr;
  ~PartFile() {
    if (file) std::fclose(file);
    std::error_code ignored;
    if (!path.empty()) fs::remove(path, ignored);
  }
};

}  // namespace

void write_png(const fs::path& path, const Image& image) {
  if (image.width <= 0 || image.height <= 0 ||
      image.rgb.size() != 3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height))
    throw std::invalid_argument("write_png: an image of " + std::to_string(image.width) + " x " +
                                std::to_string(image.height) + " pixels cannot have " +
                                std::to_string(image.rgb.size()) + " bytes");

  PartFile part;
  const fs::path part_path = path.parent_path() / (path.stem().string() + ".part.png");
  part.file = std::fopen(part_path.c_str(), "wb");
  if (!part.file) fail(path, std::strerror(errno));
  part.path = part_path;

  PngFailure failure;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &failure, on_error, on_warning);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  const bool complete = info && encode(png, info, image, part.file);
  png_destroy_write_struct(&png, &info);
  if (!complete) fail(path, failure.reason.empty() ? "libpng could not start" : failure.reason);

  std::FILE* file = part.file;
  part.file = nullptr;
  if (std::fclose(file) != 0) fail(path, std::strerror(errno));
  std::error_code error;
  fs::rename(part_path, path, error);
  if (error) fail(path, error.message());
  part.path.clear();
}

}  // namespace hooke::render
