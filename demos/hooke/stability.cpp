#include "commands.hpp"

#include <hooke/error.hpp>
#include <stability/stability.hpp>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <mutex>
#include <thread>

namespace hooke::command {

namespace {

using stability::Case;
using stability::Row;

std::vector<Case> chosen_cases(const StabilityOptions& options) {
  const std::vector<Case> all = stability::cases();
  std::vector<Case> out;
  std::string names;
  for (const Case& hard : all) {
    names += (names.empty() ? "" : ", ") + hard.name;
    if (options.cases.empty()) out.push_back(hard);
  }
  for (const std::string& name : options.cases) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const Case& hard) { return hard.name == name; });
    if (found == all.end()) throw Error("there is no hard case \"" + name + "\"; there are " + names);
    out.push_back(*found);
  }
  return out;
}

// Every row of a case, in the table's order; rows are independent, so threads share them.
std::vector<Row> measure(const Case& hard, const std::vector<stability::Trial>& trials, int threads,
                         const std::function<void(double)>& done) {
  std::vector<Row> rows(trials.size());
  std::atomic<std::size_t> next = 0, finished = 0;
  std::mutex telling;
  const auto work = [&] {
    for (std::size_t i = next++; i < trials.size() && !interrupted(); i = next++) {
      rows[i] = stability::measure(hard, trials[i]);
      const std::lock_guard lock(telling);
      done(double(++finished) / double(trials.size()));
    }
  };
  {
    std::vector<std::jthread> others;
    for (int i = 1; i < threads; ++i) others.emplace_back(work);
    work();
  }
  std::erase_if(rows, [](const Row& row) { return row.method.empty(); });
  return rows;
}

std::string command_of(const StabilityOptions& options) {
  std::string out = "hooke stability";
  for (const std::string& name : options.cases) out += " " + name;
  if (!options.method.empty()) out += " --method " + options.method;
  return out + (options.thorough ? " --long" : "") + " --out DIR";
}

}  // namespace

int stability(const StabilityOptions& options) {
  if (options.threads < 1 || options.threads > 1024)
    throw Error("--threads must be from 1 to 1024, got " + std::to_string(options.threads));
  const std::vector<Case> cases = chosen_cases(options);
  const std::vector<std::string> methods = stability::solvers();
  if (!options.method.empty() && std::find(methods.begin(), methods.end(), options.method) == methods.end()) {
    std::string names;
    for (const std::string& name : methods) names += (names.empty() ? "" : ", ") + name;
    throw Error("--method: the table has no rows of \"" + options.method + "\"; it has " + names);
  }
  report::Machine machine = report::this_machine();
  machine.command = command_of(options);

  // What cannot be written is told before minutes are spent.
  io::make_folder(options.out);
  stability::Table table(options.out / "table.csv");
  io::OutputFile page(options.out / "table.html"), text(options.out / "table.md");

  catch_signals();
  std::vector<Row> rows;
  std::size_t begun = 0;
  for (; begun < cases.size() && !interrupted(); ++begun) {
    const Case& hard = cases[begun];
    Progress progress(std::to_string(begun + 1) + " of " + std::to_string(cases.size()) + ", " + hard.name);
    auto trials = stability::trials(hard, options.thorough);
    if (!options.method.empty())
      std::erase_if(trials, [&](const auto& trial) { return trial.solver.method != options.method; });
    for (Row& row : measure(hard, trials, options.threads, [&](double done) { progress.show(done); })) {
      table.add(row, machine);
      rows.push_back(std::move(row));
    }
    progress.finish();
    std::printf("%s: %s\n", hard.name.c_str(), stability::summary(rows, hard.name).c_str());
    std::fflush(stdout);
  }
  table.finish();
  page.write(stability::page(cases, rows, machine));
  page.commit();
  text.write(stability::markdown(cases, rows));
  text.commit();
  if (const char* problem = stability::draw(rows, options.out / "table.png"))
    std::fprintf(stderr, "hooke: no picture: %s\n", problem);
  std::printf("%s\n%s\n", (options.out / "table.csv").c_str(), (options.out / "table.html").c_str());
  return interrupted() ? kInterrupted : kDone;
}

}  // namespace hooke::command
