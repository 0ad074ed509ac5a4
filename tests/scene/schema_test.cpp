// The schema, the manual page and the parser must know the same keys.
#include <hooke/method.hpp>
#include <scene/parse.hpp>
#include <scene/reader.hpp>

#include <io/temporary_folder.hpp>

#include <gmock/gmock.h>

namespace hooke::scene {
namespace {

const std::filesystem::path kDocs = HOOKE_DOCS_FOLDER;

std::vector<std::string> keys_of(const Json& object) {
  std::vector<std::string> out;
  for (const auto& [key, unused] : object.at("properties").items()) out.push_back(key);
  return out;
}

TEST(Schema, HasExactlyTheKeysThatTheParserKnows) {
  const Json schema = Json::parse(test::contents(kDocs / "scene.schema.json"));
  for (const auto& [kind, keys] : key_table()) {
    const Json& object = kind == "scene" ? schema : schema.at("$defs").at(kind);
    EXPECT_THAT(keys_of(object), ::testing::UnorderedElementsAreArray(keys)) << kind;
    EXPECT_EQ(object.at("additionalProperties"), false) << kind;
    for (const auto& [key, property] : object.at("properties").items())
      EXPECT_TRUE(property.contains("description")) << kind << "." << key;
  }
  for (const auto& [kind, object] : schema.at("$defs").items())
    EXPECT_TRUE(!object.contains("properties") || key_table().contains(kind)) << kind;
}

TEST(Schema, ListsTheMethodsThereAre) {
  const Json schema = Json::parse(test::contents(kDocs / "scene.schema.json"));
  std::vector<std::string> names;
  for (const Method* method : methods()) names.emplace_back(method->name);
  const std::vector<std::string> of_points = names;
  names.emplace_back(softbody::filtered_leapfrog().name);
  names.emplace_back(softbody::xpbd().name);
  EXPECT_THAT(schema["$defs"]["solver"]["properties"]["method"]["enum"].get<std::vector<std::string>>(),
              ::testing::UnorderedElementsAreArray(names));
  EXPECT_THAT(schema["$defs"]["particle_solver"]["properties"]["method"]["enum"].get<std::vector<std::string>>(),
              ::testing::UnorderedElementsAreArray(of_points));
}

TEST(Manual, DescribesEveryKeyOfEveryObject) {
  const std::string manual = test::contents(kDocs / "scene-files.md");
  for (const auto& [kind, keys] : key_table()) {
    const auto begin = manual.find("\n### " + kind + "\n");
    ASSERT_NE(begin, std::string::npos) << kind;
    const std::string section = manual.substr(begin, manual.find("\n### ", begin + 1) - begin);
    for (const std::string& key : keys)
      EXPECT_NE(section.find("| `" + key + "` |"), std::string::npos) << kind << "." << key;
  }
}

TEST(Manual, ItsExamplesAreScenes) {
  const std::string manual = test::contents(kDocs / "scene-files.md");
  int examples = 0;
  for (std::size_t at = manual.find("```json\n"); at != std::string::npos; at = manual.find("```json\n", at + 1)) {
    const std::size_t begin = at + 8;
    EXPECT_NO_THROW(parse_scene(manual.substr(begin, manual.find("```", begin) - begin), "scene-files.md"));
    ++examples;
  }
  EXPECT_GE(examples, 2);
}

}  // namespace
}  // namespace hooke::scene
