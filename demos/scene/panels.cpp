#include <scene/panels.hpp>

#include <hooke/error.hpp>
#include <scene/library.hpp>
#include <scene/parse.hpp>
#include <scene/reader.hpp>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

namespace hooke::scene {

namespace {

std::string contents_of(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) throw Error(path.string() + ": is a folder, not a file of panels");
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (!file || !(text << file.rdbuf())) throw Error(path.string() + ": cannot read: " + std::strerror(errno));
  return text.str();
}

// A scene's JSON, and where the files that it names are.
struct Base {
  Json json;
  std::filesystem::path folder;
};

Base base_of(const Value& value, const std::filesystem::path& folder) {
  if (value.json().is_object()) return {value.json(), folder};
  const std::string name = value.text();
  std::filesystem::path path = folder / name;
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) path = scene_file(name);
  if (path.empty()) value.fail_got("must be a scene file, its name in hooke list, or a scene");
  return {parse_json(contents_of(path), path.string()), path.parent_path()};
}

// Replaces or adds what the keys, JSON pointers as "/bodies/0/solver/method", point to.
void change(Json& scene, const Value& changes) {
  if (!changes.json().is_object()) changes.fail_got("must be an object");
  for (const auto& [pointer, value] : changes.json().items()) {
    try {
      scene[Json::json_pointer(pointer)] = value;
    } catch (const Json::exception&) {
      changes.fail("\"" + pointer + "\" must point into the scene, as \"/bodies/0/solver/method\"");
    }
  }
}

Figure figure_of(const Value& value) {
  const std::vector<std::string> names{"speed", "stretch", "energy"};
  return Figure(std::find(names.begin(), names.end(), value.choice(names)) - names.begin());
}

}  // namespace

Panels read_panels(const std::filesystem::path& path) {
  const std::string file = path.string();
  const Json json = parse_json(contents_of(path), file);
  const Object object(Value(json, file, ""), "panels");
  if (const Value version = object["hooke"]; !version.json().is_number_integer() || version.json() != 1)
    version.fail_got("must be 1, the version of the format");
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  Panels out;
  out.file = file;
  if (object.has("title")) out.title = object["title"].text();
  if (object.has("energy_curve")) out.energy_curve = object["energy_curve"].truth();
  if (const auto figures = object.find("figures"))
    for (std::size_t i = 0; i < figures->array(); ++i) out.figures.push_back(figure_of(figures->at(i)));
  const Value panels = object["panels"];
  if (panels.array() < 1 || panels.array() > 16) panels.fail("must have 1 to 16 panels");
  out.columns = int(std::min<std::size_t>(3, panels.array()));
  if (object.has("columns")) out.columns = int(object["columns"].whole(1, Index(panels.array())));
  for (std::size_t i = 0; i < panels.array(); ++i) {
    const Object panel(panels.at(i), "panel");
    const Object& from = panel.has("scene") ? panel : object;
    if (!from.has("scene")) panels.at(i).fail("needs a scene, its own or that of the whole file");
    Base base = base_of(from["scene"], folder);
    if (object.has("set")) change(base.json, object["set"]);
    if (panel.has("set")) change(base.json, panel["set"]);
    Panel each;
    each.title = panel["title"].text();
    each.scene = parse_scene(base.json.dump(), file + ": " + panels.at(i).path(), base.folder);
    if (panel.has("may_diverge")) each.may_diverge = panel["may_diverge"].truth();
    const SceneDescription& first = out.panels.empty() ? each.scene : out.panels[0].scene;
    if (each.scene.duration != first.duration || each.scene.frame_rate != first.frame_rate)
      panels.at(i).fail("must have the duration and the frame_rate of the first panel");
    out.panels.push_back(std::move(each));
  }
  return out;
}

Panels find_panels(const std::string& path_or_name) {
  std::error_code error;
  if (std::filesystem::exists(path_or_name, error)) return read_panels(path_or_name);
  if (const auto path = scene_file("panels/" + path_or_name); !path.empty()) return read_panels(path);
  throw Error(path_or_name + ": there is no such file of panels, nor panels of that name; there are " +
              names_of(named_panels()));
}

std::vector<NamedScene> named_panels() {
  std::vector<NamedScene> out;
  add_named_files(
      "panels", [](const auto& path) { return read_panels(path).title; }, out);
  return out;
}

}  // namespace hooke::scene
