#include <hooke/softbody/filtered_sheet.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace hooke::softbody {

namespace {

// a over A = h² k / (4 m): 0.5 is the least that is stable; contacts pull too.
constexpr double kShare = 0.55, kShareWithContacts = 0.6;
// Velocity Verlet is used up to this share of its largest stable step.
constexpr double kPlainShare = 0.9;
// A contact gives back this share of the depth in a step, and half of it of the approach.
constexpr double kContactShare = 1;
constexpr std::size_t kMostSpecials = 1024;

Index round_up(Index n, Index to) { return (n + to - 1) / to * to; }

MotionSettings with_step(MotionSettings settings, double step) {
  settings.dt = step;
  settings.watches_energy = false;  // it keeps another energy than that of springs and masses
  return settings;
}

}  // namespace

template <class S>
FilteredSheet<S>::FilteredSheet(std::string name, PointMasses<S> points, const MotionSettings& settings, SheetPlan plan)
    : Base(std::move(name), std::move(points), with_step(settings, plan.step)),
      plan_(std::move(plan)),
      field_(plan_.network, points_.position),
      rows_(plan_.grid.rows),
      columns_(plan_.grid.columns),
      stride_(round_up(columns_, kLanes<S>)),
      padded_rows_(round_up(rows_, kLanes<S>)),
      plane_((padded_rows_ + 1) * stride_),
      pad_(stride_ + 2 * kMargin) {
  damped_ = field_.uses_velocity();
  even_ = (plan_.mass_model.row == 1).all() && (plan_.mass_model.column == 1).all();
  lay_out_springs();
  z_.resize(std::size_t(3 * plane_));
  last_x_.resize(std::size_t(9 * pad_));
  if (damped_) last_v_.resize(std::size_t(9 * pad_));
  waiting_.resize(std::size_t(12 * pad_));
  far_from_rest_.assign(std::size_t(rows_), false);
  for (Lines<S>* row : {&scale_row_, &mass_row_, &zero_row_}) row->resize(std::size_t(stride_));
  for (Lines<S>* rows : {&extra_row_, &right_}) rows->resize(std::size_t(3 * pad_));
  wait_.resize(std::size_t(6 * stride_));
  for (Lines<S>* rows : {&add_, &block_}) rows->resize(std::size_t(3 * kLanes<S> * stride_));
}

template <class S>
void FilteredSheet<S>::find_held() {
  const auto held = [&](Index r, Index c) { return points_.inverse_mass[r * columns_ + c] == 0; };
  held_row_.assign(std::size_t(rows_), true), held_column_.assign(std::size_t(columns_), true);
  pins_.clear();
  for (Index r = 0; r < rows_; ++r)
    for (Index c = 0; c < columns_; ++c) {
      if (held(r, c)) {
        pins_.push_back(r * columns_ + c);
      } else {
        held_row_[std::size_t(r)] = false;
        held_column_[std::size_t(c)] = false;
      }
    }
  specials_.clear();
  const auto add = [&](Index point, bool is_held, double extra) {
    const Index r = point / columns_, c = point % columns_;
    if (held_row_[std::size_t(r)] || held_column_[std::size_t(c)]) return;
    specials_.push_back({point, r, c, 0, 0, is_held, extra});
  };
  for (const Index pin : pins_) add(pin, true, 0);
  for (const auto& odd : plan_.mass_model.odd)
    if (points_.inverse_mass[odd.point] != 0) add(odd.point, false, odd.extra);
  if (specials_.size() > kMostSpecials)
    throw std::invalid_argument("body \"" + this->name() + "\": filtered-leapfrog takes at most " +
                                std::to_string(kMostSpecials) +
                                " held points outside of whole rows and columns and points of odd mass, got " +
                                std::to_string(specials_.size()));
  std::sort(specials_.begin(), specials_.end(), [](const Special& a, const Special& b) { return a.point < b.point; });
  const auto number = [](std::vector<Index>& list, Index value) {
    const auto found = std::find(list.begin(), list.end(), value);
    if (found != list.end()) return std::size_t(found - list.begin());
    list.push_back(value);
    return list.size() - 1;
  };
  special_rows_.clear(), special_columns_.clear();
  for (Special& special : specials_) {
    special.row_number = number(special_rows_, special.row);
    special.column_number = number(special_columns_, special.column);
  }
  special_sums_.assign(special_rows_.size() * std::size_t(3 * stride_), S(0));
  special_place_.resize(Index(specials_.size()), 3);
}

