// Hard cases: does a solver stay bounded, come to rest, keep its energy, and say so where it cannot?
// Every case × every solver × float and double is a row that is measured, never written down.
#pragma once

#include <report/report.hpp>
#include <scene/description.hpp>

#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace hooke::stability {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// What a row came to.
enum class Outcome {
  Met,         ///< stayed bounded and met the case's gate
  Missed,      ///< stayed bounded, but missed the gate
  Broke,       ///< became infinite, left the scene, or the library gave up
  NotClaimed,  ///< the solver does not claim the case; `said` tells why
  TooDear      ///< not measured: needs more work than this form of the suite may spend
};
/// "met", "missed", "broke", "not claimed", "too dear".
const char* name_of(Outcome outcome);

/// One run, measured. What is not asked or not defined is NaN.
struct Row {
  std::string hard, parameter;    ///< the case and its parameter
  std::string method, precision;  ///< the solver
  Outcome outcome = Outcome::Met;
  double figure = kNone;  ///< what the case asks for, see Case::figure
  double gate = kNone;    ///< most that the figure may be
  double energy_growth =
      kNone;                 ///< greatest rise above the start over the most that the motion turned into kinetic energy
  double jitter = kNone;     ///< RMS speed of free points at the end, where rest is due [m/s]
  double failed_at = kNone;  ///< [s]
  double simulated = 0;      ///< [s]
  std::string said;          ///< by the library, or why there is no claim

  bool bounded() const { return outcome == Outcome::Met || outcome == Outcome::Missed; }
  bool measured() const { return bounded() || outcome == Outcome::Broke; }
};

/// A solver in a precision.
using Solver = scene::Solver;

/// One run of a case.
struct Trial {
  std::string parameter;
  Solver solver;
  bool thorough = false;  ///< minutes of simulated time instead of seconds
};

struct Case {
  std::string name, title;
  std::string problem;  ///< what happens and why it is hard, a few sentences
  std::string figure;   ///< what Row::figure is, with its unit
  std::string gate;     ///< in words
  std::vector<std::string> parameters;
  std::vector<std::string> thorough;  ///< parameters of the long form alone
  std::function<void(const Trial&, Row&)> run;
};

/// All of them, in the order of the table.
std::vector<Case> cases();

/// Rows of the reference problems that no case has: (name, reason).
std::vector<std::pair<std::string, std::string>> left_out();

/// Names of the solvers that the table compares.
std::vector<std::string> solvers();

/// What the table asks of a case: every parameter × solver × float and double.
std::vector<Trial> trials(const Case& hard, bool thorough);

/// Runs one row. What a body or scene refuses becomes Outcome::NotClaimed with its message.
Row measure(const Case& hard, const Trial& trial);

/// table.csv: a line a row, 17 digits, empty where nothing was measured.
class Table {
 public:
  explicit Table(const std::filesystem::path& path);
  void add(const Row& row, const report::Machine& machine);
  void finish() { file_.commit(); }

 private:
  io::OutputFile file_;
};

/// "16 rows: 12 met, …", of one case or of all.
std::string summary(const std::vector<Row>& rows, const std::string& hard = "");

/// One page that needs nothing but a browser, and the same as Markdown.
std::string page(const std::vector<Case>& cases, const std::vector<Row>& rows, const report::Machine& machine);
std::string markdown(const std::vector<Case>& cases, const std::vector<Row>& rows);

/// Cases × solvers, coloured by outcome, drawn by gnuplot.
/// @return why there is no picture, or nullptr
const char* draw(const std::vector<Row>& rows, const std::filesystem::path& png);

/// FNV-1a over the bits of positions and velocities of every point body, in the world's order.
std::uint64_t state_hash(const World& world);

}  // namespace hooke::stability
