// Letters and numbers of files as they are written, whatever the locale of the process: a host program (Python with
// locale.setlocale, Qt) may have set one whose numbers have a comma, or in which the capital of i is no I.
#pragma once

#include <string>
#include <string_view>

namespace flexframe::sim {

constexpr char plain_lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }
constexpr char plain_upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }
std::string plain_lower(std::string_view text);
std::string plain_upper(std::string_view text);

// The number that a text begins with, behind blanks, a sign before it: as strtod, with a decimal point. end: behind it; at the text's
// beginning where there is none. Beyond the range of double: infinite, or zero.
double leading_number(const char* text, const char** end);

}  // namespace flexframe::sim