template <class S>
typename FilteredSheet<S>::Line FilteredSheet<S>::line_of(const LineFilter& filter, Index padded) {
  const Pentadiagonal& m = filter.matrix;
  const Index n = m.size();
  Line out;
  for (auto* values : {&out.below, &out.below2, &out.above, &out.above2}) values->setZero(padded);
  out.inverse_pivot.setOnes(padded);
  out.below.head(n) = m.below().template cast<S>();
  out.below2.head(n) = m.below2().template cast<S>();
  out.inverse_pivot.head(n) = m.inverse_pivot().template cast<S>();
  out.above.head(n - 1) = out.below.segment(1, n - 1);
  if (n > 2) out.above2.head(n - 2) = out.below2.segment(2, n - 2);
  return out;
}

// Everything that depends on the step, the pins and whether there are colliders.
template <class S>
void FilteredSheet<S>::prepare(double h, bool contacts) {
  // Ticks are as long as each other but for rounding.
  if (!stale_ && contacts == contacts_ && std::abs(h - h_) <= 1e-9 * h) return;
  if (stale_) find_held();
  stale_ = known_ = false;
  h_ = h, contacts_ = contacts;
  const auto rates = field_.rate_bounds(points_.position, points_.velocity, points_.inverse_mass);
  const double plain =
      kPlainShare * largest_stable_step(velocity_verlet(), std::sqrt(rates.omega_squared), rates.gamma);
  filtered_ = h > plain;
  factor();
}

// The filter of a step of h_.
template <class S>
void FilteredSheet<S>::factor() {
  double a_x = 0, a_y = 0;
  if (filtered_) {
    const auto stiffness = damped_ ? plan_.line_stiffness(h_) : plan_.undamped;
    const double share = (contacts_ ? kShareWithContacts : kShare) * h_ * h_ / 4;
    a_x = share * stiffness.x, a_y = share * stiffness.y;
  }
  along_rows_.emplace(plan_.mass_model.column, held_column_, a_x);
  along_columns_.emplace(plan_.mass_model.row, held_row_, a_y);
  row_line_ = line_of(*along_rows_, stride_);
  column_line_ = line_of(*along_columns_, padded_rows_);
  prepare_specials();
}

// Held points and odd masses sit on top of the filter: with D their extra masses in units (infinite where
// held) and F the filter, z = F (b + λ) there, λ = -(F + D⁻¹)⁻¹ F b at the special points (Woodbury).
template <class S>
void FilteredSheet<S>::prepare_specials() {
  const Index count = Index(specials_.size());
  const auto respond = [](const LineFilter& line, const std::vector<Index>& places) {
    std::vector<Values<double>> out;
    for (const Index place : places) {
      Values<double> unit = Values<double>::Zero(line.matrix.size());
      unit[place] = 1;
      out.push_back(line.matrix.solve(std::move(unit)));
    }
    return out;
  };
  row_response_ = respond(*along_rows_, special_columns_);
  column_response_ = respond(*along_columns_, special_rows_);
  Eigen::MatrixXd matrix(count, count);
  for (Index i = 0; i < count; ++i)
    for (Index j = 0; j < count; ++j) {
      const Special &a = specials_[std::size_t(i)], &b = specials_[std::size_t(j)];
      matrix(i, j) = column_response_[a.row_number][b.row] * row_response_[a.column_number][b.column];
      if (i == j && !a.held) matrix(i, j) += 1 / a.extra;
    }
  if (count > 0) special_matrix_.compute(matrix);
  special_kick_.setZero(count, 3);
}

// Where driven pins go in the coming step, and how their velocity jumps now.
template <class S>
void FilteredSheet<S>::meet_pins(double t, double h) {
  jumps_ = this->prescribes();
  if (!jumps_) {
    for (std::size_t i = 0; i < specials_.size(); ++i)
      special_place_.row(Index(i)) = points_.position.row(specials_[i].point);
    return;
  }
  const Index n = points_.size();
  place_x_.resize(n, 3), place_v_.resize(n, 3), jump_.resize(n, 3);
  if (pin_velocity_.rows() != n) pin_velocity_ = points_.velocity;
  for (const Index pin : pins_) place_x_.row(pin) = points_.position.row(pin), place_v_.row(pin) = S(0);
  this->prescribe(t, points_.position, t + h, place_x_, place_v_);
  for (const Index pin : pins_) jump_.row(pin) = place_v_.row(pin) - pin_velocity_.row(pin);
  column_jump_.resize(along_rows_->held.size());
  for (std::size_t q = 0; q < column_jump_.size(); ++q) {
    column_jump_[q].resize(rows_, 3);
    for (Index r = 0; r < rows_; ++r) {
      column_jump_[q].row(r) = jump_.row(r * columns_ + along_rows_->held[q]);
      for (std::size_t p = 0; p < along_columns_->held.size(); ++p)
        column_jump_[q].row(r) -=
            S(along_columns_->extension[p][r]) * jump_.row(along_columns_->held[p] * columns_ + along_rows_->held[q]);
    }
  }
}

