// Some pictures of a sequence in one.
#pragma once

#include "render/draw/renderer.h"
#include "render/film/animation.h"

#include <filesystem>

namespace flexframe::film {

// Which pictures of the sequence, and how many of them, evenly spaced from `first` to `first + pictures - 1`.
struct SheetRange {
  int first = 0, pictures = 0, count = 0;
};

// Draws them anew, small, each with its time and with the scene as large as it gets; title, note, scalar bar and legend stand once around
// all. At most 1920 pixels wide. Written whole or not at all.
void write_contact_sheet(const Animation& animation, const SheetRange& range, render::Renderer& renderer,
                         const std::filesystem::path& path);

}  // namespace flexframe::film
