// Tables as CSV files (RFC 4180, one header line, LF): the state of bodies and what is measured
// frame by frame.
#pragma once

#include <hooke/io/output_file.hpp>
#include <hooke/types.hpp>

#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hooke::io {

/// A field as it stands in a CSV file: in quotes where it has a comma, a quote or a line break.
std::string csv_field(std::string_view text);

/// The state of bodies: body,index,x,y,z,vx,vy,vz with 17 significant digits.
class StateTable {
 public:
  explicit StateTable(const std::filesystem::path& path);
  /// One line a point in order. @param x [m], @param v [m/s], shapes (n, 3)
  void add(std::string_view body, const Points<double>& x, const Points<double>& v);
  void finish() { file_.commit(); }

 private:
  OutputFile file_;
};

/// Rows of numbers under a header; what was written stays readable when a run is cut off.
class NumberTable {
 public:
  /// @param keep bytes of an earlier run's table after which this one goes on; < 0: a new one
  NumberTable(const std::filesystem::path& path, const std::vector<std::string>& columns, std::int64_t keep = -1);
  /// @param row as many numbers as there are columns, else std::invalid_argument
  void add(std::span<const double> row);
  void add(std::initializer_list<double> row) { add(std::span(row.begin(), row.size())); }
  void finish() { file_.commit(); }
  /// Puts everything on the disk. @return its size [bytes], from which another run can go on
  std::int64_t sync() { return file_.sync(), file_.size(); }

 private:
  OutputFile file_;
  std::size_t columns_;
};

/// What is measured once a frame.
struct Diagnostics {
  double time = 0;                                     ///< [s]
  double kinetic = 0, gravitational = 0, elastic = 0;  ///< [J]
  Vec3 momentum{0, 0, 0};                              ///< [kg m/s]
  double worst_stretch = 0;                            ///< largest strain of a structural spring, 0 where there is none
};

/// time,kinetic,gravitational,elastic,total,momentum_x,momentum_y,momentum_z,worst_stretch
class DiagnosticsTable {
 public:
  explicit DiagnosticsTable(const std::filesystem::path& path, std::int64_t keep = -1);
  void add(const Diagnostics& frame);
  void finish() { table_.finish(); }
  std::int64_t sync() { return table_.sync(); }

 private:
  NumberTable table_;
};

/// How long the stages of one frame took.
struct Timings {
  double time = 0;                              ///< [s], simulated
  double simulate = 0, measure = 0, write = 0;  ///< [ms]
};

/// time,simulate_ms,measure_ms,write_ms
class TimingsTable {
 public:
  explicit TimingsTable(const std::filesystem::path& path, std::int64_t keep = -1);
  void add(const Timings& frame);
  void finish() { table_.finish(); }
  std::int64_t sync() { return table_.sync(); }

 private:
  NumberTable table_;
};

}  // namespace hooke::io
