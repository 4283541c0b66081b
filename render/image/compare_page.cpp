#include "render/image/compare_page.h"

#include "render/base/base64.h"
#include "render/base/house_page.h"
#include "render/base/html.h"
#include "render/image/compare_page_texts.h"
#include "render/image/png.h"
#include "sim/base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace flexframe::render {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_shown = 40;      // pairs with pictures
constexpr std::size_t full_shares = 10;     // of more pairs each gets a tenth of what is left: the worst are shown largest
constexpr std::size_t least_bytes = 4'000;  // below that a pair is not worth showing

// What the page holds of a pair: a part of the pictures, every `factor`-th pixel each way.
struct Shown {
  PixelBox part;
  int factor = 1;
  std::vector<std::uint8_t> before, after, heat;  // PNG; empty: none
  std::size_t bytes() const { return (before.size() + after.size() + heat.size()) / 3 * 4; }
};

struct Pictures {
  Image before, after, heat;  // without pixels: none
};

PixelBox whole_of(const Pictures& p) { return {0, 0, std::max(p.before.width, p.after.width), std::max(p.before.height, p.after.height)}; }

// PixelBox and surroundings, at least 240 x 160, within the picture.
PixelBox around(const PixelBox& box, const PixelBox& whole) {
  const int width = std::min(whole.width, std::max(240, box.width + 80)), height = std::min(whole.height, std::max(160, box.height + 80));
  const int x = std::clamp(box.x + box.width / 2 - width / 2, 0, whole.width - width);
  const int y = std::clamp(box.y + box.height / 2 - height / 2, 0, whole.height - height);
  return {x, y, width, height};
}

Shown pack(const Pictures& pictures, const PixelBox& part, int factor) {
  Shown out{part, factor, {}, {}, {}};
  const auto packed = [&](const Image& image) -> std::vector<std::uint8_t> {
    if (image.pixels.empty()) return {};
    // Pictures of different size are shown whole.
    const PixelBox own = part == whole_of(pictures) ? PixelBox{0, 0, image.width, image.height} : part;
    const Image cut = cut_out(image, own);
    const int width = (own.width + factor - 1) / factor, height = (own.height + factor - 1) / factor;
    return encode_png(factor > 1 ? reduce_image(cut, width, height) : cut, {.level = 6, .text = {}});
  };
  out.before = packed(pictures.before);
  out.after = packed(pictures.after);
  out.heat = packed(pictures.heat);
  return out;
}

// The most of the pair that fits into `room` bytes.
Shown choose(const ComparedPair& pair, const Pictures& pictures, std::size_t room) {
  const PixelBox whole = whole_of(pictures);
  std::error_code none;
  std::uintmax_t files = 0;
  for (const fs::path& file : {pair.baseline, pair.candidate})
    if (!file.empty()) files += fs::file_size(file, none);
  // How large it will be is told by the files well enough to leave out what is far too large.
  const double area = double(whole.width) * whole.height;
  const auto hopeless = [&](const PixelBox& part, int factor) {
    return static_cast<double>(files) * part.width * part.height / (area * factor * factor) > 1.5 * static_cast<double>(room);
  };
  if (!hopeless(whole, 1)) {
    Shown shown = pack(pictures, whole, 1);
    if (shown.bytes() <= room) return shown;
  }
  const PixelBox part = was_measured(pair.state) && pair.difference.box.width > 0 ? around(pair.difference.box, whole) : whole;
  for (int factor = 1;; ++factor) {
    const bool last = part.width / factor < 80 || part.height / factor < 80;
    if (!last && hopeless(part, factor)) continue;
    Shown shown = pack(pictures, part, factor);
    if (last || shown.bytes() <= room) return shown;
  }
}

std::string figure(const char* kind, const std::string& caption, const std::vector<std::uint8_t>& png) {
  if (png.empty()) return "";
  return fmt::format("<figure class=\"{0}\"><img alt=\"{1}\" src=\"data:image/png;base64,{2}\"><figcaption>{1}</figcaption></figure>\n",
                     kind, escape_html(caption), base64(png));
}