// Accelerations beside gravity and springs, where there are any. Contacts are penalties: positions and
// velocities are left alone, and what Contacts would have done to them becomes a force before the filter.
template <class S>
void FilteredSheet<S>::gather_extra(double t, double h) {
  extra_on_ = this->other_forces() || this->collides();
  if (!extra_on_) return;
  const Points<S>& v = needs_velocity() ? predicted_ : points_.velocity;
  this->acceleration(points_.position, v, t, extra_);
  if (!this->collides()) return;
  const S step = S(h), share = S(kContactShare);
  from_ = points_.position - step * points_.velocity;
  touched_x_ = points_.position;
  touched_v_ = points_.velocity;
  this->collide(t - h, from_, t, touched_x_, touched_v_);
  extra_ += (share / (step * step)) * (touched_x_ - points_.position) +
            (share / (2 * step)) * (touched_v_ - points_.velocity);
}

// What forces on the coming rows are multiplied with, and their masses: nothing where points are held.
template <class S>
void FilteredSheet<S>::weigh_row(Index row, double h) {
  const MassModel& masses = plan_.mass_model;
  if (row > 0 && masses.row[row] == masses.row[row - 1]) return;
  for (Index c = 0; c < columns_; ++c) {
    const bool held = held_column_[std::size_t(c)];
    scale_row_.data()[c] = held ? S(0) : S(h / masses.unit);
    mass_row_.data()[c] = held ? S(0) : S(h * masses.row[row] * masses.column[c]);
  }
}

// Rows are read where they are, past their ends too, but for the last ones: those are copied, and behind them are
// zeros.
template <class S>
void FilteredSheet<S>::read_row(SheetForward<S>& out, int i, Index row) {
  const Index first = row * columns_;
  const bool whole = first + stride_ + 2 <= points_.size();
  out.apart[i] = whole ? points_.size() : pad_;
  const auto place = [&](const Points<S>& from, Lines<S>& last) -> const S* {
    if (whole) return &from(first, 0);
    S* to = last.data() + row % 3 * 3 * pad_;
    for (int k = 0; k < 3; ++k)
      if (row < rows_)
        std::copy_n(&from(first, k), columns_, to + k * pad_);
      else
        std::fill_n(to + k * pad_, columns_, S(0));
    return to;
  };
  out.x[i] = place(points_.position, last_x_);
  out.v[i] = damped_ ? place(predicted_, last_v_) : nullptr;
}

// Masses on top of the filter's weigh, too.
template <class S>
void FilteredSheet<S>::add_odd(Index row, double h) {
  for (const Special& special : specials_) {
    if (special.row != row || special.held) continue;
    for (int k = 0; k < 3; ++k) {
      const double g = extra_on_ ? double(extra_(special.point, k)) : tick_.gravity[k];
      const S more = S(h * special.extra * g);
      right_.data()[k * pad_ + special.column] += more;
      row_of(row)[k * plane_ + special.column] += more;
    }
  }
}

