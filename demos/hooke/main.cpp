// The hooke command: reads its arguments, calls one command, turns exceptions into exit codes.
#include "commands.hpp"

#include <hooke/error.hpp>

#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdio>
#include <exception>
#include <new>

namespace hooke::command {

namespace {

// One line whatever an error says.
int tell(int code, std::string text) {
  for (char& c : text)
    if (c == '\n' || c == '\r') c = ' ';
  std::fprintf(stderr, "hooke: %s\n", text.c_str());
  return code;
}

struct Arguments {
  SimulateOptions simulate;
  RenderOptions render, panels;
  ReportOptions report;
  StabilityOptions stability;
  std::string validate_scene, size;  // of pictures
  bool list = false, no_estimate = false;
};

void add_run_options(CLI::App& command, RunOptions& run) {
  command.add_option("scene", run.scene, "Scene file, or the name of a scene (hooke list)")->required();
  command.add_option("--method", run.method, "Integration method of every body, e.g. velocity-verlet");
  command.add_option("--dt", run.dt, "Largest substep [s]; without it from the largest stable one");
  command.add_option("--precision", run.precision, "float, double or double-float");
  command.add_option("--end", run.end, "Simulated time [s] instead of the scene's duration");
  command.add_option("--threads", run.threads, "Threads that move bodies; one body is moved by one thread");
}

void add_picture_options(CLI::App& command, RenderOptions& options, std::string& size) {
  command.add_option("--out", options.out, "FILE.mp4, FILE.png or a folder for one PNG a frame")->required();
  command.add_option("--size", size, "WIDTHxHEIGHT [pixels], 1280x720 if not given");
  command.add_option("--frame-at", options.frame_at, "Moment of a PNG [s]");
  command.add_option("--poster", options.poster, "With a film: also its poster frame as this PNG, supersampled twice");
  command.add_option("--supersample", options.supersample, "1 to 4: draws that many times larger and averages");
}

void check(const CLI::App& command, const RunOptions& run) {
  for (const auto& [name, value] : {std::pair{"--dt", run.dt}, {"--end", run.end}})
    if (command.get_option_no_throw(name) && command.count(name) && !(value > 0 && std::isfinite(value)))
      throw Error(std::string(name) + " must be positive [s], got " + std::to_string(value));
  if (run.end > 1e6) throw Error("--end must be at most 1e6 s, got " + std::to_string(run.end));
}

void read_size(const std::string& text, RenderOptions& options) {
  int used = 0;
  if (std::sscanf(text.c_str(), "%dx%d%n", &options.width, &options.height, &used) != 2 ||
      std::size_t(used) != text.size())
    throw Error("--size must be WIDTHxHEIGHT in pixels, e.g. 1920x1080, got " + text);
  if (options.width < 16 || options.height < 16 || options.width > 8192 || options.height > 8192)
    throw Error("--size must be from 16x16 to 8192x8192, got " + text);
}

int dispatch(int argc, char** argv) {
  Arguments a;
  CLI::App app(
      "Simulates and draws soft bodies.\nExit codes: 0 done, 1 diverged, 2 bad input, 3 output not writable, "
      "130 interrupted.",
      "hooke");
  app.set_version_flag("--version", "hooke " HOOKE_VERSION);
  app.add_flag("--list", a.list, "The scenes that have a name");
  app.footer("Example: hooke render cape --out cape.mp4");

  CLI::App* simulate_command = app.add_subcommand("simulate", "Simulate a scene and write its end and its diagnostics");
  add_run_options(*simulate_command, a.simulate.run);
  simulate_command
      ->add_option("--out", a.simulate.out, "Folder for state.csv, diagnostics.csv, particles.csv and timings.csv")
      ->required();
  simulate_command->add_option("--export", a.simulate.export_format,
                               "Also: soft bodies as obj, ply or pc2, particles as ply, csv or vdb");
  simulate_command->add_option(
      "--error", a.simulate.run.error,
      "Wanted error at the end, a share of each body's size: picks method, precision and step");
  simulate_command->add_flag("--no-error-estimate", a.no_estimate, "Spares the error estimate, 0.19 of the run's cost");
  simulate_command->add_flag("--verify", a.simulate.verify,
                             "Tells the true error by a converged run; costs tens of times the run");
  simulate_command->add_option("--checkpoint", a.simulate.checkpoint,
                               "Simulated seconds between checkpoints (OUT/checkpoint), 0 for none; without it one "
                               "each 10 s by the clock, or seldomer where they would cost over 1 %");
  simulate_command->add_flag("--resume", a.simulate.resume,
                             "Goes on from OUT/checkpoint, with the same scene and options, to the same bits");
  simulate_command->footer(
      "Example: hooke simulate hanging-sheet-32 --method velocity-verlet --precision double --out sheet");

  CLI::App* render_command = app.add_subcommand("render", "Simulate a scene and draw it as a film or a picture");
  add_run_options(*render_command, a.render.run);
  add_picture_options(*render_command, a.render, a.size);
  render_command->footer("Example: hooke render flag --out flag.png --frame-at 2.5 --size 1920x1080 --supersample 2");

  CLI::App* panels_command =
      app.add_subcommand("panels", "Simulate several scenes and draw them side by side with their measured figures");
  panels_command->add_option("panels", a.panels.run.scene, "File of panels, or the name of one")->required();
  panels_command->add_option("--end", a.panels.run.end, "Simulated time [s] instead of the scenes' duration");
  add_picture_options(*panels_command, a.panels, a.size);
  panels_command->footer("Example: hooke panels six-methods --out methods.mp4 --size 1920x1080");

  CLI::App* validate_command = app.add_subcommand("validate", "Check a scene; largest stable step of every method");
  validate_command->add_option("scene", a.validate_scene, "Scene file, or the name of a scene")->required();
  validate_command->footer("Example: hooke validate my-scene.json");

  CLI::App* report_command =
      app.add_subcommand("report", "Speed against error of every method and precision on the standard scenes");
  report_command->add_option("scene", a.report.scenes, "Names of standard scenes; all if none is given");
  report_command->add_option("--out", a.report.out, "Folder for report.csv, report.html and pictures")->required();
  report_command->add_flag("--quick", a.report.quick, "Under a minute: few repeats, coarse steps, no large scenes");
  report_command->add_option(
      "--budget", a.report.budget,
      "Processor time a scene [s], three times that for large ones; its reference may take as much");
  report_command->footer("Example: hooke report hanging-sheet-32 --budget 20 --out report");

  CLI::App* stability_command =
      app.add_subcommand("stability", "Hard cases: what stays bounded, comes to rest and keeps its energy");
  stability_command->add_option("case", a.stability.cases, "Names of hard cases; all if none is given");
  stability_command->add_option("--method", a.stability.method, "Only the rows of this method, e.g. xpbd");
  stability_command->add_option("--out", a.stability.out, "Folder for the table: CSV, HTML, Markdown and a picture")
      ->required();
  stability_command->add_flag("--long", a.stability.thorough,
                              "Minutes of simulated time and full sizes: an hour instead of a minute or two");
  stability_command->add_option("--threads", a.stability.threads, "Threads that share the rows");
  stability_command->footer("Example: hooke stability mass-ratio-chain rest --out stability");

  CLI::App* list_command = app.add_subcommand("list", "The scenes and panels that have a name");
  list_command->footer("Example: hooke list");
  app.require_subcommand(0, 1);

  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    return tell(kBadInput, std::string(error.what()) + " (hooke --help)");
  }
  if (simulate_command->parsed()) {
    check(*simulate_command, a.simulate.run);
    if (const auto seconds = a.simulate.checkpoint; seconds && !(*seconds >= 0 && std::isfinite(*seconds)))
      throw Error("--checkpoint must not be negative [s], got " + std::to_string(*seconds));
    if (simulate_command->count("--error")) {
      const double error = a.simulate.run.error;
      if (!(error > 0 && std::isfinite(error)))
        throw Error("--error must be positive, a share of the body's size, got " + std::to_string(error));
      for (const char* name : {"--method", "--dt", "--precision"})
        if (simulate_command->count(name))
          throw Error(std::string("--error chooses what ") + name + " gives; use one of them");
    }
    a.simulate.estimate_error = !a.no_estimate;
    return simulate(a.simulate);
  }
  for (const auto& [command, options] : {std::pair{render_command, &a.render}, {panels_command, &a.panels}}) {
    if (!command->parsed()) continue;
    check(*command, options->run);
    if (!a.size.empty()) read_size(a.size, *options);
    if (options->supersample < 1 || options->supersample > 4)
      throw Error("--supersample must be from 1 to 4, got " + std::to_string(options->supersample));
    return command == render_command ? render(*options) : panels(*options);
  }
  if (report_command->parsed()) return report(a.report);
  if (stability_command->parsed()) return stability(a.stability);
  if (validate_command->parsed()) return validate(a.validate_scene);
  if (list_command->parsed() || a.list) return list();
  return tell(kBadInput,
              "a command is needed: simulate, render, panels, validate, report, stability or list (hooke --help)");
}

}  // namespace

}  // namespace hooke::command

int main(int argc, char** argv) {
  using namespace hooke::command;
  try {
    return dispatch(argc, argv);
  } catch (const hooke::OutputError& error) {
    return tell(kOutputFailed, error.what());
  } catch (const std::bad_alloc&) {
    return tell(kBadInput, "not enough memory");
  } catch (const std::exception& error) {
    return tell(kBadInput, error.what());
  } catch (...) {
    return tell(kBadInput, "unexpected error");
  }
}
