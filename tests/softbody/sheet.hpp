// The hanging sheet of the known problems.
#pragma once

#include <hooke/softbody/cloth.hpp>
#include <hooke/softbody/soft_body.hpp>

#include <memory>

namespace hooke::test {

/// A square metre of n × n points, 0.3 kg, equal masses, fixed constants times `stiffness`, no dampers; first row held;
/// tilted by 45° or vertical. In double.
inline softbody::SoftBodySettings sheet(int n, bool tilted = true, double stiffness = 1) {
  using namespace softbody;
  ClothMaterial any;
  any.stretch = any.shear = any.bend = 1;
  Cloth cloth = cloth_from_grid(1, 1, n, n, {1, 0, 0}, {0, -1, tilted ? 1.0 : 0.0}, any);
  auto network = std::make_shared<SpringNetwork>(*cloth.network);
  for (Spring& spring : network->springs) {
    spring.stiffness = spring.family == Family::Stretch ? 500 : spring.family == Family::Shear ? 100 : 5;
    spring.stiffness *= stiffness;
    spring.damping = 0;
  }
  cloth.network = std::move(network);
  cloth.masses.setConstant(0.3 / (n * n));
  SoftBodySettings settings = settings_of(cloth);
  for (int i = 0; i < n; ++i) settings.pins.push_back(i);
  settings.precision = Precision::Double;
  return settings;
}

}  // namespace hooke::test
