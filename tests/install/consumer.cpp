// What a user's first program does: one spring, one second.
#include <hooke/softbody/soft_body.hpp>
#include <hooke/world.hpp>

#include <cstdio>

int main() {
  hooke::softbody::SoftBodySettings settings;
  settings.positions.resize(2, 3);
  settings.positions << 0, 0, 0, 0, -1, 0;
  settings.masses.setConstant(2, 1.0);
  auto network = std::make_shared<hooke::softbody::SpringNetwork>();
  network->springs.push_back({0, 1, 100});
  settings.network = network;
  settings.pins = {0};
  hooke::World world;
  const hooke::Body& body = world.add(hooke::softbody::make_soft_body(settings));
  if (!world.update(1.0).good()) return 1;
  const double y = body.positions()(1, 1);
  std::printf("after 1 s the weight is at %.3f m\n", y);
  return y < -1 && y > -1.3 ? 0 : 1;
}
