#include "commands.hpp"

#include <hooke/error.hpp>
#include <hooke/method.hpp>
#include <scene/library.hpp>
#include <scene/panels.hpp>

#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace hooke::command {

namespace {

void print_body(const scene::SceneBody& body) {
  const Points<double> x = body.body->positions();
  const Vec3 extent = (x.colwise().maxCoeff() - x.colwise().minCoeff()).matrix().transpose();
  Index held = 0;
  for (const bool is_held : body.held) held += is_held;
  std::printf("%s: %ld points (%ld held), %zu springs, %zu triangles, %.6g kg, %.4g x %.4g x %.4g m\n",
              body.body->name().c_str(), long(x.rows()), long(held), body.network->springs.size(),
              body.triangles.size(), body.body->total_mass(), extent.x(), extent.y(), extent.z());
}

void print_particles(const scene::SceneParticles& particles) {
  std::string kinds;
  for (const scene::ParticleKind& kind : particles.kinds()) kinds += (kinds.empty() ? "" : ", ") + kind.name;
  std::printf("%s: particles of the kinds %s; after a tick %ld alive of %lld born\n", particles.body().name().c_str(),
              kinds.c_str(), long(particles.body().size()), static_cast<long long>(particles.counts().born));
}

// "0.53 ms", "none", "any" or why the method cannot be used.
std::string stable_text(double step) {
  if (std::isinf(step)) return "any";
  if (!(step > 0)) return "none is stable without damping";
  char text[40];
  std::snprintf(text, sizeof text, "%.4g ms", 1e3 * step);
  return text;
}

}  // namespace

int validate(const std::string& name) {
  const scene::SceneDescription description = scene::find_scene(name);
  scene::Scene scene = scene::build(description);
  std::printf("%s%s%s\n", name.c_str(), description.title.empty() ? "" : ": ", description.title.c_str());
  std::printf("%.6g s at %.6g frames and %.6g ticks a second, preroll %.6g s\n", description.duration,
              description.frame_rate, description.tick_rate, description.preroll);

  // Asked before the tick, of the state at the start.
  std::vector<std::string> stable;
  for (const scene::SceneBody& body : scene.bodies) {
    std::string lines;
    const bool velocity_forces = body.body->motion_facts().velocity_forces;
    for (const Method* method : methods()) {
      const bool refused = !method->accepts_velocity_forces && velocity_forces;
      const std::string text =
          refused ? "does not accept forces of velocity" : stable_text(body.body->stable_step(*method));
      lines += "    " + std::string(method->name);
      lines.resize(lines.size() + 23 - std::min<std::size_t>(22, method->name.size()), ' ');
      lines += text + "\n";
    }
    stable.push_back(lines);
  }

  // One tick shows what the automatic step makes of it.
  const StepReport report = scene.world.update(scene.world.clock().tick());
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    print_body(scene.bodies[i]);
    std::printf("  largest stable step:\n%s", stable[i].c_str());
  }
  for (const scene::SceneParticles& particles : scene.particles) print_particles(particles);
  std::printf("%s", chosen(scene).c_str());
  if (!report.good()) {
    std::printf("the first tick fails: %s\n", report.text().c_str());
    return kDiverged;
  }
  std::printf("valid\n");
  return kDone;
}

int list() {
  const auto print = [](const std::vector<scene::NamedScene>& scenes) {
    for (const scene::NamedScene& scene : scenes) std::printf("%-24s %s\n", scene.name.c_str(), scene.title.c_str());
  };
  print(scene::named_scenes());
  std::printf("\nSide by side (hooke panels NAME):\n");
  print(scene::named_panels());
  return kDone;
}

}  // namespace hooke::command
