#include <hooke/io/tables.hpp>

#include <stdexcept>

namespace hooke::io {

std::string csv_field(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c;
  }
  return out + '"';
}

StateTable::StateTable(const std::filesystem::path& path) : file_(path) { file_.write("body,index,x,y,z,vx,vy,vz\n"); }

void StateTable::add(std::string_view body, const Points<double>& x, const Points<double>& v) {
  if (x.rows() != v.rows()) throw std::invalid_argument("StateTable: positions and velocities differ in number");
  const std::string name = csv_field(body);
  for (Index i = 0; i < x.rows(); ++i) {
    file_.write(name + "," + std::to_string(i));
    for (const Points<double>* points : {&x, &v})
      for (int k = 0; k < 3; ++k) {
        file_.write(",");
        file_.write((*points)(i, k));
      }
    file_.write("\n");
  }
}

NumberTable::NumberTable(const std::filesystem::path& path, const std::vector<std::string>& columns, std::int64_t keep)
    : file_(keep < 0 ? OutputFile(path, OutputFile::Leftover::Keep)
                     : OutputFile(path, OutputFile::Leftover::Keep, keep)),
      columns_(columns.size()) {
  if (keep >= 0) return;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (i) file_.write(",");
    file_.write(csv_field(columns[i]));
  }
  file_.write("\n");
  file_.flush();
}

void NumberTable::add(std::span<const double> row) {
  if (row.size() != columns_) throw std::invalid_argument("NumberTable: a row must have as many numbers as columns");
  for (std::size_t i = 0; i < row.size(); ++i) {
    if (i) file_.write(",");
    file_.write(row[i]);
  }
  file_.write("\n");
  file_.flush();
}

DiagnosticsTable::DiagnosticsTable(const std::filesystem::path& path, std::int64_t keep)
    : table_(path,
             {"time", "kinetic", "gravitational", "elastic", "total", "momentum_x", "momentum_y", "momentum_z",
              "worst_stretch"},
             keep) {}

void DiagnosticsTable::add(const Diagnostics& f) {
  table_.add({f.time, f.kinetic, f.gravitational, f.elastic, f.kinetic + f.gravitational + f.elastic, f.momentum.x(),
              f.momentum.y(), f.momentum.z(), f.worst_stretch});
}

TimingsTable::TimingsTable(const std::filesystem::path& path, std::int64_t keep)
    : table_(path, {"time", "simulate_ms", "measure_ms", "write_ms"}, keep) {}

void TimingsTable::add(const Timings& f) { table_.add({f.time, f.simulate, f.measure, f.write}); }

}  // namespace hooke::io
