#include <scene/reader.hpp>

#include <hooke/error.hpp>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <set>

namespace hooke::scene {

namespace {

constexpr std::size_t kDeepest = 16;

// One line of printable text, however long or strange it was.
std::string tidy(std::string text, std::size_t most = 120) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  if (text.size() > most) {
    std::size_t end = most;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) --end;  // whole UTF-8 characters
    text = text.substr(0, end) + "...";
  }
  return text;
}

std::string shown(const Json& json) {
  if (json.is_object()) return "an object";
  if (json.is_array()) return "an array of " + std::to_string(json.size());
  return tidy(json.dump(-1, ' ', false, Json::error_handler_t::replace), 60);
}

// Follows the parser through the text: path, keys seen twice, depth.
class Follower {
 public:
  explicit Follower(const std::string& file) : file_(file) {}

  bool operator()(int, Json::parse_event_t event, Json& parsed) {
    using Event = Json::parse_event_t;
    switch (event) {
      case Event::object_start:
      case Event::array_start:
        open(event == Event::array_start);
        break;
      case Event::object_end:
      case Event::array_end:
        levels_.pop_back();
        count();
        break;
      case Event::value:
        count();
        break;
      case Event::key: {
        Level& level = levels_.back();
        level.key = parsed.get<std::string>();
        if (!level.keys.insert(level.key).second) throw Error(file_ + ": " + tidy(path()) + ": this key appears twice");
        break;
      }
    }
    return true;
  }

  std::string path() const {
    std::string out;
    for (const Level& level : levels_) {
      if (level.is_array)
        out += "[" + std::to_string(level.index) + "]";
      else if (!level.key.empty())
        out += (out.empty() ? "" : ".") + level.key;
    }
    return out;
  }

 private:
  struct Level {
    bool is_array;
    std::size_t index = 0;
    std::string key;
    std::set<std::string> keys;
  };
  void open(bool is_array) {
    if (levels_.size() >= kDeepest)
      throw Error(file_ + ": " + tidy(path()) + ": nested more than " + std::to_string(kDeepest) + " deep");
    levels_.push_back({is_array, 0, {}, {}});
  }
  void count() {
    if (!levels_.empty() && levels_.back().is_array) ++levels_.back().index;
  }

  const std::string& file_;
  std::vector<Level> levels_;
};

// "[json.exception.parse_error.101] parse error at line 1, column 2: …" without the brackets.
std::string plain(const std::string& what) {
  std::size_t begin = 0;
  if (const std::size_t at = what.find("] "); at != std::string::npos) begin = at + 2;
  std::string text = what.substr(begin);
  if (text.starts_with("parse error at ")) text = text.substr(15);
  return tidy(text, 200);
}

}  // namespace

