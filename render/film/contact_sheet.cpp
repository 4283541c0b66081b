#include "render/film/contact_sheet.h"

#include "render/film/overlay.h"
#include "render/frame/layout.h"
#include "render/image/png.h"

#include <algorithm>
#include <cmath>

namespace flexframe::film {
namespace {

constexpr int widest = 1920, narrowest = 160, gap = 4;

// One cell: the scene and its time.
render::Image draw_cell(const Animation& animation, int k, render::Size size, render::Renderer& renderer, PictureMemory& memory) {
  update_picture(animation, k, memory);
  render::Picture& picture = memory.picture;
  picture.size = size;
  render::Overlay overlay;
  overlay.time = picture.overlay.time;
  overlay.dark = picture.overlay.dark;
  overlay.grid_note = false;
  picture.overlay = std::move(overlay);
  picture.insets.clear();
  if (animation.fit && animation.views.empty())
    aim_camera(animation, k, render::fit_camera(picture, animation.points, *animation.fit), picture);
  return renderer.draw(picture);
}

void copy_image(const render::Image& from, render::Image& to, int x, int y) {
  for (int row = 0; row < from.height; ++row)
    std::copy_n(&from.pixels[std::size_t(row) * from.width * from.channels], std::size_t(from.width) * from.channels,
                &to.pixels[(std::size_t(y + row) * to.width + x) * to.channels]);
}

}  // namespace

void write_contact_sheet(const Animation& animation, const SheetRange& range, render::Renderer& renderer,
                         const std::filesystem::path& path) {
  const int count = std::min(range.count, range.pictures);
  if (count < 1) return;
  // As good as square; one column more where that leaves fewer cells empty.
  const auto rows_of = [count](int columns) { return (count + columns - 1) / columns; };
  int columns = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(count))));
  if ((columns + 1) * rows_of(columns + 1) < columns * rows_of(columns)) ++columns;
  const int rows = rows_of(columns);

  // What stands around the cells, and the room it leaves them.
  render::Picture frame;
  fill_overlay(animation, animation.results->times[0], frame);
  frame.overlay.time.clear();
  frame.overlay.plots.clear();
  frame.overlay.triad = false;
  // The bar keeps its unit; its label stands below the title, where it takes no room from the cells.
  if (std::optional<render::ScalarBar>& bar = frame.overlay.scalar_bar; bar && !bar->unit.empty()) {
    frame.overlay.note += (frame.overlay.note.empty() ? "colours: " : "; colours: ") + bar->label;
    bar->label.clear();
  }
  frame.background.top = frame.background.bottom;
  const render::Size film = animation.settings.size;
  const double shape = static_cast<double>(film.height) / film.width;
  // Small films are not blown up beyond their own size.
  const int width = std::clamp(columns * (film.width + gap) + film.width / 2, 2 * narrowest, widest);
  frame.size = {width, std::clamp(static_cast<int>(rows * width * shape / columns), 2 * narrowest, 16384)};
  render::Size cell;
  render::PixelRect inner;
  for (int pass = 0; pass < 4; ++pass) {
    const render::Layout layout = render::make_layout(frame);
    inner = layout.inner;
    cell.width = std::clamp((inner.width - gap) / columns - gap, 16, film.width);
    cell.height = std::max(16, static_cast<int>(std::lround(cell.width * shape)));
    // As large as the cells and what stands around them, and no larger.
    const int above = frame.size.height - inner.height, beside = frame.size.width - inner.width;
    frame.size.height = std::clamp(rows * (cell.height + gap) + gap + above, narrowest, 16384);
    frame.size.width = std::clamp(columns * (cell.width + gap) + gap + beside, 2 * narrowest, widest);
  }

  render::Image sheet = renderer.draw(frame);
  PictureMemory memory;
  for (int k = 0; k < count; ++k) {
    const int picture = range.first + (count > 1 ? static_cast<int>(static_cast<long long>(k) * (range.pictures - 1) / (count - 1)) : 0);
    const render::Image image = draw_cell(animation, picture, cell, renderer, memory);
    const int x = inner.x + gap + (k % columns) * (cell.width + gap), y = inner.y + gap + (k / columns) * (cell.height + gap);
    if (x + image.width <= sheet.width && y + image.height <= sheet.height) copy_image(image, sheet, x, y);
  }
  render::write_png(path, sheet, {.level = 6, .text = {}});
}

}  // namespace flexframe::film