// Forces row by row and, behind them, the first half of the solves down the columns.
template <class S>
void FilteredSheet<S>::forward(double h) {
  ++evaluations_;
  std::fill(special_sums_.begin(), special_sums_.end(), S(0));
  std::fill_n(waiting_.data(), 12 * pad_, S(0));
  S* zeros = row_of(padded_rows_);
  SheetForward<S> row{};
  row.columns = int(stride_), row.pad = pad_, row.plane = plane_;
  row.right = specials_.empty() ? nullptr : right_.data();
  row.extra = extra_on_ ? extra_row_.data() : nullptr;
  for (int k = 0; k < 3; ++k) row.gravity[k] = S(tick_.gravity[k]);
  for (Index r = 0; r < rows_; ++r) {
    weigh_row(r, h);
    for (int i = 0; i < 3; ++i) read_row(row, i, r + i);
    row.near = waiting(r, 0), row.far = waiting(r, 1);
    row.next_near = waiting(r + 1, 0), row.next_far = waiting(r + 1, 1);
    row.springs = springs_.data() + r * (stride_ / kLanes<S>);
    const bool held = held_row_[std::size_t(r)];
    row.scale = held ? zero_row_.data() : scale_row_.data();
    row.mass = held ? zero_row_.data() : mass_row_.data();
    for (int k = 0; k < 3 && extra_on_; ++k)
      std::copy_n(&extra_(r * columns_, k), columns_, extra_row_.data() + k * pad_);
    row.z = row_of(r), row.z1 = r > 0 ? row_of(r - 1) : zeros, row.z2 = r > 1 ? row_of(r - 2) : zeros;
    row.w1 = column_line_.below[r], row.w2 = column_line_.below2[r];
    row.far_from_rest = far_from_rest_[std::size_t(r)];
    sheet_forward(row);
    far_from_rest_[std::size_t(r)] = row.far_from_rest;
    if (specials_.empty()) continue;
    add_odd(r, h);
    for (std::size_t i = 0; i < special_rows_.size(); ++i) {
      SheetSum<S> sum{int(columns_), pad_,
                      stride_,       special_sums_.data() + i * std::size_t(3 * stride_),
                      right_.data(), S(column_response_[i][r])};
      sheet_sum(sum);
    }
  }
}

// The kick that the driven lines give the point (row, column), in coordinate k.
template <class S>
double FilteredSheet<S>::followed(Index row, Index column, int k) const {
  double sum = 0;
  for (std::size_t p = 0; p < along_columns_->held.size(); ++p)
    sum += along_columns_->extension[p][row] * double(jump_(along_columns_->held[p] * columns_ + column, k));
  for (std::size_t q = 0; q < along_rows_->held.size(); ++q)
    sum += along_rows_->extension[q][column] * double(column_jump_[q](row, k));
  return sum;
}

template <class S>
void FilteredSheet<S>::solve_specials(double kick) {
  for (std::size_t i = 0; i < specials_.size(); ++i) {
    const Special& special = specials_[i];
    const S* sums = special_sums_.data() + special.row_number * std::size_t(3 * stride_);
    const Values<double>& response = row_response_[special.column_number];
    for (int k = 0; k < 3; ++k) {
      double right = 0;
      for (Index c = 0; c < columns_; ++c) right -= response[c] * double(sums[k * stride_ + c]);
      if (jumps_) {
        if (special.held) right += double(jump_(special.point, k)) / kick;
        right -= followed(special.row, special.column, k) / kick;
      }
      special_kick_(Index(i), k) = right;
    }
  }
  special_kick_ = special_matrix_.solve(special_kick_).eval();
}

// What follows the driven lines.
template <class S>
void FilteredSheet<S>::follow_pins(Index row, double kick) {
  for (std::size_t p = 0; p < along_columns_->held.size(); ++p) {
    SheetSum<S> sum{int(columns_),
                    points_.size(),
                    plane_,
                    row_of(row),
                    jump_.data() + along_columns_->held[p] * columns_,
                    S(along_columns_->extension[p][row] / kick)};
    sheet_sum(sum);
  }
  for (std::size_t q = 0; q < along_rows_->held.size(); ++q)
    for (int k = 0; k < 3; ++k) {
      const double jump = double(column_jump_[q](row, k)) / kick;
      for (Index c = 0; c < columns_; ++c) row_of(row)[k * plane_ + c] += S(jump * along_rows_->extension[q][c]);
    }
}

template <class S>
void FilteredSheet<S>::move_row(Index row, S kick, S drift) {
  const Index first = row * columns_;
  SheetMove<S> move{};
  move.columns = int(columns_), move.kick = kick, move.h = drift;
  for (int k = 0; k < 3; ++k) {
    move.x[k] = &points_.position(first, k), move.v[k] = &points_.velocity(first, k);
    if (needs_velocity()) move.predicted[k] = &predicted_(first, k);
    move.z[k] = row_of(row) + k * plane_;
  }
  sheet_move(move);
}

