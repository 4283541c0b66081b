// Characters of UTF-8, whatever the bytes are: names of files and titles of scenes need not be text.
#pragma once

#include <string_view>

namespace flexframe::render {

// The code point at the start of the text, which is taken off it; a byte that is no UTF-8 gives U+FFFD. The text must not be empty.
int next_character(std::string_view& text);

}  // namespace flexframe::render
