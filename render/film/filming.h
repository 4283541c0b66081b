// Draws a range of pictures into PNG files with several processes.
//
// Workers are forked before any graphics context exists, each rasterises in its own thread and takes the next picture when it is
// done with one: deform, draw, encode, write. A picture depends only on the animation and its number, so the files are the same bits
// whatever the number of workers, the shard or the point of resuming. Files appear whole or not at all (render/base/file.h), so killing any
// of the processes at any time leaves only whole pictures; workers end with their parent.
#pragma once

#include "render/draw/renderer.h"
#include "render/film/animation.h"

#include <filesystem>
#include <functional>

namespace flexframe::film {

struct FilmOptions {
  // Made if it is missing; pictures are folder/frame_00000.png ..., channels in folder/../depth, ../scalar, ../vector.
  std::filesystem::path folder{};
  int first = 0, end = -1;    // pictures first..end-1; end < 0: to the last
  int shard = 0, shards = 1;  // of these, the ones with number % shards == shard % shards
  bool resume = false;        // keep pictures that are whole and made from the same inputs
  int workers = 0;            // 0: as many as cores may be used
  render::Backend backend = render::Backend::osmesa;
  std::function<void(int done, int all)> progress{};  // now and then; may throw to stop
  std::function<void(const std::filesystem::path& picture)>
      finished{};  // each picture in order of number, as soon as it and all before it are there
};

struct FilmReport {
  int pictures = 0, drawn = 0, kept = 0;
  int workers = 0;
  double cpu_deform = 0.0, cpu_draw = 0.0, cpu_encode = 0.0;  // CPU seconds of all workers
  double wall_seconds = 0.0;
};

// Without resume, pictures of the asked range from an earlier run are removed first, and with the whole range those beyond its end.
// Throws sim::InputError for a range or shard without pictures, FileError or DrawError with path and reason when a picture cannot be drawn
// or written or a worker died.
FilmReport film(const Animation& animation, const FilmOptions& options);

// frame_00012.png
std::string picture_file_name(int picture);

}  // namespace flexframe::film
