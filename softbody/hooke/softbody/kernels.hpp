// The inner loops of springs and wind. Compiled once for each instruction set and chosen at
// run time; internal to hooke::softbody and not installed.
#pragma once

namespace hooke::softbody {

/// Springs i in [0, n) between points a[i] and b[i], each coordinate a separate array.
/// f[k][i] = force on a. Velocities may be null where there is no damping.
template <class S>
struct SpringBlock {
  int n;
  const S *a[3], *b[3];
  const S *va[3], *vb[3];
  const S *stiffness, *rest, *rest_squared, *damping;
  S* f[3];
};

void spring_forces(const SpringBlock<float>& block);
void spring_forces(const SpringBlock<double>& block);

/// Triangles i in [0, n); corner c has positions x[c][k][i] and velocities v[c][k][i].
/// f[k][i] = a third of the aerodynamic force of the triangle.
template <class S>
struct WindBlock {
  int n;
  const S *x[3][3], *v[3][3];
  S wind[3];
  S drag, lift;  // ½ ρ C / 3
  S* f[3];
};

void wind_forces(const WindBlock<float>& block);
void wind_forces(const WindBlock<double>& block);

/// target[i] += sign * source[i]
void add_to(float* target, const float* source, float sign, int n);
void add_to(double* target, const double* source, double sign, int n);

inline constexpr int kBlock = 128;

}  // namespace hooke::softbody
