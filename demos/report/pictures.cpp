#include "report.hpp"

#include <hooke/method.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>

namespace hooke::report {

namespace {

constexpr std::array kColors{"#7f7f7f", "#e377c2", "#ff7f0e", "#9edae5", "#1f77b4", "#c49c94", "#d62728", "#2ca02c",
                             "#17becf", "#9467bd", "#5b1a8b", "#bcbd22", "#8c564b", "#006d5b", "#b8336a", "#3d5a80"};
constexpr double kLeast = 1e-16;  // what is exact is drawn here: a logarithm has no zero

struct Curve {
  std::string name, method, precision;
  std::vector<const Row*> rows;
};

std::vector<Curve> curves(const SceneReport& report) {
  std::vector<Curve> out;
  for (const Row& row : report.rows) {
    if (!row.ok()) continue;
    const std::string name = name_of(row);
    auto known = std::find_if(out.begin(), out.end(), [&](const Curve& curve) { return curve.name == name; });
    if (known == out.end()) known = out.insert(out.end(), {name, row.method, row.precision, {}});
    known->rows.push_back(&row);
  }
  return out;
}

std::string script(const SceneReport& report, const std::string& png) {
  char text[400];
  std::string out;
  const auto add = [&](const char* pattern, auto... values) {
    std::snprintf(text, sizeof text, pattern, values...);
    out += text;
  };
  const std::vector<Curve> all = curves(report);
  double low = 1e300, high = 0, left = 1e300, right = 0;
  const auto block = [&](const std::string& name, const std::vector<const Row*>& rows) {
    out += "$" + name + " << EOD\n";
    for (const Row* row : rows) {
      add("%.6e %.6e\n", row->seconds, std::max(row->rms, kLeast));
      low = std::min(low, std::max(row->rms, kLeast)), high = std::max({high, row->rms, kLeast});
      left = std::min(left, row->seconds), right = std::max(right, row->seconds);
    }
    out += "EOD\n";
  };
  for (std::size_t i = 0; i < all.size(); ++i) block("c" + std::to_string(i), all[i].rows);
  const auto front = pareto(report);
  block("front", front);

  out += "set terminal pngcairo size 1200,800 font 'DejaVu Sans,13' linewidth 1.4 background '#ffffff'\n";
  out += "set output '" + png + "'\n";
  out += "set title '" + report.scene.title + ": error against cost' font ',17'\n";
  out += "set logscale xy\nset format x '10^{%T}'\nset format y '10^{%T}'\n";
  out += "set xlabel 'processor time of one thread, seconds per simulated second'\n";
  out += std::string("set ylabel 'RMS error at the end ") +
         (report.scene.compare == scene::StandardScene::Compare::Points ? "of all points" : "of centre and spread") +
         ", m'\n";
  out += "set grid xtics ytics lc rgb '#dddddd' lt 1\nset border lc rgb '#555555'\n";
  out += "set key outside right top reverse Left samplen 2.4 spacing 1.15 font ',11'\n";
  const double unsure = report.reference.uncertainty();
  if (unsure > low / 3) {
    add("set arrow from graph 0, first %.3e to graph 1, first %.3e nohead lc rgb '#999999' dt 3\n", unsure, unsure);
    add("set label 'the reference is no surer than this' at graph 0.01, first %.3e font ',9' tc rgb '#777777'\n",
        1.25 * unsure);
  }
  add("set yrange [%.3e:%.3e]\nset xrange [%.3e:%.3e]\n", low / 3, high * 3, left / 1.5, right * 1.5);
  out += "plot $front using 1:2 with lines lw 9 lc rgb '#ffd966' title 'Pareto front'";
  // The key names every method once, by colour, and every precision once, by mark and dash.
  std::map<std::string, bool> named;
  std::vector<std::string> precisions;
  const auto look = [&](const std::string& precision) {
    return precision == "float" ? "dt (6,4) pt 6" : precision == "double" ? "dt 1 pt 7" : "dt (2,3) pt 5";
  };
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Curve& curve = all[i];
    if (std::find(precisions.begin(), precisions.end(), curve.precision) == precisions.end())
      precisions.push_back(curve.precision);
    out += ", $c" + std::to_string(i) + " using 1:2 with linespoints lw 1.4 ps 0.9 lc rgb '" + color_of(curve.method) +
           "' " + look(curve.precision) + " notitle";
    if (!named[curve.method])
      out += ", NaN with lines lw 4 lc rgb '" + color_of(curve.method) + "' title '" + curve.method + "'";
    named[curve.method] = true;
  }
  for (const std::string& precision : precisions)
    out += ", NaN with linespoints lw 1.4 ps 0.9 lc rgb '#333333' " + std::string(look(precision)) + " title '" +
           precision + "'";
  return out + "\n";
}

bool have_gnuplot() {
  static const bool have = std::system("gnuplot --version >/dev/null 2>&1") == 0;
  return have;
}

}  // namespace

std::string color_of(const std::string& method) {
  if (method == "filtered-leapfrog") return "#7fcf00";
  if (method == "xpbd") return "#ff00aa";
  if (method == "yardstick") return "#000000";
  if (method == "bullet-classic") return "#a0522d";
  std::size_t i = 0;
  while (i < methods().size() && methods()[i]->name != method) ++i;
  return kColors[i % kColors.size()];
}

const char* plot(const std::function<std::string(const std::string& png)>& script, const std::filesystem::path& png) {
  if (!have_gnuplot()) return "there is no gnuplot (apt-get install gnuplot-nox)";
  // By its part name first, as every other output.
  const std::filesystem::path part = io::part_name(png);
  std::string quoted;
  for (const char c : part.string()) quoted += c == '\'' ? "''" : std::string(1, c);
  std::FILE* pipe = popen("gnuplot -", "w");
  if (!pipe) return "gnuplot could not be started";
  const std::string text = script(quoted);
  std::fwrite(text.data(), 1, text.size(), pipe);
  std::error_code error;
  if (pclose(pipe) != 0 || (std::filesystem::rename(part, png, error), error)) return "gnuplot failed";
  return nullptr;
}

const char* draw(const SceneReport& report, const std::filesystem::path& png) {
  if (curves(report).empty()) return have_gnuplot() ? nullptr : plot({}, png);
  return plot([&](const std::string& path) { return script(report, path); }, png);
}

}  // namespace hooke::report
