// What a study leaves behind: table (CSV, JSON, Markdown) and diagrams (SVG, PNG).
#include "render/film/study_text.h"
#include "render/image/png.h"
#include "sim/base/file_output.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <string_view>
#include <utility>

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

nlohmann::ordered_json overview_json(const StudyOverview& o) {
  nlohmann::ordered_json out = {{"reference", o.reference},         {"reference_pixels", optional_number(o.reference_pixels)},
                                {"map_pixels", o.map_pixels},       {"pictures", o.pictures},
                                {"motion_pixels", o.motion_pixels}, {"recommended", o.recommended},
                                {"left_out", o.left_out},           {"points", nlohmann::ordered_json::array()}};
  for (const OverviewPoint& p : o.points)
    out["points"].push_back({{"name", p.name},
                             {"series", p.series},
                             {"tolerance", p.tolerance},
                             {"cpu_simulation", p.cpu_run},
                             {"cpu_pictures", p.cpu_pictures},
                             {"pixels", p.pixels},
                             {"percent", p.percent},
                             {"front", p.front}});
  return out;
}

std::string to_json(const Study& s) {
  nlohmann::ordered_json out = {{"title", s.title}, {"scene", s.scene_file}, {"command", s.command}, {"columns", s.columns}};
  out["reference"] = {
      {"what", s.reference}, {"error", optional_number(s.reference_judged ? s.reference_error : -1.0)}, {"cpu_seconds", s.reference_cpu}};
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
  if (s.overview) out["pictures_against_time"] = overview_json(*s.overview);
  out["notes"] = s.notes;
  return out.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

constexpr std::size_t page_width = 140;

// A paragraph in lines of the page's width.
std::string wrapped_paragraph(std::string_view text) {
  std::string out, line;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    if (!line.empty() && line.size() + 1 + end > page_width) out += std::exchange(line, {}) + '\n';
    if (!line.empty()) line += ' ';
    line += text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out + line + '\n';
}

// A command to copy, which goes on below where it is long.
std::string command_block(std::string_view command) {
  std::string out, line = "   ";
  while (!command.empty()) {
    std::size_t end = std::min(command.find(" --", 1), command.size());
    while (end < command.size() && std::ranges::count(command.substr(0, end), '\'') % 2 == 1)
      end = std::min(command.find(" --", end + 1), command.size());
    if (line.size() + end + 2 > page_width) out += std::exchange(line, "     ") + " \\\n";
    line += command.front() == ' ' ? "" : " ";
    line += command.substr(0, end);
    command.remove_prefix(end);
  }
  return out + line + '\n';
}

std::string to_markdown(const Study& s) {
  std::string out = fmt::format("# {}: what accuracy costs\n", s.title);
  const auto line = [&](const std::vector<std::string>& cells) {
    out += '|';
    for (const std::string& cell : cells) out += cell.empty() ? " |" : fmt::format(" {} |", cell);
    out += '\n';
  };
  if (s.overview) out += "\n![what accuracy costs](overview.png)\n";
  for (const StudyBlock& b : study_blocks(s)) {
    out += '\n';
    if (b.kind == StudyBlock::Kind::heading) out += fmt::format("## {}\n", b.text);
    if (b.kind == StudyBlock::Kind::text) out += wrapped_paragraph(b.text);
    if (b.kind == StudyBlock::Kind::command) out += "Made by\n\n" + command_block(b.text);
    if (b.kind == StudyBlock::Kind::diagram) out += fmt::format("![{0}]({0}.svg)\n", b.text);
    if (b.kind != StudyBlock::Kind::table) continue;
    line(b.rows.front());
    out += '|';
    for (std::size_t k = 0; k < b.rows.front().size(); ++k) out += "---|";
    out += '\n';
    for (std::size_t i = 1; i < b.rows.size(); ++i) line(b.rows[i]);
  }
  return out;
}

}  // namespace

void write_study(const Study& s, const fs::path& folder) {
  for (const auto& [name, diagram] : study_diagrams(s)) {
    sim::write_whole_file(folder / (name + ".svg"), diagram_svg(diagram));
    render::write_png(folder / (name + ".png"), diagram_image(diagram), {.level = 9, .text = {}});
  }
  if (s.overview) render::write_png(folder / "overview.png", s.overview->figure, {.level = 9, .text = {}});
  sim::write_whole_file(folder / "study.csv", to_csv(s));
  sim::write_whole_file(folder / "study.json", to_json(s));
  sim::write_whole_file(folder / "study.md", to_markdown(s));
}

}  // namespace flexframe::film
