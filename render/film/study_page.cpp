#include "render/film/study_page.h"

#include "render/base/base64.h"
#include "render/base/house_page.h"
#include "render/base/html.h"
#include "render/film/study_text.h"
#include "render/image/png.h"

#include <fmt/format.h>

namespace flexframe::film {
namespace {

// A paragraph; `words` as typed.
std::string paragraph(std::string_view text) {
  std::string out = text.starts_with("Note: ") ? "<p class=\"note\">" : "<p>";
  bool typed = false;
  for (std::size_t at = text.find('`'); at != std::string_view::npos; at = text.find('`')) {
    out += render::escape_html(text.substr(0, at)) + (typed ? "</code>" : "<code>");
    typed = !typed;
    text.remove_prefix(at + 1);
  }
  return out + render::escape_html(text) + (typed ? "</code></p>\n" : "</p>\n");
}

}  // namespace

std::string study_page(const Study& study) {
  const std::vector<NamedDiagram> diagrams = study_diagrams(study);
  std::string out = render::house_head(study.title + ": what accuracy costs");
  if (study.overview)
    out += fmt::format(
        "<img alt=\"error in pixels against CPU time\" style=\"width:100%;max-width:1600px\" src=\"data:image/png;base64,{}\">\n",
        render::base64(render::encode_png(study.overview->figure, {.level = 9, .text = {}})));
  for (const StudyBlock& b : study_blocks(study)) {
    if (b.kind == StudyBlock::Kind::heading) out += fmt::format("<h2 id=\"{0}\">{0}</h2>\n", render::escape_html(b.text));
    if (b.kind == StudyBlock::Kind::text) out += paragraph(b.text);
    if (b.kind == StudyBlock::Kind::command) out += paragraph(fmt::format("Made by `{}`.", b.text));
    if (b.kind == StudyBlock::Kind::table) out += render::house_table(b.rows, true);
    if (b.kind == StudyBlock::Kind::diagram)
      for (const NamedDiagram& d : diagrams)
        if (d.name == b.text) out += diagram_svg(d.diagram);
  }
  return out + render::house_tail();
}

}  // namespace flexframe::film