const KeyTable& key_table() {
  static const KeyTable table{
      {"scene",
       {"hooke", "title", "gravity", "damping", "duration", "frame_rate", "tick_rate", "preroll", "poster", "bodies",
        "colliders", "camera"}},
      {"soft", {"type", "name", "origin",    "points", "velocities",   "masses",   "mass",  "springs",
                "pins", "grid", "mesh",      "cape",   "lattice",      "material", "pin",   "pin_motion",
                "wind", "drag", "thickness", "color",  "inside_color", "look",     "solver"}},
      {"spring", {"points", "stiffness", "damping", "rest_length"}},
      {"grid", {"size", "points", "right", "down"}},
      {"lattice", {"size", "points", "center", "rotation"}},
      {"cape", {"human", "size", "points"}},
      {"cloth_material", {"density", "stretch", "shear", "bend", "damping_ratio"}},
      {"damping_ratio", {"stretch", "shear", "bend"}},
      {"fixed_material", {"mass", "stiffness", "damping"}},
      {"lattice_material", {"density", "young", "poisson_ratio", "damping_ratio"}},
      {"fixed_lattice_material", {"mass", "stiffness", "damping_ratio"}},
      {"fixed_stiffness", {"structural", "shear", "bend"}},
      {"pin_motion", {"points", "translate", "swing", "keys"}},
      {"motion", {"translate", "swing", "keys"}},
      {"swing", {"amplitude", "period"}},
      {"key", {"time", "offset"}},
      {"wind",
       {"velocity", "gust", "gust_period", "swing", "stop", "fade", "air_density", "drag", "lift", "seed",
        "once_a_tick"}},
      {"drag", {"linear", "quadratic"}},
      {"particles",
       {"type", "name", "origin", "capacity", "at_capacity", "seed", "prewarm", "trail", "contact", "emitters",
        "forces", "sub_emitters", "kinds", "solver"}},
      {"contact", {"radius", "restitution", "rest_speed", "exact", "dies"}},
      {"emitter", {"shape",    "to",           "radius", "inner_radius", "angle",   "half_extent", "file", "position",
                   "axis",     "along_normal", "spread", "rate",         "bursts",  "start",       "stop", "speed",
                   "lifetime", "mass",         "size",   "motion",       "inherit", "kind"}},
      {"burst", {"time", "count", "period"}},
      {"linear_drag", {"force", "coefficient", "wind"}},
      {"quadratic_drag", {"force", "coefficient", "wind"}},
      {"attractor", {"force", "place", "strength", "radius"}},
      {"turbulence", {"force", "speed", "size", "turnover", "seed", "rate"}},
      {"vortex", {"force", "place", "axis", "circulation", "core", "updraught", "rate"}},
      {"velocity_field", {"force", "file", "grid", "place", "rate"}},
      {"repulsion", {"force", "stiffness", "distance"}},
      {"sub_emitter",
       {"on", "parent", "kind", "probability", "count", "least_impact", "axis", "spread", "speed", "inherit",
        "lifetime", "size", "mass"}},
      {"kind", {"name", "look", "color", "size", "intensity", "opacity"}},
      {"temperature", {"temperature"}},
      {"particle_solver", {"method", "dt", "precision"}},
      {"solver", {"error", "method", "dt", "wanted_error", "iterations", "precision", "compensated", "retries"}},
      {"half_space", {"type", "name", "normal", "offset", "friction", "restitution"}},
      {"sphere", {"type", "name", "center", "radius", "motion", "friction", "restitution", "color", "look"}},
      {"capsule", {"type", "name", "a", "b", "radius", "motion", "friction", "restitution", "color", "look"}},
      {"box", {"type", "name", "center", "size", "rotation", "motion", "friction", "restitution", "color", "look"}},
      {"rotation", {"axis", "angle"}},
      {"mesh", {"type", "name", "file", "origin", "voxel", "motion", "friction", "restitution", "color", "look"}},
      {"lathe",
       {"type", "name", "profile", "center", "axis", "voxel", "motion", "friction", "restitution", "color", "look"}},
      {"level_set", {"type", "name", "file", "grid", "origin", "motion", "friction", "restitution", "color", "look"}},
      {"human",
       {"type", "name", "motion", "height", "from", "until", "hold", "blend_in", "settle", "filter_hz", "friction",
        "restitution", "color"}},
      {"panels", {"hooke", "title", "scene", "set", "columns", "figures", "energy_curve", "panels"}},
      {"panel", {"title", "scene", "set", "may_diverge"}},
      {"camera", {"eye", "target", "origin", "fov", "follow"}},
  };
  return table;
}

Json parse_json(const std::string& text, const std::string& file) {
  Follower follower(file);
  try {
    return Json::parse(
        text, [&](int depth, Json::parse_event_t event, Json& parsed) { return follower(depth, event, parsed); });
  } catch (const Json::parse_error& error) {
    throw Error(file + ": " + plain(error.what()));
  } catch (const Json::exception& error) {
    const std::string path = tidy(follower.path());
    throw Error(file + ": " + (path.empty() ? "" : path + ": ") + "must be finite: " + plain(error.what()));
  }
}

void Value::fail(const std::string& rule) const {
  throw Error(tidy(file_, 300) + ": " + (path_.empty() ? "" : tidy(path_) + ": ") + tidy(rule, 600));
}

