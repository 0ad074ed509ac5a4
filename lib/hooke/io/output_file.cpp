#include <hooke/io/output_file.hpp>

#include <hooke/error.hpp>

#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <system_error>
#include <utility>

namespace hooke::io {

std::string text_of(double value) {
  char digits[40];
  const auto end = std::to_chars(digits, digits + sizeof digits, value, std::chars_format::general, 17).ptr;
  return std::string(digits, end);
}

std::filesystem::path part_name(const std::filesystem::path& path) {
  std::filesystem::path name = path.stem();
  name += ".part";
  name += path.extension();
  return path.parent_path() / name;
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw OutputError(folder.string() + ": cannot make the folder: " + error.message());
  if (!std::filesystem::is_directory(folder, error))
    throw OutputError(folder.string() + ": cannot make the folder: something else has this name");
}

OutputFile::OutputFile(std::filesystem::path path, Leftover leftover)
    : path_(std::move(path)), part_(part_name(path_)), leftover_(leftover) {
  file_ = std::fopen(part_.c_str(), "wb");
  if (!file_) fail("open", errno);
}

OutputFile::OutputFile(std::filesystem::path path, Leftover leftover, std::int64_t keep)
    : path_(std::move(path)), part_(part_name(path_)), leftover_(leftover) {
  std::error_code error;
  const std::filesystem::path from = std::filesystem::exists(part_, error) ? part_ : path_;
  const std::uintmax_t there = std::filesystem::file_size(from, error);
  if (error) throw Error(from.string() + ": cannot be continued: " + error.message());
  if (there < std::uintmax_t(keep))
    throw Error(from.string() + ": cannot be continued after " + std::to_string(keep) + " bytes, it has only " +
                std::to_string(there));
  if (from == path_) std::filesystem::rename(path_, part_, error);
  if (error) fail("rename", error.value());
  std::filesystem::resize_file(part_, std::uintmax_t(keep), error);
  if (error) fail("cut", error.value());
  file_ = std::fopen(part_.c_str(), "r+b");
  if (!file_) fail("open", errno);
  if (std::fseek(file_, 0, SEEK_END) != 0) fail("seek", errno);
}

OutputFile::~OutputFile() {
  if (!file_) return;
  std::fclose(file_);
  std::error_code ignored;
  if (leftover_ == Leftover::Remove) std::filesystem::remove(part_, ignored);
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      part_(std::move(other.part_)),
      leftover_(other.leftover_),
      file_(std::exchange(other.file_, nullptr)) {}

void OutputFile::fail(const char* action, int reason) {
  throw OutputError(path_.string() + ": cannot " + action + ": " + std::strerror(reason));
}

void OutputFile::write(std::string_view text) { write_bytes(std::as_bytes(std::span(text.data(), text.size()))); }

void OutputFile::write(double value) { write(text_of(value)); }

void OutputFile::write(std::int64_t value) { write(std::to_string(value)); }

void OutputFile::write_bytes(std::span<const std::byte> bytes) {
  if (!bytes.empty() && std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail("write", errno);
}

void OutputFile::rewrite(std::int64_t offset, std::span<const std::byte> bytes) {
  if (std::fseek(file_, static_cast<long>(offset), SEEK_SET) != 0) fail("seek", errno);
  write_bytes(bytes);
  if (std::fseek(file_, 0, SEEK_END) != 0) fail("seek", errno);
}

void OutputFile::flush() {
  if (std::fflush(file_) != 0) fail("write", errno);
}

void OutputFile::sync() {
  flush();
  // Pipes and the like have nothing to write to.
  if (::fsync(::fileno(file_)) != 0 && errno != EINVAL && errno != EROFS) fail("write", errno);
}

std::int64_t OutputFile::size() {
  const long at = std::ftell(file_);
  if (at < 0) fail("tell the size", errno);
  return at;
}

void OutputFile::commit() {
  flush();
  std::FILE* const file = std::exchange(file_, nullptr);
  const auto give_up = [&](const char* action, int reason) {
    std::error_code ignored;
    if (leftover_ == Leftover::Remove) std::filesystem::remove(part_, ignored);
    fail(action, reason);
  };
  if (std::fclose(file) != 0) give_up("close", errno);
  std::error_code error;
  std::filesystem::rename(part_, path_, error);
  if (error) give_up("rename", error.value());
}

}  // namespace hooke::io
