#include <hooke/softbody/choose_solver.hpp>

#include <hooke/error.hpp>
#include <hooke/softbody/filtered_grid.hpp>
#include <hooke/world.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <stdexcept>

namespace hooke::softbody {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Steps are kept at this share of the largest stable one.
constexpr double kStepSafety = 0.9;
// Predicted errors times this must be below the wanted one: by order 2, where the motion is calm and smooth, calm and
// rough; by higher orders; and by methods that damp.
constexpr double kSafety = 2, kCalmSafety = 1.3, kRoughSafety = 1.4, kHighSafety = 1.5, kCoarseSafety = 3;
// Rounding in float moves points by this share of the size times √steps (measured on sheets, chains and boxes).
constexpr double kFloatFloor = 1.2e-8;
// So many times that in a chain, which has no neighbours that even out its rounding; where dampers take it away; and
// where float is stepped in double, so that little but the rounding of the start remains.
constexpr double kChainFloor = 10, kDampedFloor = 0.4, kFineFloor = 0.5;
// Velocity Verlet at its limit is compared with so many times as many steps. The difference tells its error at order 2.
constexpr double kPairSteps = 1.5;
// Motion is rough where that difference is more than this share of it: part of it lies in modes that the limit's step
// does not resolve. Then both runs are as wrong as each other, and the error is so many times the difference.
constexpr double kRough = 0.03, kRoughPair = 1.25;
// Motion is calm where it has turned, that is, its second half takes the points not much farther than the first one,
// and where it is a small share of the size.
constexpr double kCalmMore = 1.5, kCalmMost = 0.1;
// Where the limit's step is not enough the growth of its error is followed over the first share of the run at least,
// and errors of higher orders are judged over the second.
constexpr double kPairShare = 1.0 / 8, kJudgedShare = 1.0 / 16;
// The judge may find so many times the error that the pair tells: at order 0.5.
constexpr double kMostJudged = 3;
// At the limit order 4 errs so much less than order 2, whatever the motion is, and where it is smooth.
constexpr double kHighBetter = 16, kHighBetterSmooth = 100;
// Orders that show at least where motion is rough, of the methods of order 4 and 6, and that of RK4 with dampers.
constexpr double kRoughHigh = 2.2, kRoughHighest = 2.5, kDampedHigh = 3.7, kDampedRoughHigh = 3;
// What rounding alone may take must be so much less than the wanted error.
constexpr double kRoom = 1.3;
// Errors grow as a power of time; measured ones beyond these bounds are not believed, and may be wrong by the last
// figure. Phases drift as time goes, so errors of a motion that has turned grow not much faster than that, and those of
// one that still grows by so much more than its displacement does.
constexpr double kLeastGrowth = 0.5, kMostGrowth = 2.5, kDoubt = 0.5, kCalmDoubt = 0.2;
constexpr double kLeastSmooth = 0.6, kDriftGrowth = 1.1;
// Modes that are not resolved have lost their phases already.
constexpr double kLeastRough = 0.25, kMostRough = 0.6;
// Rounding is seen to begin slower than it goes on.
constexpr double kLeastRounding = 0.75;
// What dampers take from errors goes as this power at the most.
constexpr double kMostFading = 1;
// Errors of higher orders sit in the fastest modes: in motion without dampers they grow at least so.
constexpr double kHighGrowth = 1;
// Filtered leapfrog is for errors from this share of the size on; its trials may cost so much of velocity Verlet's run.
constexpr double kFilteredFrom = 3e-4, kFilteredBudget = 0.35, kQuietBudget = 0.08;
// Methods that are stable at any step are for errors from this share of the size on, and for at most this share of
// velocity Verlet's cost.
constexpr double kCoarseFrom = 1e-4, kCoarseBudget = 0.5;
// They are judged up to this share of the run, and this many kept states at the least.
constexpr double kCoarseShare = 1.0 / 8;
constexpr Index kCoarseTicks = 4;
// What their damping takes from a motion adds up at least as a fall does.
constexpr double kCoarseGrowth = 2;
// Dampers limit velocity Verlet's step where semi-implicit Euler's is longer by this: from 1 to 2.
constexpr double kMostlyDamped = 1.3;
// One step a tick of theirs so many times cheaper than velocity Verlet is tried before anything else.
constexpr double kCoarseEarly = 16;
// A body is near rest where its motion is foretold to stay below this share of the wanted error.
constexpr double kNearRest = 0.5;
// Seen in one kept state that motion is taken to grow as this power of time, and must stay below this share; in two it
// grows as the power that they show and this doubt.
constexpr double kRestGrowth = 0.75, kAtRest = 0.1, kRestDoubt = 0.25;
// XPBD's swing there has mostly turned after so many steps. It is known to the first factor where steps are at most so
// many times shorter than those it was seen with.
constexpr double kSwingSteps = 48, kSwingSafety = 1.25, kSwingFiner = 8;
// The run may cost this share of velocity Verlet's, and the trials that one.
constexpr double kSwingBudget = 0.5, kSwingTrial = 0.4;
// A step of backward Euler costs as much as so many evaluations of the forces at the least.
constexpr double kLeastEvaluations = 10;
// Of the rejected ones so many are told in words, those first that cost the least more.
constexpr std::size_t kRejectedTold = 3;
// Trials keep at most so many states.
constexpr Index kMostStates = 64;

template <class... Values>
std::string format(const char* pattern, Values... values) {
  char text[500];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

const char* word_of(Precision precision) { return precision == Precision::Float ? "float" : "double"; }

double rms(const Points<double>& a, const Points<double>& b) {
  return std::sqrt((a - b).square().rowwise().sum().mean());
}

double size_of(const Points<double>& x) {
  return x.rows() ? std::sqrt((x.colwise().maxCoeff() - x.colwise().minCoeff()).square().sum()) : 0;
}

bool is_implicit(const Method& method) { return &method != &xpbd() && std::holds_alternative<Implicit>(method.scheme); }

void check(const SoftBodySettings& settings, const RunSetting& run) {
  const auto positive = [&](double value, const char* what) {
    if (!(value > 0) || !std::isfinite(value))
      throw std::invalid_argument("body \"" + settings.name + "\": " + what + " must be positive, got " +
                                  format("%g", value));
  };
  positive(run.duration, "duration");
  positive(run.tick_rate, "tick rate");
}

Index ticks_of(const RunSetting& run) {
  return std::max<Index>(1, Index(std::floor(run.duration * run.tick_rate + 1e-6)));
}

// One run of the body, tick by tick, its states kept now and then.
class Trial {
 public:
  Trial(const SoftBodySettings& settings, const RunSetting& run, Index stride)
      : world_(run.tick_rate), stride_(stride) {
    world_.set_gravity(run.gravity);
    world_.set_damping(run.damping);
    for (const Collider& collider : run.colliders) world_.add_collider(collider);
    body_ = &world_.add(make_soft_body(settings));
    if (run.prepare) run.prepare(*body_);
    start_ = body_->positions();
  }

  /// Goes on to this tick, or to the one that fails.
  void reach(Index tick) {
    const double length = world_.clock().tick();
    while (good_ && done_ < tick) {
      good_ = world_.update(length).good();
      if (good_ && ++done_ % stride_ == 0) {
        states_.push_back(body_->positions());
        speeds_.push_back(std::sqrt(body_->velocities().square().rowwise().sum().mean()));
      }
    }
  }
  Index done() const { return done_; }
  const std::vector<Points<double>>& states() const { return states_; }
  Points<double> positions() const { return body_->positions(); }
  /// RMS way of the points from their places at the start to those in kept state i, from 1 on [m].
  double moved(Index i) const { return rms(states_[std::size_t(i - 1)], start_); }
  const std::vector<double>& speeds() const { return speeds_; }  // RMS over points, beside the states [m/s]
  MotionFacts facts() const { return body_->motion_facts(); }

 private:
  World world_;
  Body* body_ = nullptr;
  Index stride_, done_ = 0;
  bool good_ = true;
  Points<double> start_{0, 3};
  std::vector<Points<double>> states_;
  std::vector<double> speeds_;
};

// The most that two runs differ after tick `from` and up to another; infinite where one of them failed.
double difference(const Trial& a, const Trial& b, Index tick, Index stride, Index from = 0) {
  double most = 0;
  for (std::size_t i = std::size_t(from / stride); i < std::size_t(tick / stride); ++i) {
    if (i >= a.states().size() || i >= b.states().size()) return kInfinity;
    const double now = rms(a.states()[i], b.states()[i]);
    if (!std::isfinite(now)) return kInfinity;
    most = std::max(most, now);
  }
  return most;
}

// An error that was seen up to a share of the run.
struct Seen {
  double error, share;
};

// The powers of time that an error may grow with.
struct Growth {
  double least, most = kMostGrowth, doubt = kDoubt;
};

// What an error that was seen becomes at the end of the run.
struct Forecast {
  double low = 0, likely = 0, high = 0;

  Forecast(Seen before, Seen now, Growth growth) {
    const bool shows = before.error > 0 && std::isfinite(now.error) && before.share < now.share;
    const double slope = shows ? std::log(now.error / before.error) / std::log(now.share / before.share) : 1;
    const double power = std::clamp(slope, growth.least, growth.most);
    likely = now.error * std::pow(1 / now.share, power);
    low = now.error * std::pow(1 / now.share, std::max(growth.least, power - growth.doubt));
    high = likely * std::pow(1 / now.share, growth.doubt);
  }
};

class Chooser {
 public:
  Chooser(const SoftBodySettings& settings, const RunSetting& run, double wanted_error)
      : settings_(settings), run_(run), ticks_(ticks_of(run)), cost_(settings) {
    settings_.motion.dt = 0;
    settings_.wanted_error = 0;
    settings_.motion.method = &velocity_verlet();
    settings_.precision = Precision::Double;
    tick_ = 1 / run.tick_rate;
    stride_ = (ticks_ + kMostStates - 1) / kMostStates;
    choice_.size = size_of(settings.positions);
    choice_.wanted_error = wanted_ = wanted_error * choice_.size;
    const auto body = make_soft_body(settings_);
    if (run.prepare) run.prepare(*body);
    for (const Method* method : {&velocity_verlet(), &semi_implicit_euler(), &pefrl(), &blanes_moan_6(), &rk4()})
      limits_.push_back({method, body->stable_step(*method)});
    // What the first part of a fall and the energy in its springs make of it.
    const double start = settings.velocities.rows() ? settings.velocities.square().sum() / double(body->size()) : 0;
    const double fall = run.gravity.norm() * run.duration / 8, mass = settings.masses.sum();
    speed_ = std::sqrt(start + fall * fall + (mass > 0 ? body->energy(run.gravity).elastic / mass : 0));
    high_ = body->motion_facts().velocity_forces ? &rk4() : &pefrl();
    highest_ = high_ == &pefrl() ? &blanes_moan_6() : nullptr;
  }

  SolverChoice run() {
    if (settings_.positions.rows() == 0 || !(choice_.size > 0)) return trivial("a body without size needs no choice");
    if (!std::isfinite(limit(velocity_verlet()))) return trivial("nothing limits the step");
    base_ = candidate(velocity_verlet(), Precision::Float, 1);
    const double twice = candidate(velocity_verlet(), Precision::Double, 1).seconds;
    steps_in_double_ = twice <= base_.seconds;
    base_.seconds = std::min(base_.seconds, twice);
    if (!filtered_leapfrog_does()) look_at_velocity_verlet();
    return finish();
  }

 private:
  struct Limit {
    const Method* method;
    double step;
  };

  double limit(const Method& method) const {
    for (const Limit& known : limits_)
      if (known.method == &method) return known.step;
    return 0;
  }

  // `finer` times as many steps as the limit asks for.
  Index substeps(const Method& method, double finer) const {
    const double least = std::isfinite(limit(method)) ? std::ceil(tick_ / (kStepSafety * limit(method)) - 1e-9) : 1;
    return std::max<Index>(1, Index(std::ceil(finer * std::max(1.0, least) - 1e-9)));
  }

  Candidate candidate(const Method& method, Precision precision, double finer) const {
    return with_steps(method, precision, substeps(method, finer));
  }

  Candidate with_steps(const Method& method, Precision precision, Index steps) const {
    Candidate out;
    out.method = &method;
    out.precision = precision;
    out.substeps = steps;
    out.evaluations = evaluations_of(method, double(ticks_), double(steps));
    out.seconds = cost_.seconds(method, precision, out.evaluations, in_double(out));
    return out;
  }

  // Whether float would be stepped in double.
  bool in_double(const Candidate& c) const {
    return rounding_shows(settings_, tick_ / double(c.substeps), speed_, run_.gravity.norm(), limit(*c.method));
  }

  // Its rounding alone, at the end of the run.
  double floor_of(const Candidate& c) const {
    const double stages = c.method == &velocity_verlet() ? 1 : 2;
    const double share = c.precision == Precision::Float ? kFloatFloor : kFloatFloor * 2e-9;
    const double springs = settings_.network ? double(settings_.network->springs.size()) : 0;
    const bool chain = springs < 1.5 * double(settings_.positions.rows());
    const bool fused = std::holds_alternative<Splitting>(c.method->scheme) && run_.colliders.empty() && !run_.prepare;
    const double times = !highest_ ? kDampedFloor : fused && in_double(c) ? kFineFloor : chain ? kChainFloor : 1;
    return times * share * choice_.size * std::sqrt(stages * double(ticks_) * double(c.substeps));
  }

  std::unique_ptr<Trial> trial(const Candidate& c) const {
    SoftBodySettings s = settings_;
    s.motion.method = c.method;
    s.precision = c.precision;
    s.motion.dt = tick_ / double(c.substeps);
    return std::make_unique<Trial>(s, run_, stride_);
  }

  // Runs a trial on to a tick and counts what that costs.
  void reach(Trial& t, const Candidate& c, Index tick) {
    const double before = double(t.done());
    t.reach(tick);
    const double share = (double(t.done()) - before) / double(ticks_);
    choice_.pilot_evaluations += share * c.evaluations;
    choice_.pilot_seconds += share * c.seconds;
  }

  // The first tick with a kept state at or after this share of the run.
  Index tick_of(double share) const {
    const Index tick = Index(std::ceil(share * double(ticks_)));
    return std::clamp<Index>((tick + stride_ - 1) / stride_ * stride_, stride_, ticks_ / stride_ * stride_);
  }
  double shown(double share) const { return double(tick_of(share)) / double(ticks_); }

  void consider(Candidate c, double error) {
    c.predicted_error = error;
    considered_.push_back(c);
  }

  // Filtered leapfrog over the whole run from coarse steps on: its trials are cheap beside velocity Verlet.
  bool filtered_leapfrog_does() {
    // For small errors only sheets that hardly move are worth a look.
    const bool quiet = wanted_ < kFilteredFrom * choice_.size;
    const Method& method = filtered_leapfrog();
    const double budget = (quiet ? kQuietBudget : kFilteredBudget) * base_.seconds;
    std::unique_ptr<Trial> before;
    Index steps = 1;
    double change_before = kInfinity, travel = 0;
    try {
      SoftBodySettings s = settings_;
      s.motion.method = &method;
      s.precision = Precision::Float;
      s.motion.dt = tick_;
      const auto facts = filtered_facts(*make_soft_body(s));
      if (!facts || !(facts->travel > 0)) return false;
      // Begin where the rule for sheets tells 16 times the wanted error, or at a fiftieth of velocity Verlet's cost.
      const double most = std::min(0.5, std::pow(16 * wanted_ / (0.11 * choice_.size), 1 / 1.33));
      const double cheap = (quiet ? 0.005 : 0.02) * base_.seconds / with_steps(method, Precision::Float, 1).seconds;
      steps = Index(std::max(1.0, std::min(std::ceil(facts->travel / most), std::floor(cheap))));
      travel = facts->travel;
      for (int level = 0; level < 12; ++level, steps *= 2) {
        const Candidate c = with_steps(method, Precision::Float, steps);
        if (choice_.pilot_seconds + c.seconds > budget) return false;
        auto now = trial(c);
        reach(*now, c, ticks_);
        if (before) {
          const bool both = now->done() == ticks_ && before->done() == ticks_;
          const double change = both ? rms(now->positions(), before->positions()) : kInfinity;
          // Too large steps freeze: two frozen runs agree as well, three that come closer do not.
          const bool settling = std::isfinite(change_before) && change_before > 1.5 * change;
          const double order = settling ? std::clamp(std::log2(change_before / change), 0.7, 1.8) : 1.0;
          const double crossed = travel / double(steps);
          const bool quiet_enough = change + change_before < 0.02 * wanted_ && crossed < FilteredFacts::kFreeze;
          const bool believed = settling || crossed < 0.25 || quiet_enough;
          const double error = change / (std::pow(2.0, order) - 1);
          change_before = change;
          const double finer = std::pow(kSafety * error / wanted_, 1 / order);
          if (believed && std::isfinite(error) && finer <= 4) {
            Candidate best =
                with_steps(method, Precision::Float, Index(std::ceil(double(steps) * std::max(0.5, finer))));
            if (best.seconds > 0.8 * base_.seconds) return false;
            consider(best, error * std::pow(double(steps) / double(best.substeps), order));
            choice_.reason =
                format("over the whole run filtered leapfrog changes by %.1e m from %ld to %ld steps a tick", change,
                       long(steps / 2), long(steps));
            return true;
          }
        }
        before = std::move(now);
      }
    } catch (const std::exception&) {
      // It does not take this body.
    }
    return false;
  }

  // The pair of trials of velocity Verlet, at the limit and below it, on to a share of the run.
  void extend_pair(double share) {
    share_ = share;
    for (int i : {0, 1})
      if (pair_[i]->done() < tick_of(share)) reach(*pair_[i], pair_candidate_[i], tick_of(share));
    look_at_motion();
    // Speeds grow at most as in a fall.
    const std::vector<double>& speeds = pair_[1]->speeds();
    const std::size_t n = std::size_t(tick_of(share) / stride_);
    if (speeds.size() < n) return;
    const double now = speeds[n - 1], half = speeds[(n + 1) / 2 - 1];
    const double power = n > 1 && half > 0 ? std::clamp(std::log2(now / half), 0.0, 1.0) : 0.5;
    speed_ = now * std::pow(std::max(1.0, 0.6 / shown(share)), power);
  }

  // What the pair's share tells of the motion.
  void look_at_motion() {
    const Index until = tick_of(share_), states = until / stride_, half = states / 2;
    double first = 0, all = 0;
    for (Index i = 1; i <= std::min(states, Index(pair_[1]->states().size())); ++i) {
      all = std::max(all, pair_[1]->moved(i));
      if (i <= half) first = all;
    }
    motion_growth_ = first > 0 ? std::log(all / first) / std::log(double(states) / double(half)) : kMostGrowth;
    calm_ = all <= kCalmMore * first && all <= kCalmMost * choice_.size;
    rough_ = difference(*pair_[0], *pair_[1], until, stride_) > kRough * all;
    safety_ = !calm_ ? kSafety : rough_ ? kRoughSafety : kCalmSafety;
  }

  // Where dampers take from a calm motion, what has faded counts no more.
  bool fades() const { return !highest_ && calm_; }
  Index since(double share) const {
    return fades() && tick_of(share) > stride_ ? tick_of(share) / 2 / stride_ * stride_ : 0;
  }

  double pair_ratio() const { return double(pair_candidate_[1].substeps) / double(pair_candidate_[0].substeps); }

  // Error at the limit as the pair tells it. Where it is not more than rounding, of which the finer one has more, it is
  // as much as that.
  double pair_error(double share) const {
    const double seen = difference(*pair_[0], *pair_[1], tick_of(share), stride_, since(share));
    const double times = pair_ratio(), of_both = std::sqrt(1 + times);
    const double rounding = of_both * std::sqrt(shown(share)) * floor_of(pair_candidate_[0]);
    if (seen < 3 * rounding) return seen / of_both;
    return rough_ ? kRoughPair * seen : seen / (1 - 1 / (times * times));
  }

  Forecast forecast() const {
    const Seen now{pair_error(share_), shown(share_)};
    Growth growth = rough_ ? Growth{kLeastRough, kMostRough}
                           : Growth{kLeastSmooth, std::min(kMostGrowth, kDriftGrowth + motion_growth_)};
    growth.doubt = calm_ ? kCalmDoubt : kDoubt;
    if (now.error < 3 * std::sqrt(now.share) * floor_of(pair_candidate_[0]))
      growth.least = kLeastRounding, growth.most = std::max(growth.most, kLeastRounding);
    else if (!highest_)
      growth.least = fades() ? -kMostFading : 0;
    return {{pair_error(share_ / 2), shown(share_ / 2)}, now, growth};
  }

  void look_at_velocity_verlet() {
    const Method& method = velocity_verlet();
    // Where rounding rules float out.
    const Precision precision =
        wanted_ >= kRoom * floor_of(base_) && !steps_in_double_ ? Precision::Float : Precision::Double;
    const Candidate base = candidate(method, precision, 1);
    pair_candidate_[0] = base, pair_candidate_[1] = candidate(method, precision, kPairSteps);
    for (int i : {0, 1}) pair_[i] = trial(pair_candidate_[i]);
    const auto enough = [&](double error, const char* how) {
      try_semi_implicit_euler(precision);
      const bool coarse = try_coarse_steps();
      for (const Precision p : {Precision::Float, Precision::Double}) {
        const Candidate c = candidate(method, p, 1);
        const double rounding = floor_of(c);
        consider(c, std::max(error, p == precision ? rounding : kRoom * rounding));
      }
      if (coarse) return;
      choice_.reason =
          format("seen over the first %.3g of the run, velocity Verlet at its stability limit errs by %s %.1e m",
                 shown(share_), how, error);
    };
    if (near_rest_does()) return;
    // Where coarse steps cost a small share of it, they are tried early: the pair would cost more than they do.
    if (kCoarseEarly * with_steps(xpbd(), Precision::Float, 1).seconds < base.seconds &&
        wanted_ >= kCoarseFrom * choice_.size) {
      extend_pair(1.0 / 32);
      if (try_coarse_steps()) return;
    }
    for (const double share : {1.0 / 32, 1.0 / 16, 1.0 / 8, 1.0 / 4}) {
      if (share < 1.0 / 4 && tick_of(share) == tick_of(share / 2)) continue;  // growth would not show
      extend_pair(share);
      const Forecast now = forecast();
      if (safety_ * now.high <= wanted_) return enough(now.high, "less than");
      // Clearly not: what comes is dearer and looked at in its own way.
      if (!(now.low <= 2 * wanted_)) break;
    }
    const Forecast now = forecast();
    if (safety_ * now.likely <= wanted_) return enough(now.likely, "about");
    refine(now);
  }

  // Dampers let semi-implicit Euler take longer steps than velocity Verlet.
  void try_semi_implicit_euler(Precision precision) {
    const Candidate c = candidate(semi_implicit_euler(), precision, 1);
    if (c.seconds > 0.85 * pair_candidate_[0].seconds) return;
    const auto euler = trial(c);
    reach(*euler, c, tick_of(share_));
    const auto seen = [&](double share) { return difference(*euler, *pair_[1], tick_of(share), stride_); };
    const Forecast error({seen(share_ / 2), shown(share_ / 2)}, {seen(share_), shown(share_)},
                         {highest_ ? kLeastGrowth : 0.0});
    if (safety_ * error.high <= wanted_) consider(c, std::max(error.likely, floor_of(c)));
  }

  // Methods that are stable at any step. True where one of them does.
  bool try_coarse_steps() {
    const std::size_t before = considered_.size();
    if (!tried_coarse_)
      for (const Method* method : {&xpbd(), &implicit_euler()}) try_coarse_steps(*method);
    tried_coarse_ = true;
    return considered_.size() > before;
  }

  // From one step a tick on, until the error that velocity Verlet's trial sees at the end of its share gives hope. Then
  // both go on to where damping of what should swing shows.
  void try_coarse_steps(const Method& method) {
    if (wanted_ < kCoarseFrom * choice_.size) return;
    // Where dampers alone limit the step, a few sweeps are as wrong at all coarse steps: their errors do not show.
    if (&method == &xpbd() && limit(semi_implicit_euler()) > kMostlyDamped * limit(velocity_verlet())) return;
    const Index first = tick_of(share_),
                judged = std::max(first, std::min(tick_of(1), std::max(tick_of(kCoarseShare), kCoarseTicks * stride_)));
    const double share = double(judged) / double(ticks_);
    double most = kCoarseBudget * pair_candidate_[0].seconds;
    for (const Candidate& c : considered_)
      if (c.predicted_error <= wanted_) most = std::min(most, c.seconds);
    try {
      double before = kInfinity;
      for (Index steps = 1;; steps *= 2) {
        Candidate c = with_steps(method, Precision::Float, steps);
        if (is_implicit(method)) {
          if (!implicit_cost_) implicit_cost_.emplace(settings_);
          const double all = double(ticks_) * double(steps);
          c.seconds =
              std::max(kLeastEvaluations * c.seconds, implicit_cost_->seconds(c.precision, 2 * all, 2 * all, all));
        }
        if (c.seconds > most) return;
        const auto now = trial(c);
        // First a little: an implicit method's cost is known once it has run.
        if (!reach_coarse(*now, c, stride_, most) || !reach_coarse(*now, c, first, most)) return;
        double seen = difference(*now, *pair_[0], first, stride_);
        double grown = 1 / shown(share_);
        if (kCoarseSafety * seen * grown <= wanted_) {
          if (pair_[0]->done() < judged) reach(*pair_[0], pair_candidate_[0], judged);
          if (!reach_coarse(*now, c, judged, most)) return;
          seen = difference(*now, *pair_[0], judged, stride_);
          const Index half = std::max(stride_, judged / 2 / stride_ * stride_);
          const Seen before_that{difference(*now, *pair_[0], half, stride_), double(half) / double(ticks_)};
          const double error = Forecast(before_that, {seen, share}, {kCoarseGrowth}).likely;
          if (kCoarseSafety * error <= wanted_) {
            consider(c, std::max(error, floor_of(c)));
            choice_.reason =
                format("velocity Verlet, run over the first %.3g, sees it err by %.1e m there", share, seen);
            return;
          }
          grown = error / seen;
        }
        // Errors fall at order 1 to 2. Too far off?
        const double order = std::clamp(std::log2(before / seen), 1.0, 2.0);
        if (std::pow(kCoarseSafety * seen * grown / wanted_, 1 / order) * c.seconds > 1.5 * most) return;
        before = seen;
      }
    } catch (const std::exception&) {
      // It does not take this body.
    }
  }

  // A body that hardly moves: XPBD errs by what its few sweeps leave undone, and that is a swing of its own, whose
  // width falls as the square of the step and whose turn comes after so many steps. One coarse run over the whole time
  // shows it, together with whatever else moves.
  bool near_rest_does() {
    const Index states = ticks_ / stride_;
    if (wanted_ < kCoarseFrom * choice_.size) return false;
    Index steps = std::max<Index>(1, Index(std::ceil(kSwingSteps / double(ticks_))));
    const auto with = [&](Index n) { return with_steps(xpbd(), Precision::Float, n); };
    if (with(steps).seconds > kSwingTrial * base_.seconds) return false;
    // How the body moves at all.
    Index looked = 0;
    double seen = 0, moves = kInfinity;
    while (looked < std::min<Index>(2, states)) {
      ++looked;
      reach(*pair_[0], pair_candidate_[0], looked * stride_);
      if (pair_[0]->done() < looked * stride_) return false;
      const double now = std::max(seen, pair_[0]->moved(looked));
      const double growth =
          looked == 1 || seen == 0 ? kRestGrowth : std::clamp(std::log2(now / seen), 0.0, 2.0) + kRestDoubt;
      moves = now * std::pow(double(states) / double(looked), growth);
      seen = now;
      if (moves <= kAtRest * wanted_ || seen > kNearRest * wanted_) break;
    }
    if (!(moves <= kNearRest * wanted_)) return false;
    const double room = (wanted_ - moves) / kSwingSafety;
    // What is only to come falls with no square of a step.
    const bool left_alone = run_.colliders.empty() && !run_.prepare && !settings_.wind;
    try {
      double left = kSwingTrial * base_.seconds;
      for (; with(steps).seconds <= left; steps *= 2) {
        const Candidate c = with(steps);
        left -= c.seconds;
        const auto now = trial(c);
        double most = 0, finer = 0;
        Index turn = 0;
        for (Index i = 1; i <= states; ++i) {
          reach(*now, c, i * stride_);
          if (now->done() < i * stride_) return false;
          if (const double swing = now->moved(i); swing > most) most = swing, turn = i;
          // It takes at least so many times the steps.
          finer = std::sqrt(most / room);
          if (!(finer * c.seconds <= kSwingBudget * base_.seconds) || (finer > 1 && !left_alone)) return false;
        }
        // Of what it shows so much may be no swing, but a motion that velocity Verlet sees begin as well.
        const double begun = now->moved(looked), real = begun > 0 ? most * std::min(1.0, seen / begun) : 0;
        if (finer > 1 && real > room) return false;
        if (finer > kSwingFiner || (finer > 1 && 4 * turn > 3 * states)) continue;  // it may swing farther
        const Candidate best = with(std::max<Index>(1, Index(std::ceil(double(steps) * finer))));
        const double times = double(steps) / double(best.substeps);
        const double error = std::max(moves + most * times * times, floor_of(best));
        if (best.seconds > kSwingBudget * base_.seconds || error > wanted_) return false;
        consider(best, error);
        choice_.reason = format("the body stays within %.1e m, and XPBD within %.1e m with %ld step%s a tick", moves,
                                most, long(steps), steps == 1 ? "" : "s");
        return true;
      }
    } catch (const std::exception&) {
      // It does not take this body.
    }
    return false;
  }

  // Runs it on, counts its work, and tells whether it got there within `most` seconds for the whole run.
  bool reach_coarse(Trial& t, Candidate& c, Index tick, double most) {
    const double before = double(t.done());
    if (before >= double(tick)) return true;
    t.reach(tick);
    const double done = double(t.done()) / double(ticks_);
    if (is_implicit(*c.method) && t.done() > 0) {
      const MotionFacts facts = t.facts();
      c.evaluations = double(facts.evaluations) / done;
      c.seconds = implicit_cost_->seconds(c.precision, c.evaluations, double(facts.products) / done,
                                          double(ticks_) * double(c.substeps));
    }
    const double share = done - before / double(ticks_);
    choice_.pilot_evaluations += share * c.evaluations;
    choice_.pilot_seconds += share * c.seconds;
    return t.done() == tick && c.seconds <= most;
  }

  // Velocity Verlet at its limit is not enough.
  void refine(Forecast seen) {
    const Precision precision = pair_candidate_[0].precision;
    if (share_ >= 0.25 && safety_ * seen.likely <= 2 * wanted_) {
      // A little more, as its order may be less than 2.
      const Candidate c = candidate(velocity_verlet(), precision, std::sqrt(1.1 * safety_ * seen.likely / wanted_));
      consider(c, std::max(wanted_ / safety_, floor_of(c)));
      choice_.reason =
          format("seen over the first %.3g of the run, velocity Verlet at its stability limit errs by about %.1e m",
                 shown(share_), seen.likely);
      return;
    }
    if (share_ < kPairShare) {
      extend_pair(kPairShare);
      seen = forecast();
    }
    // Where what is needed costs several times more, the growth of errors is looked at to the end.
    const double finer = std::min(3.0, std::sqrt(safety_ * seen.likely / wanted_));
    const double needed =
        std::min(candidate(velocity_verlet(), precision, finer).seconds, candidate(*high_, precision, 1).seconds);
    const double rest = (1 - shown(share_)) * (pair_candidate_[0].seconds + pair_candidate_[1].seconds);
    if (choice_.pilot_seconds + rest <= 0.7 * needed) extend_pair(1);
    const double whole = share_ == 1 ? pair_error(1) : seen.likely;

    // The next order as judge of both, over a first part.
    const double part = kJudgedShare;
    const double here = pair_error(part);
    const double growth = here > 0 && std::isfinite(whole) ? std::max(fades() ? 0.0 : 1.0, whole / here) : 1;
    // In float the differences would be its rounding.
    const Precision judging = wanted_ < 30 * floor_of(base_) ? Precision::Double : precision;
    const auto run = [&](const Method& method, double times) {
      const Candidate c = candidate(method, judging, times);
      auto out = trial(c);
      reach(*out, c, tick_of(part));
      return out;
    };
    const auto between = [&](const Trial& a, const Trial& b) {
      return difference(a, b, tick_of(part), stride_, since(part));
    };
    const auto judge = run(*high_, 1);
    // RK4 at its limit errs nearly as much as velocity Verlet does.
    const auto finer_judge = highest_ ? nullptr : run(*high_, 2);
    const Trial& best_known = finer_judge ? *finer_judge : *judge;
    const double e1 = between(*pair_[0], best_known), e2 = between(*pair_[1], best_known);
    const double order =
        e2 > 0 && std::isfinite(e1) ? std::clamp(std::log(e1 / e2) / std::log(pair_ratio()), 0.5, 2.0) : 2;
    // A judge that is seen to differ by more than that from the pair may be the worse one.
    const double error = std::min(e1, kMostJudged * here) * growth;
    add_finer(velocity_verlet(), error, order, safety_, 8);

    // Its own error: first by a rule, then seen. It sits in the fastest modes, which dampers take first.
    const bool smooth = order > 1.7;
    const double high_growth = highest_ ? std::max(growth, std::pow(1 / shown(part), kHighGrowth))
                               : calm_  ? std::min(growth, 1.0)
                                        : growth;
    const double high_order = !highest_ ? (smooth ? kDampedHigh : kDampedRoughHigh)
                              : smooth  ? 3.5
                                        : std::max(kRoughHigh, 2 * order);
    double high_error = !highest_ ? between(*judge, *finer_judge) * high_growth
                                  : error / (order > 1.95 ? kHighBetterSmooth : kHighBetter);
    if (highest_ && !(kHighSafety * high_error <= wanted_)) {
      const auto better = run(*highest_, 1);
      high_error = between(*judge, *better) * high_growth;
      double highest_error = high_error / 4, highest_order = smooth ? 5 : std::max(kRoughHighest, high_order);
      if (!(kHighSafety * high_error / std::pow(2.6, high_order) <= wanted_)) {
        const auto best = run(*highest_, 2);
        highest_error = between(*better, *best) * high_growth;
        // Where it would take more than these steps its order is worth a look.
        if (highest_order < 5 && std::isfinite(highest_error) &&
            kHighSafety * highest_error > std::pow(2.0, highest_order) * wanted_) {
          const double next = between(*best, *run(*highest_, 4)) * high_growth;
          if (next > 0 && std::isfinite(next))
            highest_order = std::clamp(std::log2(highest_error / next), highest_order, 5.0);
        }
      }
      add_finer(*highest_, highest_error, highest_order, kHighSafety, 8);
    }
    add_finer(*high_, high_error, high_order, kHighSafety, 8);
    choice_.reason =
        format("velocity Verlet at its stability limit would err by %.1e m, order %.2g seen", error, order);
  }

  // The method with as many steps as its error at the limit asks for, in the precisions that rounding allows.
  void add_finer(const Method& method, double error, double order, double safety, double most) {
    const double finer = std::clamp(std::pow(safety * error / wanted_, 1 / order), 1.0, most);
    for (const Precision precision : {Precision::Float, Precision::Double}) {
      const Candidate c = candidate(method, precision, finer);
      const double steps = double(c.substeps) / double(substeps(method, 1));
      consider(c, std::max(error / std::pow(steps, order), kRoom * floor_of(c)));
    }
  }

  SolverChoice trivial(const char* reason) {
    Candidate c = candidate(velocity_verlet(), Precision::Float, 1);
    if (floor_of(c) > wanted_) c = candidate(velocity_verlet(), Precision::Double, 1);
    consider(c, floor_of(c));
    choice_.reason = reason;
    return finish();
  }

  // The cheapest that meets it, or the most accurate.
  SolverChoice finish() {
    std::size_t best = 0;
    const auto better = [&](const Candidate& a, const Candidate& b) {
      const bool a_meets = a.predicted_error <= wanted_, b_meets = b.predicted_error <= wanted_;
      if (a_meets != b_meets) return a_meets;
      if (a_meets && a.seconds != b.seconds) return a.seconds < b.seconds;
      if (a.predicted_error != b.predicted_error) return a.predicted_error < b.predicted_error;
      return a.precision == Precision::Double && b.precision != Precision::Double;
    };
    for (std::size_t i = 1; i < considered_.size(); ++i)
      if (better(considered_[i], considered_[best])) best = i;
    static_cast<Candidate&>(choice_) = considered_[best];
    choice_.meets = choice_.predicted_error <= wanted_;
    choice_.dt = tick_ / double(choice_.substeps);
    for (std::size_t i = 0; i < considered_.size(); ++i)
      if (i != best) choice_.rejected.push_back(considered_[i]);
    std::stable_sort(choice_.rejected.begin(), choice_.rejected.end(),
                     [](const Candidate& a, const Candidate& b) { return a.seconds < b.seconds; });
    return choice_;
  }

  SoftBodySettings settings_;
  const RunSetting& run_;
  Index ticks_, stride_ = 1;
  double speed_ = 0;  // RMS over points and time [m/s], as far as it is known
  double tick_ = 0, wanted_ = 0;
  const SolverCost cost_;
  std::vector<Limit> limits_;
  std::optional<ImplicitCost> implicit_cost_;
  const Method *high_ = nullptr, *highest_ = nullptr;  // of order 4 and, where there is one, 6
  Candidate base_, pair_candidate_[2];
  std::unique_ptr<Trial> pair_[2];
  double share_ = 0;
  double motion_growth_ = kMostGrowth;  // the power of time that displacements grow with
  bool calm_ = false, rough_ = false;
  double safety_ = kSafety;
  bool steps_in_double_ = false, tried_coarse_ = false;
  std::vector<Candidate> considered_;
  SolverChoice choice_;
};

}  // namespace

void SolverChoice::apply(SoftBodySettings& settings) const {
  settings.motion.method = method;
  settings.motion.dt = dt;
  settings.precision = precision;
  settings.wanted_error = 0;
}

std::string SolverChoice::text() const {
  std::string out = std::string(method->name) +
                    format(
                        ", %s, %ld substep%s a tick; expected error %.2g of %.2g m wanted; %.3g force evaluations, "
                        "choosing cost %.2g of them",
                        word_of(precision), long(substeps), substeps == 1 ? "" : "s", predicted_error, wanted_error,
                        evaluations, seconds > 0 ? pilot_seconds / seconds : 0);
  if (!meets) out += "; nothing meets the wanted error, this is the most accurate";
  out += "\n" + reason;
  for (std::size_t i = 0; i < std::min(rejected.size(), kRejectedTold); ++i) {
    const Candidate& c = rejected[i];
    out += "; " + std::string(c.method->name) +
           format(" %s would cost %.2g times as much and err by %.1e m", word_of(c.precision),
                  seconds > 0 ? c.seconds / seconds : 0, c.predicted_error);
  }
  return out;
}

SolverChoice choose_solver(const SoftBodySettings& settings, const RunSetting& run, double wanted_error) {
  check(settings, run);
  if (!(wanted_error > 0) || !std::isfinite(wanted_error))
    throw std::invalid_argument("body \"" + settings.name + "\": wanted error must be positive, got " +
                                format("%g", wanted_error));
  return Chooser(settings, run, wanted_error).run();
}

Verification verify(const SoftBodySettings& settings, const RunSetting& run) {
  check(settings, run);
  const Index ticks = ticks_of(run);
  const auto end_of = [&](const SoftBodySettings& s) {
    Trial trial(s, run, ticks);
    trial.reach(ticks);
    if (trial.done() < ticks)
      throw Error("body \"" + settings.name + "\": " + std::string(s.motion.method->name) + " diverges at " +
                  format("%.4g s", double(trial.done()) / run.tick_rate));
    return trial.positions();
  };
  Verification out;
  SoftBodySettings s = settings;
  s.precision = Precision::Double;
  s.wanted_error = 0;
  s.motion.method = &velocity_verlet();
  s.motion.dt = 0;
  const auto body = make_soft_body(s);
  const Method& method = body->motion_facts().velocity_forces ? rk4() : blanes_moan_6();
  const double stable = kStepSafety * body->stable_step(method);
  double steps = std::isfinite(stable) ? std::max(1.0, std::ceil(1 / run.tick_rate / stable)) : 1;
  const SolverCost cost(settings);
  const Points<double> ours = end_of(settings);
  Points<double> before;
  s.motion.method = &method;
  for (int level = 0; level < 7; ++level, steps *= 2) {
    s.motion.dt = 1 / run.tick_rate / steps;
    const Points<double> now = end_of(s);
    out.seconds += cost.seconds(method, Precision::Double, evaluations_of(method, double(ticks), steps));
    out.error = rms(ours, now);
    out.uncertainty = level > 0 ? rms(now, before) : kInfinity;
    out.reference = std::string(method.name) + format(", double, %g steps a tick", steps);
    before = now;
    if (out.uncertainty <= 0.1 * out.error || out.uncertainty < 1e-13 * size_of(settings.positions)) break;
  }
  return out;
}

}  // namespace hooke::softbody
