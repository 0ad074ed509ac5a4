#include <render/particles.hpp>
#include <render/stage.hpp>
#include <render/surface.hpp>

#include "figures.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <stdexcept>

namespace hooke::render {
namespace {

constexpr int kWidth = 320, kHeight = 180;
const Camera kFront{{0, 1, 4}, {0, 1, 0}, {0, 1, 0}, 30};

// Particles that own their arrays.
struct Cloud {
  Points<float> positions{0, 3}, velocities{0, 3}, colors{0, 3};
  Values<float> radii, opacities, turns, ages;

  void add(const Vec3& x, const Vec3& v, const Vec3& color, double radius, double opacity = 1, double turn = 0) {
    const Index n = positions.rows();
    for (Points<float>* points : {&positions, &velocities, &colors}) points->conservativeResize(n + 1, 3);
    for (Values<float>* values : {&radii, &opacities, &turns, &ages}) values->conservativeResize(n + 1);
    positions.row(n) = x.cast<float>().transpose().array();
    velocities.row(n) = v.cast<float>().transpose().array();
    colors.row(n) = color.cast<float>().transpose().array();
    radii(n) = static_cast<float>(radius);
    opacities(n) = static_cast<float>(opacity);
    turns(n) = static_cast<float>(turn);
    ages(n) = 1;
  }
  Particles as(Particles::Kind kind) const {
    return {.kind = kind,
            .positions = &positions,
            .velocities = &velocities,
            .colors = &colors,
            .radii = &radii,
            .opacities = &opacities,
            .turns = &turns,
            .ages = &ages,
            .shutter = 0.02};
  }
  Cloud reversed() const {
    Cloud other;
    for (Index i = positions.rows(); i-- > 0;)
      other.add(positions.row(i).matrix().transpose().cast<double>(),
                velocities.row(i).matrix().transpose().cast<double>(),
                colors.row(i).matrix().transpose().cast<double>(), radii(i), opacities(i), turns(i));
    return other;
  }
};

Cloud random_cloud(Index n, unsigned seed, double color) {
  std::mt19937 numbers(seed);
  std::uniform_real_distribution<double> share(0, 1);
  Cloud cloud;
  for (Index i = 0; i < n; ++i) {
    const Vec3 x(share(numbers) - 0.5, 0.5 + share(numbers), share(numbers) - 0.5);
    const Vec3 v(share(numbers) - 0.5, share(numbers), share(numbers));
    cloud.add(x, 3 * v, color * Vec3(1, 0.6 + 0.4 * share(numbers), 0.5), 0.02 + 0.08 * share(numbers),
              0.2 + 0.6 * share(numbers), 6 * share(numbers));
  }
  return cloud;
}

// A studio without light, so that the picture is the particles' own light.
Look dark() {
  Look look;
  look.key_intensity = look.rim_intensity = look.fill_intensity = 0;
  look.floor_color = {0, 0, 0};
  look.bloom = 0;
  return look;
}

// What the tone curve and the picture's encoding made of grey linear light.
double shown(double light) {
  const double t = light, film = (t * (t + 0.0245786) - 0.000090537) / (t * (0.983729 * t + 0.4329510) + 0.238081);
  const double c = 0.006 + 0.986 * std::clamp(film, 0.0, 1.0);
  return 255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055);
}

// All the light of a picture of grey light on black [pixels].
double whole_light(const Image& image) {
  std::vector<double> light(256);
  for (int value = 0; value < 256; ++value) {
    double low = 0, high = 20;
    for (int k = 0; k < 60; ++k) (shown(0.5 * (low + high)) < value ? low : high) = 0.5 * (low + high);
    light[static_cast<std::size_t>(value)] = low;
  }
  double sum = 0;
  const double nothing = shown(0) + 2;  // and the dither
  for (std::size_t i = 1; i < image.rgb.size(); i += 3)
    if (image.rgb[i] > nothing) sum += light[image.rgb[i]];
  return sum;
}

double mean_at(const Image& image, int x, int y, int channel, int half = 3) {
  double sum = 0;
  for (int j = y - half; j <= y + half; ++j)
    for (int i = x - half; i <= x + half; ++i) sum += image.at(i, j)[channel];
  return sum / ((2 * half + 1) * (2 * half + 1));
}

TriangleMesh screen(double half = 0.5, double z = 0) {
  TriangleMesh mesh;
  figures::append(mesh, {{-half, 1 - half, z}, {half, 1 - half, z}, {half, 1 + half, z}, {-half, 1 + half, z}},
                  {{0, 1, 2}, {0, 2, 3}});
  return mesh;
}

TEST(BlackBody, GoesFromRedOverOrangeToWhiteToBlue) {
  double green = 0, blue = 0, luminance = 0;
  for (double kelvin = 1000; kelvin <= 20000; kelvin *= 1.1) {
    const Vec3 c = black_body(kelvin);
    ASSERT_GT(c[1] / c[0], green) << kelvin;
    ASSERT_GE(c[2] / c[0], blue) << kelvin;
    const double y = c.dot(Vec3(0.2126, 0.7152, 0.0722));
    ASSERT_GT(y, luminance) << kelvin;
    green = c[1] / c[0], blue = c[2] / c[0], luminance = y;
  }
  EXPECT_LT(black_body(1000)[1], 0.06 * black_body(1000)[0]);
  EXPECT_EQ(black_body(1000)[2], 0);
  const Vec3 day = black_body(6500) / black_body(6500).maxCoeff();
  EXPECT_GT(day.minCoeff(), 0.92);
  EXPECT_NEAR(black_body(2000).dot(Vec3(0.2126, 0.7152, 0.0722)), 1, 0.01);
}

// Tabulated chromaticities of the Planckian locus (CIE 1931, 2 degrees).
TEST(BlackBody, AgreesWithThePlanckianLocus) {
  Mat3 to_xyz;
  to_xyz << 0.4124564, 0.3575761, 0.1804375, 0.2126729, 0.7151522, 0.0721750, 0.0193339, 0.1191920, 0.9503041;
  const double table[][3] = {
      {2000, 0.5267, 0.4133}, {3000, 0.4369, 0.4041}, {5000, 0.3451, 0.3516}, {10000, 0.2807, 0.2884}};
  for (const auto& [kelvin, x, y] : table) {
    const Vec3 xyz = to_xyz * black_body(kelvin);
    EXPECT_NEAR(xyz[0] / xyz.sum(), x, 0.004) << kelvin;
    EXPECT_NEAR(xyz[1] / xyz.sum(), y, 0.004) << kelvin;
  }
}

TEST(BlackBody, RefusesTemperaturesItDoesNotCover) {
  for (const double kelvin : {-5.0, 100.0, 1e6, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW(black_body(kelvin), std::invalid_argument);
}

TEST(Lamps, GiveTheLightOfAllSparks) {
  Cloud cloud = random_cloud(800, 3, 2000);
  for (Index i = 0; i < 800; ++i) cloud.radii(i) *= 0.01f;
  const Particles sparks = cloud.as(Particles::Kind::Sparks);
  const std::vector<Lamp> lamps = lamps_of(std::span(&sparks, 1), 16);
  ASSERT_EQ(lamps.size(), 16u);
  for (const Vec3& place : {Vec3(0, 0, 0), Vec3(0.5, 0.1, -0.5), Vec3(2, 1, 0), Vec3(0, 0.7, 1.2)}) {
    Vec3 whole(0, 0, 0), lit(0, 0, 0);
    for (Index i = 0; i < 800; ++i) {
      const Vec3 x = (cloud.positions.row(i) - 0.01f * cloud.velocities.row(i)).matrix().transpose().cast<double>();
      whole += std::pow(double(cloud.radii(i)), 2) * cloud.colors.row(i).matrix().transpose().cast<double>() /
               (x - place).squaredNorm();
    }
    for (const Lamp& lamp : lamps) lit += lamp.power * lamp.falloff(place);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(lit[k] / whole[k], 1, 0.02) << place.transpose();
  }
  EXPECT_TRUE(lamps_of({}, 16).empty());
}

TEST(Sparks, GiveAsMuchLightHoweverThinLongOrFineTheyAreDrawn) {
  // The same area times radiance each time; at 4 m a pixel is 12 mm in the small picture.
  Stage small(kWidth, kHeight, 1, dark()), large(2 * kWidth, 2 * kHeight, 1, dark());
  const auto light_of = [&](double radius, double speed, int scale) {
    Cloud cloud;
    const double radiance = 0.9 * std::pow(0.02 / radius, 2) * (speed > 0 ? 6 : 1);
    cloud.add({0.1, 1.02, 0}, {speed, 0.37 * speed, 0}, Vec3(radiance, radiance, radiance), radius);
    const Particles sparks = cloud.as(Particles::Kind::Sparks);
    return whole_light((scale == 1 ? small : large).draw({}, std::span(&sparks, 1), kFront)) /
           (scale * scale * (speed > 0 ? 6 : 1));
  };
  const double pixel = 2 * 4 * std::tan(15 * std::numbers::pi / 180) / kHeight;
  const double expected = 0.9 * std::numbers::pi * std::pow(0.02 / pixel, 2);
  for (const double radius : {0.003, 0.03, 0.06}) {
    EXPECT_NEAR(light_of(radius, 10, 1) / expected, 1, 0.04) << radius << " m";
    EXPECT_NEAR(light_of(radius, 25, 1) / expected, 1, 0.04) << radius << " m, longer";
    EXPECT_NEAR(light_of(radius, 10, 2) / expected, 1, 0.04) << radius << " m, finer";
  }
  EXPECT_NEAR(light_of(0.03, 0, 1) / expected, 1, 0.04) << "at rest";
}

TEST(Sparks, BehindTheCameraAreNotSeenAndThoseThatPassItDoNoHarm) {
  Look look = dark();
  look.bloom = 0.2;
  Stage stage(kWidth, kHeight, 1, look);
  const Image nothing = stage.draw({}, kFront);
  Cloud cloud;
  cloud.add({0.2, 1, 4.5}, {0, 0, 10}, {1000, 1000, 1000}, 0.002);
  const Particles behind = cloud.as(Particles::Kind::Sparks);
  EXPECT_EQ(stage.draw({}, std::span(&behind, 1), kFront).rgb, nothing.rgb);
  cloud = {};
  cloud.add({0.1, 1.1, 4.2}, {0.1, 0.1, 100}, {1000, 1000, 1000}, 0.002);  // flew past the eye
  const Particles past = cloud.as(Particles::Kind::Sparks);
  const Image streak = stage.draw({}, std::span(&past, 1), kFront);
  int lit = 0;
  for (std::size_t i = 1; i < streak.rgb.size(); i += 3) lit += streak.rgb[i] > nothing.rgb[i] + 10;
  EXPECT_GT(lit, 0);
  EXPECT_LT(lit, kWidth * kHeight / 4);
}

TEST(Sparks, AYoungSparkHasAShortStreakThatIsAsBright) {
  Cloud cloud;
  cloud.add({0.4, 1, 0}, {40, 0, 0}, {2000, 2000, 2000}, 0.002);
  const auto row = [&](double age) {
    cloud.ages(0) = static_cast<float>(age);
    const Particles sparks = cloud.as(Particles::Kind::Sparks);
    const Image image = Stage(kWidth, kHeight, 1, dark()).draw({}, std::span(&sparks, 1), kFront);
    int lit = 0;
    for (int x = 0; x < kWidth; ++x) lit += image.at(x, kHeight / 2)[1] > 60 || image.at(x, kHeight / 2 - 1)[1] > 60;
    return lit;
  };
  const int whole = row(1), young = row(0.005);
  EXPECT_GT(whole, 40);
  EXPECT_NEAR(double(young) / whole, 0.25, 0.06);
}

TEST(Sparks, AreHiddenBehindAModelAndSeenInFrontOfIt) {
  const TriangleMesh square = screen();
  const std::vector<Model> models{{.mesh = &square}};
  Look look = dark();
  look.fill_intensity = 0.2;
  Stage stage(kWidth, kHeight, 1, look);
  const Image without = stage.draw(models, kFront);
  Cloud cloud;
  for (const double z : {-0.2, 0.2}) {
    cloud = {};
    cloud.add({0.1, 1, z}, {10, 2, 0}, {3000, 2000, 1000}, 0.002);
    const Particles sparks = cloud.as(Particles::Kind::Sparks);
    const Image with = stage.draw(models, std::span(&sparks, 1), kFront);
    int changed = 0;
    for (int y = 70; y < 110; ++y)
      for (int x = 130; x < 190; ++x) changed += std::abs(with.at(x, y)[0] - without.at(x, y)[0]) > 1;
    if (z < 0)
      EXPECT_EQ(changed, 0);
    else
      EXPECT_GT(changed, 30);
  }
}

TEST(Sparks, LightTheFloorAndModelsFromTheirSide) {
  TriangleMesh ball;
  figures::append_capsule(ball, {0.5, 0.3, 0}, {0.5, 0.3, 0}, 0.3, 0.3, 64);
  const std::vector<Model> models{{.mesh = &ball}};
  Look look = dark();
  look.fill_intensity = 0.3;
  look.floor_color = {0.4, 0.4, 0.4};
  const Camera camera{{0, 1.5, 5}, {0, 0.4, 0}, {0, 1, 0}, 30};
  Stage stage(kWidth, kHeight, 1, look);
  Cloud cloud;
  cloud.add({-0.6, 0.4, 0}, {1, 0, 0}, {20000, 8000, 2000}, 0.002);
  const Particles sparks = cloud.as(Particles::Kind::Sparks);
  const Image without = stage.draw(models, camera), with = stage.draw(models, std::span(&sparks, 1), camera);
  const auto gain = [&](int x, int y, int channel) {
    return mean_at(with, x, y, channel) - mean_at(without, x, y, channel);
  };
  EXPECT_GT(gain(120, 125, 0), 2 * gain(60, 160, 0)) << "the floor below and away";
  EXPECT_GT(gain(120, 125, 0), 2 * gain(120, 125, 2)) << "warm";
  EXPECT_GT(gain(180, 95, 0), gain(206, 95, 0) + 5) << "the ball's near side";
}

TEST(Sparks, BloomSpreadsLightAndKeepsMostOfIt) {
  Cloud cloud;
  cloud.add({0.1, 1, 0}, {10, 0, 0}, {1500, 1500, 1500}, 0.002);
  const Particles sparks = cloud.as(Particles::Kind::Sparks);
  Look look = dark();
  const Image sharp = Stage(kWidth, kHeight, 1, look).draw({}, std::span(&sparks, 1), kFront);
  look.bloom = 0.3;
  const Image soft = Stage(kWidth, kHeight, 1, look).draw({}, std::span(&sparks, 1), kFront);
  EXPECT_LT(mean_at(sharp, 160, 84, 1, 1), 30);
  EXPECT_GT(mean_at(soft, 160, 84, 1, 1), mean_at(sharp, 160, 84, 1, 1) + 8);
  EXPECT_LT(mean_at(soft, 160, 90, 1, 0), 256);
  EXPECT_LT(whole_light(soft), 1.02 * whole_light(sharp));
  EXPECT_GT(whole_light(soft), 0.70 * whole_light(sharp));
}

TEST(Smoke, TheOrderGivenDoesNotShow) {
  const Cloud smoke = random_cloud(60, 5, 0.8), drops = random_cloud(40, 6, 1.0);
  const Cloud smoke_back = smoke.reversed(), drops_back = drops.reversed();
  const TriangleMesh square = screen(0.4);
  const std::vector<Model> models{{.mesh = &square}};
  const std::vector<Particles> one{smoke.as(Particles::Kind::Smoke), drops.as(Particles::Kind::Drops)};
  const std::vector<Particles> other{drops_back.as(Particles::Kind::Drops), smoke_back.as(Particles::Kind::Smoke)};
  Stage stage(kWidth, kHeight);
  EXPECT_EQ(stage.draw(models, one, kFront).rgb, stage.draw(models, other, kFront).rgb);
}

TEST(Smoke, NearPuffsHideFarOnesAndNothingHidesWhatIsBefore) {
  Cloud cloud;
  cloud.add({0, 1, 0.6}, {0, 0, 0}, {0.05, 0.05, 0.9}, 0.4);
  cloud.add({0, 1, -0.6}, {0, 0, 0}, {0.9, 0.05, 0.05}, 0.4);
  const Particles smoke = cloud.as(Particles::Kind::Smoke);
  Stage stage(kWidth, kHeight);
  const Image front = stage.draw({}, std::span(&smoke, 1), kFront);
  const Image back = stage.draw({}, std::span(&smoke, 1), Camera{{0, 1, -4}, {0, 1, 0}, {0, 1, 0}, 30});
  EXPECT_GT(mean_at(front, 160, 90, 2), mean_at(front, 160, 90, 0) + 20);
  EXPECT_GT(mean_at(back, 160, 90, 0), mean_at(back, 160, 90, 2) + 20);
  const TriangleMesh square = screen(0.5, 1.5);
  const std::vector<Model> models{{.mesh = &square}};
  const Image hidden = stage.draw(models, std::span(&smoke, 1), kFront), without = stage.draw(models, kFront);
  EXPECT_EQ(mean_at(hidden, 160, 90, 2), mean_at(without, 160, 90, 2));
}

TEST(Smoke, FadesWhereASurfaceCutsIt) {
  const TriangleMesh square = screen(0.6);
  const std::vector<Model> models{{.mesh = &square}};
  Stage stage(kWidth, kHeight);
  const double without = mean_at(stage.draw(models, kFront), 160, 90, 1);
  double last = 0;
  for (const double z : {-0.25, -0.1, 0.0, 0.1, 0.25}) {
    Cloud cloud;
    cloud.add({0, 1, z}, {0, 0, 0}, {0.02, 0.02, 0.02}, 0.3);
    const Particles smoke = cloud.as(Particles::Kind::Smoke);
    const double hidden = without - mean_at(stage.draw(models, std::span(&smoke, 1), kFront), 160, 90, 1);
    EXPECT_GT(hidden, last + 2) << z;
    last = hidden;
  }
}

TEST(Smoke, AGivenPictureSaysWhereAPuffHides) {
  Image half{4, 4, std::vector<std::uint8_t>(48, 0)};
  for (int y = 0; y < 2; ++y) std::fill_n(half.at(0, y), 12, std::uint8_t(255));  // the upper half
  Cloud cloud;
  cloud.add({0, 1, 0}, {0, 0, 0}, {0.02, 0.02, 0.02}, 0.6);
  Particles smoke = cloud.as(Particles::Kind::Smoke);
  smoke.texture = &half;
  Stage stage(kWidth, kHeight);
  const Image with = stage.draw({}, std::span(&smoke, 1), kFront), without = stage.draw({}, kFront);
  EXPECT_LT(mean_at(with, 160, 70, 1), 0.5 * mean_at(without, 160, 70, 1));
  EXPECT_NEAR(mean_at(with, 160, 112, 1), mean_at(without, 160, 112, 1), 2);
}

TEST(Drops, ShowWhatIsBehindUpsideDown) {
  // A dark plate in the upper half of the background shows in the lower half of the drop.
  TriangleMesh plate;
  figures::append(plate, {{-1.5, 1, -1}, {1.5, 1, -1}, {1.5, 2.5, -1}, {-1.5, 2.5, -1}}, {{0, 1, 2}, {0, 2, 3}});
  Material black;
  black.color = {0.01, 0.01, 0.01};
  const std::vector<Model> models{{.mesh = &plate, .material = black}};
  Cloud cloud;
  cloud.add({0, 1, 0}, {0, 0, 0}, {1, 1, 1}, 0.3);
  const Particles drops = cloud.as(Particles::Kind::Drops);
  const Image with = Stage(kWidth, kHeight).draw(models, std::span(&drops, 1), kFront);
  EXPECT_GT(mean_at(with, 160, 84, 1), mean_at(with, 160, 96, 1) + 20);
  EXPECT_LT(mean_at(with, 60, 75, 1), mean_at(with, 60, 105, 1) - 20) << "beside the drop";
}

TEST(WithParticles, TheSameBytesWhateverWasDrawnBetweenAndThoseWithoutAreUnchanged) {
  const TriangleMesh man = figures::mannequin(16);
  const std::vector<Model> models{{.mesh = &man}};
  const Cloud sparks = random_cloud(200, 1, 100), smoke = random_cloud(20, 2, 0.7), drops = random_cloud(30, 4, 0.9);
  const std::vector<Particles> all{sparks.as(Particles::Kind::Sparks), smoke.as(Particles::Kind::Smoke),
                                   drops.as(Particles::Kind::Drops)};
  Stage stage(kWidth, kHeight);
  const Image without = stage.draw(models, kFront), with = stage.draw(models, all, kFront);
  EXPECT_NE(without.rgb, with.rgb);
  EXPECT_EQ(stage.draw(models, kFront).rgb, without.rgb);
  const Cloud none;
  const std::vector<Particles> empty{none.as(Particles::Kind::Sparks), none.as(Particles::Kind::Smoke)};
  EXPECT_EQ(stage.draw(models, empty, kFront).rgb, without.rgb);
  EXPECT_EQ(stage.draw(models, all, kFront).rgb, with.rgb);
  EXPECT_EQ(Stage(kWidth, kHeight).draw(models, all, kFront).rgb, with.rgb);
}

TEST(WithParticles, BadInputIsNamed) {
  Stage stage(32, 18);
  const Cloud good = random_cloud(9, 1, 0.5);
  const auto message = [&](const Particles& bad) -> std::string {
    const std::vector<Particles> both{good.as(Particles::Kind::Smoke), bad};
    try {
      stage.draw({}, both, kFront);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "nothing was thrown";
  };
  using ::testing::AllOf;
  using ::testing::HasSubstr;
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  for (const auto kind : {Particles::Kind::Sparks, Particles::Kind::Smoke, Particles::Kind::Drops}) {
    Cloud bad = good;
    bad.positions(7, 1) = nan;
    EXPECT_THAT(message(bad.as(kind)), AllOf(HasSubstr("particles 1"), HasSubstr("positions[7]"), HasSubstr("nan")));
    bad = good;
    bad.velocities(3, 2) = std::numeric_limits<float>::infinity();
    EXPECT_THAT(message(bad.as(kind)), HasSubstr("velocities[3]"));
    bad = good;
    bad.colors(2, 0) = -1;
    EXPECT_THAT(message(bad.as(kind)), HasSubstr("colors[2]"));
    bad = good;
    bad.radii(5) = -0.1f;
    EXPECT_THAT(message(bad.as(kind)), HasSubstr("radii[5]"));
    bad = good;
    bad.opacities(8) = 1.5f;
    EXPECT_THAT(message(bad.as(kind)), HasSubstr("opacities[8]"));
    bad = good;
    bad.radii.conservativeResize(4);
    EXPECT_THAT(message(bad.as(kind)), AllOf(HasSubstr("radii"), HasSubstr("(9), got 4")));
    Particles missing = good.as(kind);
    missing.radii = nullptr;
    EXPECT_THAT(message(missing), HasSubstr("need positions"));
    missing = good.as(kind);
    missing.shutter = -1;
    EXPECT_THAT(message(missing), HasSubstr("shutter"));
  }
  Cloud hot = good;
  hot.colors(4, 1) = 900;  // sparks may be, smoke may not
  EXPECT_THAT(message(hot.as(Particles::Kind::Smoke)), HasSubstr("colors[4]"));
  EXPECT_EQ(message(hot.as(Particles::Kind::Sparks)), "nothing was thrown");
}

// A square of water at height 0.3 over the floor.
struct Pool {
  TriangleMesh mesh;
  Values<float> foam;
  explicit Pool(double waves) {
    const int n = 40;
    std::vector<Vec3> points;
    std::vector<Triangle> triangles;
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i) {
        const double x = 2.0 * i / n - 1, z = 2.0 * j / n - 1;
        points.emplace_back(x, 0.3 + waves * std::sin(12 * x + 5 * z), z);
      }
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const int a = j * (n + 1) + i, b = a + n + 1;
        triangles.push_back({a, b, a + 1});
        triangles.push_back({a + 1, b, b + 1});
      }
    figures::append(mesh, points, triangles);
    foam.setZero(mesh.vertices.rows());
  }
};

const Camera kAbovePool{{0, 2.2, 3}, {0, 0.2, 0}, {0, 1, 0}, 30};

TEST(Water, BendsWhatIsBehindMirrorsTheStudioAndThrowsNoShadow) {
  const Pool calm(0), wavy(0.02);
  TriangleMesh ball;
  figures::append_capsule(ball, {0, 0.1, 0}, {0, 0.1, 0}, 0.1, 0.1, 48);
  Material red;
  red.color = {0.6, 0.02, 0.02};
  const Model sunk{.mesh = &ball, .material = red};
  Stage stage(kWidth, kHeight);
  const Image bare = stage.draw(std::vector<Model>{sunk}, kAbovePool);
  const Image flat = stage.draw(std::vector<Model>{sunk, {.mesh = &calm.mesh, .material = water()}}, kAbovePool);
  const Image bent = stage.draw(std::vector<Model>{sunk, {.mesh = &wavy.mesh, .material = water()}}, kAbovePool);
  const auto is_red = [](const Image& image, int x, int y) { return image.at(x, y)[0] > 1.8 * image.at(x, y)[2]; };
  int red_bare = 0, red_flat = 0, moved = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      red_bare += is_red(bare, x, y);
      red_flat += is_red(flat, x, y);
      moved += is_red(bent, x, y) != is_red(flat, x, y);
    }
  EXPECT_GT(red_bare, 100);
  EXPECT_GT(red_flat, red_bare / 2) << "seen through the water";
  EXPECT_GT(moved, red_flat / 10) << "bent by the waves";
  EXPECT_GT(mean_at(flat, 160, 130, 0), 0.6 * mean_at(bare, 160, 130, 0)) << "no shadow under the water";
  EXPECT_GT(mean_at(flat, 110, 110, 2) / mean_at(flat, 110, 110, 0),
            mean_at(bare, 110, 110, 2) / mean_at(bare, 110, 110, 0))
      << "a little blue-green";
}

TEST(Water, IsWhiteWithFoamWhereThereIsSome) {
  Pool pool(0.005);
  for (Index i = 0; i < pool.foam.rows(); ++i) pool.foam(i) = pool.mesh.vertices(i, 0) > 0.1 ? 1.f : 0.f;
  Stage stage(kWidth, kHeight);
  const Image with =
      stage.draw(std::vector<Model>{{.mesh = &pool.mesh, .material = water(), .cover = &pool.foam}}, kAbovePool);
  const Image without = stage.draw(std::vector<Model>{{.mesh = &pool.mesh, .material = water()}}, kAbovePool);
  EXPECT_GT(mean_at(with, 220, 90, 0), mean_at(without, 220, 90, 0) + 15);
  EXPECT_NEAR(mean_at(with, 90, 90, 0), mean_at(without, 90, 90, 0), 1);
}

TEST(Stone, IsDarkerWhereItIsWet) {
  TriangleMesh ball;
  figures::append_capsule(ball, {0, 1, 0}, {0, 1, 0}, 0.7, 0.7, 64);
  Values<float> cover(ball.vertices.rows());
  for (Index i = 0; i < cover.rows(); ++i) cover(i) = ball.vertices(i, 0) > 0 ? 1.f : 0.f;
  Material stone = sandstone();
  stone.wetness = 1;
  Stage stage(kWidth, kHeight);
  const Image wet = stage.draw(std::vector<Model>{{.mesh = &ball, .material = stone, .cover = &cover}}, kFront);
  const Image dry = stage.draw(std::vector<Model>{{.mesh = &ball, .material = sandstone()}}, kFront);
  EXPECT_LT(mean_at(wet, 185, 100, 1), 0.85 * mean_at(dry, 185, 100, 1));
  EXPECT_NEAR(mean_at(wet, 130, 100, 1), mean_at(dry, 130, 100, 1), 1);
}

TEST(Metal, MirrorsTheLampsAlongItsScratches) {
  TriangleMesh ball;
  figures::append_capsule(ball, {0, 1, 0}, {0, 1, 0}, 0.7, 0.7, 64);
  const Image image = Stage(kWidth, kHeight).draw(std::vector<Model>{{.mesh = &ball, .material = steel()}}, kFront);
  int brightest = 0, darkest = 255;
  for (int y = 50; y < 130; ++y)
    for (int x = 120; x < 200; ++x) {
      brightest = std::max<int>(brightest, image.at(x, y)[1]);
      darkest = std::min<int>(darkest, image.at(x, y)[1]);
    }
  EXPECT_GT(brightest, 2 * darkest);
}

TEST(Cover, BadValuesAreNamed) {
  Pool pool(0);
  Stage stage(32, 18);
  const auto message = [&]() -> std::string {
    try {
      stage.draw(std::vector<Model>{{.mesh = &pool.mesh, .material = water(), .cover = &pool.foam}}, kAbovePool);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "nothing was thrown";
  };
  pool.foam(12) = 1.5f;
  EXPECT_THAT(message(), ::testing::AllOf(::testing::HasSubstr("model 0"), ::testing::HasSubstr("cover[12]")));
  pool.foam = Values<float>::Zero(3);
  EXPECT_THAT(message(), ::testing::HasSubstr("got 3"));
}

}  // namespace
}  // namespace hooke::render
