// Where the pictures of a run go: a film, one PNG, or a folder of them.
#pragma once

#include "commands.hpp"

#include <render/image.hpp>
#include <render/video_file.hpp>
#include <scene/description.hpp>

#include <filesystem>
#include <optional>

namespace hooke::command {

/// Throws hooke::Error where the options contradict each other.
void check(const RenderOptions& options);

/// The moment of a still picture: what is asked for, or the scene's poster [s].
double moment_of(const RenderOptions& options, const scene::SceneDescription& scene);

class Film {
 public:
  /// Without ffmpeg, a film becomes a folder of its name.
  Film(const RenderOptions& options, double fps);

  void add(const render::Image& image);
  void finish();
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  std::optional<render::VideoFile> video_;
  bool still_ = false;
  int count_ = 0;
};

}  // namespace hooke::command
