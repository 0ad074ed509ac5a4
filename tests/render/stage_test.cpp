#include <render/stage.hpp>

#include "figures.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace hooke::render {
namespace {

constexpr int kWidth = 320, kHeight = 180;

double brightness(const Image& image, int x, int y, int half = 2) {
  double sum = 0;
  for (int j = y - half; j <= y + half; ++j)
    for (int i = x - half; i <= x + half; ++i) sum += image.at(i, j)[0] + image.at(i, j)[1] + image.at(i, j)[2];
  return sum / (3.0 * (2 * half + 1) * (2 * half + 1));
}

// A square of side 2 r at height y, facing up.
TriangleMesh table(double r, double y) {
  TriangleMesh mesh;
  figures::append(mesh, {{-r, y, r}, {r, y, r}, {r, y, -r}, {-r, y, -r}}, {{0, 1, 2}, {0, 2, 3}});
  return mesh;
}

// A square in the plane z = 0 whose outside faces +z.
TriangleMesh screen() {
  TriangleMesh mesh;
  figures::append(mesh, {{-0.8, 0.1, 0}, {0.8, 0.1, 0}, {0.8, 1.7, 0}, {-0.8, 1.7, 0}}, {{0, 1, 2}, {0, 2, 3}});
  return mesh;
}

const Camera kFront{{0, 1.2, 5}, {0, 0.9, 0}, {0, 1, 0}, 30};
const Camera kBehind{{0, 1.2, -5}, {0, 0.9, 0}, {0, 1, 0}, 30};

class StageTest : public ::testing::Test {
 protected:
  TriangleMesh man = figures::mannequin(16);
  figures::Cape cape = figures::cape(20, 24);
  std::vector<Model> models{
      {.mesh = &man},
      {.mesh = &cape.mesh, .material = figures::cape_cloth(), .uv = &cape.uv, .thickness = 0.003, .subdivisions = 1}};
};

TEST_F(StageTest, TheSamePictureTwiceIsTheSameBytesWhateverWasDrawnBetween) {
  Stage stage(kWidth, kHeight);
  const Image first = stage.draw(models, kBehind);
  figures::Cape other = figures::cape(8, 9, 1.5);
  const TriangleMesh still = cape.mesh;
  cape.mesh.vertices += 0.1;
  const Image moved = stage.draw(models, kFront);
  stage.draw(std::vector<Model>{{.mesh = &other.mesh}}, kFront);
  cape.mesh = still;
  EXPECT_EQ(stage.draw(models, kBehind).rgb, first.rgb);
  EXPECT_EQ(Stage(kWidth, kHeight).draw(models, kBehind).rgb, first.rgb);
  EXPECT_NE(moved.rgb, first.rgb);
}

TEST_F(StageTest, NothingIsPureBlackOrWhite) {
  Stage stage(kWidth, kHeight);
  for (const Camera& camera : {kFront, kBehind}) {
    const Image image = stage.draw(models, camera);
    ASSERT_EQ(image.rgb.size(), 3u * kWidth * kHeight);
    for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
      ASSERT_GT(image.rgb[i] + image.rgb[i + 1] + image.rgb[i + 2], 6) << i / 3;
      ASSERT_LT(std::min({image.rgb[i], image.rgb[i + 1], image.rgb[i + 2]}), 254) << i / 3;
    }
  }
}

TEST_F(StageTest, TheFloorHasNoEndNoHorizonAndNoHole) {
  Stage stage(kWidth, kHeight);
  for (const Camera& camera :
       {kFront, Camera{{0.3, 0.6, 3}, {0, 1.2, 0}, {0, 1, 0}, 60}, Camera{{6, 9, 12}, {1, 0, -1}, {0, 1, 0}, 40},
        Camera{{-20, 3, 25}, {0, 1, 0}, {0, 1, 0}, 50}}) {
    const Image image = stage.draw({}, camera);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        ASSERT_GT(image.at(x, y)[1], 50) << "a hole at " << x << ", " << y;
        if (y > 0) {
          ASSERT_LE(std::abs(image.at(x, y)[1] - image.at(x, y - 1)[1]), 6) << "an edge at " << x << ", " << y;
        }
      }
  }
}

TEST_F(StageTest, BackFacesShowTheInsideColourWithAndWithoutThickness) {
  const TriangleMesh square = screen();
  Material material;
  material.color = {0.4, 0.02, 0.02};
  material.inside_color = {0.02, 0.02, 0.4};
  material.sheen = {0, 0, 0};
  Stage stage(kWidth, kHeight);
  for (const Material::Kind kind : {Material::Kind::Matte, Material::Kind::Cloth})
    for (const double thickness : {0.0, 0.004}) {
      material.kind = kind;
      const std::vector<Model> screens{{.mesh = &square, .material = material, .thickness = thickness}};
      const Image front = stage.draw(screens, kFront), behind = stage.draw(screens, kBehind);
      const std::uint8_t *red = front.at(kWidth / 2, kHeight / 2), *blue = behind.at(kWidth / 2, kHeight / 2);
      EXPECT_GT(red[0], 2 * red[2]);
      EXPECT_GT(blue[2], 2 * blue[0]);
    }
}

