// Scenes that break one rule, and the words that tell where and how.
#pragma once

#include <hooke/error.hpp>
#include <io/temporary_folder.hpp>
#include <scene/parse.hpp>
#include <scene/scene.hpp>

#include <gmock/gmock.h>

#include <string>

namespace hooke::scene {

struct BrokenCase {
  const char* name;
  std::string text;
  std::string message;
};

inline std::string name_of(const ::testing::TestParamInfo<BrokenCase>& each) { return each.param.name; }

/// The scene is refused in one line that begins with the file and holds the case's words. Beside it stand a file
/// that is no mesh, an open mesh and a flat one.
inline void expect_told_in_one_line(const BrokenCase& each) {
  test::TemporaryFolder folder;
  folder.write("broken.obj", "this is no mesh\n");
  folder.write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  folder.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
  std::string message = "no error";
  try {
    build(parse_scene(each.text, "scene.json", folder.path()));
  } catch (const Error& error) {
    message = error.what();
  }
  // Files are named as they were found.
  if (const auto at = message.find(folder.path().string()); at != std::string::npos)
    message.replace(at, folder.path().string().size(), ".");
  EXPECT_THAT(message, ::testing::HasSubstr(each.message));
  EXPECT_THAT(message, ::testing::StartsWith("scene.json: "));
  EXPECT_THAT(message, ::testing::Not(::testing::HasSubstr("\n")));
  EXPECT_LT(message.size(), 1000u);
}

}  // namespace hooke::scene
