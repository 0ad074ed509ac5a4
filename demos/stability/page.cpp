#include "stability.hpp"

#include <algorithm>
#include <cstdio>

namespace hooke::stability {

namespace {

using report::escaped;
using report::number;

std::string solver_of(const Row& row) { return row.method + ", " + row.precision; }

std::vector<const Row*> rows_of(const Case& hard, const std::vector<Row>& rows) {
  std::vector<const Row*> out;
  for (const Row& row : rows)
    if (row.hard == hard.name) out.push_back(&row);
  return out;
}

std::string line(const Row& row) {
  const bool good = row.outcome == Outcome::Met;
  return std::string("<tr") +
         (good             ? ""
          : row.measured() ? " class=failed"
                           : " class=soft") +
         "><td class=word>" + escaped(row.parameter) + "</td><td class=word>" + escaped(solver_of(row)) +
         "</td><td class=word>" + name_of(row.outcome) + "</td><td>" + number(row.figure) + "</td><td>" +
         number(row.gate) + "</td><td>" + number(row.energy_growth, "%.1e") + "</td><td>" + number(row.jitter, "%.1e") +
         "</td><td>" + number(row.failed_at) + "</td><td class=word>" + escaped(row.said) + "</td></tr>\n";
}

std::string section(const Case& hard, const std::vector<const Row*>& rows) {
  std::string out = "<section id=\"" + hard.name + "\">\n<h2>" + escaped(hard.title) + "</h2>\n<p class=facts><code>" +
                    hard.name + "</code></p>\n<p>" + escaped(hard.problem) + "</p>\n<p><b>Gate:</b> " +
                    escaped(hard.gate) + ". <b>Figure:</b> " + escaped(hard.figure) +
                    ".</p>\n<div class=wide><table><tr><th class=word>parameter<th class=word>solver<th "
                    "class=word>outcome<th>figure<th>gate<th>energy growth<th>jitter [m/s]<th>failed at [s]<th "
                    "class=word>said</tr>\n";
  for (const Row* row : rows) out += line(*row);
  return out + "</table></div>\n</section>\n";
}

}  // namespace

std::string summary(const std::vector<Row>& rows, const std::string& hard) {
  std::string out;
  std::size_t all = 0;
  for (const Outcome outcome : {Outcome::Met, Outcome::Missed, Outcome::Broke, Outcome::NotClaimed, Outcome::TooDear}) {
    const auto n = std::size_t(std::count_if(rows.begin(), rows.end(), [&](const Row& row) {
      return row.outcome == outcome && (hard.empty() || row.hard == hard);
    }));
    if (n > 0) out += (out.empty() ? "" : ", ") + std::to_string(n) + " " + name_of(outcome);
    all += n;
  }
  return std::to_string(all) + " rows: " + out;
}

std::string page(const std::vector<Case>& cases, const std::vector<Row>& rows, const report::Machine& machine) {
  std::string out = report::page_head("Hooke: stability");
  out +=
      "<header>\n<h1>Stability</h1>\n<p class=soft>" + report::facts_of(machine) + "</p>\n<p>" + summary(rows) +
      ". Energy growth is the greatest rise above the start over the largest kinetic energy; jitter is the RMS speed "
      "at the end, where rest is due.</p>\n<p><code>" +
      escaped(machine.command) +
      "</code></p>\n<p><img src=\"table.png\" alt=\"cases by solvers, coloured by "
      "outcome\" style=\"max-width:100%\"></p>\n<nav>";
  for (const Case& hard : cases)
    if (!rows_of(hard, rows).empty()) out += "<a href=\"#" + hard.name + "\">" + escaped(hard.title) + "</a> ";
  out += "</nav>\n</header>\n";
  for (const Case& hard : cases)
    if (const auto mine = rows_of(hard, rows); !mine.empty()) out += section(hard, mine);
  out += "<section><h2>Left out</h2><ul>";
  for (const auto& [name, reason] : left_out()) out += "<li>" + escaped(name) + ": " + escaped(reason) + "</li>";
  return out + "</ul></section>\n</body>\n</html>\n";
}

std::string markdown(const std::vector<Case>& cases, const std::vector<Row>& rows) {
  // A cell a solver: float / double.
  std::vector<std::string> methods;
  for (const Row& row : rows)
    if (std::find(methods.begin(), methods.end(), row.method) == methods.end()) methods.push_back(row.method);
  std::string out = summary(rows) + ".\n\n| case | parameter |";
  for (const std::string& method : methods) out += " " + method + " |";
  out += "\n| --- | --- |";
  for (std::size_t i = 0; i < methods.size(); ++i) out += " --- |";
  out += "\n";
  const auto cell = [](const Row& row) -> std::string {
    const std::string figure = std::isfinite(row.figure) ? " " + number(row.figure, "%.2g") : "";
    switch (row.outcome) {
      case Outcome::Met:
        return "met" + figure;
      case Outcome::Missed:
        return "**missed" + figure + "**";
      case Outcome::Broke:
        return "**broke at " + number(row.failed_at) + " s**";
      case Outcome::NotClaimed:
        return "–";
      default:
        return "(too dear)";
    }
  };
  for (const Case& hard : cases) {
    const auto mine = rows_of(hard, rows);
    std::vector<std::string> parameters;
    for (const Row* row : mine)
      if (std::find(parameters.begin(), parameters.end(), row->parameter) == parameters.end())
        parameters.push_back(row->parameter);
    for (const std::string& parameter : parameters) {
      out += "| " + hard.name + " | " + parameter + " |";
      for (const std::string& method : methods) {
        std::string both;
        for (const Row* row : mine)
          if (row->parameter == parameter && row->method == method) both += (both.empty() ? " " : " / ") + cell(*row);
        if (both == " – / –") both = " –";
        out += both + " |";
      }
      out += "\n";
    }
  }
  return out;
}

}  // namespace hooke::stability
