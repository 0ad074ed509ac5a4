// The hooke command as its users meet it: exit codes, messages and files.
#include <io/temporary_folder.hpp>

#include <gmock/gmock.h>

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <sstream>
#include <thread>

namespace hooke {
namespace {

using std::filesystem::exists;
using test::contents;
using test::TemporaryFolder;
using ::testing::HasSubstr;

class Command : public ::testing::Test {
 protected:
  struct Result {
    int code = -1;
    std::string out, err;
  };
  Result run(const std::string& arguments) {
    const std::string line = std::string(HOOKE_COMMAND) + " " + arguments + " >" + (folder_ / "out.txt").string() +
                             " 2>" + (folder_ / "err.txt").string();
    const int status = std::system(line.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, contents(folder_ / "out.txt"), contents(folder_ / "err.txt")};
  }
  std::string scene(const std::string& keys) {
    return folder_.write("scene.json", R"({"hooke": 1, )" + keys + "}").string();
  }
  std::string out() const { return (folder_ / "run").string(); }

  TemporaryFolder folder_;
};

const std::string kPendulum =
    R"("duration": 0.1, "bodies": [{"type": "soft", "name": "a, b", "points": [[0,0,0],[1,0,0]],
    "mass": 2, "springs": [{"points": [0,1], "stiffness": 500}], "pins": [0]}])";

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> out;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) out.push_back(line);
  return out;
}

TEST_F(Command, SimulatesAndWritesStateDiagnosticsAndTimings) {
  const Result result = run("simulate " + scene(kPendulum) + " --out " + out());
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("velocity-verlet, float"));
  const auto state = lines_of(contents(folder_ / "run/state.csv"));
  ASSERT_EQ(state.size(), 3u);
  EXPECT_EQ(state[0], "body,index,x,y,z,vx,vy,vz");
  EXPECT_EQ(state[1], "\"a, b\",0,0,0,0,0,0,0");
  EXPECT_THAT(state[2], ::testing::StartsWith("\"a, b\",1,"));
  EXPECT_EQ(lines_of(contents(folder_ / "run/diagnostics.csv")).size(), 1u + 7u);
  EXPECT_EQ(lines_of(contents(folder_ / "run/timings.csv")).size(), 1u + 7u);
  for (const auto& entry : std::filesystem::directory_iterator(out()))
    EXPECT_EQ(entry.path().string().find(".part."), std::string::npos) << entry.path();
}

TEST_F(Command, TheSameRunGivesTheSameBytesAtAnyThreadCount) {
  const std::string scene_file = scene(R"("duration": 0.2, "bodies": [
    {"type": "soft", "name": "a", "grid": {"size": [1, 1], "points": [9, 9]}, "pin": "top"},
    {"type": "soft", "name": "b", "grid": {"size": [1, 1], "points": [7, 9]}, "pin": "left", "wind": {"velocity": [1, 0, 3]}}])");
  EXPECT_EQ(run("simulate " + scene_file + " --out " + out()).code, 0);
  EXPECT_EQ(run("simulate " + scene_file + " --threads 2 --out " + out() + "2").code, 0);
  for (const char* file : {"state.csv", "diagnostics.csv"})
    EXPECT_EQ(contents(folder_ / "run" / file), contents(folder_ / "run2" / file)) << file;
}

TEST_F(Command, ExportsMovingMeshes) {
  const std::string keys =
      R"("duration": 0.1, "bodies": [{"type": "soft", "name": "x/y", "grid": {"size": [1, 1], "points": [3, 3]}}])";
  for (const char* format : {"obj", "ply", "pc2"})
    EXPECT_EQ(run("simulate " + scene(keys) + " --export " + std::string(format) + " --out " + out()).code, 0)
        << format;
  EXPECT_TRUE(exists(folder_ / "run/x_y.0006.obj"));
  EXPECT_TRUE(exists(folder_ / "run/x_y.0006.ply"));
  EXPECT_EQ(std::filesystem::file_size(folder_ / "run/x_y.pc2"), 32u + 7 * 9 * 12);
}