void Value::fail_got(const std::string& rule) const { fail(rule + ", got " + shown(*json_)); }

double Value::number(const Range& range, const char* unit) const {
  const std::string rule = std::string("must be ") + range.words + (*unit ? std::string(" [") + unit + "]" : "");
  if (!json_->is_number())
    fail_got(range.words == Range::any().words ? rule : "must be a number, " + std::string(range.words));
  const double value = json_->get<double>();
  const bool low = range.least_allowed ? value >= range.least : value > range.least;
  const bool high = range.most_allowed ? value <= range.most : value < range.most;
  if (!std::isfinite(value) || !low || !high) fail_got(rule);
  return value;
}

Index Value::whole(Index least, Index most) const {
  const std::string rule = "must be a whole number from " + std::to_string(least) + " to " + std::to_string(most);
  if (!json_->is_number_integer()) fail_got(rule);
  if (json_->is_number_unsigned() && json_->get<std::uint64_t>() > std::uint64_t(std::numeric_limits<Index>::max()))
    fail_got(rule);
  const Index value = json_->get<Index>();
  if (value < least || value > most) fail_got(rule);
  return value;
}

std::string Value::text() const {
  if (!json_->is_string()) fail_got("must be a text in quotes");
  const std::string text = json_->get<std::string>();
  if (text.empty()) fail("must not be empty");
  if (std::any_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }))
    fail_got("must have no control characters");
  return text;
}

bool Value::truth() const {
  if (!json_->is_boolean()) fail_got("must be true or false");
  return json_->get<bool>();
}

Vec3 Value::vec3() const {
  if (!json_->is_array() || json_->size() != 3) fail_got("must be an array of 3 numbers");
  return {at(0).number(), at(1).number(), at(2).number()};
}

std::size_t Value::array() const {
  if (!json_->is_array()) fail_got("must be an array");
  return json_->size();
}

Value Value::at(std::size_t i) const { return Value((*json_)[i], file_, path_ + "[" + std::to_string(i) + "]"); }

std::string Value::choice(const std::vector<std::string>& allowed) const {
  std::string list;
  for (const std::string& word : allowed) list += (list.empty() ? "" : ", ") + word;
  if (!json_->is_string() || std::find(allowed.begin(), allowed.end(), json_->get<std::string>()) == allowed.end())
    fail_got("must be one of " + list);
  return json_->get<std::string>();
}

Object::Object(const Value& value, std::string_view kind) : value_(value), kind_(kind) {
  if (!value.json().is_object()) value.fail_got("must be an object");
  const std::vector<std::string>& known = key_table().find(kind)->second;
  for (const auto& [key, unused] : value.json().items())
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      std::string list;
      for (const std::string& word : known) list += (list.empty() ? "" : ", ") + word;
      const std::string path = value.path().empty() ? key : value.path() + "." + key;
      Value(value.json(), value.file(), path).fail("unknown key; known here: " + list);
    }
}

bool Object::has(std::string_view key) const { return find(key).has_value(); }

std::optional<Value> Object::find(std::string_view key) const {
  assert(std::ranges::count(key_table().find(kind_)->second, key) == 1);
  const auto found = value_.json().find(std::string(key));
  if (found == value_.json().end()) return std::nullopt;
  return Value(*found, value_.file(), (value_.path().empty() ? "" : value_.path() + ".") + std::string(key));
}

Value Object::operator[](std::string_view key) const {
  const auto found = find(key);
  if (!found) value_.fail("the key \"" + std::string(key) + "\" is missing");
  return *found;
}

double Object::number(std::string_view key, double otherwise, const Range& range, const char* unit) const {
  const auto found = find(key);
  return found ? found->number(range, unit) : otherwise;
}

Vec3 Object::vec3(std::string_view key, const Vec3& otherwise) const {
  const auto found = find(key);
  return found ? found->vec3() : otherwise;
}

}  // namespace hooke::scene
