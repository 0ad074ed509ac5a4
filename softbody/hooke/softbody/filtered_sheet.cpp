#include <hooke/softbody/filtered_sheet.hpp>

#include <hooke/softbody/filtered_kernels.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
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
      plane_((padded_rows_ + 3) * stride_) {
  damped_ = field_.uses_velocity();
  even_ = (plan_.mass_model.row == 1).all() && (plan_.mass_model.column == 1).all();
  lay_out_springs();
  z_.assign(std::size_t(3 * plane_), S(0));
  scratch_.assign(std::size_t(3 * (columns_ + 2)), S(0));
  last_row_.assign(std::size_t(6 * (columns_ + 2)), S(0));
  mass_row_.assign(std::size_t(columns_), S(0));
  block_.assign(std::size_t(3 * kLanes<S> * stride_), S(0));
}

// Rows of parameters that are the same are kept once: in a sheet of one material that is nearly all.
template <class S>
void FilteredSheet<S>::lay_out_springs() {
  std::map<std::vector<S>, std::size_t> known;
  const Points<S>& x = points_.position;
  std::vector<S> row(std::size_t(4 * stride_));
  for (int d = 0; d < kDirections; ++d) {
    const Index rows_below = d == kDown2 ? 2 : d == kRight || d == kRight2 ? 0 : 1;
    for (Index r = 0; r + rows_below < rows_; ++r) {
      S *k = row.data(), *rest = k + stride_, *rest2 = rest + stride_, *damping = rest2 + stride_;
      for (Index c = 0; c < stride_; ++c) {
        k[c] = damping[c] = 0, rest[c] = rest2[c] = 1;
        const int i = c < columns_ ? plan_.grid.springs[std::size_t(d)][std::size_t(r * columns_ + c)] : -1;
        if (i < 0) continue;
        const Spring& spring = plan_.network->springs[std::size_t(i)];
        k[c] = S(spring.stiffness), damping[c] = S(spring.damping);
        if (spring.rest_length == Spring::kFromStart) {
          // The same operations in the same order as the kernel's.
          const S dx = x(spring.b, 0) - x(spring.a, 0), dy = x(spring.b, 1) - x(spring.a, 1),
                  dz = x(spring.b, 2) - x(spring.a, 2);
          rest2[c] = dx * dx + dy * dy + dz * dz;
          rest[c] = std::sqrt(rest2[c]);
        } else {
          rest[c] = S(spring.rest_length);
          rest2[c] = rest[c] * rest[c];
        }
      }
      const auto [entry, is_new] = known.try_emplace(row, parameters_.size());
      if (is_new) parameters_.insert(parameters_.end(), row.begin(), row.end());
      first_[std::size_t(d)].push_back(entry->second);
    }
  }
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
  if (this->prescribes()) {
    const Index n = points_.size();
    const bool first = place_x_.rows() != n;
    place_x_.resize(n, 3), place_v_.resize(n, 3), jump_.resize(n, 3);
    if (first) pin_velocity_ = points_.velocity;
  }
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
  double a_x = 0, a_y = 0;
  if (filtered_) {
    const auto stiffness = plan_.line_stiffness(h);
    const double share = (contacts ? kShareWithContacts : kShare) * h * h / 4;
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

// The springs that start in a row.
template <class S>
void FilteredSheet<S>::pull_row(Index row) {
  SheetRow<S> block;
  block.columns = int(columns_), block.rows_below = int(std::min<Index>(2, rows_ - 1 - row));
  block.stride = stride_;
  block.scratch = scratch_.data();
  for (Index j = 0; j <= block.rows_below; ++j)
    for (Index k = 0; k < 3; ++k) {
      const bool last = row + j == rows_ - 1;
      block.x[j][k] =
          last ? last_row_.data() + k * (columns_ + 2) : points_.position.col(k).data() + (row + j) * columns_;
      block.v[j][k] = !damped_ ? nullptr
                      : last   ? last_row_.data() + (3 + k) * (columns_ + 2)
                               : predicted_.col(k).data() + (row + j) * columns_;
      block.f[j][k] = row_of(row + j) + k * plane_;
    }
  for (std::size_t d = 0; d < kDirections; ++d)
    block.spring[d] = std::size_t(row) < first_[d].size() ? parameters_.data() + first_[d][std::size_t(row)] : nullptr;
  sheet_springs(block);
}

// From the forces on a row to h (f / m + g), in units of mass.
template <class S>
void FilteredSheet<S>::right_side(Index row, double h) {
  const MassModel& masses = plan_.mass_model;
  S* z = row_of(row);
  if (row == 0 || masses.row[row] != masses.row[row - 1])
    for (Index c = 0; c < columns_; ++c) mass_row_[std::size_t(c)] = S(h * masses.row[row] * masses.column[c]);
  for (const Special& special : specials_) {
    if (special.row != row || special.held) continue;
    for (int k = 0; k < 3; ++k) {
      const double g = extra_on_ ? double(extra_(special.point, k)) : tick_.gravity[k];
      z[k * plane_ + special.column] += S(masses.unit * special.extra * g);
    }
  }
  SheetRight<S> right;
  right.columns = int(columns_);
  right.scale = S(h / masses.unit);
  right.mass = mass_row_.data();
  for (int k = 0; k < 3; ++k) {
    right.f[k] = z + k * plane_;
    right.gravity[k] = S(tick_.gravity[k]);
    right.extra[k] = extra_on_ ? extra_.col(k).data() + row * columns_ : nullptr;
  }
  sheet_right(right);
  for (int k = 0; k < 3; ++k) {
    if (held_row_[std::size_t(row)]) std::fill_n(z + k * plane_, columns_, S(0));
    for (const Index c : along_rows_->held) z[k * plane_ + c] = 0;
  }
}

// Forces row by row and, behind them, the first half of the solves down the columns.
template <class S>
void FilteredSheet<S>::forward(double h) {
  ++evaluations_;
  const Index last = (rows_ - 1) * columns_;
  for (int k = 0; k < 3; ++k) {
    std::copy_n(points_.position.col(k).data() + last, columns_, last_row_.data() + k * (columns_ + 2));
    if (damped_) std::copy_n(predicted_.col(k).data() + last, columns_, last_row_.data() + (3 + k) * (columns_ + 2));
    std::fill_n(z_.data() + k * plane_, 2 * stride_, S(0));
  }
  std::fill(special_sums_.begin(), special_sums_.end(), S(0));
  const S* zeros = row_of(padded_rows_);
  for (Index r = 0; r < rows_; ++r) {
    pull_row(r);
    right_side(r, h);
    for (std::size_t i = 0; i < special_rows_.size(); ++i) {
      SheetSum<S> sum{int(columns_), plane_,
                      stride_,       special_sums_.data() + i * std::size_t(3 * stride_),
                      row_of(r),     S(column_response_[i][r])};
      sheet_sum(sum);
    }
    if (!filtered_ && even_ && specials_.empty()) continue;
    SheetSweep<S> sweep{int(columns_),
                        plane_,
                        row_of(r),
                        r > 0 ? row_of(r - 1) : zeros,
                        r > 1 ? row_of(r - 2) : zeros,
                        S(1),
                        column_line_.below[r],
                        column_line_.below2[r]};
    sheet_sweep(sweep);
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
  for (int k = 0; k < 3; ++k) {
    const Index first = row * columns_;
    SheetMove<S> move{int(columns_),
                      points_.position.col(k).data() + first,
                      points_.velocity.col(k).data() + first,
                      needs_velocity() ? predicted_.col(k).data() + first : nullptr,
                      row_of(row) + k * plane_,
                      kick,
                      drift};
    sheet_move(move);
  }
}

// The second half of the solves down the columns, the solves along rows, and the move, in blocks of rows
// from the last to the first.
template <class S>
void FilteredSheet<S>::back(double kick, double drift) {
  const bool solve = filtered_ || !even_ || !specials_.empty();
  S *zeros = row_of(padded_rows_), *wait = row_of(padded_rows_ + 1), *wait2 = row_of(padded_rows_ + 2);
  if (!specials_.empty()) solve_specials(kick);
  for (Index first = padded_rows_ - kLanes<S>; first >= 0; first -= kLanes<S>) {
    const Index end = std::min(first + kLanes<S>, rows_);
    const bool lowest = first + kLanes<S> >= rows_;
    for (Index r = end; solve && r-- > first;) {
      const auto under = [&](Index row) {
        return row < first + kLanes<S> ? row_of(row) : lowest ? zeros : row == first + kLanes<S> ? wait : wait2;
      };
      SheetSweep<S> sweep{int(columns_),
                          plane_,
                          row_of(r),
                          under(r + 1),
                          under(r + 2),
                          column_line_.inverse_pivot[r],
                          column_line_.above[r],
                          column_line_.above2[r]};
      sheet_sweep(sweep);
    }
    if (solve) {
      for (int k = 0; k < 3; ++k) {
        std::copy_n(row_of(first) + k * plane_, columns_, wait + k * plane_);
        std::copy_n(row_of(first + 1) + k * plane_, columns_, wait2 + k * plane_);
      }
      for (Index r = first; r < end; ++r)
        for (std::size_t i = 0; i < specials_.size(); ++i) {
          const Special& special = specials_[i];
          const double weight = column_response_[special.row_number][r];
          for (int k = 0; k < 3; ++k) row_of(r)[k * plane_ + special.column] += S(weight * special_kick_(Index(i), k));
        }
      SheetRowSolve<S> rows{int(stride_),
                            plane_,
                            stride_,
                            row_of(first),
                            row_line_.below.data(),
                            row_line_.below2.data(),
                            row_line_.above.data(),
                            row_line_.above2.data(),
                            row_line_.inverse_pivot.data(),
                            block_.data()};
      sheet_row_solve(rows);
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

template class FilteredSheet<float>;
template class FilteredSheet<double>;

}  // namespace hooke::softbody
