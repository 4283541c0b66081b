#include "render/film/sweep_sheet.h"

#include "render/draw/renderer.h"
#include "render/film/animation.h"
#include "render/film/overlay.h"
#include "render/film/sweep_plots.h"
#include "render/frame/layout.h"
#include "render/image/png.h"
#include "render/image/text.h"
#include "sim/base/error.h"
#include "sim/scene/scene_reader.h"
#include "sim/simulate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

namespace flexframe::film {
namespace {

constexpr int widest = 1920, widest_cell = 640, gap = 6, caption_line = 20;
constexpr double caption_size = 13.0;
constexpr glm::vec3 ink(0.13f, 0.15f, 0.18f);

// One point: its scene, its run, what draws it; or why there is none.
struct Cell {
  long point = 0;
  std::string caption, problem;
  sim::Scene scene;
  sim::Results results;
  std::optional<Animation> animation;
};

std::string caption_of(const sim::Design& design, long point) {
  const std::vector<sim::Design::Value> values = design.point(point);
  std::string out;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const sim::SweepAxis& axis = design.axes()[k];
    const bool word = !axis.chance && axis.numbers.empty();
    out += fmt::format("{}{} = {}", out.empty() ? "" : ", ", short_key(design, k),
                       word ? values[k].text : fmt::format("{:.4g}", values[k].number));
  }
  return out;
}

// Points that are drawn, and how many stand in a row.
std::vector<long> chosen_points(const sim::Design& design, int most, int& columns) {
  std::vector<long> out;
  if (design.searches() > 0) {
    // Of searches evenly over their runs.
    std::vector<long> made;
    for (long k = 0; k < design.size(); ++k)
      if (design.has(k)) made.push_back(k);
    const auto shown = static_cast<long>(std::min<std::size_t>(static_cast<std::size_t>(most), made.size()));
    for (long k = 0; k < shown; ++k) out.push_back(made[static_cast<std::size_t>(k) * made.size() / static_cast<std::size_t>(shown)]);
    columns = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(std::max(1L, shown)))));
    return out;
  }
  const bool two_keys = design.sampling() == sim::Sampling::none && design.axes().size() == 2;
  const long n = std::min<long>(most, design.size());
  // Of a grid the places of a golden section: an even step would meet the same values of the last keys again and again.
  for (long k = 0; k < n; ++k)
    out.push_back(n == design.size() ? k
                                     : static_cast<long>(std::fmod(0.6180339887498949 * static_cast<double>(k), 1.0) *
                                                         static_cast<double>(design.size())));
  std::sort(out.begin(), out.end());
  columns = two_keys && design.size() <= most ? static_cast<int>(design.axes()[1].values.size())
                                              : static_cast<int>(std::ceil(std::sqrt(static_cast<double>(n))));
  return out;
}

std::unique_ptr<Cell> make_cell(const sim::Sweep& sweep, long point) {
  auto cell = std::make_unique<Cell>();
  cell->point = point;
  cell->caption = caption_of(sweep.design, point);
  try {
    const sim::SceneDocument document = sim::parse_document(sweep.scene_text, sweep.question.scene, sweep.design.settings(point));
    cell->scene = sim::make_scene(document);
    RenderSettings settings = read_render_settings(document);
    check_render_settings(settings, cell->scene);
    sim::SimulateOptions options;
    options.tolerance = sweep.question.tolerance;
    options.accuracy = sweep.question.accuracy;
    options.max_steps = sweep.question.max_steps;
    options.estimate_error = options.check_effects = false;
    cell->results = sim::simulate(cell->scene, options);
    cell->animation = make_animation(cell->results, settings, &cell->scene);
  } catch (const InputError& problem) {
    cell->problem = problem.what();
  } catch (const SimulationError& problem) {
    cell->problem = problem.what();
  }
  return cell;
}

// One colour range, one exaggeration's view and one set of points that the camera sees.
void make_alike(std::vector<std::unique_ptr<Cell>>& cells) {
  const Animation* first = nullptr;
  render::ScalarMap map;
  std::vector<glm::dvec3> points;
  for (const auto& cell : cells) {
    if (!cell->animation) continue;
    const Animation& a = *cell->animation;
    if (!first) map = a.scalar_map;
    map.lower = std::min(map.lower, a.scalar_map.lower);
    map.upper = std::max(map.upper, a.scalar_map.upper);
    points.insert(points.end(), a.points.begin(), a.points.end());
    first = first ? first : &a;
  }
  for (const auto& cell : cells) {
    if (!cell->animation) continue;
    cell->animation->scalar_map.lower = map.lower;
    cell->animation->scalar_map.upper = map.upper;
    cell->animation->points = points;
    cell->animation->light = first->light;
  }
}

