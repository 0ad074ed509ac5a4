// The state of a world as bytes: how they are written, and read without trust. What belongs to the state is
// the business of whoever owns it: World::save, Body::save.
#pragma once

#include <hooke/types.hpp>

#include <cstdint>
#include <iosfwd>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace hooke {

/// A number that a file can hold.
template <class T>
concept Number = std::is_arithmetic_v<T>;

/// 64 bits of any bytes; another value after any change within eight bytes that begin at a multiple of eight,
/// and but for one time in 2^64 after any other. Cost: about 0.5 ns a byte.
std::uint64_t checksum(std::string_view bytes);

/// Collects numbers in named sections, which may lie in each other.
///
/// File: "HOOKE\r\n\x1a", version (u32), size of the contents (u64), their checksum (u64), contents. Section: its
/// name, size (u64), what is in it. Text: size (u32), UTF-8. Array: rows (u64), numbers, column after column. All
/// numbers little-endian; a bool is a byte.
class CheckpointWriter {
 public:
  static constexpr std::uint32_t kVersion = 3;

  void begin(std::string_view section);
  void end();

  template <Number T>
  void add(T value) {
    if constexpr (std::is_same_v<T, bool>)
      add_numbers(&value, 1, 1);
    else
      add_numbers(&value, sizeof(T), 1);
  }
  void add(std::string_view text);
  template <class A>
  void add(const Eigen::PlainObjectBase<A>& array) {
    add(std::uint64_t(array.rows()));
    add_numbers(array.data(), sizeof(typename A::Scalar), std::size_t(array.size()));
  }
  template <Number T>
  void add(std::span<const T> list) {
    add(std::uint64_t(list.size()));
    add_numbers(list.data(), sizeof(T), list.size());
  }
  template <Number T>
  void add(const std::vector<T>& list) {
    add(std::span<const T>(list));
  }

  /// What was added so far, without the file's head.
  const std::string& contents() const { return bytes_; }
  /// Head and contents: the whole file.
  std::string file() const;

 private:
  void add_numbers(const void* values, std::size_t size, std::size_t count);

  std::string bytes_;
  std::vector<std::size_t> open_;  // where the sizes of open sections are
};

/// Reads what a CheckpointWriter wrote, in the same order. Everything is checked before it is used: whatever the
/// bytes, a call returns what it promises or throws hooke::Error naming file, section, value and rule. Memory is
/// asked for only where the file has the bytes to fill it.
class CheckpointReader {
 public:
  /// @param contents without the file's head  @param name what errors call the file
  CheckpointReader(std::string contents, std::string name);

  /// Reads a whole file and checks its head and checksum.
  static CheckpointReader read(std::istream& file, std::string name);

  void begin(std::string_view section);
  /// @throws hooke::Error where something is left of the section
  void end();
  /// @throws hooke::Error where something is left of the file
  void finish() const;

  /// A number from `least` to `most`; NaN is in no range.
  template <Number T>
  T number(const char* what, T least = std::numeric_limits<T>::lowest(), T most = std::numeric_limits<T>::max()) {
    T value{};
    if constexpr (std::is_same_v<T, bool>) {
      value = number<std::uint8_t>(what, 0, 1) == 1;
    } else {
      take(what, &value, sizeof(T), 1);
      if (!(value >= least && value <= most)) out_of_range(what, double(value), double(least), double(most));
    }
    return value;
  }
  std::string text(const char* what);
  /// How many things follow, at most `most`; each takes `bytes` or more.
  Index count(const char* what, Index most, std::size_t bytes = 1);
  /// An array of so many rows, all of them finite.
  template <class A>
  void array(const char* what, Eigen::PlainObjectBase<A>& out, Index rows) {
    using S = typename A::Scalar;
    check_rows(what, rows, sizeof(S) * std::size_t(A::ColsAtCompileTime));
    out.resize(rows, Eigen::NoChange);
    take(what, out.data(), sizeof(S), std::size_t(out.size()));
    if (!out.derived().array().isFinite().all()) fail(what, "must be finite");
  }
  /// So many numbers, of any value.
  template <Number T>
  void fill(const char* what, std::span<T> out) {
    check_rows(what, Index(out.size()), sizeof(T));
    take(what, out.data(), sizeof(T), out.size());
  }

  /// @throws hooke::Error naming file, section, `what` and the rule
  [[noreturn]] void fail(std::string_view what, std::string_view rule) const;
  void require(bool good, std::string_view what, std::string_view rule) const {
    if (!good) fail(what, rule);
  }

 private:
  void take(const char* what, void* values, std::size_t size, std::size_t count);
  void check_rows(const char* what, Index rows, std::size_t bytes);
  [[noreturn]] void out_of_range(const char* what, double value, double least, double most) const;
  std::size_t left() const;

  struct Section {
    std::string name;
    std::size_t end;
  };
  std::string bytes_, name_;
  std::size_t at_ = 0;
  std::vector<Section> open_;
};

/// What a checkpoint leaves to the program that builds the world: settings by name. Two worlds fit where these
/// are the same.
class Blueprint {
 public:
  void add(std::string name, std::string_view value) { entries_.emplace_back(std::move(name), value); }
  void add(std::string name, const char* value) { add(std::move(name), std::string_view(value)); }
  void add(std::string name, bool value) { add(std::move(name), value ? "true" : "false"); }
  void add(std::string name, double value);
  void add(std::string name, Index value) { add(std::move(name), std::to_string(value)); }
  /// Of much data, a checksum.
  void add_sum(std::string name, const CheckpointWriter& data);

  void save(CheckpointWriter& out) const;
  /// @throws hooke::Error naming the first entry that differs, and both values
  void check(CheckpointReader& in) const;

 private:
  std::vector<std::pair<std::string, std::string>> entries_;
};

}  // namespace hooke
