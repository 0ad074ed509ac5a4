#include <render/video_file.hpp>

#include <hooke/error.hpp>

#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace hooke::render {

namespace {

namespace fs = std::filesystem;

fs::path find_on_path(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path candidate = fs::path(folder.empty() ? "." : folder) / program;
    std::error_code ignored;
    if (fs::is_regular_file(candidate, ignored) && access(candidate.c_str(), X_OK) == 0) return candidate;
  }
  return {};
}

// Blocks SIGPIPE in this thread while a pipe is written, and swallows the one it raised.
class QuietPipe {
 public:
  QuietPipe() {
    sigemptyset(&pipe_signal_);
    sigaddset(&pipe_signal_, SIGPIPE);
    sigset_t pending;
    sigpending(&pending);
    was_pending_ = sigismember(&pending, SIGPIPE) == 1;
    pthread_sigmask(SIG_BLOCK, &pipe_signal_, &before_);
  }
  ~QuietPipe() {
    const timespec now{0, 0};
    if (!was_pending_)
      while (sigtimedwait(&pipe_signal_, nullptr, &now) == -1 && errno == EINTR) {
      }
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  QuietPipe(const QuietPipe&) = delete;
  QuietPipe& operator=(const QuietPipe&) = delete;

 private:
  sigset_t pipe_signal_;
  sigset_t before_;
  bool was_pending_ = false;
};

// The last line with text in it.
std::string last_line(int file) {
  std::string text;
  char buffer[4096];
  if (lseek(file, 0, SEEK_SET) == 0)
    for (ssize_t got; (got = read(file, buffer, sizeof buffer)) > 0;) text.append(buffer, static_cast<size_t>(got));
  std::string last;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    if (line.find_first_not_of(" \t\r") != std::string::npos) last = line;
  return last;
}

}  // namespace

struct VideoFile::Encoder {
  fs::path path, part_path;
  int width, height;
  double fps;
  long frames = 0;
  pid_t process = -1;
  int frames_out = -1;  // our end of the pipe
  int messages = -1;    // unlinked temporary file with the encoder's stderr
  int exit_code = 0;

  ~Encoder() {
    wait_for_end();
    if (messages >= 0) close(messages);
  }

  [[noreturn]] void fail(const std::string& reason) const {
    throw OutputError("VideoFile: cannot write " + path.string() + ": " + reason);
  }

  std::vector<std::string> arguments(const fs::path& program) const {
    std::ostringstream rate;
    rate.precision(12);
    rate << fps;
    // A leading "-" in a file name would be read as an option; "file:" rules that out.
    return {program.string(), "-hide_banner", "-loglevel", "error", "-nostdin", "-y", "-f", "rawvideo", "-pixel_format",
            "rgb24", "-video_size", std::to_string(width) + "x" + std::to_string(height), "-framerate", rate.str(),
            "-i", "pipe:0", "-an",
            // Our pictures are sRGB; the matrix has to be named or players guess from the size.
            "-vf", "scale=out_color_matrix=bt709:out_range=tv", "-colorspace", "bt709", "-color_primaries", "bt709",
            "-color_trc", "iec61966-2-1", "-color_range", "tv", "-c:v", "libx264", "-preset", "medium", "-crf", "18",
            "-pix_fmt", "yuv420p", "-movflags", "+frag_keyframe+empty_moov", "-f", "mp4", "file:" + part_path.string()};
  }

