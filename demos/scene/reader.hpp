// Strict reading of JSON objects: every value is asked for by key, type and rule, and what
// breaks a rule is told with its path in the file. The keys of each kind of object stand in
// one table, which the schema is tested against.
#pragma once

#include <hooke/types.hpp>

#include <nlohmann/json.hpp>

#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hooke::scene {

using Json = nlohmann::json;

/// Keys of every kind of object, by the name that the schema gives the kind.
using KeyTable = std::map<std::string, std::vector<std::string>, std::less<>>;
const KeyTable& key_table();

/// Parses JSON text. Throws hooke::Error "FILE: …" naming line and column of a syntax error and
/// the path of a number that is too large, a key that appears twice, or nesting that is too deep.
Json parse_json(const std::string& text, const std::string& file);

/// A rule for numbers: the words that end "must be …".
struct Range {
  double least = -std::numeric_limits<double>::infinity(), most = std::numeric_limits<double>::infinity();
  bool least_allowed = true, most_allowed = true;
  const char* words = "a number";

  static Range any() { return {}; }
  static Range positive() { return {0, 1e300, false, true, "positive"}; }
  static Range not_negative() { return {0, 1e300, true, true, "0 or more"}; }
  static Range between(double least, double most, const char* words) { return {least, most, true, true, words}; }
};

/// A value in the file, with where it stands.
class Value {
 public:
  Value(const Json& json, std::string file, std::string path)
      : json_(&json), file_(std::move(file)), path_(std::move(path)) {}

  const std::string& path() const { return path_; }
  const std::string& file() const { return file_; }
  const Json& json() const { return *json_; }

  /// Throws hooke::Error "FILE: PATH: RULE".
  [[noreturn]] void fail(const std::string& rule) const;
  /// … "RULE, got VALUE".
  [[noreturn]] void fail_got(const std::string& rule) const;

  double number(const Range& range = Range::any(), const char* unit = "") const;
  Index whole(Index least, Index most) const;
  std::string text() const;   ///< not empty, no control characters
  bool truth() const;         ///< true or false
  Vec3 vec3() const;          ///< [x, y, z]
  std::size_t array() const;  ///< its length; fails for anything else
  Value at(std::size_t i) const;
  /// One of these words.
  std::string choice(const std::vector<std::string>& allowed) const;

 private:
  const Json* json_;
  std::string file_, path_;
};

/// An object of a kind of key_table(); unknown keys fail when it is opened.
class Object {
 public:
  Object(const Value& value, std::string_view kind);

  const Value& value() const { return value_; }
  bool has(std::string_view key) const;
  Value operator[](std::string_view key) const;  ///< required
  std::optional<Value> find(std::string_view key) const;

  double number(std::string_view key, double otherwise, const Range& range, const char* unit = "") const;
  Vec3 vec3(std::string_view key, const Vec3& otherwise) const;

 private:
  Value value_;
  std::string kind_;
};

}  // namespace hooke::scene
