// Commands that are printed for the user to run, or written to scripts.
#pragma once

#include <string>

namespace flexframe::cli {

// The text as one word of a POSIX shell: in quotes where it needs them.
inline std::string shell_word(const std::string& text) {
  if (!text.empty() && text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./=:+,") == text.npos)
    return text;
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

}  // namespace flexframe::cli
