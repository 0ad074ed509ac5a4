// The inner loops of springs and wind. Compiled once for each instruction set and chosen at
// run time; internal to hooke::softbody and not installed.
#pragma once

namespace hooke::softbody {

inline constexpr int kBlock = 128;

/// Springs i in [0, n), n <= kBlock, between points a[i] and b[i], each coordinate a separate
/// array. f[k][i] becomes the force on a; where sum_a and sum_b are set, it is added to
/// sum_a[k][i] and taken from sum_b[k][i]. Velocities are null where there is no damping, and so is what the
/// rounding of places has dropped where nobody knows it.
template <class S>
struct SpringBlock {
  int n;
  const S *a[3], *b[3];
  const S *low_a[3], *low_b[3];
  const S *va[3], *vb[3];
  const S *stiffness, *rest, *rest_squared, *damping;
  const double* fine_rest_squared;  // for what rounding has dropped
  S f[3][kBlock];
  S *sum_a[3], *sum_b[3];
};

void spring_forces(SpringBlock<float>& block);
void spring_forces(SpringBlock<double>& block);

/// ½ k (l - L)² of such springs, summed up [J]. Only what the formula asks for has to be set.
double spring_energy(const SpringBlock<float>& block);
double spring_energy(const SpringBlock<double>& block);

/// Springs as above, for bounds on their rates: by spring, w k P and w c n nᵀ as xx, xy, xz, yy, yz, zz, where
/// w = inverse masses of both ends, P the stiffness's direction and n the spring's.
template <class S>
struct BoundBlock {
  int n;
  const S *a[3], *b[3], *wa, *wb;
  const S *stiffness, *rest, *damping;  // damping may be null
  S k[6][kBlock], c[6][kBlock];
};
void spring_bounds(BoundBlock<float>& block);
void spring_bounds(BoundBlock<double>& block);

/// out[i] becomes a bound from above on the eigenvalues of the symmetric matrices m (xx, xy, xz, yy, yz, zz),
/// within 1 % of the largest; 0 for 0.
void eigenvalue_bounds(int n, const float* const m[6], float* out);
void eigenvalue_bounds(int n, const double* const m[6], double* out);

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