const std::string kJet =
    R"("duration": 0.5, "frame_rate": 20, "colliders": [{"type": "half-space", "restitution": 0.5}],
    "bodies": [{"type": "particles", "name": "a jet", "capacity": 150, "emitters": [
       {"position": [0, 0.2, 0], "axis": [1, 0, 0], "spread": 30, "rate": 500, "speed": [1, 2], "lifetime": [0.2, 0.4], "mass": 0.01}],
       "forces": [{"force": "turbulence", "speed": 1, "size": 0.2, "rate": 3}],
       "kinds": [{"name": "k"}, {"name": "bit"}],
       "sub_emitters": [{"on": "impact", "parent": "k", "kind": "bit", "count": 1, "lifetime": 0.1, "mass": 0.01}]},
      {"type": "soft", "name": "rag", "grid": {"size": [1, 1], "points": [4, 4]}, "origin": [0, 2, 0], "pin": "top"}])";

TEST_F(Command, ParticlesHaveStateCountsAndEnergies) {
  const Result result = run("simulate " + scene(kJet) + " --out " + out());
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("a jet: "));
  EXPECT_THAT(result.out, HasSubstr(" of at most 150 particles, 1 emitter, 1 force, 1 sub-emitter, 2 kinds; verlet"));
  EXPECT_THAT(result.out, HasSubstr("a jet: no error estimate"));
  EXPECT_THAT(result.out, HasSubstr("rag: error estimate"));
  const auto counts = lines_of(contents(folder_ / "run/particles.csv"));
  ASSERT_EQ(counts.size(), 1u + 11u);
  EXPECT_EQ(counts[0], "time,body,alive,born,died,refused,displaced,impacts");
  long alive = 0, born = 0, died = 0, refused = 0, displaced = 0, impacts = 0;
  double time = 0, before = -1;
  long born_before = 0;
  for (std::size_t i = 1; i < counts.size(); ++i) {
    ASSERT_EQ(std::sscanf(counts[i].c_str(), "%lf,a jet,%ld,%ld,%ld,%ld,%ld,%ld", &time, &alive, &born, &died, &refused,
                          &displaced, &impacts),
              7)
        << counts[i];
    EXPECT_GT(time, before);
    EXPECT_EQ(alive, born - died - displaced);
    EXPECT_LE(alive, 150);
    EXPECT_GE(born, born_before);
    before = time, born_before = born;
  }
  EXPECT_EQ(counts[1], "0,a jet,0,0,0,0,0,0");
  EXPECT_NEAR(time, 0.5, 1e-9);
  EXPECT_GT(died, 20);
  EXPECT_GT(impacts, 0);
  EXPECT_GT(refused, 0) << "500/s for 0.3 s are 150, and children beside";
  // The soft body's 16 points first, then who is alive.
  const auto state = lines_of(contents(folder_ / "run/state.csv"));
  ASSERT_EQ(long(state.size()), 1 + 16 + alive);
  EXPECT_THAT(state[1], ::testing::StartsWith("rag,0,"));
  EXPECT_THAT(state[17], ::testing::StartsWith("a jet,0,"));
  // Their energy counts: 0.01 kg at 1 to 2 m/s.
  const auto diagnostics = lines_of(contents(folder_ / "run/diagnostics.csv"));
  double kinetic = 0;
  ASSERT_EQ(std::sscanf(diagnostics[5].c_str(), "%lf,%lf", &time, &kinetic), 2);
  EXPECT_GT(kinetic, 100 * 0.5 * 0.01 * 0.5);
}

TEST_F(Command, ParticlesGiveTheSameBytesAtAnyThreadCount) {
  const std::string file =
      scene(R"("duration": 0.4, "colliders": [{"type": "sphere", "center": [0.3, 0.2, 0], "radius": 0.2}],
    "bodies": [{"type": "particles", "name": "p", "capacity": 40000, "contact": {"restitution": 0.5}, "emitters": [
       {"shape": "sphere", "radius": 0.3, "spread": 90, "bursts": [{"count": 15000, "period": 0.2}], "lifetime": [0.3, 1]}],
       "kinds": [{"name": "k"}, {"name": "bit"}],
       "sub_emitters": [{"on": "impact", "parent": "k", "kind": "bit", "count": [0, 2], "lifetime": 0.1}]}])");
  ASSERT_EQ(run("simulate " + file + " --out " + out()).code, 0);
  ASSERT_EQ(run("simulate " + file + " --threads 3 --out " + out() + "2").code, 0);
  for (const char* name : {"state.csv", "diagnostics.csv", "particles.csv"})
    EXPECT_EQ(contents(folder_ / "run" / name), contents(folder_ / "run2" / name)) << name;
}

