#include "report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <set>

namespace hooke::report {

namespace {

constexpr int kDecades = 8;
constexpr double kEqualTime = 1.05;

template <class... Values>
std::string format(const char* pattern, Values... values) {
  char text[600];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

bool is_rival(const Row& row) { return row.method == "yardstick" || row.method == "bullet-classic"; }

double error_of(const SceneReport& report, const Row& row) { return std::max(row.rms, report.reference.uncertainty()); }

std::string step_of(const Row& row) {
  return row.tolerance > 0 ? format("tolerance %.1g m", row.tolerance) : format("dt = %.3g s", row.dt);
}

// Runs of decades that the same row wins, each a sentence.
void tell_winners(const SceneReport& report, std::vector<std::string>& out) {
  const auto table = cheapest(report);
  for (std::size_t i = 0; i < table.size();) {
    std::size_t j = i;
    while (j + 1 < table.size() && table[j + 1].row == table[i].row) ++j;
    const std::string range =
        i == j ? "an error of " + power_of_ten(table[i].error) + " m"
               : "errors of " + power_of_ten(table[i].error) + " to " + power_of_ten(table[j].error) + " m";
    if (const Row* row = table[i].row) {
      out.push_back(format("For %s the cheapest is %s at %s: %.3g s per simulated second, error %.2g m.", range.c_str(),
                           name_of(*row).c_str(), step_of(*row).c_str(), row->seconds, row->rms));
    } else if (table[i].error < report.reference.uncertainty()) {
      out.push_back(format("Below %.2g m the reference itself is uncertain: nothing is said about %s.",
                           report.reference.uncertainty(), range.c_str()));
    } else {
      out.push_back(format("No run reached %s within the budget.", range.c_str()));
    }
    i = j + 1;
  }
}

// How the best of Hooke's own stands against a rival, decade by decade.
void tell_rival(const SceneReport& report, const std::string& rival, std::vector<std::string>& out) {
  double least = 1e300, most = 0, from = 0, to = 0;
  const auto theirs = cheapest(report, rival);
  if (std::none_of(report.rows.begin(), report.rows.end(), [&](const Row& row) { return row.method == rival; })) return;
  SceneReport own = report;
  std::erase_if(own.rows, is_rival);
  const auto ours = cheapest(own);
  for (std::size_t i = 0; i < ours.size(); ++i) {
    if (!ours[i].row || !theirs[i].row) continue;
    const double ratio = theirs[i].row->seconds / ours[i].row->seconds;
    least = std::min(least, ratio), most = std::max(most, ratio);
    if (from == 0) from = ours[i].error;
    to = ours[i].error;
  }
  const std::string range =
      from == to ? "an error of " + power_of_ten(from) : "errors of " + power_of_ten(from) + " to " + power_of_ten(to);
  if (from == 0) {
    out.push_back("The " + rival + " reached no error of the table.");
  } else if (from == to || format("%.3g", least) == format("%.3g", most)) {
    out.push_back(format("At an error of %s m Hooke's cheapest is %.3g times as fast as the %s.",
                         power_of_ten(from).c_str(), least, rival.c_str()));
  } else {
    out.push_back(format("At %s m Hooke's cheapest is %.3g to %.3g times as fast as the %s.", range.c_str(), least,
                         most, rival.c_str()));
  }
}

void tell_precisions(const SceneReport& report, std::vector<std::string>& out) {
  std::map<std::string, const Row*> best;
  for (const Row& row : report.rows) {
    if (!row.ok() || is_rival(row)) continue;
    const Row*& known = best[row.precision];
    if (!known || row.rms < known->rms) known = &row;
  }
  if (best.empty()) return;
  std::string text = "Least error by precision:";
  for (const auto& [precision, row] : best)
    text +=
        format("%s %.2g m in %s (%s)", text.back() == ':' ? "" : ",", row->rms, precision.c_str(), row->method.c_str());
  if (report.reference.uncertainty() > 0)
    text += format("; the reference is certain to %.2g m", report.reference.uncertainty());
  out.push_back(text + ".");
}

void tell_energy(const SceneReport& report, std::vector<std::string>& out) {
  const Row *least = nullptr, *most = nullptr;
  const double good = 1e-3 * report.size;
  for (const Row& row : report.rows) {
    if (!row.ok() || !std::isfinite(row.energy_drift) || row.rms > good) continue;
    if (!least || row.energy_drift < least->energy_drift) least = &row;
    if (!most || row.energy_drift > most->energy_drift) most = &row;
  }
  if (!least || least == most) return;
  out.push_back(
      format("Among runs within %.2g m, energy drifts by %.1e (%s at %s) to %.1e (%s at %s) of the greatest "
             "kinetic energy.",
             good, least->energy_drift, name_of(*least).c_str(), step_of(*least).c_str(), most->energy_drift,
             name_of(*most).c_str(), step_of(*most).c_str()));
}

// A series begins at twice its largest stable step, where it should fail: more than that is worth a word.
void tell_failures(const SceneReport& report, std::vector<std::string>& out) {
  struct Count {
    std::string method;
    std::set<std::string> series;
    int runs = 0, blown_up = 0, not_converged = 0;
  };
  std::vector<Count> counts;
  for (const Row& row : report.rows) {
    auto known = std::find_if(counts.begin(), counts.end(), [&](const Count& c) { return c.method == row.method; });
    if (known == counts.end()) known = counts.insert(counts.end(), {row.method, {}});
    known->series.insert(name_of(row));
    ++known->runs;
    known->blown_up += row.status == "blow-up";
    known->not_converged += row.status == "not converged";
  }
  std::string expected, blown_up, not_converged;
  const auto add = [](std::string& text, const std::string& more) { text += (text.empty() ? "" : ", ") + more; };
  for (const Count& c : counts) {
    if (c.blown_up > int(c.series.size()))
      add(blown_up, format("%s (%d of %d runs)", c.method.c_str(), c.blown_up, c.runs));
    else if (c.blown_up > 0)
      add(expected, c.method);
    if (c.not_converged > 0)
      add(not_converged, format("%s (%d of %d runs)", c.method.c_str(), c.not_converged, c.runs));
  }
  if (!blown_up.empty()) out.push_back("Blew up: " + blown_up + ".");
  if (!expected.empty())
    out.push_back("Blew up at the coarsest step alone, which is twice the stable one: " + expected + ".");
  if (!not_converged.empty()) out.push_back("Did not converge: " + not_converged + ".");
}

}  // namespace

std::string power_of_ten(double value) { return format("1e%d", int(std::lround(std::log10(value)))); }

std::string name_of(const Row& row) {
  return row.method + " in " + row.precision + (row.setting.empty() ? "" : " with " + row.setting);
}

std::vector<const Row*> pareto(const SceneReport& report) {
  std::vector<const Row*> rows, out;
  for (const Row& row : report.rows)
    if (row.ok()) rows.push_back(&row);
  std::stable_sort(rows.begin(), rows.end(), [](const Row* a, const Row* b) { return a->seconds < b->seconds; });
  for (const Row* row : rows)
    if (out.empty() || error_of(report, *row) < error_of(report, *out.back())) out.push_back(row);
  return out;
}

std::vector<Cheapest> cheapest(const SceneReport& report, const std::string& method) {
  std::vector<Cheapest> out;
  for (int decade = 1; decade <= kDecades; ++decade) {
    Cheapest entry;
    entry.error = std::pow(10.0, -decade);
    std::vector<const Row*> there;
    for (const Row& row : report.rows)
      if (row.ok() && error_of(report, row) <= entry.error && (method.empty() || row.method == method))
        there.push_back(&row);
    double least = std::numeric_limits<double>::infinity();
    for (const Row* row : there) least = std::min(least, row->seconds);
    for (const Row* row : there)
      if (row->seconds <= kEqualTime * least && (!entry.row || row->rms < entry.row->rms)) entry.row = row;
    out.push_back(entry);
  }
  return out;
}

std::vector<std::string> conclusions(const SceneReport& report) {
  std::vector<std::string> out;
  tell_winners(report, out);
  tell_rival(report, "yardstick", out);
  tell_rival(report, "bullet-classic", out);
  tell_precisions(report, out);
  tell_energy(report, out);
  tell_failures(report, out);
  return out;
}

}  // namespace hooke::report
