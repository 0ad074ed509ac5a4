#include "commands.hpp"

#include <hooke/error.hpp>
#include <report/report.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace hooke::command {

namespace {

std::vector<scene::StandardScene> chosen_scenes(const ReportOptions& options) {
  const std::vector<scene::StandardScene> all = scene::standard_scenes();
  std::vector<scene::StandardScene> out;
  std::string names;
  for (const scene::StandardScene& scene : all) {
    names += (names.empty() ? "" : ", ") + scene.name;
    if (options.scenes.empty() && !(options.quick && scene.large)) out.push_back(scene);
  }
  for (const std::string& name : options.scenes) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const auto& scene) { return scene.name == name; });
    if (found == all.end()) throw Error("there is no standard scene \"" + name + "\"; there are " + names);
    out.push_back(*found);
  }
  return out;
}

report::Effort effort_of(const ReportOptions& options) {
  report::Effort effort;
  if (options.quick) effort = {1.5, 0.005};
  if (!options.budget) return effort;
  if (!(*options.budget > 0 && std::isfinite(*options.budget)))
    throw Error("--budget must be positive [s], got " + std::to_string(*options.budget));
  effort.budget = *options.budget;
  effort.repeat = std::min(effort.repeat, effort.budget / 100);
  return effort;
}

std::string command_of(const ReportOptions& options) {
  std::string out = "hooke report";
  for (const std::string& scene : options.scenes) out += " " + scene;
  char text[60] = "";
  if (options.budget) std::snprintf(text, sizeof text, " --budget %g", *options.budget);
  return out + (options.quick ? " --quick" : "") + text + " --out DIR";
}

}  // namespace

int report(const ReportOptions& options) {
  const std::vector<scene::StandardScene> scenes = chosen_scenes(options);
  const report::Effort effort = effort_of(options);
  report::Machine machine = report::this_machine();
  machine.command = command_of(options);

  // What cannot be written is told before minutes are spent.
  io::make_folder(options.out);
  report::Table table(options.out / "report.csv");
  io::OutputFile page(options.out / "report.html");

  catch_signals();
  std::vector<report::SceneReport> reports;
  bool drawn = true;
  for (std::size_t i = 0; i < scenes.size() && !interrupted(); ++i) {
    Progress progress(std::to_string(i + 1) + " of " + std::to_string(scenes.size()) + ", " + scenes[i].name);
    reports.push_back(report::measure(scenes[i], effort, [&](double done) { progress.show(done); }));
    progress.finish();
    table.add(reports.back(), machine);
    const char* problem = drawn ? report::draw(reports.back(), options.out / (scenes[i].name + ".png")) : nullptr;
    if (problem) std::fprintf(stderr, "hooke: no pictures: %s\n", problem), drawn = false;
    std::printf("%s\n", scenes[i].title.c_str());
    for (const std::string& sentence : report::conclusions(reports.back())) std::printf("  %s\n", sentence.c_str());
    std::fflush(stdout);
  }
  table.finish();
  page.write(report::page(reports, machine));
  page.commit();
  std::printf("%s\n%s\n", (options.out / "report.csv").c_str(), (options.out / "report.html").c_str());
  return reports.size() < scenes.size() ? kInterrupted : kDone;
}

}  // namespace hooke::command
