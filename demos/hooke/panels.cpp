// Several runs side by side, each with its measured figures and, where it is asked for, its energy over time.
#include "commands.hpp"
#include "film.hpp"
#include "shot.hpp"

#include <hooke/error.hpp>
#include <hooke/io/output_file.hpp>
#include <render/caption.hpp>
#include <render/image_file.hpp>
#include <scene/figures.hpp>
#include <scene/panels.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>

namespace hooke::command {

namespace {

constexpr double kStrip = 0.24;       // share of a panel's height that its energy takes
constexpr int kGap = 4;               // pixels between panels
constexpr double kFlownApart = 2.5;   // a body that grew to so many times its size is no longer drawn anew
constexpr double kHeadroom = 1.15;    // of the energy's scale
constexpr double kLeastScale = 1e-9;  // [J]

using Color = std::array<double, 3>;
constexpr Color kGround{18, 19, 22}, kZero{70, 73, 80}, kCurve{236, 178, 74};

struct Measured {
  double speed = 0;  // root mean square over free points [m/s]
  double stretch = 0, kinetic = 0, energy = 0;
};

struct PanelRun {
  scene::Scene scene;
  std::vector<Snapshot> snapshots;
  std::vector<Measured> measured;
  double lost_at = -1;  // when it diverged or flew apart [s]
  RunResult result;
  std::unique_ptr<Shot> shot;
  std::unique_ptr<render::Stage> stage;
};

Measured measure(const scene::Scene& scene) {
  Measured out;
  double squares = 0;
  Index free = 0;
  for (const scene::SceneBody& body : scene.bodies) {
    const Points<double> v = body.body->velocities();
    for (Index i = 0; i < v.rows(); ++i) {
      if (body.held[std::size_t(i)]) continue;
      squares += v.row(i).square().sum();
      ++free;
    }
    const Energy energy = body.body->energy(scene.world.gravity());
    out.kinetic += energy.kinetic;
    out.energy += energy.total();
  }
  out.speed = free > 0 ? std::sqrt(squares / double(free)) : 0;
  out.stretch = scene::worst_stretch(scene);
  return out;
}

double size_of(const Snapshot& snapshot) {
  double size = 0;
  for (const Points<float>& points : snapshot.points)
    if (points.rows() > 0)
      size = std::max(size, double((points.colwise().maxCoeff() - points.colwise().minCoeff()).maxCoeff()));
  return size;
}

bool drawable(const Snapshot& snapshot, double start_size) {
  for (const Points<float>& points : snapshot.points)
    if (!points.allFinite()) return false;
  return size_of(snapshot) <= kFlownApart * start_size;
}

void simulate(const scene::Panel& panel, double end, PanelRun& out) {
  out.scene = scene::build(panel.scene);
  double start_size = 0;
  out.result = run(out.scene, end, [&](std::int64_t frame, double ms) {
    out.measured.push_back(measure(out.scene));
    Snapshot snapshot = snapshot_of(out.scene, ms);
    if (frame == 0) start_size = size_of(snapshot);
    if (out.lost_at < 0 && !drawable(snapshot, start_size)) out.lost_at = snapshot.time;
    // What cannot be drawn any more stays as it was last seen.
    if (out.lost_at >= 0 && !out.snapshots.empty()) {
      const double time = snapshot.time;
      snapshot = out.snapshots.back();
      snapshot.time = time;
    }
    out.snapshots.push_back(std::move(snapshot));
  });
  if (!out.result.report.good() && out.lost_at < 0) out.lost_at = out.result.shown_time;
}

std::vector<std::string> caption_of(const scene::Panels& panels, std::size_t i, const PanelRun& panel,
                                    std::size_t frame) {
  std::vector<std::string> lines{panels.panels[i].title, panel.shot->solver()};
  const Measured& now = panel.measured[frame];
  char text[100];
  std::string figures;
  for (const scene::Figure figure : panels.figures) {
    switch (figure) {
      case scene::Figure::Speed:
        std::snprintf(text, sizeof text, "RMS speed %.2g m/s", now.speed);
        break;
      case scene::Figure::Stretch:
        std::snprintf(text, sizeof text, "worst stretch %.3g %%", 100 * now.stretch);
        break;
      case scene::Figure::Energy:
        std::snprintf(text, sizeof text, "energy %+.3g J", now.energy - panel.measured[0].energy);
        break;
    }
    figures += (figures.empty() ? "" : ", ") + std::string(text);
  }
  if (panel.lost_at >= 0 && panel.snapshots[frame].time >= panel.lost_at - 1e-9) {
    std::snprintf(text, sizeof text, "blown up after %.2f s", panel.lost_at);
    figures = text;
  }
  if (!figures.empty()) lines.push_back(figures);
  return lines;
}

void paint(render::Image& image, int x, int y, const Color& color, double share) {
  if (x < 0 || y < 0 || x >= image.width || y >= image.height) return;
  for (std::size_t c = 0; c < 3; ++c) {
    std::uint8_t& byte = image.at(x, y)[c];
    byte = std::uint8_t(std::lround(byte + share * (color[c] - byte)));
  }
}

// A curve over [x0, x0 + width) that is as thick as `pen` [pixels]; heights by column, NaN where it ends.
void draw_curve(render::Image& image, int x0, const std::vector<double>& heights, double pen, const Color& color) {
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const double here = heights[i], next = i + 1 < heights.size() ? heights[i + 1] : here;
    if (!std::isfinite(here)) return;
    const double to = std::isfinite(next) ? next : here;
    const double low = std::min(here, to) - pen / 2, high = std::max(here, to) + pen / 2;
    for (int y = std::max(0, int(low) - 1); y <= std::min(image.height - 1, int(high) + 1); ++y)
      paint(image, x0 + int(i), y, color, std::clamp(std::min(y + 1.0, high) - std::max(double(y), low), 0.0, 1.0));
  }
}

// Total energy minus that of the start, up to `frame`; the whole height is ± scale.
void draw_energy(render::Image& image, int x0, int y0, int width, int height, const PanelRun& panel, std::size_t frame,
                 std::size_t frames, double scale, double dot) {
  render::Image strip{width, height,
                      std::vector<std::uint8_t>(std::size_t(3) * std::size_t(width) * std::size_t(height))};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) paint(strip, x, y, kGround, 1);
  draw_curve(strip, 0, std::vector<double>(std::size_t(width), 0.5 * height), 1, kZero);
  std::vector<double> heights(std::size_t(width), std::nan(""));
  for (int x = 0; x < width; ++x) {
    const double at = (x + 0.5) / width * double(frames - 1);
    if (at > double(frame) + 0.5) break;
    const auto from = std::min(std::size_t(at), panel.measured.size() - 1),
               to = std::min(from + 1, panel.measured.size() - 1);
    if (at > double(panel.measured.size())) break;
    const double share = std::min(1.0, at - double(from));
    const double energy =
        (1 - share) * panel.measured[from].energy + share * panel.measured[to].energy - panel.measured[0].energy;
    const double level = std::clamp(energy / scale, -3.0, 3.0);
    heights[std::size_t(x)] = 0.5 * height * (1 - level);
    if (!std::isfinite(energy) || std::abs(level) >= 3) break;
  }
  draw_curve(strip, 0, heights, std::max(1.5, height / 55.0), kCurve);
  char text[60];
  std::snprintf(text, sizeof text, "total energy, up to +-%.2g J", scale);
  render::draw_text(strip, text, 6 * dot, 5 * dot, dot);
  for (int y = 0; y < height; ++y)
    std::copy_n(strip.at(0, y), std::size_t(3) * std::size_t(width), image.at(x0, y0 + y));
}

}  // namespace