TEST_F(Command, ExportsParticlesOneFileAFrame) {
  for (const char* format : {"ply", "csv", "vdb"}) {
    const Result result =
        run("simulate " + scene(kJet) + " --no-error-estimate --export " + format + " --out " + out());
    EXPECT_EQ(result.code, 0) << result.err;
    for (const char* frame : {"0000", "0010"})
      EXPECT_TRUE(exists(folder_ / ("run/a_jet." + std::string(frame) + "." + format))) << format << frame;
    EXPECT_EQ(result.out.find("rag: not exported") != std::string::npos, std::string(format) != "ply") << format;
  }
  EXPECT_TRUE(exists(folder_ / "run/rag.0010.ply"));
  // The points of the export are those of the state.
  const auto points = lines_of(contents(folder_ / "run/a_jet.0010.csv"));
  const auto state = lines_of(contents(folder_ / "run/state.csv"));
  EXPECT_EQ(points[0], "index,x,y,z,vx,vy,vz,id,age,radius");
  ASSERT_EQ(points.size() - 1, state.size() - 17);
  EXPECT_EQ(points[1].substr(0, 20), state[17].substr(6, 20));
  // Smoke is a volume and water a surface as well.
  const std::string seen = R"("duration": 0.05, "bodies": [{"type": "particles", "name": "p",
      "emitters": [{"rate": 2000, "kind": "fog"}, {"rate": 2000, "position": [1, 0, 0], "kind": "wet"}],
      "kinds": [{"name": "fog", "look": "smoke"}, {"name": "wet", "look": "water"}, {"name": "lit"}]}])";
  EXPECT_EQ(run("simulate " + scene(seen) + " --export vdb --out " + out()).code, 0);
  for (const char* file : {"p.0003.vdb", "p.fog.0003.vdb", "p.wet.0003.vdb"})
    EXPECT_TRUE(exists(folder_ / "run" / file)) << file;
  EXPECT_FALSE(exists(folder_ / "run/p.lit.0003.vdb"));
  const Result meshes = run("simulate " + scene(kJet) + " --no-error-estimate --export obj --out " + out());
  EXPECT_EQ(meshes.code, 0);
  EXPECT_THAT(meshes.out, HasSubstr("a jet: not exported, obj is for soft bodies"));
}

TEST_F(Command, WhatParticlesDoNotHaveIsToldInOneLine) {
  const std::string jet = scene(R"("bodies": [{"type": "particles", "name": "p", "emitters": [{"rate": 10}]}])");
  const std::string rag = folder_.write("rag.json", R"({"hooke": 1, )" + kPendulum + "}").string();
  for (const auto& [arguments, words] : std::vector<std::pair<std::string, std::string>>{
           {jet + " --method filtered-leapfrog", "particles \"p\": the method must be one of explicit-euler"},
           {jet + " --precision double-float", "particles \"p\": the precision must be float or double"},
           {jet + " --error 0.01", "--error is for soft bodies"},
           {jet + " --export obj", "--export obj is for soft bodies"},
           {rag + " --export vdb", "--export vdb is for particles"}}) {
    const Result result = run("simulate " + arguments + " --out " + out());
    EXPECT_EQ(result.code, 2) << arguments;
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_EQ(lines_of(result.err).size(), 1u) << result.err;
    EXPECT_FALSE(exists(folder_ / "run")) << arguments;
  }
  const Result valid = run("validate " + jet);
  EXPECT_EQ(valid.code, 0);
  EXPECT_THAT(valid.out, HasSubstr("p: particles of the kinds particle"));
  EXPECT_THAT(valid.out, HasSubstr("valid"));
}

TEST_F(Command, ABlowUpIsExitCodeOneAndKeepsTheLastGoodState) {
  const Result result = run("simulate " + scene(R"("duration": 20, "tick_rate": 60, "bodies": [
      {"type": "soft", "name": "stiff", "grid": {"size": [1, 1], "points": [6, 6]}, "pin": "top",
       "material": {"mass": 0.001, "stiffness": {"structural": 1e6}}, "solver": {"method": "explicit-euler", "dt": 1}}])") +
                            " --out " + out());
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.err, HasSubstr("body \"stiff\""));
  EXPECT_THAT(result.err, HasSubstr("dt"));
  const std::string state = contents(folder_ / "run/state.csv");
  EXPECT_EQ(lines_of(state).size(), 37u);
  EXPECT_EQ(state.find("nan"), std::string::npos);
  EXPECT_EQ(state.find("inf"), std::string::npos);
  EXPECT_TRUE(exists(folder_ / "run/diagnostics.csv"));
}

