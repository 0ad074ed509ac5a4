// The inner loops of springs and wind. Compiled once for each instruction set and chosen at
// run time; internal to hooke::softbody and not installed.
#pragma once

namespace hooke::softbody {

inline constexpr int kBlock = 128;

/// Springs i in [0, n), n <= kBlock, between points a[i] and b[i], each coordinate a separate
/// array. f[k][i] becomes the force on a; where sum_a and sum_b are set, it is added to
/// sum_a[k][i] and taken from sum_b[k][i]. Velocities are null where there is no damping.
template <class S>
struct SpringBlock {
  int n;
  const S *a[3], *b[3];
  const S *va[3], *vb[3];
  const S *stiffness, *rest, *rest_squared, *damping;
  S f[3][kBlock];
  S *sum_a[3], *sum_b[3];
};

void spring_forces(SpringBlock<float>& block);
void spring_forces(SpringBlock<double>& block);

/// Triangles i in [0, n), n <= kBlock; corner c has positions x[c][k][i] and velocities
/// v[c][k][i]. f[k][i] becomes a third of the aerodynamic force of the triangle; where sum is
/// set, it is added to sum[c][k][i] for every corner.
template <class S>
struct WindBlock {
  int n;
  const S *x[3][3], *v[3][3];
  S wind[3];
  S drag, lift;  // ½ ρ C / 3
  S f[3][kBlock];
  S* sum[3][3];
};

void wind_forces(WindBlock<float>& block);
void wind_forces(WindBlock<double>& block);

}  // namespace hooke::softbody
