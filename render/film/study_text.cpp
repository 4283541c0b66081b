#include "render/film/study_text.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::film {
namespace {

using Kind = StudyBlock::Kind;

std::string error_text(double error, bool floor, double least) {
  if (error < 0.0) return "";
  return floor ? fmt::format("at the floor (< {:.1e})", least) : fmt::format("{:.1e}", error);
}

// Axes in the order of their points, with diagrams beside them.
std::vector<std::string> axes_of(const Study& s) {
  std::vector<std::string> out;
  for (const StudyPoint& p : s.points)
    if (std::find(out.begin(), out.end(), p.axis) == out.end()) out.push_back(p.axis);
  return out;
}

const char* axis_sentence(const std::string& axis) {
  if (axis == "tolerance") return "The scene with different tolerances of the time integration.";
  if (axis == "method") return "Integration methods, each at three tolerances.";
  if (axis == "elements") return "Finite elements, the tolerance a tenth of the scene's.";
  if (axis == "kept")
    return "The lowest eigenmodes of the finite elements: the given number of the softest beam, of the other beams those below the same "
           "frequency.";
  if (axis == "modes") return "Eigenforms of the beam in place of elements, the tolerance a tenth of the scene's.";
  if (axis == "volumes") return "Volumes of two elements each (mixed), the tolerance a tenth of the scene's.";
  if (axis == "model")
    return "The same beams by other models, each with the method that the program chooses for it and with explicit steps, at two "
           "tolerances; the diagram connects the cheapest of each model.";
  return "Second-order displacements (stiffening) on and off.";
}

// Series of an axis in the order of their points.
std::vector<std::string> series_of(const Study& s, const std::string& axis) {
  std::vector<std::string> out;
  for (const StudyPoint& p : s.points)
    if (p.axis == axis && std::find(out.begin(), out.end(), p.series) == out.end()) out.push_back(p.series);
  return out;
}

// The cheapest point of a series that keeps the accuracy in spite of the reference's own error; null: none does.
const StudyPoint* cheapest(const Study& s, const std::string& axis, const std::string& series, double wanted) {
  const StudyPoint* out = nullptr;
  for (const StudyPoint& p : s.points)
    if (p.axis == axis && p.series == series && p.error >= 0.0 && p.error + s.reference_error <= wanted &&
        (!out || p.median_cpu < out->median_cpu))
      out = &p;
  return out;
}

// Forms of the beams at equal error: who wins where.
void add_forms(const Study& s, std::vector<StudyBlock>& out) {
  const std::vector<std::string> forms = series_of(s, "model");
  StudyBlock table{.kind = Kind::table};
  table.rows.push_back({"error"});
  table.rows[0].insert(table.rows[0].end(), forms.begin(), forms.end());
  std::string sentence;
  for (double wanted : {1e-1, 3e-2, 1e-2, 3e-3, 1e-3}) {
    std::vector<std::string> row{fmt::format("{:g}", wanted)};
    const StudyPoint* best = nullptr;
    for (const std::string& f : forms) {
      const StudyPoint* p = cheapest(s, "model", f, wanted);
      row.push_back(p ? fmt::format("{:.4f} ({})", p->median_cpu, p->label) : "none");
      if (p && (!best || p->median_cpu < best->median_cpu)) best = p;
    }
    table.rows.push_back(std::move(row));
    if (best)
      sentence +=
          fmt::format("{} an error of {:g} {} ({})", sentence.empty() ? "Cheapest are at" : ", at", wanted, best->series, best->label);
  }
  if (sentence.empty()) return;
  out.push_back({.kind = Kind::text, .text = "CPU seconds of the cheapest setting of each beam model at equal error:"});
  out.push_back(std::move(table));
  out.push_back({.kind = Kind::text, .text = sentence + "."});
}

StudyBlock advice_table(const Study& s) {
  StudyBlock out{.kind = Kind::table, .rows = {{"requested error", "cheapest setting", "CPU s", "error"}}};
  for (const StudyAdvice& a : s.advice) {
    if (a.point < 0) {
      out.rows.push_back({fmt::format("{:g}", a.wanted), "no setting of this study reaches it", "", ""});
      continue;
    }
    const StudyPoint& p = s.points[a.point];
    out.rows.push_back({fmt::format("{:g}", a.wanted), p.setting, fmt::format("{:.4f}", p.median_cpu),
                        error_text(p.error, p.floor, 3.0 * s.reference_error)});
  }
  return out;
}

void add_axis(const Study& s, const std::string& axis, std::vector<StudyBlock>& out) {
  out.push_back({.kind = Kind::heading, .text = axis});
  out.push_back({.kind = Kind::text, .text = axis_sentence(axis)});
  out.push_back({.kind = Kind::diagram, .text = axis});
  if (axis == "model") add_forms(s, out);
  StudyBlock table{.kind = Kind::table,
                   .rows = {{"setting", "coordinates", "CPU s", "error", "worst output", "error of this setting alone"}}};
  for (const StudyPoint& p : s.points) {
    if (p.axis != axis) continue;
    if (!p.failure.empty()) table.rows.push_back({p.setting, "", "", p.failure, "", ""});
    else
      table.rows.push_back({p.setting + (p.front ? " (front)" : ""), fmt::format("{}", p.coordinates), fmt::format("{:.4f}", p.median_cpu),
                            error_text(p.error, p.floor, 3.0 * s.reference_error), p.column,
                            p.axis_floor ? "" : error_text(p.axis_error, false, 0.0)});
  }
  out.push_back(std::move(table));
  for (const StudyOrder& o : s.orders)
    if (o.axis == axis)
      out.push_back({.kind = Kind::text, .text = fmt::format("Convergence order of {}: {:.2f} ({} points).", o.series, o.order, o.points)});
}

void add_pictures(const Study& s, std::vector<StudyBlock>& out) {
  out.push_back({.kind = Kind::heading, .text = "Pictures"});
  out.push_back({.kind = Kind::text,
                 .text = "Nodes and schemes of the kernel map: largest difference of a vertex from the map with all nodes, relative to the "
                         "largest displacement, ten times of the motion. Samples: root mean square of the pixels' difference from a "
                         "picture of 16 times as many pixels."});
  out.push_back({.kind = Kind::diagram, .text = "pictures"});
  StudyBlock table{.kind = Kind::table, .rows = {{"axis", "of", "setting", "CPU s a picture", "error"}}};
  for (const PicturePoint& p : s.pictures)
    table.rows.push_back({p.axis, p.series, p.label, p.failure.empty() ? fmt::format("{:.2e}", p.cpu) : "",
                          p.failure.empty() ? fmt::format("{:.1e}", p.error) : p.failure});
  out.push_back(std::move(table));
}

// A run that is wrong by more than the range of its output stands in the table only.
constexpr double most_drawn = 1.0;

// Only the points that are better by a tenth than every cheaper one of the series.
void keep_front(DiagramSeries& series) {
  std::sort(series.points.begin(), series.points.end(), [](const DiagramPoint& a, const DiagramPoint& b) { return a.x < b.x; });
  double best = 1e300;
  std::erase_if(series.points, [&](const DiagramPoint& p) { return p.y > 0.9 * best || (best = p.y, false); });
}

// The diagram's series of that name, which is begun where there is none.
DiagramSeries& series_of(Diagram& d, const std::string& label, bool line) {
  for (DiagramSeries& one : d.series)
    if (one.label == label) return one;
  return d.series.emplace_back(DiagramSeries{label, {}, line, false});
}

Diagram axis_diagram(const Study& s, const std::string& axis) {
  Diagram d;
  d.title = fmt::format("{}: {}", s.title, axis);
  d.x_label = "CPU seconds";
  d.y_label = "error / range of the output";
  d.floor = s.reference_error;
  d.note = "hollow: at the floor of the reference";
  for (const StudyPoint& p : s.points) {
    if (p.axis != axis || p.error < 0.0 || p.error > most_drawn) continue;
    series_of(d, p.series, true).points.push_back({p.median_cpu, p.error, p.floor, p.knob > 0.0 ? fmt::format("{:g}", p.knob) : p.label});
  }
  if (axis == "model") {
    d.title = s.title + ": models of the beam at equal error";
    for (DiagramSeries& one : d.series) keep_front(one);
  }
  return d;
}

Diagram front_diagram(const Study& s) {
  Diagram d;
  d.title = s.title + ": error against time";
  d.x_label = "CPU seconds";
  d.y_label = "error / range of the output";
  d.floor = s.reference_error;
  d.note = "labelled: the cheapest settings for 1e-2, 1e-3, 1e-4, 1e-5; hollow: at the floor of the reference";
  DiagramSeries front{"Pareto front", {}, true, true};
  for (const StudyPoint& p : s.points)
    if (p.front && p.error <= most_drawn) front.points.push_back({p.median_cpu, p.error, false, ""});
  std::sort(front.points.begin(), front.points.end(), [](const DiagramPoint& a, const DiagramPoint& b) { return a.x < b.x; });
  d.series.push_back(front);
  for (const std::string& axis : axes_of(s)) {
    DiagramSeries one{axis, {}, false, false};
    for (size_t i = 0; i < s.points.size(); ++i) {
      const StudyPoint& p = s.points[i];
      if (p.axis != axis || p.error < 0.0 || p.error > most_drawn) continue;
      const bool advised =
          std::any_of(s.advice.begin(), s.advice.end(), [&](const StudyAdvice& a) { return a.point == static_cast<int>(i); });
      one.points.push_back({p.median_cpu, p.error, p.floor, advised ? p.label : ""});
    }
    if (!one.points.empty()) d.series.push_back(one);
  }
  return d;
}

Diagram picture_diagram(const Study& s) {
  Diagram d;
  d.title = s.title + ": kernel map and antialiasing";
  d.x_label = "CPU seconds a picture";
  d.y_label = "error";
  for (const PicturePoint& p : s.pictures) {
    if (!p.failure.empty()) continue;
    DiagramSeries& series = series_of(d, fmt::format("{}, {}", p.axis, p.series), p.knob > 0.0);
    series.points.push_back({p.cpu, p.error, false, p.knob > 0.0 ? fmt::format("{:g}", p.knob) : p.label});
  }
  return d;
}

}  // namespace

