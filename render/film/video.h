// A video of pictures by the program ffmpeg, where it is installed.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace flexframe::film {

struct VideoReport {
  bool made = false;
  std::string note;          // why there is none
  double cpu_seconds = 0.0;  // of ffmpeg
};

// Pictures folder/frame_%05d.png from number `first` on, `count` of them, to an H.264 file (.mp4) or, by the name's ending, a GIF (.gif) or an animated PNG (.apng, .png).
// Written under another name and renamed. Calls `wait` now and then; it may throw to stop. A missing or failing ffmpeg is a note,
// not an error: the pictures are the work.
VideoReport make_video(const std::filesystem::path& folder, int first, int count, double frame_rate, const std::filesystem::path& path,
                       const std::function<void()>& wait = {});

}  // namespace flexframe::film
