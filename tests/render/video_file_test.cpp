#include <render/video_file.hpp>

#include <hooke/error.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace hooke::render {
namespace {

namespace fs = std::filesystem;

class VideoFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!VideoFile::available() || std::system("ffprobe -version > /dev/null 2>&1") != 0)
      GTEST_SKIP() << "ffmpeg or ffprobe is not on PATH";
    folder = fs::temp_directory_path() / ("hooke video ' file " + std::to_string(getpid()));
    fs::create_directories(folder);
  }
  void TearDown() override {
    if (!folder.empty()) fs::remove_all(folder);
  }
  // "width,height,pixel format,frames" as a player that decodes everything sees it.
  std::string probe(const fs::path& path) const {
    fs::copy_file(path, folder / "probed.mp4", fs::copy_options::overwrite_existing);
    const std::string command = "cd \"" + folder.string() +
                                "\" && ffprobe -v error -count_frames -select_streams v -show_entries "
                                "stream=width,height,pix_fmt,nb_read_frames -of csv=p=0 probed.mp4";
    std::string text;
    if (FILE* out = popen(command.c_str(), "r")) {
      for (int c; (c = std::fgetc(out)) != EOF;)
        if (c != '\n') text += static_cast<char>(c);
      pclose(out);
    }
    return text;
  }
  fs::path folder;
};

Image frame(int k) {
  Image image{64, 48, std::vector<std::uint8_t>(3 * 64 * 48, static_cast<std::uint8_t>(40 + 5 * k))};
  return image;
}

TEST_F(VideoFileTest, FinishGivesTheFilmItsNameAndAllItsFrames) {
  const fs::path path = folder / "film.mp4";
  VideoFile film(path, 64, 48, 30);
  for (int k = 0; k < 20; ++k) film.add(frame(k));
  EXPECT_FALSE(fs::exists(path));
  film.finish();
  EXPECT_FALSE(fs::exists(folder / "film.part.mp4"));
  EXPECT_EQ(probe(path), "64,48,yuv420p,20");
  EXPECT_THROW(film.add(frame(0)), OutputError);
}

TEST_F(VideoFileTest, AFilmThatIsCutOffStaysPlayableUnderItsPartName) {
  {
    VideoFile film(folder / "film.mp4", 64, 48, 30);
    for (int k = 0; k < 20; ++k) film.add(frame(k));
  }
  EXPECT_FALSE(fs::exists(folder / "film.mp4"));
  EXPECT_EQ(probe(folder / "film.part.mp4"), "64,48,yuv420p,20");
}

TEST_F(VideoFileTest, AnEncoderThatFailsIsAnOutputErrorInItsOwnWords) {
  try {
    VideoFile film(folder / "none" / "film.mp4", 64, 48, 30);
    for (int k = 0; k < 500; ++k) film.add(frame(0));  // would raise SIGPIPE
    film.finish();
    FAIL() << "nothing was thrown";
  } catch (const OutputError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("film.mp4"));
    EXPECT_THAT(error.what(), ::testing::HasSubstr("No such file"));
  }
}

TEST_F(VideoFileTest, AFilmWithoutFramesIsAnOutputError) {
  VideoFile film(folder / "film.mp4", 64, 48, 30);
  EXPECT_THROW(film.finish(), OutputError);
  EXPECT_FALSE(fs::exists(folder / "film.mp4"));
}

TEST(VideoFile, RefusesOddSizesAndWrongFrames) {
  EXPECT_THROW(VideoFile("/tmp/x.mp4", 63, 48, 30), std::invalid_argument);
  EXPECT_THROW(VideoFile("/tmp/x.mp4", 64, 48, 0), std::invalid_argument);
}

TEST(VideoFile, KnowsThatThereIsNoEncoderOnAnEmptyPath) {
  const char* before = std::getenv("PATH");
  const std::string saved = before ? before : "";
  setenv("PATH", "/nonexistent", 1);
  EXPECT_FALSE(VideoFile::available());
  EXPECT_THROW(VideoFile("/tmp/x.mp4", 64, 48, 30), OutputError);
  setenv("PATH", saved.c_str(), 1);
}

}  // namespace
}  // namespace hooke::render