// The second half of the solves down the columns, the solves along rows, and the move, in blocks of rows
// from the last to the first.
template <class S>
void FilteredSheet<S>::back(double kick, double drift) {
  const bool solve = filtered_ || !even_ || !specials_.empty();
  if (!specials_.empty()) solve_specials(kick);
  std::fill_n(wait_.data(), 6 * stride_, S(0));
  for (Index first = padded_rows_ - kLanes<S>; first >= 0; first -= kLanes<S>) {
    const Index end = std::min(first + kLanes<S>, rows_);
    if (solve) {
      SheetBack<S> block{};
      block.columns = int(stride_);
      block.plane = plane_, block.stride = stride_;
      block.z = row_of(first);
      block.wait = wait_.data(), block.scratch = block_.data();
      block.pivot = &column_line_.inverse_pivot[first];
      block.next = &column_line_.above[first], block.next2 = &column_line_.above2[first];
      block.below = row_line_.below.data(), block.below2 = row_line_.below2.data();
      block.above = row_line_.above.data(), block.above2 = row_line_.above2.data();
      block.inverse_pivot = row_line_.inverse_pivot.data();
      const auto add_specials = [&](bool on) {
        for (std::size_t i = 0; i < specials_.size(); ++i)
          for (Index r = first; r < end; ++r)
            for (int k = 0; k < 3; ++k) {
              S& place = add_.data()[(k * kLanes<S> + r - first) * stride_ + specials_[i].column];
              place = on ? place + S(column_response_[specials_[i].row_number][r] * special_kick_(Index(i), k)) : S(0);
            }
      };
      if (!specials_.empty()) block.add = add_.data();
      add_specials(true);
      sheet_back(block);
      add_specials(false);
    }
    for (Index r = first; r < end; ++r) {
      if (jumps_) follow_pins(r, kick);
      move_row(r, S(kick), S(drift));
    }
  }
}

// Held points are exactly where they belong.
template <class S>
void FilteredSheet<S>::finish_pins() {
  if (this->prescribes()) {
    if (jumps_)
      for (const Index pin : pins_) {
        points_.position.row(pin) = place_x_.row(pin);
        pin_velocity_.row(pin) = place_v_.row(pin);
      }
    for (const Index pin : pins_) points_.velocity.row(pin) = pin_velocity_.row(pin);
    return;
  }
  for (std::size_t i = 0; i < specials_.size(); ++i) {
    if (!specials_[i].held) continue;
    points_.position.row(specials_[i].point) = special_place_.row(Index(i));
    points_.velocity.row(specials_[i].point) = S(0);
  }
}

template <class S>
SolveResult FilteredSheet<S>::substep(double t, double h) {
  if (t == tick_.start) substep_ = 0;
  const bool first = substep_ == 0, last = ++substep_ == this->substeps();
  prepare(h, this->settings().collides && !tick_.colliders.empty());
  if (first && needs_velocity()) predicted_ = points_.velocity;

  meet_pins(t, h);
  const double kick = first ? 0.5 : 1;
  const bool extra = this->other_forces() || this->collides();
  if (first && known_ && !extra && known_gravity_ == tick_.gravity && !(jumps_ && !specials_.empty())) {
    for (Index r = 0; r < rows_; ++r) {
      if (jumps_) follow_pins(r, kick);
      move_row(r, S(kick), S(h));
    }
  } else {
    gather_extra(t, h);
    forward(h);
    back(kick, h);
  }
  finish_pins();
  known_ = false;
  if (!last) return {};

  // x and v belong to the same time at ticks.
  jumps_ = false;
  gather_extra(t + h, h);
  forward(h);
  back(0.5, 0);
  finish_pins();
  known_ = !extra_on_;
  known_gravity_ = tick_.gravity;
  return {};
}

template <class S>
FilteredFacts FilteredSheet<S>::facts() const {
  FilteredFacts out;
  out.step = h_ > 0 ? h_ : plan_.step;
  out.wave_speed = std::max(plan_.speed_x, plan_.speed_y);
  out.travel = plan_.travel(out.step);
  out.stiffness_scale = plan_.stiffness_scale;
  out.expected_error = plan_.expected_error(out.step);
  out.filtered = filtered_;
  return out;
}

template <class S>
double FilteredSheet<S>::kept_energy(const Vec3& gravity) const {
  const Energy plain = this->energy(gravity);
  if (!along_rows_) return plain.total();
  double kinetic = 0;
  for (int k = 0; k < 3; ++k) {
    // Row by row, then column by column.
    Eigen::ArrayXXd v(rows_, columns_), product(rows_, columns_);
    for (Index r = 0; r < rows_; ++r)
      for (Index c = 0; c < columns_; ++c) {
        const Index i = r * columns_ + c;
        v(r, c) = points_.inverse_mass[i] == 0 ? 0 : double(points_.velocity(i, k));
      }
    for (Index r = 0; r < rows_; ++r) product.row(r) = along_rows_->matrix.times(v.row(r).transpose()).transpose();
    for (Index c = 0; c < columns_; ++c) product.col(c) = along_columns_->matrix.times(product.col(c)).eval();
    kinetic += 0.5 * plan_.mass_model.unit * (v * product).sum();
    for (const Special& special : specials_) {
      const double speed = v(special.row, special.column);
      kinetic += 0.5 * plan_.mass_model.unit * special.extra * speed * speed;
    }
  }
  return plain.total() - plain.kinetic + kinetic;
}