TEST_F(Command, BadInputIsExitCodeTwoAndOneLine) {
  const std::string good = scene(kPendulum);
  const std::string broken =
      folder_.write("broken.json", R"({"hooke": 1, "bodies": [{"type": "soft", "points": 7}]})").string();
  const std::string cut = folder_.write("cut.json", R"({"hooke": 1, "bod)").string();
  const std::string named = "\"" + folder_.write("line\nbreak.json", "{").string() + "\"";
  const std::vector<std::pair<std::string, std::string>> cases{
      {"simulate nothing.json --out " + out(), "nothing.json"},
      {"simulate " + broken + " --out " + out(), "broken.json: bodies[0].points: must be an array, got 7"},
      {"validate " + broken, "bodies[0].points"},
      {"render " + broken + " --out " + out() + ".png", "bodies[0].points"},
      {"simulate " + cut + " --out " + out(), "cut.json: line 1, column"},
      {"simulate " + named + " --out " + out(), "break.json"},
      {"simulate " + folder_.path().string() + " --out " + out(), "no such scene"},
      {"simulate " + good, "--out"},
      {"simulate " + good + " --out " + out() + " --resume", "run/checkpoint: there is no checkpoint"},
      {"simulate " + good + " --out " + out() + " --checkpoint -1", "--checkpoint must not be negative"},
      {"simulate " + good + " --out " + out() + " --method euler", "velocity-verlet"},
      {"simulate " + good + " --out " + out() + " --precision half", "float, double"},
      {"simulate " + good + " --out " + out() + " --dt 0", "--dt must be positive"},
      {"simulate " + good + " --out " + out() + " --dt nan", "--dt must be positive"},
      {"simulate " + good + " --out " + out() + " --end -1", "--end must be positive"},
      {"simulate " + good + " --out " + out() + " --end soon", "--end"},
      {"simulate " + good + " --out " + out() + " --threads 0", "--threads must be from 1"},
      {"simulate " + good + " --out " + out() + " --export fbx", "obj, ply, pc2"},
      {"render " + good + " --out " + out() + ".mp4 --size 641x480", "even"},
      {"render " + good + " --out " + out() + ".png --size large", "--size must be WIDTHxHEIGHT"},
      {"render " + good + " --out " + out() + ".png --supersample 9", "--supersample"},
      {"render " + good + " --out " + out() + ".mp4 --frame-at 1", "--frame-at is for a PNG"},
      {"panels " + broken + " --out " + out() + ".png", "broken.json"},
      {"panels no-such --out " + out() + ".png", "no such file of panels"},
      {"dance", "dance"},
      {"", "a command is needed"},
  };
  for (const auto& [arguments, words] : cases) {
    const Result result = run(arguments);
    EXPECT_EQ(result.code, 2) << arguments;
    EXPECT_THAT(result.err, HasSubstr(words)) << arguments;
    EXPECT_EQ(lines_of(result.err).size(), 1u) << arguments << "\n" << result.err;
    EXPECT_FALSE(exists(folder_ / "run")) << arguments;
  }
}

