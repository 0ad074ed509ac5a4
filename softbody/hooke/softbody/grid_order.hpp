// Grids whose points are numbered in any order, as mesh files have them. Internal to hooke::softbody and
// not installed.
#pragma once

#include <hooke/softbody/spring_network.hpp>
#include <hooke/stepper.hpp>

#include <memory>
#include <vector>

namespace hooke::softbody {

/// Points in an order, row by row, in which the network is a grid of at least two rows and columns; empty where none
/// is found.
///
/// From the point of the fewest springs on, every spring must lead to a place of the grid one or two steps along its
/// rows and columns, or one along its diagonals: the one nearest to it in the lattice that the springs around span.
/// Finds grids that are flat or curved, by up to some twenty degrees a step; not those that have no springs along rows
/// or columns.
/// @param start positions (n, 3)
std::vector<int> grid_order(const SpringNetwork& network, const Points<double>& start);

/// The network with point order[i] called i.
SpringNetwork renumbered(const SpringNetwork& network, const std::vector<int>& order);

/// Rows order[i] of values (n, 3).
template <class S>
Points<S> renumbered(const Points<S>& values, const std::vector<int>& order);

/// A stepper of the renumbered network, for points in their own order.
template <class S>
std::unique_ptr<Stepper<S>> renumbered(std::unique_ptr<Stepper<S>> inner, std::vector<int> order);

}  // namespace hooke::softbody