template <class S>
double FilteredSheet<S>::stable_step(const Method& method) const {
  if (&method == &filtered_leapfrog()) return std::numeric_limits<double>::infinity();
  const auto rates = field_.rate_bounds(points_.position, points_.velocity, points_.inverse_mass);
  return largest_stable_step(method, std::sqrt(rates.omega_squared), rates.gamma);
}

template <class S>
MotionFacts FilteredSheet<S>::motion_facts() const {
  MotionFacts out = Base::motion_facts();
  out.velocity_forces = needs_velocity();
  if (plan_.automatic) out.wanted_dt = 0;
  out.evaluations = evaluations_;
  return out;
}

template <class S>
void FilteredSheet<S>::still_acceleration(const Points<S>& x, const Points<S>& still, double t, Points<S>& a) {
  Base::acceleration(x, still, t, a);
  Points<S> force = Points<S>::Zero(x.rows(), 3);
  field_.add_force(x, still, t, force);
  a += force.colwise() * points_.inverse_mass;
}

template <class S>
Energy FilteredSheet<S>::energy(const Vec3& gravity) const {
  Energy energy = Base::energy(gravity);
  energy.elastic += field_.potential_energy(points_.position);
  return energy;
}

template <class S>
void FilteredSheet<S>::set_position(Index point, const Vec3& position) {
  Base::set_position(point, position);
  known_ = false;
}

template <class S>
void FilteredSheet<S>::set_velocity(Index point, const Vec3& velocity) {
  Base::set_velocity(point, velocity);
  known_ = false;
}

template <class S>
void FilteredSheet<S>::pin(Index point) {
  Base::pin(point);
  stale_ = true;
}

template <class S>
void FilteredSheet<S>::release(Index point) {
  Base::release(point);
  stale_ = true;
}

template <class S>
void FilteredSheet<S>::drive_pins(std::vector<Index> points, PinMotion motion) {
  Base::drive_pins(std::move(points), std::move(motion));
  stale_ = true;
}

template <class S>
void FilteredSheet<S>::take_back() {
  Base::take_back();
  known_ = false;
}

template <class S>
void FilteredSheet<S>::describe(Blueprint& out) const {
  Base::describe(out);
  field_.describe(out);
  out.add("stiffness scale", plan_.stiffness_scale);
}

// The filter is made again from what it was made of; whether there is one was decided by a state that is gone.
template <class S>
void FilteredSheet<S>::save(CheckpointWriter& out) const {
  Base::save(out);
  out.begin("filter");
  out.add(stale_);
  out.add(h_);
  out.add(contacts_);
  out.add(filtered_);
  out.add(evaluations_);
  out.add(pin_velocity_.rows() > 0);
  if (pin_velocity_.rows() > 0) out.add(pin_velocity_);
  out.add(known_);
  out.add(known_gravity_);
  if (known_) out.add(std::span<const S>(z_.data(), std::size_t(3 * plane_)));
  out.end();
}

template <class S>
void FilteredSheet<S>::load(CheckpointReader& in) {
  Base::load(in);
  in.begin("filter");
  stale_ = in.number<bool>("pins have changed");
  h_ = in.number<double>("step", 0);
  contacts_ = in.number<bool>("contacts");
  filtered_ = in.number<bool>("filtered");
  evaluations_ = in.number<std::int64_t>("evaluations", 0);
  in.require(stale_ || h_ > 0, "step", "must be positive");
  if (!stale_) {
    find_held();
    factor();
  }
  pin_velocity_.resize(0, 3);
  if (in.number<bool>("pins have moved")) in.array("pin velocity", pin_velocity_, points_.size());
  known_ = in.number<bool>("known");
  in.array("known gravity", known_gravity_, 3);
  if (known_) in.fill("kicks", std::span(z_.data(), std::size_t(3 * plane_)));
  in.end();
}

template class FilteredSheet<float>;
template class FilteredSheet<double>;

}  // namespace hooke::softbody
