// Stiff and long: the FPUT chain against the literature, and the energy of the hanging sheet.
#include "core/problems.hpp"

#include <scene/fput.hpp>
#include <scene/scene.hpp>
#include <scene/standard.hpp>

#include <iostream>

namespace hooke::test {
namespace {

using scene::fput_body;
using scene::stiff_energies;

// On to time `end` in ticks of 0.05 s.
void go(PointBody<double>& body, double start, double end) {
  const int ticks = int(std::lround((end - start) / 0.05));
  for (int i = 0; i < ticks; ++i) {
    const StepReport report = body.advance({start + 0.05 * i, start + 0.05 * (i + 1), Vec3::Zero(), {}});
    ASSERT_TRUE(report.good()) << report.text();
  }
}

TEST(Fput, StartsWithTheEnergyOfTheLiterature) {
  const auto body = fput_body<double>({});
  EXPECT_NEAR(body->energy(Vec3::Zero()).total(), 2.00120008, 5e-9);
  const Values<double> energies = stiff_energies(*body);
  EXPECT_NEAR(energies[0], 1, 1e-12);
  EXPECT_NEAR(energies[1] + energies[2], 0, 1e-15);
  EXPECT_GE(1.01 * 50 * 50 + 100, 1 / std::pow(body->stable_step(velocity_verlet()) / 2, 2));
  EXPECT_LE(50, 2 / body->stable_step(velocity_verlet()));
  EXPECT_THROW(fput_body<double>({}, {0, 50}), std::invalid_argument);
  EXPECT_THROW(fput_body<double>({}, {3, 0}), std::invalid_argument);
}

TEST(Fput, ForceAndStiffnessAreDerivativesOfTheEnergy) {
  Random random;
  SCOPED_TRACE(random.trace());
  // A body of one kilogram each: momentum after a short explicit step is the force.
  const double h = 1e-5;
  auto body = fput_body<double>(motion(explicit_euler(), h));
  for (Index i = 0; i < 6; ++i) body->set_position(i, random.vector(0.5)), body->set_velocity(i, Vec3::Zero());
  const Points<double> x = body->positions();
  Values<double> slope(6);
  for (Index i = 0; i < 6; ++i) {
    const auto energy_at = [&](double shift) {
      body->set_position(i, row(x, i) + Vec3(shift, 0, 0));
      const double energy = body->energy(Vec3::Zero()).elastic;
      body->set_position(i, row(x, i));
      return energy;
    };
    slope[i] = (energy_at(1e-5) - energy_at(-1e-5)) / 2e-5;
  }
  ASSERT_TRUE(body->advance({0, h, Vec3::Zero(), {}}).good());
  for (Index i = 0; i < 6; ++i) EXPECT_NEAR(body->velocities()(i, 0) / h, -slope[i], 1e-5 * (1 + std::abs(slope[i])));
}

struct Row {
  double t, i1, i2, i3, digits;
};
constexpr Row kTable[] = {{1, 1.004734940, 0.001128951, 0.000005396, 6e-10},
                          {10, 0.956065120, 0.025680530, 0.000198334, 6e-10},
                          {50, 0.5585379, 0.3672151, 0.0697391, 6e-8},
                          {100, 0.1055618, 0.4207497, 0.4759918, 6e-8},
                          {200, 0.0102362, 0.1597589, 0.8349879, 6e-8}};

TEST(Fput, TradesItsStiffEnergiesAsInTheLiterature) {
  struct Case {
    const Method& method;
    double dt, end;
  };
  for (const Case& c : {Case{blanes_moan_6(), 0.005, 200}, Case{blanes_moan_4(), 0.00125, 200},
                        Case{pefrl(), 0.0003125, 10}, Case{rkn4(), 0.00015625, 10}}) {
    SCOPED_TRACE(std::string(c.method.name) + " at dt " + std::to_string(c.dt));
    auto body = fput_body<double>(motion(c.method, c.dt));
    double t = 0;
    for (const Row& known : kTable) {
      if (known.t > c.end) break;
      SCOPED_TRACE(known.t);
      go(*body, t, known.t);
      t = known.t;
      const Values<double> found = stiff_energies(*body);
      EXPECT_NEAR(found[0], known.i1, known.digits);
      EXPECT_NEAR(found[1], known.i2, known.digits);
      EXPECT_NEAR(found[2], known.i3, known.digits);
    }
  }
}

TEST(Fput, SumOfStiffEnergiesStaysWithSymplecticMethodsOnly) {
  struct Case {
    const Method& method;
    double dt;
  };
  const auto range = [](const Method& method, double dt, double end) {
    auto body = fput_body<double>(motion(method, dt));
    double low = 2, high = 0;
    for (int i = 0; i < int(end / 0.05); ++i) {
      go(*body, 0.05 * i, 0.05 * (i + 1));
      const double sum = stiff_energies(*body).sum();
      low = std::min(low, sum), high = std::max(high, sum);
    }
    std::cout << method.name << ", dt " << dt << " s, to " << end << " s: " << low << " to " << high << "\n";
    return std::pair(low, high);
  };
  for (const Case& c : {Case{semi_implicit_euler(), 0.00025}, Case{verlet(), 0.005}, Case{velocity_verlet(), 0.005},
                        Case{pefrl(), 0.0125}, Case{blanes_moan_4(), 0.025}, Case{blanes_moan_6(), 0.05},
                        Case{implicit_midpoint(), 0.01}}) {
    SCOPED_TRACE(c.method.name);
    ASSERT_TRUE(c.method.symplectic);
    const auto [low, high] = range(c.method, c.dt, 200);
    EXPECT_GT(low, 0.9376 - 0.02);
    EXPECT_LT(high, 1.0654 + 0.02);
  }
  // Implicit Euler is stable, and wrong.
  EXPECT_LT(range(implicit_euler(), 0.0025, 10).first, 0.1);
}

TEST(HangingSheet, KeepsItsEnergyWithPefrl) {
  scene::SceneDescription sheet = scene::hanging_sheet(32);
  scene::override_solver(sheet, "pefrl", 1.0 / 1920, "double");
  scene::Scene built = scene::build(sheet);
  const double start = built.world.energy().total();
  double worst = 0, lowest = 0;
  for (int i = 0; i < 600; ++i) {
    ASSERT_TRUE(built.world.update(1.0 / 60).good());
    const Energy now = built.world.energy();
    worst = std::max(worst, std::abs(now.total() - start));
    lowest = std::min(lowest, now.gravitational);
  }
  std::cout << "worst energy error " << worst << " J\n";
  EXPECT_LE(worst, 1e-7);
}

}  // namespace
}  // namespace hooke::test
