#include "render/film/overlay.h"

#include "render/picture/colormap.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <string_view>

namespace flexframe::film {

std::pair<std::string, double> readable_unit(const std::string& unit, double largest) {
  struct Step {
    double from, factor;  // of the unit itself
    const char* prefix;
  };
  static constexpr Step small[] = {{1.0, 1.0, ""}, {1e-3, 1e3, "m"}, {1e-6, 1e6, "µ"}, {0.0, 1e9, "n"}};
  static constexpr Step large[] = {{1e9, 1e-9, "G"}, {1e6, 1e-6, "M"}, {1e4, 1e-3, "k"}, {1e-3, 1.0, ""},
                                   {1e-6, 1e6, "µ"}, {1e-9, 1e9, "n"}, {0.0, 1e12, "p"}};
  const bool length = unit == "m";
  if (!length && unit != "N" && unit != "N m" && unit != "Pa" && unit != "W" && unit != "J") return {unit, 1.0};
  if (largest == 0.0) return {unit, 1.0};
  for (const Step& step : length ? std::span<const Step>(small) : std::span<const Step>(large))
    if (largest >= step.from) return {step.prefix + unit, step.factor};
  return {unit, 1.0};  // not a number
}

PlotSeries thin_series(const std::string& label, const sim::VecX& times, const sim::VecX& values) {
  constexpr Eigen::Index bins = 2000;
  PlotSeries out{.label = label, .x = {}, .y = {}};
  const Eigen::Index n = values.size(), per = std::max<Eigen::Index>(1, n / bins);
  // The first and the last: a curve that begins later has no dot in the first picture.
  if (n > 0) out.x.push_back(times[0]), out.y.push_back(values[0]);
  for (Eigen::Index i = 0; i < n; i += per) {
    const Eigen::Index count = std::min(per, n - i);
    Eigen::Index low = 0, high = 0;
    values.segment(i, count).minCoeff(&low);
    values.segment(i, count).maxCoeff(&high);
    for (Eigen::Index k : {std::min(low, high), std::max(low, high)}) {
      if (out.x.back() == times[i + k]) continue;
      out.x.push_back(times[i + k]);
      out.y.push_back(values[i + k]);
    }
  }
  if (n > 0 && out.x.back() != times[n - 1]) {
    out.x.push_back(times[n - 1]);
    out.y.push_back(values[n - 1]);
  }
  return out;
}

namespace {

// Curves of several runs have the colours of their runs, differences from the first those that follow, whatever the panel; negative: none
// has this name.
glm::vec3 color_of_run(const RenderSettings& settings, const std::string& label) {
  glm::vec3 color(-1.0f);
  size_t longest = 0;
  for (size_t r = 0; r < settings.runs.size(); ++r) {
    const auto& [name, own] = settings.runs[r];
    if (name.size() < longest) continue;
    const bool difference = label.starts_with(name + " - ");
    if (!difference && !label.starts_with(name + ": ")) continue;
    color = difference ? render::category_color(static_cast<int>(settings.runs.size() + r) - 1) : own;
    longest = name.size();
  }
  return color;
}

}  // namespace

void fill_overlay(const Animation& animation, double t, render::Picture& picture) {
  const sim::Results& results = *animation.results;
  const RenderSettings& settings = animation.settings;
  const OverlaySettings& asked = settings.overlay;
  render::Overlay& overlay = picture.overlay;
  overlay = {};

  switch (settings.background) {
    case BackgroundKind::gradient:
      if (settings.look == LookKind::presentation) picture.background = {.top = {0.82f, 0.84f, 0.87f}, .bottom = {0.975f, 0.975f, 0.97f}};
      break;
    case BackgroundKind::white:
      picture.background.top = picture.background.bottom = glm::vec3(1.0f);
      break;
    case BackgroundKind::dark:
      picture.background.top = {0.13f, 0.15f, 0.19f};
      picture.background.bottom = {0.05f, 0.06f, 0.08f};
      overlay.dark = true;
      break;
    case BackgroundKind::transparent:
      picture.background.transparent = true;
      break;
  }

  if (asked.title) overlay.title = results.title;
  if (asked.time) overlay.time = render::time_text(t, animation.step, results.times[results.times.size() - 1], results.times[0]);
  overlay.triad = asked.triad;
  overlay.text_scale = settings.text_scale;
  if (asked.scalar_bar) overlay.scalar_bar = animation.scalar_bar;
  picture.scalar_map = animation.scalar_map;
  picture.lighting.studio = settings.studio;

  // Which body shows which scale; nothing to say where all are in scale.
  const std::vector<double>& scales = animation.scales;
  if (asked.note && animation.largest_displacement > 0.0 && (scales.size() > 1 || scales[0] != 1.0)) {
    const auto words = [](double scale) {
      return scale == 1.0   ? std::string("in scale")
             : scale == 0.0 ? std::string("undeformed")
                            : fmt::format("elastic displacement {}", render::scale_text(scale));
    };
    overlay.note = "solid: " + words(scales[0]);
    // Bodies may show their other scales as meshes, or not at all.
    bool ghosts = false, meshes = false;
    for (const BodyModel& body : animation.bodies) {
      ghosts |= body.visible && body.flexible && body.ghost == GhostStyle::body;
      meshes |= body.visible && body.flexible && body.ghost == GhostStyle::mesh;
    }
    const std::string others = ghosts && meshes ? "; ghost and mesh: " : meshes ? "; mesh: " : "; ghost: ";
    for (size_t i = 1; i < scales.size() && (ghosts || meshes); ++i)
      overlay.note += i == 1                                   ? others + words(scales[i])
                      : scales[i] > 1.0 && scales[i - 1] > 1.0 ? ", " + render::scale_text(scales[i])
                                                               : ", " + words(scales[i]);
    // A small picture has room for how much larger, not for what.
    overlay.short_note = overlay.note;
    for (const std::string_view left_out : {"solid: in scale; ", "elastic displacement "})
      if (const size_t at = overlay.short_note.find(left_out); at != std::string::npos && overlay.short_note.size() > left_out.size())
        overlay.short_note.erase(at, left_out.size());
  }
  if (asked.legend && settings.color_by == ColorBy::body)
    for (const BodyModel& body : animation.bodies)
      if (body.visible) overlay.legend.push_back({.text = body.name, .color = body.material.color, .opacity = 1.0f});

  for (const auto& [name, color] : settings.runs)
    if (asked.legend) overlay.legend.push_back({.text = name, .color = color, .opacity = 1.0f});

  for (const PlotPanel& panel : animation.panels) {
    render::Plot plot;
    // The names stand above the diagram, beside their lines; plain numbers have no unit.
    if (!panel.y_label.empty() && panel.y_label != "1") plot.y_label = fmt::format("[{}]", panel.y_label);
    for (const PlotSeries& series : panel.series) {
      plot.series.push_back({.label = series.label, .x = series.x, .y = series.y, .color = color_of_run(settings, series.label)});
      if (!series.values) continue;
      const SamplePlace now = find_sample(*series.times, t);
      double value = (*series.values)[now.index];
      if (now.share > 0.0) value += now.share * ((*series.values)[now.index + 1] - value);
      plot.series.back().now = panel.factor * value;
    }
    plot.mark = t;
    overlay.plots.push_back(std::move(plot));
  }
  overlay.plot_place = asked.plot_place;
  overlay.grid_note = asked.words;
}

}  // namespace flexframe::film
