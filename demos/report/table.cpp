#include "report.hpp"

#include "rivals.hpp"

#include <commit.hpp>

#include <hooke/io/tables.hpp>

#include <cmath>
#include <fstream>

namespace hooke::report {

Machine this_machine() {
  Machine out;
  out.cpu = "unknown";
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name")) {
      out.cpu = line.substr(std::min(line.size(), line.find(':') + 2));
      break;
    }
#if defined(__clang__)
  out.compiler = "clang " __clang_version__;
#elif defined(__GNUC__)
  out.compiler = "gcc " __VERSION__;
#else
  out.compiler = "unknown";
#endif
  out.compiler += ", " HOOKE_BUILD_TYPE;
  out.version = HOOKE_VERSION;
  out.commit = HOOKE_COMMIT;
  out.bullet = bullet_version();
  return out;
}

Table::Table(const std::filesystem::path& path) : file_(path, io::OutputFile::Leftover::Keep) {
  file_.write(
      "scene,method,precision,setting,dt,tolerance,seconds_per_simulated_second,repeats,rms_error,max_error,energy_"
      "drift,"
      "momentum_drift,evaluations,status,reference_uncertainty,cpu,compiler,version,commit\n");
  file_.flush();
}

void Table::add(const SceneReport& report, const Machine& machine) {
  const auto number = [&](double value) {
    if (std::isfinite(value)) file_.write(value);
    file_.write(",");
  };
  const auto text = [&](const std::string& value, const char* end = ",") {
    file_.write(io::csv_field(value));
    file_.write(end);
  };
  for (const Row& row : report.rows) {
    text(report.scene.name), text(row.method), text(row.precision), text(row.setting);
    number(row.dt), number(row.tolerance), number(row.seconds);
    text(std::to_string(row.repeats));
    number(row.rms), number(row.worst), number(row.energy_drift), number(row.momentum_drift), number(row.evaluations);
    text(row.status);
    number(report.reference.uncertainty());
    text(machine.cpu), text(machine.compiler), text(machine.version), text(machine.commit, "\n");
  }
  file_.flush();
}

}  // namespace hooke::report
