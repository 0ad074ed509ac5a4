// Files that are written safely: under a temporary name until they are complete, and with
// every failure told. Numbers are written the same in every locale.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace hooke::io {

/// A number with 17 significant digits, enough to read the same double back, whatever the locale.
std::string text_of(double value);

/// NAME.part.EXT for NAME.EXT, in the same folder.
std::filesystem::path part_name(const std::filesystem::path& path);

/// Makes a folder and those it is in. Throws hooke::OutputError naming it and the reason.
void make_folder(const std::filesystem::path& folder);

/// A file that is called NAME.part.EXT while it is written and gets its name in commit(), so
/// that NAME.EXT is always complete. Whatever fails (open, write, close, rename) throws
/// hooke::OutputError naming the file and the system's reason.
class OutputFile {
 public:
  /// What becomes of the part file when the object goes without commit().
  enum class Leftover {
    Remove,
    Keep  ///< for files that can be read wherever they were cut off
  };

  explicit OutputFile(std::filesystem::path path, Leftover leftover = Leftover::Remove);
  /// Goes on after the first `keep` bytes of what another run left under the temporary name or, if there is none,
  /// under the file's own; the rest is cut off.
  /// @throws hooke::Error where neither is there or has so many bytes
  OutputFile(std::filesystem::path path, Leftover leftover, std::int64_t keep);
  ~OutputFile();
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;

  const std::filesystem::path& path() const { return path_; }

  void write(std::string_view text);
  void write(double value);        ///< as text_of()
  void write(std::int64_t value);  ///< decimal digits
  void write_bytes(std::span<const std::byte> bytes);

  /// Replaces bytes already written, `offset` bytes from the beginning; writing goes on at the end.
  void rewrite(std::int64_t offset, std::span<const std::byte> bytes);

  /// Hands everything written so far to the system.
  void flush();
  /// Has the system write it to the disk.
  void sync();
  std::int64_t size();  ///< [bytes] written so far

  /// Closes the file and renames it to path(). Nothing may be written afterwards.
  void commit();

 private:
  [[noreturn]] void fail(const char* action, int reason);

  std::filesystem::path path_, part_;
  Leftover leftover_;
  std::FILE* file_ = nullptr;
};

}  // namespace hooke::io
