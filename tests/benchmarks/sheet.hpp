// The hanging sheet in every form that is measured.
#pragma once

#include "yardstick.hpp"

#include <hooke/softbody/soft_body.hpp>
#include <hooke/world.hpp>

namespace hooke::bench {

using softbody::Precision;
using softbody::SoftBodySettings;

/// Row by row; points and springs in an order of no meaning; and with a spring of no stiffness across, so that no
/// rows can be found.
enum class Form { Grid, Shuffled, Mesh };

/// The standard scene's sheet of n × n points, as settings of a body. Undamped.
SoftBodySettings hanging_sheet(int n, Form form = Form::Grid);

/// Points in the order of the shuffled sheet of as many points.
Points<double> shuffle(const Points<double>& x);

/// The same for the yardstick.
PlainSheet plain(const SoftBodySettings& settings);

/// The yardstick's step [s]: the one of its definition for N = 32 and 64, near the stability limit for all.
double yardstick_step(int n);

/// A world with that body alone.
World world_of(const SoftBodySettings& settings, double tick_rate = 60);

/// Root mean square distance of points in the same order [m].
double rms(const Points<double>& a, const Points<double>& b);
double rms(const std::vector<double>& a, const Points<double>& b);

/// Stiffness of all springs times a factor.
SoftBodySettings softened(const SoftBodySettings& settings, double factor);

}  // namespace hooke::bench
