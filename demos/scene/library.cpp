#include <scene/library.hpp>

#include <hooke/error.hpp>
#include <scene/parse.hpp>

#include <algorithm>
#include <filesystem>

namespace hooke::scene {

namespace {

// Where scene files are: beside the source, else where an installed command finds its share.
std::vector<std::filesystem::path> scene_folders() {
  std::vector<std::filesystem::path> out;
  std::error_code error;
  const auto add = [&](const std::filesystem::path& folder) {
    if (std::filesystem::is_directory(folder, error)) out.push_back(folder);
  };
  add(HOOKE_SCENE_SOURCE_FOLDER);
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (!error) add(program.parent_path().parent_path() / HOOKE_SCENE_SHARE_FOLDER);
  return out;
}

}  // namespace

std::filesystem::path scene_file(const std::string& name) {
  std::error_code error;
  for (const auto& folder : scene_folders())
    if (const auto path = folder / (name + ".json"); std::filesystem::is_regular_file(path, error)) return path;
  return {};
}

void add_named_files(const std::string& subfolder,
                     const std::function<std::string(const std::filesystem::path&)>& title_of,
                     std::vector<NamedScene>& out) {
  std::error_code none;
  for (const auto& folder : scene_folders())
    for (const auto& entry : std::filesystem::directory_iterator(folder / subfolder, none)) {
      if (entry.path().extension() != ".json") continue;
      const std::string name = entry.path().stem();
      if (std::any_of(out.begin(), out.end(), [&](const NamedScene& scene) { return scene.name == name; })) continue;
      try {
        out.push_back({name, title_of(entry.path())});
      } catch (const Error& error) {
        out.push_back({name, error.what()});
      }
    }
  std::sort(out.begin(), out.end(), [](const NamedScene& a, const NamedScene& b) { return a.name < b.name; });
}

std::string names_of(const std::vector<NamedScene>& scenes) {
  std::string out;
  for (const NamedScene& scene : scenes) out += (out.empty() ? "" : ", ") + scene.name;
  return out;
}

std::vector<NamedScene> named_scenes() {
  std::vector<NamedScene> out;
  for (const StandardScene& scene : standard_scenes())
    if (scene.description) out.push_back({scene.name, scene.title});
  add_named_files(
      "", [](const auto& path) { return read_scene(path).title; }, out);
  return out;
}

SceneDescription find_scene(const std::string& path_or_name) {
  std::error_code error;
  if (std::filesystem::exists(path_or_name, error) && !std::filesystem::is_directory(path_or_name, error))
    return read_scene(path_or_name);
  for (StandardScene& scene : standard_scenes()) {
    if (path_or_name != scene.name) continue;
    if (scene.description) return *std::move(scene.description);
    throw Error(path_or_name + " is a scene of the report alone (hooke report): no scene file can say it");
  }
  if (const auto path = scene_file(path_or_name); !path.empty()) return read_scene(path);
  throw Error(path_or_name + ": there is no such scene file, nor a scene of that name; there are " +
              names_of(named_scenes()));
}

}  // namespace hooke::scene