  void start() {
    const fs::path program = find_on_path("ffmpeg");
    if (program.empty()) fail("ffmpeg is not on PATH");
    std::string name = (fs::temp_directory_path() / "hooke-ffmpeg-XXXXXX").string();
    messages = mkostemp(name.data(), O_CLOEXEC);
    if (messages < 0) fail(std::strerror(errno));
    unlink(name.c_str());

    std::vector<std::string> words = arguments(program);
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);

    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) fail(std::strerror(errno));
    process = fork();
    if (process == 0) {  // only async-signal-safe calls until exec
      setsid();
      signal(SIGPIPE, SIG_DFL);
      sigset_t none;
      sigemptyset(&none);
      sigprocmask(SIG_SETMASK, &none, nullptr);
      const int nowhere = open("/dev/null", O_WRONLY);
      if (dup2(ends[0], STDIN_FILENO) < 0 || dup2(nowhere, STDOUT_FILENO) < 0 || dup2(messages, STDERR_FILENO) < 0)
        _exit(127);
      execv(argv[0], argv.data());
      _exit(127);
    }
    const int reason = errno;
    close(ends[0]);
    frames_out = ends[1];
    if (process < 0) fail(std::strerror(reason));
  }

  // Closes the pipe, which makes the encoder finish, and collects its exit code.
  void wait_for_end() {
    if (frames_out >= 0) close(std::exchange(frames_out, -1));
    if (process <= 0) return;
    int status = 0;
    pid_t got;
    while ((got = waitpid(process, &status, 0)) < 0 && errno == EINTR) {
    }
    process = -1;
    if (got < 0)
      exit_code = 0;  // someone else collected it (SIGCHLD ignored): judge by the file
    else
      exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  [[noreturn]] void fail_with_encoder_text(const std::string& otherwise) {
    wait_for_end();
    const std::string line = last_line(messages);
    std::string reason = line.empty() ? otherwise : line;
    if (exit_code != 0) reason += " (ffmpeg exit code " + std::to_string(exit_code) + ")";
    fail(reason);
  }

  void write_all(const std::uint8_t* bytes, std::size_t count) {
    const QuietPipe quiet;
    while (count > 0) {
      const ssize_t written = write(frames_out, bytes, count);
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) fail_with_encoder_text(std::strerror(errno));
      bytes += written;
      count -= static_cast<std::size_t>(written);
    }
  }
};

VideoFile::VideoFile(fs::path path, int width, int height, double fps) : encoder_(std::make_unique<Encoder>()) {
  if (width <= 0 || height <= 0 || width % 2 || height % 2)
    throw std::invalid_argument("VideoFile: width and height must be positive and even, got " + std::to_string(width) +
                                " x " + std::to_string(height));
  if (!(fps > 0) || !std::isfinite(fps))
    throw std::invalid_argument("VideoFile: fps must be positive, got " + std::to_string(fps));
  encoder_->part_path = path.parent_path() / (path.stem().string() + ".part.mp4");
  encoder_->path = std::move(path);
  encoder_->width = width;
  encoder_->height = height;
  encoder_->fps = fps;
  encoder_->start();
}

VideoFile::~VideoFile() = default;
VideoFile::VideoFile(VideoFile&&) noexcept = default;
VideoFile& VideoFile::operator=(VideoFile&&) noexcept = default;

void VideoFile::add(const Image& frame) {
  if (frame.width != encoder_->width || frame.height != encoder_->height ||
      frame.rgb.size() != 3 * static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height))
    throw std::invalid_argument("VideoFile: a frame must have " + std::to_string(encoder_->width) + " x " +
                                std::to_string(encoder_->height) + " pixels, got " + std::to_string(frame.width) +
                                " x " + std::to_string(frame.height));
  if (encoder_->frames_out < 0) encoder_->fail("the film has already ended");
  encoder_->write_all(frame.rgb.data(), frame.rgb.size());
  ++encoder_->frames;
}

void VideoFile::finish() {
  if (encoder_->frames_out < 0) encoder_->fail("the film has already ended");
  encoder_->wait_for_end();
  if (encoder_->exit_code != 0) encoder_->fail_with_encoder_text("the encoder failed");
  if (encoder_->frames == 0) encoder_->fail("no frame was added");
  std::error_code error;
  fs::rename(encoder_->part_path, encoder_->path, error);
  if (error) encoder_->fail(error.message());
}

bool VideoFile::available() { return !find_on_path("ffmpeg").empty(); }

}  // namespace hooke::render
