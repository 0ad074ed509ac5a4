// Runs of the hooke command that are stopped in the middle and resumed.
#include <io/temporary_folder.hpp>

#include <gmock/gmock.h>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <thread>

namespace hooke {
namespace {

using std::filesystem::exists;
using test::contents;
using test::TemporaryFolder;
using ::testing::HasSubstr;

class Resume : public ::testing::Test {
 protected:
  struct Result {
    int code = -1;
    std::string out, err;
  };

  // Begins `hooke simulate SCENE --out OUT OPTIONS`.
  pid_t begin(const std::string& out, const std::vector<std::string>& options) {
    std::vector<std::string> words = {HOOKE_COMMAND,        "simulate", scene_, "--out", (folder_ / out).string(),
                                      "--no-error-estimate"};
    words.insert(words.end(), options.begin(), options.end());
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const std::string log = (folder_ / "out.txt").string(), errors = (folder_ / "err.txt").string();
    const pid_t child = fork();
    if (child == 0) {
      dup2(open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), 1);
      dup2(open(errors.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), 2);
      execv(HOOKE_COMMAND, arguments.data());
      _exit(99);
    }
    return child;
  }
  Result wait(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), contents(folder_ / "out.txt"),
            contents(folder_ / "err.txt")};
  }
  Result simulate(const std::string& out, const std::vector<std::string>& options) { return wait(begin(out, options)); }
  // Waits until the file is there, or a second or two.
  void wait_for(const std::filesystem::path& file) {
    for (int i = 0; i < 2000 && !exists(file); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ASSERT_TRUE(exists(file)) << file;
  }
  // Every file but the timings, which differ by nature.
  void expect_same_files(const std::string& a, const std::string& b) {
    const auto names = [&](const std::string& folder) {
      std::vector<std::string> out;
      for (const auto& entry : std::filesystem::directory_iterator(folder_ / folder))
        if (entry.path().filename() != "timings.csv") out.push_back(entry.path().filename());
      std::sort(out.begin(), out.end());
      return out;
    };
    ASSERT_EQ(names(a), names(b));
    for (const std::string& name : names(a))
      EXPECT_TRUE(contents(folder_ / a / name) == contents(folder_ / b / name)) << name;
    EXPECT_EQ(rows(contents(folder_ / a / "timings.csv")), rows(contents(folder_ / b / "timings.csv")));
  }
  static std::ptrdiff_t rows(const std::string& text) { return std::count(text.begin(), text.end(), '\n'); }

  void kill_and_resume(int times);

  TemporaryFolder folder_;
  std::string scene_ = write("6");
  // A sheet on a ball under an automatic step, and sparks that have children, in gusts.
  std::string write(const std::string& duration) {
    return folder_
        .write("scene.json", R"({"hooke": 1, "preroll": 0.3, "frame_rate": 50, "duration": )" + duration + R"(,
    "colliders": [{"type": "sphere", "center": [0, -0.6, 0.3], "radius": 0.3}, {"type": "half-space", "offset": -1}],
    "bodies": [
      {"type": "soft", "name": "sheet", "grid": {"size": [1, 1], "points": [24, 24]}, "pin": "top",
       "wind": {"velocity": [0, 0, 3], "gust": 0.5}},
      {"type": "particles", "name": "jet", "capacity": 400, "emitters": [
       {"position": [0, 0.2, 0], "axis": [1, 0, 0], "spread": 30, "rate": 900, "speed": [1, 2], "lifetime": [0.2, 0.6]}],
       "forces": [{"force": "turbulence", "speed": 1, "size": 0.2, "rate": 3}],
       "kinds": [{"name": "k"}, {"name": "bit"}],
       "sub_emitters": [{"on": "impact", "parent": "k", "kind": "bit", "count": 1, "lifetime": 0.1}]}]})")
        .string();
  }
};

// Kills the run at a random moment, resumes it, kills that too, and so on, until one comes through.
void Resume::kill_and_resume(int times) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const auto begin_time = std::chrono::steady_clock::now();
  const Result whole = simulate("whole", {"--export", "ply", "--checkpoint", "0"});
  ASSERT_EQ(whole.code, 0) << whole.err;
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_time).count();
  int kills = 0, runs = 0;
  while (kills < times) {
    std::filesystem::remove_all(folder_ / "cut");
    bool resume = false;
    int in_a_row = 0;
    for (;; ++in_a_row) {
      std::vector<std::string> options = {"--export", "ply", "--checkpoint", "0.1"};
      if (resume) options.push_back("--resume");
      const pid_t child = begin("cut", options);
      // Two or three kills a run.
      const double moment = std::uniform_real_distribution<>(0, 0.8 * seconds)(random);
      if (kills < times && in_a_row < 3) {
        std::this_thread::sleep_for(std::chrono::duration<double>(moment));
        kill(child, SIGKILL);
      }
      const Result result = wait(child);
      if (result.code == 0) break;
      ASSERT_EQ(result.code, -SIGKILL) << result.err;
      ++kills;
      resume = exists(folder_ / "cut/checkpoint");
    }
    ++runs;
    expect_same_files("whole", "cut");
    if (HasFailure()) return;
  }
  std::printf("%d kills in %d runs of %.2f s, seed %u\n", kills, runs, seconds, seed);
}

