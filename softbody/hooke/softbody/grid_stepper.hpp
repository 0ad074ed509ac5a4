// Springs of a grid, force and step in one pass over its rows. Internal to hooke::softbody and not
// installed.
#pragma once

#include <hooke/softbody/filtered_grid.hpp>
#include <hooke/stepper.hpp>

#include <memory>

namespace hooke::softbody {

/// A stepper for the undamped springs of a grid.
///
/// A row's points are stepped in place as soon as the forces on them are complete: every spring is worked on once,
/// with the point it starts at, and what it pulls at further on waits in a sum: to the right in registers, below in
/// two rows of sums. With e = l²/L² - 1, a spring's force over length is k (1 - 1/√(1 + e)): a series in e, to a unit
/// of its last place, where |e| is small, and a root and a quotient for the few that are not. L² comes from the same
/// operations as l²: exactly nothing at rest. Every operation is an IEEE one, in an order that no vector's length
/// changes, so instruction sets with fused multiply-add agree in every bit, and so do those without.
///
/// Where the grid outgrows the caches, several stages follow each other down the rows at once.
///
/// Cost: 0.35 ns a spring and stage in float with AVX-512, 0.8 ns in double.
/// @param start positions (n, 3) that resolve missing rest lengths
template <class S>
std::unique_ptr<Stepper<S>> make_grid_stepper(const SpringNetwork& network, const SpringGrid& grid,
                                              const Points<S>& start);

/// The same for positions and velocities in two floats each: forces to float's precision of differences that
/// are more precise, sums that lose nothing. Error near double's. Cost: 1.5 × float's, 0.7 of
/// double's.
std::unique_ptr<Stepper<double>> make_two_float_grid_stepper(const SpringNetwork& network, const SpringGrid& grid,
                                                             const Points<double>& start);

/// A body in float stepped in double, what the rounding of its state drops kept aside. Cost: double's.
std::unique_ptr<Stepper<float>> make_fine_grid_stepper(const SpringNetwork& network, const SpringGrid& grid,
                                                       const Points<float>& start);

}  // namespace hooke::softbody
