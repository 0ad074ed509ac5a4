#include <hooke/checkpoint.hpp>

#include <hooke/error.hpp>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <istream>
#include <stdexcept>

namespace hooke {

namespace {

constexpr std::string_view kMagic("HOOKE\r\n\x1a", 8);
constexpr std::size_t kHead = 8 + 4 + 8 + 8;
constexpr std::size_t kMostText = 10'000;

// Numbers as they are in memory, from or to little-endian.
void copy_numbers(const char* from, char* to, std::size_t size, std::size_t count) {
  if (count == 0) return;
  std::memcpy(to, from, size * count);
  if constexpr (std::endian::native == std::endian::big)
    for (std::size_t i = 0; i < count; ++i) std::reverse(to + i * size, to + (i + 1) * size);
}

template <class T>
T number_at(std::string_view bytes, std::size_t at) {
  char native[sizeof(T)];
  copy_numbers(bytes.data() + at, native, sizeof(T), 1);
  T value;
  std::memcpy(&value, native, sizeof(T));
  return value;
}

// Fit for a line of text, whatever is in the file.
std::string shown(std::string_view text) {
  std::string out(text.substr(0, 80));
  for (char& c : out)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  return '"' + out + '"';
}

std::string text_of(double value) {
  char digits[40];
  return std::string(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

}  // namespace

// Words go through a bijection each, so that no change of one can be lost.
std::uint64_t checksum(std::string_view bytes) {
  std::uint64_t sum = 0x9e3779b97f4a7c15 ^ bytes.size();
  const auto mix = [&](std::uint64_t word) {
    sum = (sum ^ word) * 0xd6e8feb86659fd93;
    sum ^= sum >> 32;
  };
  std::size_t at = 0;
  for (; at + 8 <= bytes.size(); at += 8) mix(number_at<std::uint64_t>(bytes, at));
  std::string rest(bytes.substr(at));
  rest.resize(8, '\0');
  mix(number_at<std::uint64_t>(rest, 0));
  return sum;
}

// ---- Writing

void CheckpointWriter::add_numbers(const void* values, std::size_t size, std::size_t count) {
  const std::size_t at = bytes_.size();
  bytes_.resize(at + size * count);
  copy_numbers(static_cast<const char*>(values), bytes_.data() + at, size, count);
}

void CheckpointWriter::add(std::string_view text) {
  if (text.size() > kMostText) throw std::invalid_argument("CheckpointWriter: a text is longer than 10000 bytes");
  add(std::uint32_t(text.size()));
  bytes_ += text;
}

void CheckpointWriter::begin(std::string_view section) {
  add(section);
  open_.push_back(bytes_.size());
  add(std::uint64_t(0));
}

void CheckpointWriter::end() {
  if (open_.empty()) throw std::logic_error("CheckpointWriter: no section is open");
  const std::size_t at = open_.back();
  open_.pop_back();
  const std::uint64_t size = bytes_.size() - at - sizeof size;
  copy_numbers(reinterpret_cast<const char*>(&size), bytes_.data() + at, sizeof size, 1);
}

std::string CheckpointWriter::file() const {
  CheckpointWriter head;
  head.bytes_ = kMagic;
  head.bytes_.reserve(kHead + bytes_.size());
  head.add(kVersion);
  head.add(std::uint64_t(bytes_.size()));
  head.add(checksum(bytes_));
  return std::move(head.bytes_) + bytes_;
}

// ---- Reading

CheckpointReader::CheckpointReader(std::string contents, std::string name)
    : bytes_(std::move(contents)), name_(std::move(name)) {}

CheckpointReader CheckpointReader::read(std::istream& file, std::string name) {
  const auto refuse = [&](const std::string& why) -> void { throw Error(name + ": " + why); };
  std::string head(kHead, '\0');
  file.read(head.data(), std::streamsize(kHead));
  head.resize(std::size_t(file.gcount()));
  if (head.empty()) refuse("is empty; a checkpoint was expected");
  if (head.compare(0, kMagic.size(), kMagic.substr(0, head.size())) != 0) refuse("is not a checkpoint of Hooke");
  if (head.size() < kHead) refuse("is truncated: " + std::to_string(head.size()) + " bytes are no head");
  const auto version = number_at<std::uint32_t>(head, 8);
  if (version != CheckpointWriter::kVersion)
    refuse("has format version " + std::to_string(version) + ", this program reads version " +
           std::to_string(CheckpointWriter::kVersion) + "; start again without it");
  const auto size = number_at<std::uint64_t>(head, 12), sum = number_at<std::uint64_t>(head, 20);
  // Piece by piece: a damaged size must not ask for memory.
  constexpr std::size_t kPiece = 1 << 20;
  std::string contents;
  while (contents.size() < size) {
    const std::size_t have = contents.size();
    contents.resize(std::size_t(std::min<std::uint64_t>(size, std::max(2 * have, kPiece))));
    file.read(contents.data() + have, std::streamsize(contents.size() - have));
    const std::size_t got = std::size_t(file.gcount());
    if (have + got < contents.size())
      refuse("is truncated: its contents should have " + std::to_string(size) + " bytes, got " +
             std::to_string(have + got));
  }
  if (file.peek() != std::istream::traits_type::eof()) refuse("is damaged: it goes on after its end");
  if (checksum(contents) != sum) refuse("is damaged: its checksum does not fit its contents");
  return CheckpointReader(std::move(contents), std::move(name));
}

std::size_t CheckpointReader::left() const { return (open_.empty() ? bytes_.size() : open_.back().end) - at_; }

void CheckpointReader::fail(std::string_view what, std::string_view rule) const {
  std::string where = name_ + ": ";
  for (const Section& section : open_) where += section.name + ": ";
  throw Error(where + std::string(what) + " " + std::string(rule));
}

void CheckpointReader::out_of_range(const char* what, double value, double least, double most) const {
  fail(what, "must be from " + text_of(least) + " to " + text_of(most) + ", got " + text_of(value));
}

void CheckpointReader::take(const char* what, void* values, std::size_t size, std::size_t count) {
  if (left() / size < count) fail(what, "is missing: the section is too short");
  copy_numbers(bytes_.data() + at_, static_cast<char*>(values), size, count);
  at_ += size * count;
}

void CheckpointReader::check_rows(const char* what, Index rows, std::size_t bytes) {
  const auto there = number<std::uint64_t>(what);
  if (there != std::uint64_t(rows))
    fail(what, "must have " + std::to_string(rows) + " rows in this world, got " + std::to_string(there));
  if (left() / bytes < there) fail(what, "is missing: the section is too short");
}

std::string CheckpointReader::text(const char* what) {
  const auto size = number<std::uint32_t>(what);
  if (size > kMostText || size > left()) fail(what, "is missing: the section is too short");
  at_ += size;
  return bytes_.substr(at_ - size, size);
}

Index CheckpointReader::count(const char* what, Index most, std::size_t bytes) {
  const auto value = number<std::uint64_t>(what);
  if (value > std::uint64_t(most))
    fail(what, "must be at most " + std::to_string(most) + ", got " + std::to_string(value));
  if (value > left() / bytes) fail(what, "is " + std::to_string(value) + ", but the section is too short for them");
  return Index(value);
}

void CheckpointReader::begin(std::string_view section) {
  const std::string name = text("section");
  if (name != section) fail("the next section", "must be " + shown(section) + ", got " + shown(name));
  const auto size = number<std::uint64_t>("size");
  if (size > left()) fail("section " + shown(section), "is longer than what it is in");
  open_.push_back({name, at_ + std::size_t(size)});
}

void CheckpointReader::end() {
  if (open_.empty()) throw std::logic_error("CheckpointReader: no section is open");
  if (left() > 0) fail("the section", "has " + std::to_string(left()) + " bytes that nobody asked for");
  open_.pop_back();
}

void CheckpointReader::finish() const { require(left() == 0, "the file", "goes on after its last section"); }

// ---- Blueprints

void Blueprint::add(std::string name, double value) { add(std::move(name), text_of(value)); }

void Blueprint::add_sum(std::string name, const CheckpointWriter& data) {
  char digits[17];
  const auto end = std::to_chars(digits, digits + sizeof digits, checksum(data.contents()), 16).ptr;
  add(std::move(name), "with checksum " + std::string(digits, end));
}

void Blueprint::save(CheckpointWriter& out) const {
  out.add(std::uint64_t(entries_.size()));
  for (const auto& [name, value] : entries_) {
    out.add(name);
    out.add(value);
  }
}

void Blueprint::check(CheckpointReader& in) const {
  const Index count = in.count("number of settings", std::numeric_limits<Index>::max(), 8);
  std::size_t at = 0;
  for (Index i = 0; i < count; ++i, ++at) {
    const std::string name = in.text("setting"), value = in.text("setting");
    if (at >= entries_.size()) in.fail(shown(name), "is a setting of the checkpoint and there is none here");
    if (name != entries_[at].first)
      in.fail("the checkpoint", "has the setting " + shown(name) + " where there is " + shown(entries_[at].first));
    if (value != entries_[at].second)
      in.fail(name, "is " + shown(value) + " in the checkpoint and " + shown(entries_[at].second) + " here");
  }
  if (at < entries_.size()) in.fail(shown(entries_[at].first), "is a setting here and not of the checkpoint");
}

}  // namespace hooke
