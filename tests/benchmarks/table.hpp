// What is measured, printed as Markdown and written as CSV.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hooke::bench {

/// Where and by what it was measured; stands in every line of a CSV file.
struct Machine {
  std::string cpu, compiler, flags, yardstick_flags, instruction_set, commit, date;
  int processors = 1;

  /// One line for people.
  std::string text() const;
};
Machine this_machine();

/// A cell: what people see, and all digits for programs.
struct Cell {
  std::string shown, exact;
  Cell(const char* text) : shown(text), exact(text) {}
  Cell(const std::string& text) : shown(text), exact(text) {}
  Cell(int value) : shown(std::to_string(value)), exact(shown) {}
  Cell(double value, const char* format);  ///< printf's; a value that is not finite is "-" and empty
};

class Table {
 public:
  /// @param file name of the CSV file, without ending
  Table(std::string file, std::string title, std::vector<std::string> columns);

  /// @param threads that the row's run used
  void add(std::vector<Cell> cells, int threads = 1);
  void note(const std::string& sentence) { notes_.push_back(sentence); }

  void print() const;
  /// @throws hooke::OutputError
  void write(const std::filesystem::path& folder, const Machine& machine) const;

 private:
  struct Row {
    std::vector<Cell> cells;
    int threads;
  };
  std::string file_, title_;
  std::vector<std::string> columns_, notes_;
  std::vector<Row> rows_;
};

}  // namespace hooke::bench
