#include <render/caption.hpp>

#include <gtest/gtest.h>

#include <algorithm>

namespace hooke::render {
namespace {

Image grey(int width, int height) {
  return {width, height, std::vector<std::uint8_t>(3 * static_cast<std::size_t>(width * height), 128)};
}

int brightest(const Image& image) { return *std::max_element(image.rgb.begin(), image.rgb.end()); }

TEST(Caption, DrawsBrightLettersOnADarkStripAtTheBottomLeftOnly) {
  Image image = grey(640, 360);
  draw_caption(image, {"cape  4,941 points"});
  EXPECT_GT(brightest(image), 215);
  EXPECT_LT(*std::min_element(image.rgb.begin(), image.rgb.end()), 80);
  for (int y = 0; y < 360; ++y)
    for (int x = 0; x < 640; ++x)
      if (y < 270 || x > 400) {
        ASSERT_EQ(*image.at(x, y), 128) << x << ", " << y;
      }
}

TEST(Caption, DifferentCharactersLookDifferent) {
  std::vector<std::vector<std::uint8_t>> seen;
  for (char c = 33; c <= 126; ++c) {
    Image image = grey(160, 430);
    draw_caption(image, {std::string(1, c)});
    EXPECT_GT(brightest(image), 128) << c;
    for (std::size_t i = 0; i < seen.size(); ++i) EXPECT_NE(image.rgb, seen[i]) << c << " " << char(33 + i);
    seen.push_back(image.rgb);
  }
}

TEST(Caption, NoLinesNoStrip) {
  Image image = grey(64, 64);
  draw_caption(image, {});
  EXPECT_EQ(image.rgb, grey(64, 64).rgb);
}

TEST(Caption, CutsLinesThatDoNotFitAndSurvivesTinyPictures) {
  for (const int size : {1, 7, 24, 90}) {
    Image image = grey(size, size);
    draw_caption(image, {std::string(500, 'W'), "\xc3\xa9\x01", ""});
    EXPECT_EQ(image.rgb.size(), 3u * static_cast<unsigned>(size * size));
  }
}

}  // namespace
}  // namespace hooke::render
