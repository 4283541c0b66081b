// A video of pictures by the program ffmpeg, where it is installed.
//
//   VideoWriter video(path, 30.0);
//   for (...) video.add(picture);      in order, as they are drawn
//   VideoReport report = video.finish();
//
// ffmpeg reads the pictures as they come and encodes while others are drawn; of a GIF it finds the colours meanwhile, and reads the
// pictures again for the film. The file is written under another name and renamed.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace flexframe::film {

struct VideoReport {
  bool made = false;
  std::string note;          // why there is none
  double cpu_seconds = 0.0;  // of ffmpeg, and of what unpacks pictures for it
};

// Endings of the files that can be made, capitals or not: H.264, GIF, animated PNG (the last two).
const std::vector<std::string>& video_endings();
bool is_video_name(const std::filesystem::path& path);

// Takes away what a killed run left of the video of that name.
void remove_unfinished_video(const std::filesystem::path& path);

// A missing or failing ffmpeg is a note of the report, not an error: the pictures are the work.
class VideoWriter {
 public:
  // frame_rate: pictures a second. Transparent pictures lie on white in formats that know no transparency (.mp4).
  VideoWriter(const std::filesystem::path& path, double frame_rate);
  ~VideoWriter();  // before finish: ffmpeg is ended and leaves nothing
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  // The next picture, a whole PNG file that stays there until finish. Returns at once.
  void add(const std::filesystem::path& picture);

  // Waits for ffmpeg. Calls `wait` now and then; it may throw to stop.
  VideoReport finish(const std::function<void()>& wait = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace flexframe::film
