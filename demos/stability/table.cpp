#include "hard_cases.hpp"

#include <hooke/io/tables.hpp>

namespace hooke::stability {

std::vector<Case> cases() {
  std::vector<Case> out;
  add_loads(out);
  add_shocks(out);
  add_clocks(out);
  add_rests(out);
  return out;
}

std::vector<std::pair<std::string, std::string>> left_out() {
  return {{"two bodies born inside each other", "contact between two bodies that both give way does not exist yet"}};
}

std::vector<Trial> trials(const Case& hard, bool thorough) {
  std::vector<std::string> parameters = hard.parameters;
  if (thorough) parameters.insert(parameters.end(), hard.thorough.begin(), hard.thorough.end());
  std::vector<Trial> out;
  for (const std::string& parameter : parameters)
    for (const std::string& method : solvers())
      for (const auto precision : {softbody::Precision::Float, softbody::Precision::Double}) {
        Trial trial{parameter, {}, thorough};
        trial.solver.method = method;
        trial.solver.precision = precision;
        out.push_back(std::move(trial));
      }
  return out;
}

Table::Table(const std::filesystem::path& path) : file_(path, io::OutputFile::Leftover::Keep) {
  file_.write(
      "case,parameter,method,precision,outcome,bounded,figure,gate,energy_growth,jitter,time_of_failure,simulated,said,"
      "cpu,compiler,version,commit\n");
  file_.flush();
}

void Table::add(const Row& row, const report::Machine& machine) {
  const auto number = [&](double value) {
    if (std::isfinite(value)) file_.write(value);
    file_.write(",");
  };
  const auto text = [&](const std::string& value, const char* end = ",") {
    file_.write(io::csv_field(value));
    file_.write(end);
  };
  text(row.hard), text(row.parameter), text(row.method), text(row.precision), text(name_of(row.outcome));
  text(!row.measured() ? "" : row.bounded() ? "yes" : "no");
  number(row.figure), number(row.gate), number(row.energy_growth), number(row.jitter), number(row.failed_at);
  number(row.simulated);
  text(row.said);
  text(machine.cpu), text(machine.compiler), text(machine.version), text(machine.commit, "\n");
  file_.flush();
}

}  // namespace hooke::stability
