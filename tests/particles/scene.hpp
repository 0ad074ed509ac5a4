// What the tests of particle systems share.
#pragma once

#include <hooke/particles/particle_system.hpp>
#include <hooke/world.hpp>

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace hooke::particles {

// Everything that a tick may change, as a number of particles and a hash (FNV-1a) of their bits.
template <class S>
std::string bytes(const ParticleSystem<S>& system) {
  std::uint64_t hash = 0xcbf29ce484222325;
  const auto add = [&](const void* data, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) hash = (hash ^ static_cast<const unsigned char*>(data)[i]) * 0x100000001b3;
  };
  const auto x = system.state_positions();
  const auto v = system.state_velocities();
  for (Index i = 0; i < system.size(); ++i) {
    const S numbers[6] = {x(i, 0), x(i, 1), x(i, 2), v(i, 0), v(i, 1), v(i, 2)};
    const std::uint64_t serial = system.serial(i);
    const double age = system.age(i);
    add(numbers, sizeof numbers), add(&serial, sizeof serial), add(&age, sizeof age);
  }
  return std::to_string(system.size()) + " particles, " + std::to_string(hash);
}

inline Collider floor_at(double height, double restitution = 0, double friction = 0) {
  Collider floor;
  floor.name = "floor";
  floor.shapes = {HalfSpace{Vec3(0, 1, 0), height}};
  floor.restitution = restitution, floor.friction = friction;
  return floor;
}

inline Birth thrown(const Vec3& position, const Vec3& velocity) {
  Birth birth;
  birth.position = position, birth.velocity = velocity;
  return birth;
}

}  // namespace hooke::particles
