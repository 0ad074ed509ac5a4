// What the cape must do over its shown time and after: lie on its wearer, not in him; stretch
// little; come to rest. One run, judged from all sides.
#include <scene/figures.hpp>
#include <scene/library.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace hooke::scene {
namespace {

using Corners = std::array<Vec3, 3>;

Corners corners(const Points<double>& x, const Triangle& t) {
  Corners out;
  for (std::size_t c = 0; c < 3; ++c) out[c] = x.row(t[c]).matrix().transpose();
  return out;
}

// Whether the segment from p to q passes through the triangle (Möller and Trumbore 1997).
bool pierces(const Vec3& p, const Vec3& q, const Corners& t) {
  const Vec3 way = q - p, u = t[1] - t[0], w = t[2] - t[0], across = way.cross(w);
  const double det = u.dot(across);
  if (std::abs(det) < 1e-18) return false;
  const Vec3 from = p - t[0];
  const double a = from.dot(across) / det;
  if (a < 0 || a > 1) return false;
  const Vec3 side = from.cross(u);
  const double b = way.dot(side) / det, s = w.dot(side) / det;
  return b >= 0 && a + b <= 1 && s >= 0 && s <= 1;
}

bool intersect(const Corners& s, const Corners& t) {
  for (std::size_t c = 0; c < 3; ++c)
    if (pierces(s[c], s[(c + 1) % 3], t) || pierces(t[c], t[(c + 1) % 3], s)) return true;
  return false;
}

constexpr double kCell = 0.03;  // [m]

// How many triangles of a pass through triangles of b; by a grid of cells over a.
int piercing_triangles(const Points<double>& a, const std::vector<Triangle>& a_triangles, const Points<double>& b,
                       const std::vector<Triangle>& b_triangles) {
  const auto cells = [](const Corners& t, const auto& visit) {
    const Vec3 low = t[0].cwiseMin(t[1]).cwiseMin(t[2]) / kCell, high = t[0].cwiseMax(t[1]).cwiseMax(t[2]) / kCell;
    for (long i = std::lround(std::floor(low.x())); i <= std::lround(std::floor(high.x())); ++i)
      for (long j = std::lround(std::floor(low.y())); j <= std::lround(std::floor(high.y())); ++j)
        for (long k = std::lround(std::floor(low.z())); k <= std::lround(std::floor(high.z())); ++k)
          visit((i + 4096) * 67108864 + (j + 4096) * 8192 + (k + 4096));
  };
  std::unordered_map<long, std::vector<int>> grid;
  for (std::size_t i = 0; i < a_triangles.size(); ++i)
    cells(corners(a, a_triangles[i]), [&](long cell) { grid[cell].push_back(int(i)); });
  std::vector<bool> pierced(a_triangles.size(), false);
  for (const Triangle& triangle : b_triangles) {
    const Corners t = corners(b, triangle);
    cells(t, [&](long cell) {
      const auto found = grid.find(cell);
      if (found == grid.end()) return;
      for (const int i : found->second)
        if (!pierced[std::size_t(i)] && intersect(corners(a, a_triangles[std::size_t(i)]), t))
          pierced[std::size_t(i)] = true;
    });
  }
  return int(std::count(pierced.begin(), pierced.end(), true));
}

TEST(PiercingTriangles, AreFoundWhereThereAreSome) {
  Points<double> a(3, 3), b(3, 3);
  a << 0, 0, 0, 1, 0, 0, 0, 1, 0;
  b << 0.2, 0.2, -0.5, 0.2, 0.2, 0.5, 0.3, 0.9, 0.5;
  EXPECT_EQ(piercing_triangles(a, {{0, 1, 2}}, b, {{0, 1, 2}}), 1);
  b.col(0) += 1;
  EXPECT_EQ(piercing_triangles(a, {{0, 1, 2}}, b, {{0, 1, 2}}), 0);
}

TEST(Cape, LiesOnItsWearerStretchesLittleAndComesToRest) {
  SceneDescription description = find_scene("cape");
  ASSERT_EQ(description.duration, 10);
  ASSERT_EQ(description.frame_rate, 30);
  ASSERT_LE(description.damping, 0.6);
  Scene scene = build(description);
  ASSERT_EQ(scene.humans.size(), 1u);
  const human::Human& human = scene.humans[0].human;
  const SceneBody& cape = scene.bodies[0];
  CapeFigures figures(scene, 0);
  const TriangleMesh skin = human.skin();
  Points<double> skin_now;

  // The cloth keeps farther off the capsules than the skin ever stands out of them.
  EXPECT_GE(cape.thickness, human.skin_clearance(0, 10, 30) + 0.003);

  ASSERT_TRUE(scene.world.update(description.preroll).good());
  int frames_pierced = 0, shown = 0;
  const auto look = [&] {
    figures.measure_frame(scene);
    human.skin(scene.shown_time(), skin_now);
    const Points<double> x = cape.body->positions();
    ASSERT_TRUE(x.allFinite());
    const int pierced = piercing_triangles(x, cape.triangles, skin_now, skin.triangles);
    EXPECT_EQ(pierced, 0) << "cape triangles through the skin at " << scene.shown_time() << " s";
    frames_pierced += pierced > 0;
    ++shown;
  };
  look();
  for (int frame = 1; frame < 300; ++frame) {
    for (int part = 0; part < 4; ++part) {
      ASSERT_TRUE(scene.world.update(1.0 / 120).good());
      if (part < 3) figures.measure(scene);
    }
    look();
  }
  EXPECT_EQ(shown, 300);
  EXPECT_EQ(frames_pierced, 0);
  std::printf("%s", figures.text().c_str());
  EXPECT_LE(figures.depth(), 0.002);
  EXPECT_LE(figures.bare_depth(), 0.002);
  EXPECT_LE(figures.stretch_percentile(0.999), 0.05);
  EXPECT_LE(figures.worst_stretch(), 0.10);
  EXPECT_LE(figures.pin_error(), 1e-6);  // rounding of float at a metre

  // On without pictures, until ten seconds after the last step.
  while (scene.shown_time() < human.freeze_time() + 10 - 1e-9) {
    ASSERT_TRUE(scene.world.update(1.0 / 120).good());
    figures.measure(scene);
  }
  const auto& settling = figures.settling();
  ASSERT_EQ(settling.size(), 20u);
  // Throughout the shown freeze the cape only slows down.
  for (std::size_t i = 1; i < 6; ++i) EXPECT_LT(settling[i].second, settling[i - 1].second) << "half second " << i;
  EXPECT_LT(settling.back().second, 0.01);
}

}  // namespace
}  // namespace hooke::scene
