// Text in HTML pages.
#pragma once

#include <string>
#include <string_view>

namespace flexframe::render {

// & < > " as entities, for text and for values of attributes; a byte that is no UTF-8 becomes U+FFFD.
std::string escape_html(std::string_view text);

}  // namespace flexframe::render
