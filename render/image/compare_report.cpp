#include "render/image/compare_report.h"

#include "render/base/base64.h"
#include "render/base/html.h"
#include "render/image/png.h"
#include "render/picture/picture_numbers.h"
#include "sim/base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>

namespace flexframe::render {
namespace {

namespace fs = std::filesystem;

std::set<std::string> pictures_below(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && entry.path().extension() == ".png")
      names.insert(entry.path().lexically_relative(folder).generic_string());
  return names;
}

std::string picture_cell(const char* caption, const std::vector<std::uint8_t>& png) {
  if (png.empty()) return fmt::format("<figure><figcaption>{}: none</figcaption></figure>", caption);
  return fmt::format("<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>", caption,
                     base64(png));
}

std::vector<std::uint8_t> bytes_if_there(const fs::path& path) {
  std::error_code none;
  return !path.empty() && fs::is_regular_file(path, none) ? read_file(path) : std::vector<std::uint8_t>{};
}

// Pictures of 16 bits are compared as such where both have them.
ImageDifference compare_files(const fs::path& baseline, const fs::path& candidate, const CompareOptions& options) {
  const std::vector<std::uint8_t> before = read_file(baseline), after = read_file(candidate);
  if (png_depth(before) == 16 && png_depth(after) == 16)
    return compare_images(decode_png16(before, baseline.string()), decode_png16(after, candidate.string()), options);
  return compare_images(decode_png(before, baseline.string()), decode_png(after, candidate.string()), options);
}

}  // namespace

std::string state_name(PairState state) {
  switch (state) {
    case PairState::equal:
      return "equal";
    case PairState::passes:
      return "passes";
    case PairState::differs:
      return "differs";
    case PairState::other_numbers:
      return "other numbers";
    case PairState::other_size:
      return "other size";
    case PairState::missing_baseline:
      return "missing baseline";
    default:
      return "missing picture";
  }
}

Comparison compare_pictures(const fs::path& baseline, const fs::path& candidate, const CompareOptions& options, bool keep_heat,
                            bool new_baseline) {
  const auto exists = [](const fs::path& p) {
    std::error_code error;
    const bool there = fs::exists(p, error);
    if (!there) throw FileError(p.string() + ": cannot read: " + (error ? error.message() : "no such file or folder"));
    return fs::is_directory(p);
  };
  const bool created = new_baseline && !fs::exists(baseline);
  const bool folder = created ? exists(candidate) : exists(baseline);
  if (folder != exists(candidate))
    throw ArgumentError(fmt::format("{} is a {} and {} a {}; two files or two folders are needed", baseline.string(),
                                    folder ? "folder" : "file", candidate.string(), folder ? "file" : "folder"));
  Comparison out;
  if (folder) {
    const std::set<std::string> before = created ? std::set<std::string>{} : pictures_below(baseline), after = pictures_below(candidate);
    std::set<std::string> names = before;
    names.insert(after.begin(), after.end());
    if (names.empty()) throw ArgumentError("no PNG file below " + baseline.string() + " or " + candidate.string());
    for (const std::string& name : names) {
      ComparedPair pair{
          name, before.count(name) ? baseline / name : fs::path(), after.count(name) ? candidate / name : fs::path(), PairState::equal, {},
          {}};
      if (pair.baseline.empty()) pair.state = PairState::missing_baseline;
      if (pair.candidate.empty()) pair.state = PairState::missing_candidate;
      out.pairs.push_back(std::move(pair));
    }
  } else {
    out.pairs.push_back({candidate.filename().string(),
                         created ? fs::path() : baseline,
                         candidate,
                         created ? PairState::missing_baseline : PairState::equal,
                         {},
                         {}});
    if (created) read_png(candidate);
  }
  for (ComparedPair& pair : out.pairs) {
    if (!pair.baseline.empty() && !pair.candidate.empty()) {
      pair.difference = compare_files(pair.baseline, pair.candidate, options);
      if (!keep_heat) pair.difference.heat = {};
      const ImageDifference& d = pair.difference;
      pair.state = !d.same_size ? PairState::other_size : d.equal ? PairState::equal : d.passes ? PairState::passes : PairState::differs;
      const auto before = parse_numbers(read_png_text(pair.baseline, numbers_key)),
                 after = parse_numbers(read_png_text(pair.candidate, numbers_key));
      if (before && after) pair.numbers = numbers_difference(*before, *after);
      if (!pair.numbers.empty() && (pair.state == PairState::equal || pair.state == PairState::passes))
        pair.state = PairState::other_numbers;
    }
    out.passes = out.passes && (pair.state == PairState::equal || pair.state == PairState::passes);
  }
  return out;
}