TEST_F(Resume, AKilledRunResumesToTheSameBits) {
  const char* wanted = std::getenv("HOOKE_KILLS");
  kill_and_resume(wanted ? std::atoi(wanted) : 3);
}

TEST_F(Resume, ATerminatedRunLeavesACheckpointAndGoesOn) {
  for (const char* format : {"pc2", "csv"}) {
    ASSERT_EQ(simulate("whole", {"--export", format}).code, 0);
    EXPECT_FALSE(exists(folder_ / "whole/checkpoint")) << "a run that is done leaves none";
    const pid_t child = begin("cut", {"--export", format});
    wait_for(folder_ / "cut/diagnostics.part.csv");
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    kill(child, SIGTERM);
    const Result result = wait(child);
    EXPECT_EQ(result.code, 130);
    EXPECT_THAT(result.err, HasSubstr("--resume"));
    ASSERT_TRUE(exists(folder_ / "cut/checkpoint"));
    const auto before = rows(contents(folder_ / "cut/diagnostics.csv"));
    EXPECT_LT(before, 302);
    const Result rest = simulate("cut", {"--export", format, "--resume", "--threads", "2"});
    EXPECT_EQ(rest.code, 0) << rest.err;
    EXPECT_THAT(rest.out, HasSubstr("resumed at "));
    expect_same_files("whole", "cut");
    for (const char* folder : {"whole", "cut"}) std::filesystem::remove_all(folder_ / folder);
  }
}

TEST_F(Resume, WhatDoesNotFitIsRefusedAndLeftAlone) {
  const pid_t child = begin("cut", {"--checkpoint", "0.1"});
  wait_for(folder_ / "cut/checkpoint");
  kill(child, SIGKILL);
  wait(child);
  const std::filesystem::path file = folder_ / "cut/checkpoint";
  const std::string good = contents(file), table = contents(folder_ / "cut/diagnostics.part.csv");
  const auto refused = [&](const std::vector<std::string>& options, const std::string& words) {
    std::vector<std::string> all = {"--resume"};
    all.insert(all.end(), options.begin(), options.end());
    const std::string before = contents(file);
    const Result result = simulate("cut", all);
    EXPECT_EQ(result.code, 2) << words;
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_EQ(rows(result.err), 1) << result.err;
    EXPECT_TRUE(contents(file) == before);
    EXPECT_TRUE(contents(folder_ / "cut/diagnostics.part.csv") == table);
  };
  refused({"--method", "rk4"}, "--method is \"\" in the checkpoint and \"rk4\" here");
  refused({"--end", "7"}, "--end is \"0\" in the checkpoint and \"7\" here");
  refused({"--export", "ply"}, "--export is \"\" in the checkpoint and \"ply\" here");
  const auto write_checkpoint = [&](const std::string& bytes) { folder_.write("cut/checkpoint", bytes); };
  write_checkpoint(good.substr(0, good.size() / 2));
  refused({}, "checkpoint: is truncated");
  write_checkpoint("time,kinetic\n0,1\n");
  refused({}, "checkpoint: is not a checkpoint of Hooke");
  std::string damaged = good;
  damaged[good.size() / 2] ^= 4;
  write_checkpoint(damaged);
  refused({}, "checkpoint: is damaged");
  write_checkpoint(good);
  write("6.5");
  refused({}, "scene is \"with checksum");
  write("6");
  std::filesystem::rename(folder_ / "cut/timings.part.csv", folder_ / "cut/away.csv");
  refused({}, "timings.csv: cannot be continued");
  std::filesystem::rename(folder_ / "cut/away.csv", folder_ / "cut/timings.part.csv");
  EXPECT_EQ(simulate("cut", {"--resume"}).code, 0);
  std::filesystem::remove_all(folder_ / "cut");
  const Result none = simulate("cut", {"--resume"});
  EXPECT_EQ(none.code, 2);
  EXPECT_THAT(none.err, HasSubstr("there is no checkpoint"));
  EXPECT_FALSE(exists(folder_ / "cut"));
}

TEST_F(Resume, AFullDiskLeavesTheLastGoodCheckpoint) {
  if (!exists("/dev/full")) return;
  const pid_t child = begin("cut", {"--checkpoint", "0.1"});
  wait_for(folder_ / "cut/checkpoint");
  kill(child, SIGKILL);
  wait(child);
  const std::string good = contents(folder_ / "cut/checkpoint");
  std::filesystem::remove(folder_ / "cut/checkpoint.part");
  std::filesystem::create_symlink("/dev/full", folder_ / "cut/checkpoint.part");
  const Result full = simulate("cut", {"--checkpoint", "0.1", "--resume"});
  EXPECT_EQ(full.code, 3);
  EXPECT_THAT(full.err, HasSubstr("checkpoint: cannot write: No space left on device"));
  EXPECT_TRUE(contents(folder_ / "cut/checkpoint") == good);
  ASSERT_EQ(simulate("cut", {"--checkpoint", "0.1", "--resume"}).code, 0);
  ASSERT_EQ(simulate("whole", {}).code, 0);
  expect_same_files("whole", "cut");
}

}  // namespace
}  // namespace hooke
