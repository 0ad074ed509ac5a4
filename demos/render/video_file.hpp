// Films on disk, encoded by the ffmpeg program.
#pragma once

#include <render/image.hpp>

#include <filesystem>
#include <memory>

namespace hooke::render {

/// An H.264 film (MP4, yuv420p) that grows frame by frame. While it grows it is called
/// NAME.part.mp4, beside `path`, and is fragmented so that it can be played wherever it was
/// cut off; finish() gives it its name. Without finish() the part file stays.
///
/// The encoder runs in its own session: Ctrl-C in the terminal reaches the program that
/// draws, not the encoder, so every frame that was added gets encoded.
class VideoFile {
 public:
  /// `width` and `height` [pixels] must be even (yuv420p), `fps` [frames/s] positive;
  /// otherwise std::invalid_argument. Throws hooke::OutputError if the encoder does not start.
  VideoFile(std::filesystem::path path, int width, int height, double fps);
  /// Ends the film; blocks until the encoder is done. Never throws.
  ~VideoFile();
  VideoFile(VideoFile&&) noexcept;
  VideoFile& operator=(VideoFile&&) noexcept;

  /// Appends one frame of the film's size. Throws hooke::OutputError with the encoder's own
  /// words if it has failed, std::invalid_argument if the size differs.
  void add(const Image& frame);

  /// Completes the film and renames it to `path`. Throws hooke::OutputError if the encoder
  /// failed or no frame was added. add() must not be called any more.
  void finish();

  /// Whether ffmpeg is on PATH.
  static bool available();

 private:
  struct Encoder;
  std::unique_ptr<Encoder> encoder_;
};

}  // namespace hooke::render
