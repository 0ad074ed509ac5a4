// Pictures of particle scenes by the hooke command: what is drawn, the same bytes every time.
#include <io/temporary_folder.hpp>

#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

namespace hooke {
namespace {

constexpr int kWidth = 240, kHeight = 220;
constexpr int kCaption = 66;  // rows at the bottom that its strip may fill

using Rows = std::vector<png_byte>;  // RGB above the caption

class ParticlePicture : public ::testing::Test {
 protected:
  /// The picture of one moment of a system that gives birth to `rate` particles a second, and that of no other.
  Rows picture(const std::string& kind, int rate) {
    const auto scene = folder_.write("scene.json", R"({"hooke": 1, "duration": 1, "tick_rate": 60, "preroll": 0.5,
      "camera": {"eye": [0, 0.6, 3], "target": [0, 0.5, 0], "fov": 30},
      "colliders": [{"type": "half-space"}, {"type": "box", "center": [0.3, 0.1, 0], "size": [0.2, 0.2, 0.2], "look": "steel"}],
      "bodies": [{"type": "particles", "kinds": [{"name": "a", )" +
                                                       kind + R"(}],
        "emitters": [{"shape": "disc", "radius": 0.02, "position": [0, 0.3, 0], "spread": 5, "start": -0.5, "speed": [3, 3.2],
                      "lifetime": 2, "mass": 1e-3, "size": 0.012, "rate": )" +
                                                       std::to_string(rate) + "}]}]}");
    const std::string out = (folder_ / "out.png").string();
    const std::string line = std::string(HOOKE_COMMAND) + " render " + scene.string() + " --frame-at 0 --size " +
                             std::to_string(kWidth) + "x" + std::to_string(kHeight) + " --out " + out + " >" +
                             (folder_ / "out.txt").string() + " 2>&1";
    EXPECT_EQ(std::system(line.c_str()), 0) << test::contents(folder_ / "out.txt");
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    EXPECT_TRUE(png_image_begin_read_from_file(&image, out.c_str())) << image.message;
    image.format = PNG_FORMAT_RGB;
    Rows rows(PNG_IMAGE_SIZE(image));
    EXPECT_TRUE(png_image_finish_read(&image, nullptr, rows.data(), 0, nullptr)) << image.message;
    EXPECT_EQ(rows.size(), std::size_t(3 * kWidth * kHeight));
    rows.resize(std::size_t(3 * kWidth * (kHeight - kCaption)));
    return rows;
  }

  static int differing(const Rows& a, const Rows& b) {
    int count = 0;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) count += std::abs(a[i] - b[i]) > 12;
    return count;
  }

  test::TemporaryFolder folder_;
};

class ParticleLooks : public ParticlePicture, public ::testing::WithParamInterface<const char*> {};

TEST_P(ParticleLooks, AreSeenAndTheSameEveryTime) {
  const Rows empty = picture(GetParam(), 0), some = picture(GetParam(), 1500);
  EXPECT_GT(differing(empty, some), 300);
  EXPECT_TRUE(some == picture(GetParam(), 1500)) << differing(some, picture(GetParam(), 1500));
}

INSTANTIATE_TEST_SUITE_P(Kinds, ParticleLooks,
                         ::testing::Values(R"("look": "spark", "color": {"temperature": 1900})",
                                           R"("look": "smoke", "opacity": 0.8)", R"("look": "drop")",
                                           R"("look": "water")"));

TEST_F(ParticlePicture, StreamsOfWaterAreNotDrops) {
  EXPECT_GT(differing(picture(R"("look": "drop")", 1500), picture(R"("look": "water")", 1500)), 300);
}

}  // namespace
}  // namespace hooke