// A link from the page to a file: relative, with everything unusual as %XX.
std::string link(const fs::path& file, const fs::path& page, const std::string& text) {
  if (file.empty()) return fmt::format("no {}", text);
  std::error_code none;
  const fs::path to = fs::proximate(fs::absolute(file, none), fs::absolute(page, none).parent_path(), none);
  std::string url;
  for (const char c : to.generic_string()) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       std::string_view("/._-~").find(c) != std::string_view::npos;
    url += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return fmt::format("<a href=\"{}\">{}</a>", url, text);
}

std::string measures(const ComparedPair& p) {
  const ImageDifference& d = p.difference;
  return fmt::format("<td>{}/{}<td>{:.4g}<td>{}<td>{:.4g} %<td>{}<td>{}<td>{}", d.largest, d.full, d.mean, d.pixels_over,
                     100.0 * d.share_over, d.cluster, d.measured ? fmt::format("{:.5f}", d.ssim) : "",
                     d.measured ? fmt::format("{:.5f}", d.flip) : "");
}

// shown: pairs with a section to jump to, by number.
std::string table(const Comparison& comparison, const std::set<std::size_t>& shown) {
  std::string out =
      "<div class=\"wide\"><table id=\"pairs\"><tr><th>picture<th>result<th>largest<th>mean<th>pixels "
      "over<th>share<th>together<th>SSIM<th>FLIP"
      "</tr>\n";
  for (std::size_t i = 0; i < comparison.pairs.size(); ++i) {
    const ComparedPair& p = comparison.pairs[i];
    const std::string name = escape_html(p.name);
    out += shown.count(i) ? fmt::format("<tr><td><a href=\"#pair-{}\">{}</a>", i, name) : "<tr><td>" + name;
    out += fmt::format("<td{}>{}", fails(p.state) ? " class=\"bad\"" : "", state_name(p.state));
    out += was_measured(p.state) && p.state != PairState::equal ? measures(p) : "<td colspan=\"7\">";
    out += "</tr>\n";
  }
  return out + "</table></div>\n";
}

// What stands above the pictures of a pair.
std::string words(const ComparedPair& p, const ComparePageOptions& options) {
  std::string out = fmt::format("<p><span{}>{}</span>", fails(p.state) ? " class=\"bad\"" : "", state_name(p.state));
  const ImageDifference& d = p.difference;
  const auto size = [](std::pair<int, int> s) { return fmt::format("{} x {}", s.first, s.second); };
  if (p.state == PairState::other_size) out += fmt::format(": {} before, {} now", size(p.baseline_size), size(p.candidate_size));
  else if (p.state == PairState::unreadable) out += ": " + escape_html(p.reason);
  else if (was_measured(p.state))
    out += fmt::format(": {}; largest {}/{}, mean {:.4g}, {} pixels over the limit, {} together, all within {} x {} at {}, {}",
                       size(p.candidate_size), d.largest, d.full, d.mean, d.pixels_over, d.cluster, d.box.width, d.box.height, d.box.x,
                       d.box.y);
  if (d.ignored > 0) out += fmt::format("; {} pixels are not looked at", d.ignored);
  out += fmt::format(". {}, {}</p>\n", link(p.baseline, options.file, "baseline"), link(p.candidate, options.file, "new picture"));
  if (!p.numbers.empty()) out += fmt::format("<p>{}</p>\n", escape_html(p.numbers));
  if (p.baseline_machine != p.candidate_machine)
    out += fmt::format("<p class=\"note\">baseline drawn by {}; new picture by {}</p>\n",
                       escape_html(p.baseline_machine.empty() ? "an unnamed machine" : p.baseline_machine),
                       escape_html(p.candidate_machine.empty() ? "an unnamed machine" : p.candidate_machine));
  return out;
}

