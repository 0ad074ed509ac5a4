#include "commands.hpp"
#include "shot.hpp"

#include <hooke/error.hpp>
#include <hooke/io/output_file.hpp>
#include <render/image_file.hpp>
#include <render/video_file.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace hooke::command {

namespace {

// Where pictures go: a film, one PNG, or a folder of them.
class Sink {
 public:
  Sink(const RenderOptions& options, double fps) : path_(options.out) {
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

  void add(const render::Image& image) {
    if (video_) return video_->add(image);
    if (still_) return render::write_png(path_, image);
    char name[32];
    std::snprintf(name, sizeof name, "frame.%04d.png", count_++);
    render::write_png(path_ / name, image);
  }
  void finish() {
    if (video_) video_->finish();
  }
  bool still() const { return still_; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  std::optional<render::VideoFile> video_;
  bool still_ = false;
  int count_ = 0;
};

}  // namespace

int render(const RenderOptions& options) {
  const bool film = options.out.extension() == ".mp4", still = options.out.extension() == ".png";
  if (film && (options.width % 2 || options.height % 2))
    throw Error("--size of a film must be even in both directions, got " + std::to_string(options.width) + "x" +
                std::to_string(options.height));
  if (!options.poster.empty() && (still || options.poster.extension() != ".png"))
    throw Error("--poster is a PNG file beside a film; got " + options.poster.string() + " with --out " +
                options.out.string());
  if (options.frame_at && !still) throw Error("--frame-at is for a PNG file; --out is " + options.out.string());
  scene::Scene scene = prepare(options.run);
  const scene::SceneDescription& d = scene.description;
  double end = d.duration;
  if (still) {
    const double moment = options.frame_at.value_or(d.poster >= 0 ? std::min(d.poster, end) : end / 2);
    if (!(moment >= 0 && moment <= 1e6))
      throw Error("--frame-at must be from 0 to 1e6 s, got " + std::to_string(moment));
    end = moment;
  }
  Sink sink(options, d.frame_rate);
  render::Stage stage(options.width, options.height, options.supersample);

  catch_signals();
  std::vector<Snapshot> snapshots;
  const RunResult result = run(scene, end, [&](std::int64_t frame, double ms) {
    snapshots.push_back(snapshot_of(scene, ms));
    if (frame == 1) std::printf("%s", chosen(scene).c_str()), std::fflush(stdout);
  });
  std::printf("%s", summary(result).c_str());
  std::fflush(stdout);
  // A film of n frame times has n pictures: the last state belongs to the next one.
  std::size_t pictures = snapshots.size();
  if (!still && result.report.good() && !result.interrupted && pictures > 1) --pictures;
  if (pictures == 0) {
    std::fprintf(stderr, "hooke: %s before the first frame\n", result.report.good() ? "interrupted" : "diverged");
    return result.exit_code();
  }

  Shot shot(scene, snapshots, double(options.width) / options.height);
  stage.set_look(shot.look());
  Progress progress("draw");
  bool cut = false;
  for (std::size_t i = still ? pictures - 1 : 0; i < pictures && !cut; ++i) {
    sink.add(shot.draw(stage, i));
    progress.show(double(i + 1) / double(pictures));
    cut = interrupted() && i + 1 < pictures;
  }
  progress.finish();
  sink.finish();
  if (!options.poster.empty() && !still && !cut) {
    const double moment = d.poster >= 0 ? std::min(d.poster, end) : end / 2;
    const std::size_t frame = std::min(pictures - 1, std::size_t(std::lround(moment * d.frame_rate)));
    render::Stage large(options.width, options.height, std::max(2, options.supersample));
    large.set_look(shot.look());
    if (options.poster.has_parent_path()) io::make_folder(options.poster.parent_path());
    render::write_png(options.poster, shot.draw(large, frame));
    std::printf("%s\n", options.poster.c_str());
  }
  std::printf("%s%s\n", shot.told().c_str(), sink.path().c_str());
  if (!result.report.good()) std::fprintf(stderr, "hooke: %s\n", result.report.text().c_str());
  return cut ? int(kInterrupted) : result.exit_code();
}

}  // namespace hooke::command
