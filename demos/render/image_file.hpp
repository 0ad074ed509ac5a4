// Still pictures on disk.
#pragma once

#include <render/image.hpp>

#include <filesystem>

namespace hooke::render {

/// Writes `image` as a PNG file. The picture is written to NAME.part.png beside `path` and
/// renamed when it is complete, so `path` never holds half a picture. Throws
/// hooke::OutputError (file and reason) and removes the part file if anything fails, and
/// std::invalid_argument if the image's size and bytes do not fit together.
void write_png(const std::filesystem::path& path, const Image& image);

}  // namespace hooke::render
