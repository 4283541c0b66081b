#include "render/base/html.h"

#include "render/base/utf8.h"

namespace flexframe::render {

std::string escape_html(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::string_view before = text;
    if (next_character(text) == 0xFFFD) {
      out += "\xEF\xBF\xBD";
      continue;
    }
    const char c = before.front();
    if (c == '&') out += "&amp;";
    else if (c == '<') out += "&lt;";
    else if (c == '>') out += "&gt;";
    else if (c == '"') out += "&quot;";
    else out += before.substr(0, before.size() - text.size());
  }
  return out;
}

}  // namespace flexframe::render
