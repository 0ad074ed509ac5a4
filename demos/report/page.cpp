#include "report.hpp"

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <set>

// The page's parts, as they are in their files.
#define HOOKE_PART(name, file)                                                                                     \
  __asm__(".section .rodata\n.global hooke_" name "\n.global hooke_" name "_end\nhooke_" name ":\n.incbin \"" file \
          "\"\nhooke_" name "_end:\n.byte 0\n.previous\n")
HOOKE_PART("page_js", HOOKE_REPORT_FOLDER "/page.js");
HOOKE_PART("page_css", HOOKE_REPORT_FOLDER "/page.css");
HOOKE_PART("plotly", HOOKE_REPORT_FOLDER "/third_party/plotly-basic.min.js");
extern "C" {
extern const char hooke_page_js[], hooke_page_js_end[], hooke_page_css[], hooke_page_css_end[], hooke_plotly[],
    hooke_plotly_end[];
}

namespace hooke::report {

namespace {

using nlohmann::json;

std::string_view part(const char* begin, const char* end) { return {begin, std::size_t(end - begin)}; }

json number_of(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json json_of(const Row& row) {
  return {{"method", row.method},
          {"precision", row.precision},
          {"setting", row.setting},
          {"dt", number_of(row.dt)},
          {"tolerance", number_of(row.tolerance)},
          {"seconds", number_of(row.seconds)},
          {"rms", number_of(row.rms)},
          {"worst", number_of(row.worst)},
          {"energy_drift", number_of(row.energy_drift)},
          {"evaluations", number_of(row.evaluations)}};
}

bool by_points(const SceneReport& report) { return report.scene.compare == scene::StandardScene::Compare::Points; }

// What the script draws.
json data_of(const std::vector<SceneReport>& reports) {
  json scenes = json::array();
  for (const SceneReport& report : reports) {
    json front = json::array(), series = json::array();
    for (const Row* row : pareto(report)) front.push_back(json_of(*row));
    std::string last;
    for (const Row& row : report.rows) {
      if (!row.ok()) continue;
      if (name_of(row) != last)
        series.push_back({{"method", row.method},
                          {"precision", row.precision},
                          {"color", color_of(row.method)},
                          {"rows", json::array()}});
      last = name_of(row);
      series.back()["rows"].push_back(json_of(row));
    }
    scenes.push_back({{"name", report.scene.name},
                      {"uncertainty", report.reference.uncertainty()},
                      {"ylabel", by_points(report) ? "RMS error of all points at the end [m]"
                                                   : "RMS error of centre and spread at the end [m]"},
                      {"front", front},
                      {"series", series}});
  }
  return {{"scenes", scenes}};
}

std::string method_cell(const Row& row) {
  return "<td class=word><span class=chip style=\"background:" + color_of(row.method) + "\"></span>" +
         escaped(row.method) + "</td><td class=word>" + escaped(row.precision) +
         (row.setting.empty() ? "" : ", " + escaped(row.setting)) + "</td>";
}

std::string step_cell(const Row& row) {
  return "<td>" + number(row.dt) + (row.tolerance > 0 ? " (tolerance " + number(row.tolerance, "%.0e") + ")" : "") +
         "</td>";
}

std::string cheapest_table(const SceneReport& report) {
  std::string out =
      "<div class=wide><table><tr><th>error at most [m]<th class=word>cheapest method<th class=word>precision<th>dt "
      "[s]<th>s per simulated s<th>its error [m]<th>energy drift</tr>\n";
  for (const Cheapest& entry : cheapest(report)) {
    out += "<tr><td>" + power_of_ten(entry.error) + "</td>";
    if (entry.row)
      out += method_cell(*entry.row) + step_cell(*entry.row) + "<td>" + number(entry.row->seconds) + "</td><td>" +
             number(entry.row->rms, "%.2g") + "</td><td>" + number(entry.row->energy_drift, "%.1e") + "</td>";
    else
      out +=
          std::string("<td class=word colspan=6>") +
          (entry.error < report.reference.uncertainty() ? "the reference is no surer than this" : "none gets there") +
          "</td>";
    out += "</tr>\n";
  }
  return out + "</table></div>\n";
}

std::string all_rows(const SceneReport& report) {
  std::string out = "<details><summary>All " + std::to_string(report.rows.size()) +
                    " runs</summary><div class=wide><table><tr><th class=word>method<th class=word>precision<th>dt "
                    "[s]<th>s per simulated s<th>RMS error [m]<th>largest [m]<th>energy drift<th>momentum "
                    "drift<th>evaluations<th class=word>status</tr>\n";
  for (const Row& row : report.rows)
    out += std::string("<tr") + (row.ok() ? "" : " class=failed") + ">" + method_cell(row) + step_cell(row) + "<td>" +
           number(row.seconds) + "</td><td>" + number(row.rms) + "</td><td>" + number(row.worst) + "</td><td>" +
           number(row.energy_drift, "%.1e") + "</td><td>" + number(row.momentum_drift, "%.1e") + "</td><td>" +
           number(row.evaluations, "%.0f") + "</td><td class=word>" + escaped(row.status) + "</td></tr>\n";
  return out + "</table></div></details>\n";
}

std::string set_up(const SceneReport& report) {
  std::set<std::string> methods, precisions;
  for (const Row& row : report.rows) methods.insert(row.method), precisions.insert(row.precision);
  std::string names;
  for (const auto& precision : precisions) names += (names.empty() ? "" : ", ") + precision;
  const auto& scene = report.scene;
  std::string out =
      "<p>" + std::to_string(methods.size()) + " methods in " + escaped(names) + ", " +
      std::to_string(report.rows.size()) +
      " runs: from twice the largest stable step, or a tick where any is stable, down by factors of 2, in " +
      std::to_string(scene.ticks) + " ticks. One thread, processor time, least of repeats. ";
  if (!by_points(report))
    out +=
        "Contacts make single points chaotic: the centre of all points and their spread along x, y, z are compared "
        "instead. ";
  out += scene.conservative ? "Energy should be constant. " : "Energy is not constant here and not compared. ";
  if (scene.free) out += "Momentum should change by gravity alone. ";
  out += "</p>\n";
  if (!report.notes.empty()) {
    out += "<details><summary>Left out</summary><ul>";
    for (const std::string& note : report.notes) out += "<li>" + escaped(note) + "</li>";
    out += "</ul></details>\n";
  }
  return out;
}

std::string section(const SceneReport& report, const Machine& machine) {
  const auto& scene = report.scene;
  std::string out = "<section id=\"" + scene.name + "\">\n<h2>" + escaped(scene.title) + "</h2>\n";
  out +=
      "<p class=facts><code>" + scene.name + "</code> " + std::to_string(report.points) +
      (report.points == 1 ? " point" : " points") +
      (report.springs ? ", " + std::to_string(report.springs) + (report.springs == 1 ? " spring" : " springs") : "") +
      ", " + number(scene.duration) + " s, " + number(report.size) + " m across</p>\n";
  out += "<h3>Problem</h3><p>" + escaped(scene.problem) + "</p>\n";
  out += "<h3>Reference</h3><p>" + escaped(report.reference.text) + "</p>\n";
  out += "<h3>Set-up</h3>" + set_up(report);
  out += "<h3>Error against time</h3>\n";
  if (pareto(report).empty())
    out += "<p>No run gave an answer: there is nothing to draw.</p>\n";
  else
    out += "<div class=tools id=\"tools-" + scene.name + "\"></div>\n<div class=plot id=\"plot-" + scene.name +
           "\"></div>\n";
  out += cheapest_table(report) + all_rows(report);
  out += "<h3>Conclusion</h3><ul class=conclusion>";
  for (const std::string& sentence : conclusions(report)) out += "<li>" + escaped(sentence) + "</li>\n";
  out += "</ul>\n<h3>To repeat it</h3><p><code>" + escaped(machine.command) + "</code></p><p class=soft>" +
         facts_of(machine) + "</p>\n</section>\n";
  return out;
}

}  // namespace

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text)
    out += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : c == '"' ? "&quot;" : std::string(1, c);
  return out;
}

