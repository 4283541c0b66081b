#include "render/base/house_page.h"

#include "render/base/house_texts.h"
#include "render/base/html.h"

#include <fmt/format.h>

#include <cctype>

namespace flexframe::render {
namespace {

// More than half of the column's cells that are not empty begin as a number does.
bool of_numbers(const std::vector<std::vector<std::string>>& rows, std::size_t column) {
  std::size_t filled = 0, numbers = 0;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    if (column >= rows[i].size() || rows[i][column].empty()) continue;
    const std::string& cell = rows[i][column];
    const std::size_t sign = cell[0] == '-' ? 1 : 0;
    ++filled;
    numbers += cell.size() > sign && std::isdigit(static_cast<unsigned char>(cell[sign]));
  }
  return 2 * numbers > filled;
}

std::string row(const std::vector<std::string>& cells, std::size_t columns) {
  std::string out = "<tr>";
  for (std::size_t k = 0; k < columns; ++k) out += fmt::format("<td>{}</td>", k < cells.size() ? escape_html(cells[k]) : "");
  return out + "</tr>\n";
}

}  // namespace

const std::string& house_colours() { return house_texts().at("colours.css"); }

std::string house_head(const std::string& title, const std::string& style) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, "
      "initial-scale=1\">\n<meta name=\"generator\" content=\"flexframe\">\n<title>{0}</title>\n<style>\n{1}{2}{3}</style></head>\n<body>\n"
      "<header><h1>{0}</h1><nav><button id=\"theme\" title=\"Light or dark\">Light/dark</button></nav></header>\n",
      escape_html(title), house_colours(), house_texts().at("report.css"), style);
}

std::string house_tail(const std::string& script) {
  return fmt::format("<script>\n{}{}</script>\n</body></html>\n", house_texts().at("report.js"), script);
}

std::string house_table(const std::vector<std::vector<std::string>>& rows, bool sorted) {
  if (rows.empty()) return "";
  const std::size_t columns = rows.front().size();
  std::string out = fmt::format("<div class=\"wide\"><table{}>\n<thead><tr>", sorted ? " class=\"sorted\"" : "");
  for (std::size_t k = 0; k < columns; ++k)
    out += fmt::format("<th{}>{}</th>", of_numbers(rows, k) ? " data-kind=\"number\"" : "", escape_html(rows.front()[k]));
  out += "</tr></thead>\n<tbody>\n";
  for (std::size_t i = 1; i < rows.size(); ++i) out += row(rows[i], columns);
  return out + "</tbody></table></div>\n";
}

}  // namespace flexframe::render