std::vector<StudyBlock> study_blocks(const Study& s) {
  std::vector<StudyBlock> out;
  if (!s.command.empty()) out.push_back({.kind = Kind::command, .text = s.command});
  out.push_back(advice_table(s));
  out.push_back({.kind = Kind::diagram, .text = "front"});
  out.push_back(
      {.kind = Kind::text,
       .text = fmt::format(
           "Errors are the largest over time and over the outputs, relative to the range of each output; a vector's components are "
           "relative to the whole vector. A phase error counts like any other. Reference: {}, its own error is {}, {:.2f} CPU s; "
           "errors below three times that are not resolved (\"at the floor\"). CPU seconds are medians of interleaved repeats on one "
           "core, time integration and sampling of the outputs.",
           s.reference, s.reference_judged ? fmt::format("{:.1e}", s.reference_error) : "not known", s.reference_cpu)});
  for (const std::string& note : s.notes) out.push_back({.kind = Kind::text, .text = fmt::format("Note: {}.", note)});
  for (const std::string& axis : axes_of(s)) add_axis(s, axis, out);
  if (!s.pictures.empty()) add_pictures(s, out);
  return out;
}

std::vector<NamedDiagram> study_diagrams(const Study& s) {
  std::vector<NamedDiagram> out;
  for (const std::string& axis : axes_of(s)) out.push_back({axis, axis_diagram(s, axis)});
  out.push_back({"front", front_diagram(s)});
  if (!s.pictures.empty()) out.push_back({"pictures", picture_diagram(s)});
  return out;
}

}  // namespace flexframe::film
