// Notices energy that comes from nowhere.
#pragma once

namespace hooke {

/// Watches the energy of a body to which nothing gives any. The kinetic energy is looked at every tick; the
/// total, which costs as much as an evaluation of the forces, only where that has doubled since the
/// last look: a few dozen times while a motion blows up, and hardly ever where it does not.
class EnergyWatch {
 public:
  enum class Finding {
    Fine,
    Grows,  ///< by a tenth of the kinetic energy
    Grew,   ///< by half of it: what is seen is no motion of this body
  };

  bool knows() const { return known_; }
  /// Something may have given energy; `start` again.
  void forget() { known_ = false; }
  /// @param total, kinetic energies [J] that it has now  @param rounding what of the total is noise [J]
  /// @param kick the most that the rounding of one evaluation of the forces gives, on average [J]
  void start(double total, double kinetic, double rounding, double kick) {
    known_ = true, start_ = total, looked_at_ = kinetic, rounding_ = rounding, kick_ = kick;
  }
  /// Kicks add up: undamped, they shake what was at rest.
  void kicked(double times) { rounding_ += times * kick_; }
  /// True where `judge` must be asked.
  bool due(double kinetic) const { return known_ && kinetic > 2 * looked_at_ && kinetic > rounding_; }
  Finding judge(double total, double kinetic) {
    looked_at_ = kinetic;
    const double gain = total - start_ - rounding_;
    return gain > 0.5 * kinetic ? Finding::Grew : gain > kGrows * kinetic ? Finding::Grows : Finding::Fine;
  }
  /// The largest total [J] that `judge` finds nothing wrong with.
  double fine_up_to(double kinetic) const { return start_ + rounding_ + kGrows * kinetic; }
  double gain(double total) const { return total - start_; }  ///< [J] since `start`

 private:
  static constexpr double kGrows = 0.1;
  bool known_ = false;
  double start_ = 0, looked_at_ = 0, rounding_ = 0, kick_ = 0;
};

}  // namespace hooke