TEST_F(Command, DrawsPanelsSideBySideAndFailsWhereOneDivergesThatMustNot) {
  const auto file = [&](const char* name, const char* may) {
    return folder_
        .write(name, std::string(R"({"hooke": 1, "energy_curve": true, "figures": ["energy", "speed", "stretch"],
      "scene": {"hooke": 1, "duration": 0.5, "frame_rate": 20,
        "bodies": [{"type": "soft", "points": [[0,0,0], [1.5,0,0]], "mass": 1, "pins": [0],
                    "springs": [{"points": [0,1], "stiffness": 1e5, "rest_length": 1}], "solver": {"dt": 0.004}}]},
      "panels": [{"title": "calm", "set": {"/bodies/0/solver/method": "implicit-euler"}},
                 {"title": "wild", "set": {"/bodies/0/solver/method": "explicit-euler"}, "may_diverge": )") +
                         may + "}]}")
        .string();
  };
  for (const auto& [name, may, code] : {std::tuple{"one.json", "true", 0}, {"two.json", "false", 1}}) {
    const std::string out = (folder_ / (std::string(name) + ".png")).string();
    const Result result = run("panels " + file(name, may) + " --out " + out + " --frame-at 0.5 --size 260x160");
    EXPECT_EQ(result.code, code) << result.err;
    EXPECT_TRUE(exists(std::filesystem::path(out)));
    EXPECT_EQ(result.err.find("\"wild\" diverged") != std::string::npos, code == 1) << result.err;
  }
}

TEST_F(Command, OutputsThatCannotBeWrittenAreExitCodeThree) {
  const std::string good = scene(kPendulum);
  std::filesystem::create_directories(folder_ / "full");
  for (const std::string& out_folder : {std::string("/dev/null/x"), std::string("/proc/hooke/x"), good}) {
    const Result result = run("simulate " + good + " --out " + out_folder);
    EXPECT_EQ(result.code, 3) << out_folder;
    EXPECT_THAT(result.err, HasSubstr(out_folder));
  }
  if (!exists("/dev/full")) return;
  for (const char* file : {"state.part.csv", "diagnostics.part.csv", "timings.part.csv", "a__b.0000.part.obj"}) {
    const TemporaryFolder full;
    std::filesystem::create_symlink("/dev/full", full / file);
    const Result result = run("simulate " + good + " --export obj --out " + full.path().string());
    EXPECT_EQ(result.code, 3) << file;
    EXPECT_THAT(result.err, HasSubstr("No space left on device")) << file;
  }
  EXPECT_EQ(run("render " + good + " --out /dev/null/x/a.png --size 64x64").code, 3);
}

TEST_F(Command, ATerminatedRunKeepsItsFinishedFrames) {
  const std::string file = scene(
      R"("duration": 1000, "bodies": [{"type": "soft", "grid": {"size": [1, 1], "points": [9, 9]}, "pin": "top"}])");
  const pid_t child = fork();
  if (child == 0) {
    std::freopen((folder_ / "log.txt").c_str(), "w", stdout);
    std::freopen((folder_ / "log.txt").c_str(), "w", stderr);
    execl(HOOKE_COMMAND, HOOKE_COMMAND, "simulate", file.c_str(), "--out", out().c_str(), "--export", "pc2", nullptr);
    _exit(99);
  }
  for (int i = 0; i < 1000 && !exists(folder_ / "run/body0.part.pc2"); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  kill(child, SIGTERM);
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 130);
  const std::size_t frames = lines_of(contents(folder_ / "run/diagnostics.csv")).size() - 1;
  EXPECT_GT(frames, 1u);
  EXPECT_EQ(std::filesystem::file_size(folder_ / "run/body0.pc2"), 32 + frames * 81 * 12);
  EXPECT_EQ(lines_of(contents(folder_ / "run/state.csv")).size(), 82u);
}

TEST_F(Command, ValidatesWithTheLargestStableStepOfEveryMethod) {
  const Result result = run("validate hanging-sheet-32");
  EXPECT_EQ(result.code, 0);
  for (const char* words :
       {"1024 points (32 held), 5826 springs", "implicit-euler         any", "rk4 ", "valid", "0.3 kg"})
    EXPECT_THAT(result.out, HasSubstr(words));
}

TEST_F(Command, WarnsOfAStepThatIsNotStable) {
  const Result result =
      run("validate " + scene(R"("bodies": [{"type": "soft", "grid": {"size": [1, 1], "points": [9, 9]},
      "solver": {"dt": 0.004}}])"));
  EXPECT_EQ(result.code, 0);
  EXPECT_THAT(result.out, HasSubstr("warning: the step is above the largest stable one"));
}

TEST_F(Command, ListsScenesAndHelps) {
  for (const char* list : {"list", "--list"}) {
    const Result result = run(list);
    EXPECT_EQ(result.code, 0);
    EXPECT_THAT(result.out, HasSubstr("hanging-sheet-64"));
    EXPECT_THAT(result.out, HasSubstr("cape"));
    EXPECT_THAT(result.out, HasSubstr("six-methods"));
  }
  for (const char* help : {"--help", "simulate --help", "render --help", "validate --help"}) {
    const Result result = run(help);
    EXPECT_EQ(result.code, 0);
    EXPECT_THAT(result.out, HasSubstr("Example"));
  }
}

TEST_F(Command, RendersAPictureAndAFolderOfPictures) {
  EXPECT_EQ(run("render " + scene(kPendulum) + " --out " + out() + ".png --size 160x90 --frame-at 0.05").code, 0);
  EXPECT_EQ(contents(out() + ".png").substr(1, 3), "PNG");
  EXPECT_EQ(run("render " + scene(kPendulum) + " --out " + out() + " --size 160x90").code, 0);
  EXPECT_TRUE(exists(folder_ / "run/frame.0005.png"));
  EXPECT_FALSE(exists(folder_ / "run/frame.0006.png")) << "0.1 s at 60 Hz are six pictures";
}

}  // namespace
}  // namespace hooke
