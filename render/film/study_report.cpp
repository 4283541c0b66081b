// What a study leaves behind: table (CSV, JSON, Markdown) and diagrams (SVG, PNG).
#include "render/film/diagram.h"
#include "render/film/study.h"
#include "render/image/png.h"
#include "sim/base/file_output.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace flexframe::film {
namespace {

namespace fs = std::filesystem;

std::string number(double v) { return v < 0.0 ? std::string() : fmt::format("{:.4g}", v); }

std::string csv_text(std::string text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string out = "\"";
  for (char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

std::string to_csv(const Study& s) {
  std::string out =
      "axis,series,label,knob,setting,method,tolerance,coordinates,cpu_seconds,error,column,axis_error,at_floor,on_front,failure\n";
  for (const StudyPoint& p : s.points)
    out += fmt::format("{},{},{},{:g},{},{},{:g},{},{},{},{},{},{},{},{}\n", p.axis, csv_text(p.series), csv_text(p.label), p.knob,
                       csv_text(p.setting), p.method, p.tolerance, p.coordinates, p.cpu.empty() ? "" : fmt::format("{:.6g}", p.median_cpu),
                       number(p.error), p.column, number(p.axis_error), p.floor ? 1 : 0, p.front ? 1 : 0, csv_text(p.failure));
  for (const PicturePoint& p : s.pictures)
    out +=
        fmt::format("{},{},{},{:g},,,,,{},{},,,0,0,{}\n", p.axis, csv_text(p.series), csv_text(p.label), p.knob,
                    p.failure.empty() ? fmt::format("{:.6g}", p.cpu) : "", number(p.failure.empty() ? p.error : -1.0), csv_text(p.failure));
  return out;
}

nlohmann::ordered_json optional_number(double v) { return v < 0.0 ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(v); }

std::string to_json(const Study& s) {
  nlohmann::ordered_json out = {{"title", s.title}, {"scene", s.scene_file}, {"command", s.command}, {"columns", s.columns}};
  out["reference"] = {{"what", s.reference}, {"error", s.reference_error}, {"cpu_seconds", s.reference_cpu}};
  out["points"] = nlohmann::ordered_json::array();
  for (const StudyPoint& p : s.points) {
    nlohmann::ordered_json one = {{"axis", p.axis},
                                  {"series", p.series},
                                  {"label", p.label},
                                  {"knob", p.knob},
                                  {"setting", p.setting},
                                  {"method", p.method},
                                  {"tolerance", p.tolerance},
                                  {"coordinates", p.coordinates},
                                  {"cpu_seconds", p.cpu.empty() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(p.median_cpu)},
                                  {"repeats", p.cpu},
                                  {"error", optional_number(p.error)},
                                  {"column", p.column},
                                  {"axis_error", optional_number(p.axis_error)},
                                  {"at_floor", p.floor},
                                  {"axis_at_floor", p.axis_floor},
                                  {"on_front", p.front}};
    nlohmann::ordered_json columns = nlohmann::ordered_json::object();
    for (size_t k = 0; k < p.column_errors.size(); ++k) columns[s.columns[k]] = p.column_errors[k];
    one["column_errors"] = columns;
    if (!p.failure.empty()) one["failure"] = p.failure;
    out["points"].push_back(one);
  }
  out["orders"] = nlohmann::ordered_json::array();
  for (const StudyOrder& o : s.orders)
    out["orders"].push_back({{"axis", o.axis}, {"series", o.series}, {"order", o.order}, {"points", o.points}});
  out["recommendations"] = nlohmann::ordered_json::array();
  for (const StudyAdvice& a : s.advice) {
    nlohmann::ordered_json one = {{"accuracy", a.wanted}, {"setting", nullptr}};
    if (a.point >= 0) {
      const StudyPoint& p = s.points[a.point];
      one = {{"accuracy", a.wanted}, {"setting", p.setting}, {"axis", p.axis}, {"cpu_seconds", p.median_cpu}, {"error", p.error}};
    }
    out["recommendations"].push_back(one);
  }
  out["pictures"] = nlohmann::ordered_json::array();
  for (const PicturePoint& p : s.pictures)
    out["pictures"].push_back({{"axis", p.axis},
                               {"series", p.series},
                               {"label", p.label},
                               {"knob", p.knob},
                               {"cpu_seconds", p.cpu},
                               {"error", optional_number(p.failure.empty() ? p.error : -1.0)},
                               {"failure", p.failure}});
  out["notes"] = s.notes;
  return out.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

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
std::string forms_table(const Study& s) {
  const std::vector<std::string> forms = series_of(s, "model");
  std::string head = "| error |", line = "|---|", rows, sentence;
  for (const std::string& f : forms) head += fmt::format(" {} |", f), line += "---|";
  for (double wanted : {1e-1, 3e-2, 1e-2, 3e-3, 1e-3}) {
    rows += fmt::format("| {:g} |", wanted);
    const StudyPoint* best = nullptr;
    for (const std::string& f : forms) {
      const StudyPoint* p = cheapest(s, "model", f, wanted);
      rows += p ? fmt::format(" {:.4f} ({}) |", p->median_cpu, p->label) : " none |";
      if (p && (!best || p->median_cpu < best->median_cpu)) best = p;
    }
    rows += '\n';
    if (best)
      sentence +=
          fmt::format("{} an error of {:g} {} ({})", sentence.empty() ? "Cheapest are at" : ", at", wanted, best->series, best->label);
  }
  if (sentence.empty()) return "";
  return fmt::format("CPU seconds of the cheapest setting of each beam model at equal error:\n\n{}\n{}\n{}\n{}.\n\n", head, line, rows,
                     sentence);
}

std::string to_markdown(const Study& s) {
  std::string out = fmt::format("# {}: what accuracy costs\n\n", s.title);
  if (!s.command.empty()) out += fmt::format("Made by `{}`.\n\n", s.command);
  out += "| requested error | cheapest setting | CPU s | error |\n|---|---|---|---|\n";
  for (const StudyAdvice& a : s.advice) {
    if (a.point < 0) {
      out += fmt::format("| {:g} | no setting of this study reaches it | | |\n", a.wanted);
      continue;
    }
    const StudyPoint& p = s.points[a.point];
    out += fmt::format("| {:g} | {} | {:.4f} | {} |\n", a.wanted, p.setting, p.median_cpu,
                       error_text(p.error, p.floor, 3.0 * s.reference_error));
  }
  out += "\n![error against CPU time](front.svg)\n\n";
  out += fmt::format(
      "Errors are the largest over time and over the outputs, relative to the range of each output; a vector's components are relative to "
      "the whole vector. A phase error counts like any other. Reference: {}, its own error is {:.1e}, {:.2f} CPU s; errors below three "
      "times that are not resolved (\"at the floor\"). CPU seconds are medians of interleaved repeats on one core, time integration and "
      "sampling of the outputs.\n",
      s.reference, s.reference_error, s.reference_cpu);
  for (const std::string& note : s.notes) out += fmt::format("\nNote: {}.\n", note);
  for (const std::string& axis : axes_of(s)) {
    out += fmt::format("\n## {}\n\n{}\n\n![{}]({}.svg)\n\n", axis, axis_sentence(axis), axis, axis);
    if (axis == "model") out += forms_table(s);
    out += "| setting | coordinates | CPU s | error | worst output | error of this setting alone |\n|---|---|---|---|---|---|\n";
    for (const StudyPoint& p : s.points) {
      if (p.axis != axis) continue;
      if (!p.failure.empty()) out += fmt::format("| {} | | | {} | | |\n", p.setting, p.failure);
      else
        out += fmt::format("| {}{} | {} | {:.4f} | {} | {} | {} |\n", p.setting, p.front ? " (front)" : "", p.coordinates, p.median_cpu,
                           error_text(p.error, p.floor, 3.0 * s.reference_error), p.column,
                           p.axis_floor ? "" : error_text(p.axis_error, false, 0.0));
    }
    for (const StudyOrder& o : s.orders)
      if (o.axis == axis) out += fmt::format("\nConvergence order of {}: {:.2f} ({} points).\n", o.series, o.order, o.points);
  }
  if (s.pictures.empty()) return out;
  out +=
      "\n## Pictures\n\nNodes and schemes of the kernel map: largest difference of a vertex from the map with all nodes, relative to the "
      "largest displacement, ten times of the motion. Samples: root mean "
      "square of the pixels' difference from a picture of 16 times as many pixels.\n\n![pictures](pictures.svg)\n\n| axis | of | setting | "
      "CPU s a picture | error |\n|---|---|---|---|---|\n";
  for (const PicturePoint& p : s.pictures)
    out += p.failure.empty() ? fmt::format("| {} | {} | {} | {:.2e} | {:.1e} |\n", p.axis, p.series, p.label, p.cpu, p.error)
                             : fmt::format("| {} | {} | {} | | {} |\n", p.axis, p.series, p.label, p.failure);
  return out;
}

void write_diagram(const Diagram& d, const fs::path& folder, const std::string& name) {
  sim::write_whole_file(folder / (name + ".svg"), diagram_svg(d));
  render::write_png(folder / (name + ".png"), diagram_image(d), {.level = 9, .text = {}});
}

// A run that is wrong by more than the range of its output stands in the table only.
constexpr double most_drawn = 1.0;

// Only the points that are better by a tenth than every cheaper one of the series.
void keep_front(DiagramSeries& series) {
  std::sort(series.points.begin(), series.points.end(), [](const DiagramPoint& a, const DiagramPoint& b) { return a.x < b.x; });
  double best = 1e300;
  std::erase_if(series.points, [&](const DiagramPoint& p) { return p.y > 0.9 * best || (best = p.y, false); });
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
    auto at = std::find_if(d.series.begin(), d.series.end(), [&](const DiagramSeries& one) { return one.label == p.series; });
    if (at == d.series.end()) at = d.series.insert(d.series.end(), DiagramSeries{p.series, {}, true, false});
    at->points.push_back({p.median_cpu, p.error, p.floor, p.knob > 0.0 ? fmt::format("{:g}", p.knob) : p.label});
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
    const std::string label = fmt::format("{}, {}", p.axis, p.series);
    auto at = std::find_if(d.series.begin(), d.series.end(), [&](const DiagramSeries& one) { return one.label == label; });
    if (at == d.series.end()) at = d.series.insert(d.series.end(), DiagramSeries{label, {}, p.knob > 0.0, false});
    at->points.push_back({p.cpu, p.error, false, p.knob > 0.0 ? fmt::format("{:g}", p.knob) : p.label});
  }
  return d;
}

}  // namespace

void write_study(const Study& s, const fs::path& folder) {
  for (const std::string& axis : axes_of(s)) write_diagram(axis_diagram(s, axis), folder, axis);
  write_diagram(front_diagram(s), folder, "front");
  if (!s.pictures.empty()) write_diagram(picture_diagram(s), folder, "pictures");
  sim::write_whole_file(folder / "study.csv", to_csv(s));
  sim::write_whole_file(folder / "study.json", to_json(s));
  sim::write_whole_file(folder / "study.md", to_markdown(s));
}

}  // namespace flexframe::film