std::string comparison_page(const Comparison& comparison, const std::string& title) {
  std::string html = fmt::format(R"(<!doctype html>
<html lang="en"><meta charset="utf-8"><title>{0}</title>
<style>body{{font:15px/1.4 sans-serif;margin:2em;color:#1a1e24}}table{{border-collapse:collapse}}
td,th{{padding:.25em .8em;text-align:right;border-bottom:1px solid #dde}}
td:first-child,th:first-child{{text-align:left}}.bad{{color:#b00020;font-weight:bold}}.row{{display:flex;gap:1em;flex-wrap:wrap}}
figure{{margin:0;flex:1 1 20em}}
img{{max-width:100%;border:1px solid #ccd;image-rendering:pixelated}}figcaption{{color:#556}}</style>
<h1>{0}</h1><p>{1}</p>
<table><tr><th>picture<th>result<th>largest<th>mean<th>pixels over<th>share<th>together<th>SSIM<th>FLIP</tr>
)",
                                 escape_html(title), comparison.passes ? "All pictures agree." : "Pictures differ.");
  bool any_bad = false;
  for (const ComparedPair& p : comparison.pairs) {
    const bool bad = p.state != PairState::equal && p.state != PairState::passes;
    any_bad = any_bad || bad;
    const ImageDifference& d = p.difference;
    html += fmt::format("<tr><td>{}<td{}>{}", escape_html(p.name), bad ? " class=\"bad\"" : "", state_name(p.state));
    if (p.state == PairState::passes || p.state == PairState::differs || p.state == PairState::other_numbers)
      html += fmt::format("<td>{}/{}<td>{:.4g}<td>{}<td>{:.4g} %<td>{}<td>{}<td>{}", d.largest, d.full, d.mean, d.pixels_over,
                          100.0 * d.share_over, d.cluster, d.full == 255 ? fmt::format("{:.5f}", d.ssim) : "",
                          d.full == 255 ? fmt::format("{:.5f}", d.flip) : "");
    html += "</tr>\n";
  }
  html += "</table>\n";
  for (const ComparedPair& p : comparison.pairs) {
    const bool bad = p.state != PairState::equal && p.state != PairState::passes;
    if (!(bad || (!any_bad && p.state == PairState::passes))) continue;
    const ImageDifference& d = p.difference;
    html += fmt::format("<h2>{}</h2>\n", escape_html(p.name));
    if (!p.numbers.empty()) html += fmt::format("<p>{}</p>\n", escape_html(p.numbers));
    html += fmt::format("<div class=\"row\">{}{}{}</div>\n", picture_cell("baseline", bytes_if_there(p.baseline)),
                        picture_cell("new picture", bytes_if_there(p.candidate)),
                        d.heat.pixels.empty()
                            ? std::string()
                            : picture_cell(d.full == 255 ? "FLIP, bright: visible" : "difference, bright: largest", encode_png(d.heat)));
  }
  return html + "</html>\n";
}

std::vector<std::string> update_baselines(const Comparison& comparison, const fs::path& baseline, const std::string& reason) {
  std::vector<std::string> changed;
  const bool folder = fs::is_directory(baseline) || (!fs::exists(baseline) && baseline.extension() != ".png");
  for (const ComparedPair& p : comparison.pairs) {
    if (p.state == PairState::equal) continue;
    const fs::path target = folder ? baseline / p.name : baseline;
    if (p.state == PairState::missing_candidate) {
      fs::remove(target);
    } else {
      if (target.has_parent_path()) fs::create_directories(target.parent_path());
      write_file(target, read_file(p.candidate));
    }
    changed.push_back(folder ? p.name : target.filename().string());
  }
  if (changed.empty()) return changed;
  const fs::path notes = (folder ? baseline : baseline.has_parent_path() ? baseline.parent_path() : fs::path(".")) / "CHANGES.md";
  std::string text;
  std::error_code none;
  if (fs::is_regular_file(notes, none)) {
    const auto bytes = read_file(notes);
    text.assign(bytes.begin(), bytes.end());
  } else {
    text = "# Why baselines changed\n\n";
  }
  // A reason is one line.
  std::string line = reason;
  std::replace(line.begin(), line.end(), '\n', ' ');
  text += fmt::format("- {}:", line);
  for (const std::string& name : changed) text += " " + name;
  text += "\n";
  write_file(notes, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
  return changed;
}

}  // namespace flexframe::render
