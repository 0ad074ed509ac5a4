#include "commands.hpp"
#include "film.hpp"
#include "shot.hpp"

#include <hooke/error.hpp>
#include <hooke/io/output_file.hpp>
#include <render/image_file.hpp>
#include <render/video_file.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace hooke::command {

int render(const RenderOptions& options) {
  const bool still = options.out.extension() == ".png";
  check(options);
  scene::Scene scene = prepare(options.run);
  const scene::SceneDescription& d = scene.description;
  const double end = still ? moment_of(options, d) : d.duration;
  Film film(options, d.frame_rate);
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
    film.add(shot.draw(stage, i));
    progress.show(double(i + 1) / double(pictures));
    cut = interrupted() && i + 1 < pictures;
  }
  progress.finish();
  film.finish();
  if (!options.poster.empty() && !still && !cut) {
    const std::size_t frame = std::min(pictures - 1, std::size_t(std::lround(moment_of(options, d) * d.frame_rate)));
    render::Stage large(options.width, options.height, std::max(2, options.supersample));
    large.set_look(shot.look());
    if (options.poster.has_parent_path()) io::make_folder(options.poster.parent_path());
    render::write_png(options.poster, shot.draw(large, frame));
    std::printf("%s\n", options.poster.c_str());
  }
  std::printf("%s%s\n", shot.told().c_str(), film.path().c_str());
  if (!result.report.good()) std::fprintf(stderr, "hooke: %s\n", result.report.text().c_str());
  return cut ? int(kInterrupted) : result.exit_code();
}

}  // namespace hooke::command
