// Small-step XPBD: springs as constraints with a compliance, solved one after the other. Derivation, what it
// costs, measurements and limits: docs/methods/xpbd.md.
#pragma once

#include <hooke/point_body.hpp>
#include <hooke/softbody/spring_network.hpp>

#include <memory>
#include <string>

namespace hooke::softbody {

inline constexpr int kXpbdIterations = 4;  ///< sweeps a substep where none are asked for

/// Extended position-based dynamics with small steps: backward Euler whose spring forces are found by a
/// few Gauss-Seidel sweeps a substep (MotionSettings::iterations). Order 1, bounded at any step, stiffness and mass
/// ratio; loses energy. What the sweeps leave of a spring's force is made up over the following substeps, so that
/// the state at rest is the static one at any number of iterations; before that, springs that are
/// stiffer than the sweeps can follow, h² k (1/m_a + 1/m_b) above about 1, are softer. Springs' damping is in N·s/m
/// and takes nothing from free fall. Contacts and friction are solved in the sweeps, drag and wind act as
/// explicit forces. Only bodies of make_soft_body can be moved by it. Cost: a square root and a division a spring and
/// sweep. Source: Macklin, Müller, Chentanez, "XPBD", MIG 2016; Macklin et al., "Small steps in physics simulation",
/// SCA 2019.
const Method& xpbd();

/// Makes such a body. settings.dt = 0 takes substeps of 1/1200 s.
/// @param network null: points alone
/// @throws std::invalid_argument for what SpringNetwork::check refuses, and negative iterations
template <class S>
std::unique_ptr<PointBody<S>> make_xpbd_body(std::string name, PointMasses<S> points, const MotionSettings& settings,
                                             std::shared_ptr<const SpringNetwork> network);

}  // namespace hooke::softbody
