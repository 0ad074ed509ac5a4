#include "film.hpp"

#include <hooke/error.hpp>
#include <hooke/io/output_file.hpp>
#include <render/image_file.hpp>

#include <algorithm>
#include <cstdio>

namespace hooke::command {

void check(const RenderOptions& options) {
  const bool film = options.out.extension() == ".mp4", still = options.out.extension() == ".png";
  if (film && (options.width % 2 || options.height % 2))
    throw Error("--size of a film must be even in both directions, got " + std::to_string(options.width) + "x" +
                std::to_string(options.height));
  if (!options.poster.empty() && (still || options.poster.extension() != ".png"))
    throw Error("--poster is a PNG file beside a film; got " + options.poster.string() + " with --out " +
                options.out.string());
  if (options.frame_at && !still) throw Error("--frame-at is for a PNG file; --out is " + options.out.string());
  if (options.frame_at && !(*options.frame_at >= 0 && *options.frame_at <= 1e6))
    throw Error("--frame-at must be from 0 to 1e6 s, got " + std::to_string(*options.frame_at));
}

double moment_of(const RenderOptions& options, const scene::SceneDescription& scene) {
  return options.frame_at.value_or(scene.poster >= 0 ? std::min(scene.poster, scene.duration) : scene.duration / 2);
}

Film::Film(const RenderOptions& options, double fps) : path_(options.out) {
  const std::filesystem::path parent = path_.parent_path();
  still_ = path_.extension() == ".png";
  const bool film = path_.extension() == ".mp4";
  if ((still_ || film) && !parent.empty()) io::make_folder(parent);
  if (film && render::VideoFile::available()) {
    video_.emplace(path_, options.width, options.height, fps);
  } else if (!still_) {
    if (film) {
      path_ = parent / path_.stem();
      std::fprintf(stderr, "hooke: ffmpeg is not installed; PNG files go to %s/ instead\n", path_.c_str());
    }
    io::make_folder(path_);
  }
}

void Film::add(const render::Image& image) {
  if (video_) return video_->add(image);
  if (still_) return render::write_png(path_, image);
  char name[32];
  std::snprintf(name, sizeof name, "frame.%04d.png", count_++);
  render::write_png(path_ / name, image);
}

void Film::finish() {
  if (video_) video_->finish();
}

}  // namespace hooke::command
