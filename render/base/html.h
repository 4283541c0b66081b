// Text in HTML pages.
#pragma once

#include <string>
#include <string_view>

namespace flexframe::render {

// & < > " as entities, for text and for values of attributes.
std::string escape_html(std::string_view text);

}  // namespace flexframe::render