TEST_F(StageTest, AShadowDarkensTheFloorAndFallsAwayFromTheKeyLight) {
  const TriangleMesh square = table(0.3, 0.5);
  Look look;
  look.key_direction = {-1, 1, 0};  // from the left: the shadow's middle is half a metre to the right
  const Camera from_above{{0, 6, 0.01}, {0, 0, 0}, {0, 0, -1}, 30};
  Stage stage(kWidth, kHeight, 1, look);
  const Image empty = stage.draw({}, from_above),
              shaded = stage.draw(std::vector<Model>{{.mesh = &square}}, from_above);
  const double pixels_a_metre = kHeight / (2 * 6 * std::tan(15 * std::numbers::pi / 180));
  const int right = kWidth / 2 + static_cast<int>(0.6 * pixels_a_metre);
  const int left = kWidth / 2 - static_cast<int>(0.6 * pixels_a_metre);
  EXPECT_LT(brightness(shaded, right, kHeight / 2), 0.75 * brightness(empty, right, kHeight / 2));
  EXPECT_GT(brightness(shaded, left, kHeight / 2), 0.93 * brightness(empty, left, kHeight / 2));
}

TEST_F(StageTest, ASmoothLitBallHasNoSpeckles) {
  // Shadow acne shows as pixels unlike both neighbours.
  TriangleMesh ball;
  figures::append_capsule(ball, {0, 0.9, 0}, {0, 0.9, 0}, 0.7, 0.7, 96);
  Stage stage(kWidth, kHeight);
  const Image image = stage.draw(std::vector<Model>{{.mesh = &ball}}, kFront);
  for (int y = 60; y < 120; ++y)
    for (int x = 130; x < 190; ++x) {
      const int middle = image.at(x, y)[1], mean = (image.at(x - 1, y)[1] + image.at(x + 1, y)[1]) / 2;
      ASSERT_LE(std::abs(middle - mean), 5) << x << ", " << y;
    }
}

TEST_F(StageTest, CaptionLinesAreDrawn) {
  Stage stage(kWidth, kHeight);
  const Image without = stage.draw({}, kFront), with = stage.draw({}, kFront, {"hello"});
  EXPECT_NE(without.rgb, with.rgb);
  EXPECT_TRUE(std::equal(with.rgb.begin(), with.rgb.begin() + 3 * kWidth * 100, without.rgb.begin()));
}

TEST_F(StageTest, SupersamplingKeepsThePictureAndItsSize) {
  Image fine = Stage(160, 90, 2).draw(models, kBehind), plain = Stage(160, 90, 1).draw(models, kBehind);
  ASSERT_EQ(fine.rgb.size(), plain.rgb.size());
  double difference = 0;
  for (std::size_t i = 0; i < fine.rgb.size(); ++i) difference += std::abs(fine.rgb[i] - plain.rgb[i]);
  difference /= static_cast<double>(fine.rgb.size());
  EXPECT_LT(difference, 3);
  EXPECT_GT(difference, 0);
}

TEST_F(StageTest, ACoordinateThatIsNotFiniteIsNamed) {
  Stage stage(64, 36);
  cape.mesh.vertices(17, 1) = std::numeric_limits<double>::quiet_NaN();
  try {
    stage.draw(models, kFront);
    FAIL() << "nothing was thrown";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), ::testing::AllOf(::testing::HasSubstr("model 1"), ::testing::HasSubstr("vertex 17")));
  }
  cape.mesh.vertices(17, 1) = 1;
  EXPECT_NO_THROW(stage.draw(models, kFront));
}

TEST_F(StageTest, RefusesImpossibleSizesCamerasAndMaterials) {
  EXPECT_THROW(Stage(0, 10), std::invalid_argument);
  EXPECT_THROW(Stage(10, 10, 5), std::invalid_argument);
  Stage stage(16, 16);
  EXPECT_THROW(stage.draw({}, Camera{{0, 1, 0}, {0, 1, 0}}), std::invalid_argument);
  EXPECT_THROW(stage.draw({}, Camera{{0, 5, 0}, {0, 0, 0}}), std::invalid_argument);
  EXPECT_THROW(stage.draw(std::vector<Model>{{}}, kFront), std::invalid_argument);
  models[0].material.color = {2, 0, 0};
  EXPECT_THROW(stage.draw(models, kFront), std::invalid_argument);
}

TEST_F(StageTest, TwoStagesTakeTurns) {
  Stage a(64, 36), b(80, 45);
  const Image first = a.draw(models, kFront);
  b.draw(models, kBehind);
  EXPECT_EQ(a.draw(models, kFront).rgb, first.rgb);
}

}  // namespace
}  // namespace hooke::render
