#include "sim/base/plain_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

namespace flexframe::sim {

std::string plain_lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = plain_lower(c);
  return out;
}

std::string plain_upper(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = plain_upper(c);
  return out;
}

double leading_number(const char* text, const char** end) {
  const char* at = text;
  while (*at == ' ' || (*at >= '\t' && *at <= '\r')) ++at;
  if (*at == '+' && at[1] != '-') ++at;
  const char* last = at + std::strlen(at);
  double value = 0.0;
  const auto [next, error] = std::from_chars(at, last, value);
  *end = error == std::errc::invalid_argument ? text : next;
  if (error != std::errc::result_out_of_range) return error == std::errc() ? value : 0.0;
  // Too large or too small: the exponent tells, or where there is none the digits before the point.
  const char* mark = std::find_if(at, next, [](char c) { return c == 'e' || c == 'E'; });
  const bool small = mark != next ? std::find(mark, next, '-') != next : at[*at == '-' ? 1 : 0] == '0' || at[*at == '-' ? 1 : 0] == '.';
  return std::copysign(small ? 0.0 : HUGE_VAL, *at == '-' ? -1.0 : 1.0);
}

}  // namespace flexframe::sim
