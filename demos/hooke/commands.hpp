// What the command can do. Each returns an exit code and throws hooke::Error (exit 2) or
// hooke::OutputError (exit 3).
#pragma once

#include "run.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace hooke::command {

struct SimulateOptions {
  RunOptions run;
  std::filesystem::path out;
  std::string export_format;   ///< empty: none
  bool estimate_error = true;  ///< by halving the steps of a first part
  bool verify = false;         ///< by a converged run
  /// Simulated seconds between checkpoints; 0: none; absent: as often as they cost little.
  std::optional<double> checkpoint;
  bool resume = false;  ///< from the checkpoint in `out`
};
int simulate(const SimulateOptions& options);

struct RenderOptions {
  RunOptions run;
  std::filesystem::path out;  ///< FILE.mp4, FILE.png or a folder for PNG files
  int width = 1280, height = 720, supersample = 1;
  std::optional<double> frame_at;  ///< [s], of a PNG
  std::filesystem::path poster;    ///< beside a film: its poster as a PNG; empty: none
};
int render(const RenderOptions& options);
/// Several scenes side by side; run.scene is a file of panels, of `run` only `end` counts besides.
int panels(const RenderOptions& options);

int validate(const std::string& scene);

struct ReportOptions {
  std::vector<std::string> scenes;  ///< names of standard scenes; empty: all
  std::filesystem::path out;        ///< folder for report.csv, report.html and pictures
  bool quick = false;               ///< a look: seconds a scene, the largest left out
  std::optional<double> budget;     ///< processor time a scene [s]
};
int report(const ReportOptions& options);

struct StabilityOptions {
  std::vector<std::string> cases;  ///< names of hard cases; empty: all
  std::string method;              ///< of the rows; empty: all
  std::filesystem::path out;       ///< folder for table.csv, table.html, table.md and table.png
  bool thorough = false;           ///< minutes of simulated time
  int threads = 1;                 ///< that share the rows
};
int stability(const StabilityOptions& options);

int list();

}  // namespace hooke::command
