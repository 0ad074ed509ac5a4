// The body that filtered leapfrog moves: what it decides when it is made, and its step.
// Internal to hooke::softbody and not installed.
#pragma once

#include <hooke/softbody/filtered_grid.hpp>
#include <hooke/softbody/filtered_kernels.hpp>
#include <hooke/softbody/filtered_leapfrog.hpp>
#include <hooke/softbody/lines.hpp>
#include <hooke/softbody/spring_field.hpp>

#include <Eigen/LU>

namespace hooke::softbody {

/// Grid, masses, stiffness and step of a sheet.
struct SheetPlan {
  SpringGrid grid;
  MassModel mass_model;
  std::shared_ptr<const SpringNetwork> network;  ///< with the stiffness that is used
  double width = 0, height = 0;                  ///< [m], at rest
  double speed_x = 0, speed_y = 0;               ///< of waves along rows and columns [m/s]
  double stiffness_scale = 1, cap_error = 0;     ///< [1], [m]
  double step = 0;                               ///< wanted [s]
  bool automatic = false;                        ///< the step was not given

  SheetPlan(std::shared_ptr<const SpringNetwork> given, const Points<double>& start, const Values<double>& mass,
            double dt, double wanted_error);

  struct LineStiffness {
    double x = 0, y = 0;  // [1/s²]
  };
  LineStiffness undamped;  ///< line_stiffness(0)
  LineStiffness line_stiffness(double h) const;
  double extension_under_weight(const Values<double>& mass) const;
  double travel(double h) const;
  double expected_error(double h) const;
};

template <class S>
class FilteredSheet final : public PointBody<S> {
 public:
  FilteredSheet(std::string name, PointMasses<S> points, const MotionSettings& settings, SheetPlan plan);

  FilteredFacts facts() const;
  double kept_energy(const Vec3& gravity) const;

  bool fused() const override { return false; }  // a stepper of an added field knows no filter
  using PointBody<S>::stable_step;
  double stable_step(const Method& method) const override;
  MotionFacts motion_facts() const override;
  Energy energy(const Vec3& gravity) const override;
  void set_position(Index point, const Vec3& position) override;
  void set_velocity(Index point, const Vec3& velocity) override;
  void pin(Index point) override;
  void release(Index point) override;
  void drive_pins(std::vector<Index> points, PinMotion motion) override;
  void take_back() override;
  void describe(Blueprint& out) const override;
  void save(CheckpointWriter& out) const override;
  void load(CheckpointReader& in) override;
  void wake() override {
    Base::wake();
    known_ = false;
  }

 protected:
  void still_acceleration(const Points<S>& x, const Points<S>& still, double t, Points<S>& a) override;
  bool loses_energy() const override { return damped_ || Base::loses_energy(); }
  SolveResult substep(double t, double h) override;

 private:
  static constexpr Index kMargin = 64 / sizeof(S);

  using Base = PointBody<S>;
  using Base::points_;
  using Base::tick_;
  struct Special {  // a point with a mass or hold of its own
    Index point, row, column;
    std::size_t row_number, column_number;  // in special_rows_, special_columns_
    bool held;
    double extra;  // mass in units, 0 where held
  };
  struct Line {  // factors of a LineFilter, in S
    Values<S> below, below2, above, above2, inverse_pivot;
  };

  void lay_out_springs();
  void prepare(double h, bool contacts);
  void factor();
  void find_held();
  void prepare_specials();
  static Line line_of(const LineFilter& filter, Index padded);
  void meet_pins(double t, double h);
  void gather_extra(double t, double h);
  void forward(double h);
  void weigh_row(Index row, double h);
  void read_row(SheetForward<S>& out, int i, Index row);
  void add_odd(Index row, double h);
  void solve_specials(double kick);
  void back(double kick, double drift);
  void follow_pins(Index row, double kick);
  void finish_pins();
  void move_row(Index row, S kick, S drift);
  double followed(Index row, Index column, int k) const;
  bool needs_velocity() const { return damped_ || this->uses_velocity(); }
  S* row_of(Index row) { return z_.data() + row * stride_; }
  // Forces on row + further from the rows before it: of two rows at once.
  S* waiting(Index row, int further) { return waiting_.data() + (row % 2 * 2 + further) * 3 * pad_; }

  SheetPlan plan_;
  SpringField<S> field_;                // for energy and bounds
  bool damped_ = false, even_ = false;  // even: no mass differs
  Index rows_, columns_, stride_, padded_rows_, plane_, pad_;
  Lines<S> stiffness_, rest_, inverse_, damping_;
  std::vector<SheetSprings<S>> springs_;  // by row and block of columns

  // Of the present step, pins and contacts.
  bool stale_ = true;  // pins have changed
  double h_ = 0;
  bool contacts_ = false, filtered_ = false;
  std::optional<LineFilter> along_rows_, along_columns_;
  Line row_line_, column_line_;
  std::vector<bool> held_row_, held_column_;
  std::vector<Index> pins_;        // all held points
  std::vector<Special> specials_;  // by point
  std::vector<Index> special_rows_, special_columns_;
  std::vector<Values<double>> row_response_, column_response_;  // along rows and columns, of a unit at a special one
  Eigen::PartialPivLU<Eigen::MatrixXd> special_matrix_;
  Eigen::Matrix<double, Eigen::Dynamic, 3> special_kick_;
  Points<S> special_place_;
  std::vector<S> special_sums_;  // by special row, three coordinates

  // Of the present substep.
  Index substep_ = 0;
  std::int64_t evaluations_ = 0;
  bool known_ = false;  // z_ is the kick of the coming tick's start
  Vec3 known_gravity_{0, 0, 0};
  bool extra_on_ = false, jumps_ = false;
  Lines<S> z_;                       // kicks: three planes of rows, then a row of zeros
  Lines<S> last_x_, last_v_;         // of the last rows, with margins
  Lines<S> waiting_;                 // forces on rows to come
  std::vector<char> far_from_rest_;  // by row: whether springs were, when it was last looked at
  Lines<S> scale_row_, mass_row_, extra_row_, zero_row_, right_, wait_, add_, block_;
  Points<S> extra_, predicted_, from_, touched_x_, touched_v_;
  Points<S> place_x_, place_v_, pin_velocity_, jump_;  // where there are moving pins; only their rows count
  std::vector<Points<S>> column_jump_;                 // by held column, along it
};

extern template class FilteredSheet<float>;
extern template class FilteredSheet<double>;

}  // namespace hooke::softbody