int panels(const RenderOptions& options) {
  check(options);
  const bool still = options.out.extension() == ".png";
  scene::Panels panels = scene::find_panels(options.run.scene);
  for (scene::Panel& panel : panels.panels)
    if (options.run.end > 0) panel.scene.duration = options.run.end;
  const scene::SceneDescription& first = panels.panels[0].scene;
  const double end = still ? moment_of(options, first) : first.duration;

  const int columns = panels.columns, rows = (int(panels.panels.size()) + columns - 1) / columns;
  const int width = (options.width - (columns - 1) * kGap) / columns,
            height = (options.height - (rows - 1) * kGap) / rows;
  const int strip = panels.energy_curve ? int(kStrip * height) : 0, picture = height - strip;
  if (width < 64 || picture < 64)
    throw Error("--size leaves panels of " + std::to_string(width) + "x" + std::to_string(picture) +
                " pixels; they must be at least 64x64");

  Film film(options, first.frame_rate);
  catch_signals();
  std::vector<PanelRun> runs(panels.panels.size());
  int code = kDone;
  std::size_t frames = 0;
  double scale = kLeastScale;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    PanelRun& each = runs[i];
    std::printf("%s\n", panels.panels[i].title.c_str());
    simulate(panels.panels[i], end, each);
    std::printf("%s%s", chosen(each.scene).c_str(), summary(each.result).c_str());
    std::fflush(stdout);
    if (each.result.interrupted) return kInterrupted;
    if (each.snapshots.empty())
      throw Error(panels.file + ": panels[" + std::to_string(i) + "]: diverged before the first frame");
    if (each.lost_at >= 0 && !panels.panels[i].may_diverge) {
      std::fprintf(stderr, "hooke: panel \"%s\" diverged: %s\n", panels.panels[i].title.c_str(),
                   each.result.report.text().c_str());
      code = kDiverged;
    }
    frames = std::max(frames, std::size_t(each.result.wanted_frames));
    if (each.lost_at < 0)
      for (const Measured& now : each.measured) scale = std::max(scale, kHeadroom * now.kinetic);
  }

  for (PanelRun& each : runs) {
    each.shot = std::make_unique<Shot>(each.scene, each.snapshots, double(width) / picture);
  }
  // Text as large as in a single picture, if a panel's width holds it.
  const double text = std::clamp(width / 280.0, 1.0, std::max(1.0, 0.75 * options.height / 540.0));
  const auto compose = [&](std::size_t frame, int supersample) {
    render::Image image{
        options.width, options.height,
        std::vector<std::uint8_t>(std::size_t(3) * std::size_t(options.width) * std::size_t(options.height))};
    for (std::size_t i = 0; i < runs.size(); ++i) {
      PanelRun& each = runs[i];
      if (!each.stage || supersample != options.supersample) {
        each.stage = std::make_unique<render::Stage>(width, picture, supersample);
        each.stage->set_look(each.shot->look());
      }
      const std::size_t shown = std::min(frame, each.snapshots.size() - 1);
      render::Image drawn = each.shot->draw(*each.stage, shown, {});
      render::draw_caption(drawn, caption_of(panels, i, each, shown), text / std::max(1.0, picture / 540.0));
      const int x0 = int(i) % columns * (width + kGap), y0 = int(i) / columns * (height + kGap);
      for (int y = 0; y < picture; ++y)
        std::copy_n(drawn.at(0, y), std::size_t(3) * std::size_t(width), image.at(x0, y0 + y));
      if (strip > 0) draw_energy(image, x0, y0 + picture, width, strip, each, frame, frames, scale, text);
    }
    return image;
  };

  Progress progress("draw");
  // A film of n frame times has n pictures: the last state belongs to the next one.
  const std::size_t pictures = std::max<std::size_t>(2, frames) - 1;
  bool cut = false;
  if (still) {
    film.add(compose(frames - 1, options.supersample));
  } else {
    for (std::size_t i = 0; i < pictures && !cut; ++i) {
      film.add(compose(i, options.supersample));
      progress.show(double(i + 1) / double(pictures));
      cut = interrupted() && i + 1 < pictures;
    }
  }
  progress.finish();
  film.finish();
  if (!options.poster.empty() && !cut) {
    const std::size_t frame =
        std::min(pictures - 1, std::size_t(std::lround(moment_of(options, first) * first.frame_rate)));
    if (options.poster.has_parent_path()) io::make_folder(options.poster.parent_path());
    render::write_png(options.poster, compose(frame, std::max(2, options.supersample)));
    std::printf("%s\n", options.poster.c_str());
  }
  std::printf("%s\n", film.path().c_str());
  return cut ? int(kInterrupted) : code;
}

}  // namespace hooke::command