std::string section(const ComparedPair& p, std::size_t number, std::size_t room, const ComparePageOptions& options) {
  // What only one folder has is not looked at before: damaged, it is left out of the page.
  const auto read = [](const fs::path& file) {
    try {
      return file.empty() ? Image{} : read_png(file);
    } catch (const FileError&) {
      return Image{};
    }
  };
  Pictures pictures{.before = read(p.baseline), .after = read(p.candidate), .heat = {}};
  pictures.heat = p.difference.heat;
  const Shown shown = choose(p, pictures, room);
  const PixelBox &box = p.difference.box, part = shown.part;
  std::string out = fmt::format(
      "<section class=\"pair\" id=\"pair-{}\" data-name=\"{}\" data-box=\"{},{},{},{}\" data-part=\"{},{},{},{}\" data-factor=\"{}\">\n",
      number, escape_html(p.name), box.x, box.y, box.width, box.height, part.x, part.y, part.width, part.height, shown.factor);
  out += fmt::format("<h2>{}</h2>\n{}", escape_html(p.name), words(p, options));
  std::vector<std::string> less;
  if (part != whole_of(pictures)) less.push_back(fmt::format("cut to {} x {} pixels at {}, {}", part.width, part.height, part.x, part.y));
  if (shown.factor > 1) less.push_back(fmt::format("reduced {} times", shown.factor));
  if (!less.empty()) out += fmt::format("<p class=\"note\">shown {}; the links lead to the files</p>\n", fmt::join(less, " and "));
  return out + fmt::format("<div class=\"row\">\n{}{}{}</div>\n</section>\n", figure("a", "baseline", shown.before),
                           figure("b", "new picture", shown.after),
                           figure("heat", p.difference.full == 255 ? "FLIP, bright: visible" : "difference, bright: largest", shown.heat));
}

}  // namespace

std::string comparison_page(const Comparison& comparison, const CompareRequest& request, const ComparePageOptions& options) {
  const auto& texts = compare_page_texts();
  std::vector<std::size_t> chosen;
  std::size_t bad = 0;
  for (const ComparedPair& p : comparison.pairs) bad += fails(p.state);
  for (const std::size_t i : worst_first(comparison))
    if (bad > 0 ? fails(comparison.pairs[i].state) : comparison.pairs[i].state != PairState::equal) chosen.push_back(i);

  std::string html = house_head(options.title, texts.at("style.css")) +
                     fmt::format("<p{}>{}</p>\n<dl>\n", bad > 0 ? " class=\"bad\"" : "",
                                 bad > 0 ? fmt::format("{} of {} pictures do not agree.", bad, comparison.pairs.size())
                                         : fmt::format("All {} pictures agree.", comparison.pairs.size()));
  for (const auto& [name, text] : options.facts) html += fmt::format("<dt>{}</dt><dd>{}</dd>\n", escape_html(name), escape_html(text));
  if (request.baselines.size() > 1) html += fmt::format("<dt>baselines</dt><dd>{}; any may agree</dd>\n", request.baselines.size());
  for (const std::string& note : comparison.notes) html += fmt::format("<dt>note</dt><dd>{}</dd>\n", escape_html(note));
  html += "</dl>\n";

  const std::string end = house_tail(texts.at("viewer.js"));
  const std::size_t asked = std::min(chosen.size(), most_shown);
  constexpr std::size_t words = 2'000;  // bytes of a section without its pictures
  std::set<std::size_t> shown(chosen.begin(), chosen.begin() + static_cast<std::ptrdiff_t>(asked));
  const std::size_t used = html.size() + table(comparison, shown).size() + end.size() + words;
  std::size_t left = options.bytes > used ? options.bytes - used : 0;
  std::string sections;
  shown.clear();
  for (const std::size_t i : chosen) {
    if (shown.size() == asked) break;
    const std::size_t share = left / std::min(asked - shown.size(), full_shares);
    if (share < least_bytes) break;
    const std::string next = section(comparison.pairs[i], i, share - words, options);
    if (next.size() > left) break;
    left -= next.size();
    sections += next;
    shown.insert(i);
  }
  if (shown.size() < chosen.size())
    sections += fmt::format(
        "<p class=\"note\">Pictures are shown of the worst {} of {}: the page holds those of {} pairs and {:.3g} MB at most.</p>\n",
        shown.size(), chosen.size(), most_shown, 1e-6 * static_cast<double>(options.bytes));
  return html + table(comparison, shown) + sections + end;
}

}  // namespace flexframe::render