render::Image draw_cell(const Cell& cell, double time, render::Size size, render::Renderer& renderer) {
  const Animation& a = *cell.animation;
  const int picture = a.step > 0.0 ? std::clamp(static_cast<int>(std::lround(time / a.step)), 0, a.count - 1) : 0;
  PictureMemory memory;
  update_picture(a, picture, memory);
  render::Picture& p = memory.picture;
  p.size = size;
  render::Overlay overlay;
  overlay.dark = p.overlay.dark;
  overlay.grid_note = false;
  p.overlay = std::move(overlay);
  p.insets.clear();
  if (a.fit && a.views.empty()) aim_camera(a, picture, render::fit_camera(p, a.points, *a.fit), p);
  return renderer.draw(p);
}

void copy_image(const render::Image& from, render::Image& to, int x, int y) {
  for (int row = 0; row < from.height; ++row)
    for (int col = 0; col < from.width; ++col)
      for (int c = 0; c < 3; ++c)
        to.pixels[(std::size_t(y + row) * to.width + x + col) * to.channels + c] =
            from.pixels[(std::size_t(row) * from.width + col) * from.channels + c];
}

// The text in lines that fit, at most `most` of them.
void draw_lines(render::Image& image, glm::dvec2 at, const std::string& text, double width, int most) {
  std::string rest = text;
  for (int line = 0; line < most && !rest.empty(); ++line) {
    std::string part = rest;
    while (render::text_width(part, caption_size) > width && part.find(' ') != std::string::npos) part.resize(part.rfind(' '));
    render::draw_text(image, at, render::fit_text(part, caption_size, width), caption_size, ink);
    rest = part.size() < rest.size() ? rest.substr(part.size() + 1) : "";
    at.y += 18.0;
  }
}

}  // namespace

std::vector<std::string> write_sweep_sheet(const sim::Sweep& sweep, const SweepSheet& sheet, const std::filesystem::path& path) {
  int columns = 1;
  std::vector<std::unique_ptr<Cell>> cells;
  const std::vector<long> points = chosen_points(sweep.design, sheet.most, columns);
  for (const long point : points) {
    if (sheet.progress) sheet.progress(static_cast<int>(cells.size()), static_cast<int>(points.size()));
    cells.push_back(make_cell(sweep, point));
  }
  std::vector<std::string> notes;
  const auto first = std::find_if(cells.begin(), cells.end(), [](const auto& cell) { return cell->animation.has_value(); });
  if (first == cells.end()) return {"no contact sheet: none of its points can be drawn"};
  make_alike(cells);
  const Animation& model = *(*first)->animation;
  const render::Size film = model.settings.size;
  const int rows = (static_cast<int>(cells.size()) + columns - 1) / columns;
  render::Size cell;
  cell.width = std::min({film.width, widest_cell, (widest - gap) / columns - gap});
  cell.height = std::max(16, static_cast<int>(std::lround(static_cast<double>(cell.width) * film.height / film.width)));
  // Captions of many keys take two lines.
  const bool long_captions = std::any_of(
      cells.begin(), cells.end(), [&](const auto& one) { return render::text_width(one->caption, caption_size) > cell.width - 4.0; });
  const int caption_height = long_captions ? 2 * caption_line : caption_line + 2;
  const int head = 44;
  render::Image image = render::make_image(columns * (cell.width + gap) + gap, head + rows * (cell.height + caption_height + gap), 3, 255);
  std::string range;
  if (model.scalar_bar)
    range =
        fmt::format("; {} {:.3g} (dark) to {:.3g} {} (bright)", model.scalar_bar->label, model.scalar_map.lower * model.scalar_bar->factor,
                    model.scalar_map.upper * model.scalar_bar->factor, model.scalar_bar->unit);
  render::draw_text(image, {gap, 28.0},
                    render::fit_text(fmt::format("{} at t = {:g} s, {} of {} points{}", model.results->title, sheet.time, cells.size(),
                                                 sweep.design.size(), range),
                                     16.0, image.width - 2.0 * gap, render::Weight::bold),
                    16.0, ink, render::Weight::bold);
  render::Renderer renderer(sheet.backend);
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const Cell& one = *cells[k];
    const int x = gap + static_cast<int>(k) % columns * (cell.width + gap);
    const int y = head + static_cast<int>(k) / columns * (cell.height + caption_height + gap);
    if (one.animation) {
      copy_image(draw_cell(one, sheet.time, cell, renderer), image, x, y);
      if (one.results.times[one.results.times.size() - 1] < sheet.time)
        notes.push_back(fmt::format("point {} ends before t = {:g} s: its last picture is shown", one.point, sheet.time));
    } else {
      render::draw_frame(image, {double(x), double(y), double(cell.width), double(cell.height)}, 1.0, glm::vec3(0.7f));
      draw_lines(image, {x + 8.0, y + 20.0}, one.problem, cell.width - 16.0, std::max(1, (cell.height - 24) / 18));
    }
    draw_lines(image, {x + 2.0, y + cell.height + 16.0}, one.caption, cell.width - 4.0, 2);
  }
  render::write_png(path, image, {.level = 6, .text = {}});
  return notes;
}

}  // namespace flexframe::film
