// What is made of measured scenes: a table, a page, pictures, and conclusions that follow from the
// rows alone.
#pragma once

#include "measure.hpp"

#include <hooke/io/output_file.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace hooke::report {

/// Where and by what it was measured.
struct Machine {
  std::string cpu, compiler, version, commit, bullet;
  std::string command;  ///< that repeats the run
};
Machine this_machine();

/// The rows that no other beats in both time and error, cheapest first. Errors below the reference's
/// uncertainty count as that.
std::vector<const Row*> pareto(const SceneReport& report);

/// The cheapest row whose error is at most `error` [m]. Times within 5 % of each other count as equal: then the
/// more accurate row.
struct Cheapest {
  double error = 0;
  const Row* row = nullptr;  ///< none gets there
};
/// For 1e-1, 1e-2, … 1e-8 m. With `method`, of its rows alone.
std::vector<Cheapest> cheapest(const SceneReport& report, const std::string& method = "");

/// What the rows say, a sentence each.
std::vector<std::string> conclusions(const SceneReport& report);

/// "1e-3".
std::string power_of_ten(double value);

/// "velocity-verlet in float" and what else was set.
std::string name_of(const Row& row);

/// "#1f77b4": every method has its own colour, the same in all plots.
std::string color_of(const std::string& method);

/// report.csv: a line a row, 17 digits, empty where nothing was measured.
class Table {
 public:
  explicit Table(const std::filesystem::path& path);
  void add(const SceneReport& report, const Machine& machine);
  void finish() { file_.commit(); }

 private:
  io::OutputFile file_;
};

/// Text as it stands in HTML.
std::string escaped(const std::string& text);
/// A number as people read it; a dash where there is none.
std::string number(double value, const char* pattern = "%.3g");
/// Processor, compiler, version and commit, in HTML.
std::string facts_of(const Machine& machine);
/// A page's beginning, up to and with <body>: title and style.
std::string page_head(const std::string& title);

/// One page that needs nothing but a browser.
std::string page(const std::vector<SceneReport>& reports, const Machine& machine);

/// Has gnuplot draw a picture; the file gets its name once it is complete.
/// @param script from the picture's path, quoted for gnuplot, to gnuplot's commands
/// @return why there is no picture, or nullptr
const char* plot(const std::function<std::string(const std::string& png)>& script, const std::filesystem::path& png);

/// A picture of a scene's plot, 1200 × 800 pixels, drawn by gnuplot.
/// @return why there is no picture, or nullptr
const char* draw(const SceneReport& report, const std::filesystem::path& png);

}  // namespace hooke::report
