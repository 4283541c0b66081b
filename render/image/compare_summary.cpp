#include "render/image/compare_summary.h"

#include "render/base/html.h"

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::render {
namespace {

// XML knows no control characters but tab and line ends, not even escaped.
std::string xml(const std::string& text) {
  std::string out = escape_html(text);
  std::erase_if(out, [](char c) { return static_cast<unsigned char>(c) < 0x20 && c != '\t' && c != '\n'; });
  return out;
}

// One cell of a table: a bar would end it, a backquote, an underscore and a tag mean something.
std::string cell(const std::string& text) {
  std::string out;
  for (const char c : escape_html(text)) {
    if (c == '\n' || c == '\r') {
      out += ' ';
      continue;
    }
    if (std::string_view("|`*_[]\\").find(c) != std::string_view::npos) out += '\\';
    out += c;
  }
  return out;
}

std::size_t count_failures(const Comparison& comparison) {
  return static_cast<std::size_t>(
      std::count_if(comparison.pairs.begin(), comparison.pairs.end(), [](const ComparedPair& p) { return fails(p.state); }));
}

}  // namespace

std::string failure_text(const ComparedPair& p) {
  if (!fails(p.state)) return "";
  const ImageDifference& d = p.difference;
  if (p.state == PairState::other_size)
    return fmt::format("{} x {} pixels, the baseline has {} x {}", p.candidate_size.first, p.candidate_size.second, p.baseline_size.first,
                       p.baseline_size.second);
  if (p.state == PairState::unreadable) return p.reason;
  if (!was_measured(p.state)) return state_name(p.state);
  std::string out = fmt::format("largest difference {}/{}, mean {:.4g}, {} pixels ({:.4g} %) over the limit, {} of them together",
                                d.largest, d.full, d.mean, d.pixels_over, 100.0 * d.share_over, d.cluster);
  if (!d.broken.empty()) out = d.broken + "; " + out;
  if (d.box.width > 0) out += fmt::format(", within {} x {} at {}, {}", d.box.width, d.box.height, d.box.x, d.box.y);
  return p.numbers.empty() ? out : p.numbers + "; " + out;
}

std::string junit_text(const Comparison& comparison, const std::string& suite, const Facts& facts) {
  std::string out = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n<testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"0\" "
      "skipped=\"0\">\n<properties>\n",
      xml(suite), comparison.pairs.size(), count_failures(comparison));
  for (const auto& [name, text] : facts) out += fmt::format("<property name=\"{}\" value=\"{}\"/>\n", xml(name), xml(text));
  out += "</properties>\n";
  for (const ComparedPair& p : comparison.pairs) {
    out += fmt::format("<testcase classname=\"{}\" name=\"{}\"", xml(suite), xml(p.name));
    if (!fails(p.state)) {
      out += "/>\n";
      continue;
    }
    const std::string text = xml(failure_text(p));
    out += fmt::format(">\n<failure type=\"{}\" message=\"{}\">{}\nbaseline: {}\nnew picture: {}</failure>\n</testcase>\n",
                       state_name(p.state), text, text, xml(p.baseline.empty() ? "none" : p.baseline.string()),
                       xml(p.candidate.empty() ? "none" : p.candidate.string()));
  }
  return out + "</testsuite>\n</testsuites>\n";
}

std::string markdown_text(const Comparison& comparison, const std::string& title, const Facts& facts) {
  constexpr std::size_t most_rows = 50;
  const std::size_t bad = count_failures(comparison);
  std::string out = fmt::format("### {}: {}\n\n", cell(title),
                                bad > 0 ? fmt::format("{} of {} pictures do not agree", bad, comparison.pairs.size())
                                        : fmt::format("all {} pictures agree", comparison.pairs.size()));
  if (bad > 0) {
    out += "| picture | result | what |\n|---|---|---|\n";
    std::size_t rows = 0;
    for (const std::size_t i : worst_first(comparison)) {
      const ComparedPair& p = comparison.pairs[i];
      if (!fails(p.state) || rows++ >= most_rows) break;
      out += fmt::format("| {} | {} | {} |\n", cell(p.name), state_name(p.state), cell(failure_text(p)));
    }
    if (bad > most_rows) out += fmt::format("\nand {} more\n", bad - most_rows);
    out += '\n';
  }
  for (const std::string& note : comparison.notes) out += fmt::format("- note: {}\n", cell(note));
  for (const auto& [name, text] : facts) out += fmt::format("- {}: {}\n", cell(name), cell(text));
  return out;
}

}  // namespace flexframe::render
