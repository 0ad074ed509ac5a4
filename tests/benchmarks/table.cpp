#include "table.hpp"

#include "commit.hpp"
#include "yardstick.hpp"

#include <hooke/io/tables.hpp>

#ifdef HOOKE_BENCH_HAS_HIGHWAY
#include <hwy/targets.h>
#endif

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <stdexcept>
#include <thread>

namespace hooke::bench {

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
#else
  out.compiler = "gcc " __VERSION__;
#endif
  out.flags = HOOKE_BENCH_FLAGS;
  out.yardstick_flags = yardstick_flags();
#ifdef HOOKE_BENCH_HAS_HIGHWAY
  // Of the targets that are compiled in, the best is the lowest bit.
  const auto usable = hwy::SupportedTargets() & HWY_TARGETS;
  out.instruction_set = hwy::TargetName(usable & -usable);
#else
  out.instruction_set = "no Highway";
#endif
  out.commit = HOOKE_COMMIT;
  const std::time_t now = std::time(nullptr);
  char text[40];
  std::strftime(text, sizeof text, "%Y-%m-%d", std::gmtime(&now));
  out.date = text;
  out.processors = int(std::thread::hardware_concurrency());
  return out;
}

std::string Machine::text() const {
  return cpu + ", " + std::to_string(processors) + " processors, " + instruction_set + "; " + compiler + " (" + flags +
         "; yardstick " + yardstick_flags + "); commit " + commit + ", " + date;
}

Cell::Cell(double value, const char* format) {
  if (!std::isfinite(value)) {
    shown = "-";
    return;
  }
  char text[80];
  std::snprintf(text, sizeof text, format, value);
  shown = text;
  exact = io::text_of(value);
}

Table::Table(std::string file, std::string title, std::vector<std::string> columns)
    : file_(std::move(file)), title_(std::move(title)), columns_(std::move(columns)) {}

void Table::add(std::vector<Cell> cells, int threads) {
  if (cells.size() != columns_.size()) throw std::invalid_argument("table " + file_ + ": a row of the wrong length");
  rows_.push_back({std::move(cells), threads});
}

void Table::print() const {
  std::printf("\n## %s\n\n", title_.c_str());
  for (const std::string& column : columns_) std::printf("| %s ", column.c_str());
  std::printf("|\n");
  for (std::size_t i = 0; i < columns_.size(); ++i) std::printf("| --- ");
  std::printf("|\n");
  for (const Row& row : rows_) {
    for (const Cell& cell : row.cells) std::printf("| %s ", cell.shown.c_str());
    std::printf("|\n");
  }
  if (!notes_.empty()) std::printf("\n");
  for (const std::string& sentence : notes_) std::printf("- %s\n", sentence.c_str());
  std::fflush(stdout);
}

void Table::write(const std::filesystem::path& folder, const Machine& machine) const {
  io::OutputFile file(folder / (file_ + ".csv"));
  const auto field = [&](const std::string& text, const char* end) {
    file.write(io::csv_field(text));
    file.write(end);
  };
  for (const std::string& column : columns_) field(column, ",");
  file.write("threads,cpu,processors,instruction set,compiler,flags,yardstick flags,commit,date\n");
  for (const Row& row : rows_) {
    for (const Cell& cell : row.cells) field(cell.exact, ",");
    field(std::to_string(row.threads), ",");
    field(machine.cpu, ",");
    field(std::to_string(machine.processors), ",");
    field(machine.instruction_set, ",");
    field(machine.compiler, ",");
    field(machine.flags, ",");
    field(machine.yardstick_flags, ",");
    field(machine.commit, ",");
    field(machine.date, "\n");
  }
  file.commit();
}

}  // namespace hooke::bench