std::string number(double value, const char* pattern) {
  if (!std::isfinite(value)) return "–";
  char text[60];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}

std::string facts_of(const Machine& machine) {
  return escaped(machine.cpu) + "; " + escaped(machine.compiler) + "; Hooke " + escaped(machine.version) + ", commit " +
         escaped(machine.commit) + (machine.bullet.empty() ? "" : "; Bullet " + escaped(machine.bullet));
}

std::string page_head(const std::string& title) {
  std::string out =
      "<!DOCTYPE html>\n<html lang=en>\n<head>\n<meta charset=utf-8>\n<meta name=viewport "
      "content=\"width=device-width, initial-scale=1\">\n<title>" +
      escaped(title) + "</title>\n<style>\n";
  out += part(hooke_page_css, hooke_page_css_end);
  return out + "</style>\n</head>\n<body>\n";
}

std::string page(const std::vector<SceneReport>& reports, const Machine& machine) {
  std::string data = data_of(reports).dump();
  // Nothing in the data may end the script element.
  for (std::size_t at = 0; (at = data.find("</", at)) != std::string::npos; at += 3) data.replace(at, 2, "<\\/");
  std::string out = page_head("Hooke: speed against error");
  out +=
      "<header>\n<h1>Speed against error</h1>\n<p class=soft>" + facts_of(machine) +
      "</p>\n<p>Every method of Hooke in every precision, on scenes whose answer is known: what does a given error "
      "cost? A point far down is accurate, a point far to the left is cheap; what lies on the Pareto front is beaten "
      "by nothing else.</p>\n<nav>";
  for (const SceneReport& report : reports)
    out += "<a href=\"#" + report.scene.name + "\">" + escaped(report.scene.title) + "</a> ";
  out += "</nav>\n</header>\n";
  for (const SceneReport& report : reports) out += section(report, machine);
  out += "<footer>Plots by plotly.js (MIT license, Copyright Plotly, Inc.), which is part of this page.</footer>\n";
  out += "<script type=\"application/json\" id=\"data\">" + data + "</script>\n<script>\n";
  out += part(hooke_plotly, hooke_plotly_end);
  out += "\n</script>\n<script>\n";
  out += part(hooke_page_js, hooke_page_js_end);
  return out + "</script>\n</body>\n</html>\n";
}

}  // namespace hooke::report
