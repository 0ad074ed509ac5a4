#include "stability.hpp"

#include <algorithm>
#include <cstdio>

namespace hooke::stability {

namespace {

// Readable in print and for the colour-blind: green-blue, amber, dark red, greys.
const char* color_of(Outcome outcome) {
  switch (outcome) {
    case Outcome::Met:
      return "#4aa78a";
    case Outcome::Missed:
      return "#f2b13c";
    case Outcome::Broke:
      return "#a3262a";
    case Outcome::NotClaimed:
      return "#eceff2";
    default:
      return "#c3cad2";
  }
}

std::string in_quotes(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? "''" : std::string(1, c);
  return out + "'";
}

std::size_t place_of(std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return std::size_t(found - names.begin());
  names.push_back(name);
  return names.size() - 1;
}

std::string script(const std::vector<Row>& rows, const std::string& png) {
  std::vector<std::string> lines, columns;
  std::string boxes;
  int object = 0;
  for (const Row& row : rows) {
    const std::size_t y = place_of(lines, row.hard + (row.parameter.empty() ? "" : ": " + row.parameter));
    const std::size_t x = place_of(columns, row.method);
    // Float is the left half of a cell, double the right one.
    const double left = double(x) + (row.precision == "double" ? 0.5 : 0.03);
    const double right = left + 0.47;
    char text[300];
    std::snprintf(text, sizeof text,
                  "set object %d rectangle from %.3f,%.3f to %.3f,%.3f fs solid noborder fc rgb '%s'\n", ++object, left,
                  -double(y) - 0.94, right, -double(y) - 0.06, color_of(row.outcome));
    boxes += text;
    if (row.outcome == Outcome::Broke && std::isfinite(row.failed_at)) {
      std::snprintf(text, sizeof text, "set label '%.2g s' at %.3f,%.3f center font ',8' tc rgb '#ffffff' front\n",
                    row.failed_at, (left + right) / 2, -double(y) - 0.5);
      boxes += text;
    } else if (row.outcome == Outcome::Missed && std::isfinite(row.figure)) {
      std::snprintf(text, sizeof text, "set label '%.2g' at %.3f,%.3f center font ',8' tc rgb '#3a2a00' front\n",
                    row.figure, (left + right) / 2, -double(y) - 0.5);
      boxes += text;
    }
  }
  const double height = double(lines.size()), width = double(columns.size());
  std::string out = "set terminal pngcairo size " + std::to_string(420 + 150 * columns.size()) + "," +
                    std::to_string(170 + 27 * lines.size()) + " font 'DejaVu Sans,11' background '#ffffff'\n";
  out += "set output '" + png + "'\nunset key\nunset border\nset tics scale 0\n";
  out += "set title 'Hard cases by solver: left half float, right half double' font ',16' offset 0,1.2\n";
  char text[200];
  std::snprintf(text, sizeof text,
                "set xrange [0:%g]\nset yrange [%g:0]\nset lmargin 44\nset bmargin 4\nset tmargin 6\n", width,
                -height - 1.4);
  out += text;
  out += "set x2tics (";
  for (std::size_t i = 0; i < columns.size(); ++i)
    out += (i ? "," : "") + in_quotes(columns[i]) + " " + std::to_string(double(i) + 0.5);
  out += ")\nset x2range [0:" + std::to_string(width) + "]\nunset xtics\nset ytics (";
  for (std::size_t i = 0; i < lines.size(); ++i)
    out += (i ? "," : "") + in_quotes(lines[i]) + " " + std::to_string(-double(i) - 0.5);
  out += ")\n" + boxes;
  // What the colours mean.
  double x = 0;
  for (const Outcome outcome : {Outcome::Met, Outcome::Missed, Outcome::Broke, Outcome::NotClaimed, Outcome::TooDear}) {
    const std::string what = outcome == Outcome::Met          ? "bounded, gate met"
                             : outcome == Outcome::Missed     ? "gate missed (figure)"
                             : outcome == Outcome::Broke      ? "broke (when)"
                             : outcome == Outcome::NotClaimed ? "not claimed"
                                                              : "too dear";
    std::snprintf(text, sizeof text,
                  "set object %d rectangle from %.3f,%.3f to %.3f,%.3f fs solid noborder fc rgb '%s'\n", ++object, x,
                  -height - 1.25, x + 0.2, -height - 0.7, color_of(outcome));
    out += text;
    out += "set label " + in_quotes(what) + " at " + std::to_string(x + 0.26) + "," + std::to_string(-height - 0.97) +
           "\n";
    x += width / 5;
  }
  return out + "plot NaN notitle\n";
}

}  // namespace

const char* draw(const std::vector<Row>& rows, const std::filesystem::path& png) {
  return report::plot([&](const std::string& path) { return script(rows, path); }, png);
}

}  // namespace hooke::stability
