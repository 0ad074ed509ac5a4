#include <render/image_file.hpp>

#include <hooke/error.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace hooke::render {
namespace {

namespace fs = std::filesystem;

class ImageFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder = fs::temp_directory_path() / ("hooke_image_file_" + std::to_string(getpid()));
    fs::create_directories(folder);
  }
  void TearDown() override { fs::remove_all(folder); }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
  }
  fs::path folder;
};

// No two neighbours alike, so a flipped or shifted row cannot pass; nor can it be compressed.
Image pattern(int width, int height) {
  Image image{width, height, {}};
  unsigned state = 12345;
  for (int i = 0; i < 3 * width * height; ++i)
    image.rgb.push_back(static_cast<std::uint8_t>((state = state * 1664525u + 1013904223u) >> 24));
  return image;
}

TEST_F(ImageFile, PngGivesBackEveryByte) {
  const Image image = pattern(37, 23);
  const fs::path path = folder / "a.png";
  write_png(path, image);
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  ASSERT_TRUE(png_image_begin_read_from_file(&png, path.c_str())) << png.message;
  EXPECT_EQ(png.width, 37u);
  EXPECT_EQ(png.height, 23u);
  png.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> bytes(PNG_IMAGE_SIZE(png));
  ASSERT_TRUE(png_image_finish_read(&png, nullptr, bytes.data(), 0, nullptr)) << png.message;
  EXPECT_EQ(bytes, image.rgb);
  EXPECT_EQ(files(), 1u);
}

TEST_F(ImageFile, AFolderThatIsNotThereIsAnOutputErrorNamingFileAndReason) {
  try {
    write_png(folder / "none" / "a.png", pattern(4, 4));
    FAIL() << "nothing was thrown";
  } catch (const OutputError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("a.png"));
    EXPECT_THAT(error.what(), ::testing::HasSubstr("No such file"));
  }
  EXPECT_EQ(files(), 0u);
}

TEST_F(ImageFile, WhenTheDiskIsFullTheOldPictureStaysAndNoPartIsLeft) {
  const fs::path path = folder / "a.png";
  std::ofstream(path) << "old";
  // A limit on file size fails writes as a full disk does (EFBIG instead of ENOSPC).
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{20000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(write_png(path, pattern(200, 200)), OutputError);  // about 120 kB
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(files(), 1u);
  EXPECT_EQ(fs::file_size(path), 3u);
}

TEST_F(ImageFile, AFailureInTheVeryLastBufferIsNoticed) {
  // stdio holds the last bytes back until fclose.
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{100, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(write_png(folder / "a.png", pattern(8, 8)), OutputError);  // about 260 bytes
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(files(), 0u);
}

TEST_F(ImageFile, RefusesAnImageWhoseBytesDoNotFitItsSize) {
  Image image = pattern(4, 4);
  image.rgb.pop_back();
  EXPECT_THROW(write_png(folder / "a.png", image), std::invalid_argument);
  EXPECT_THROW(write_png(folder / "a.png", Image{}), std::invalid_argument);
}

}  // namespace
}  // namespace hooke::render
