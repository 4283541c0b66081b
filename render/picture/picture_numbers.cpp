#include "render/picture/picture_numbers.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace flexframe::render {
namespace {

constexpr double agreement = 1e-4;

// Takes the next word off a line.
std::string_view next_token(std::string_view& text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  const size_t end = std::min(text.find(' '), text.size());
  const std::string_view word = text.substr(0, end);
  text.remove_prefix(end);
  return word;
}

bool read_numbers(std::string_view& text, int count, double* out) {
  for (int k = 0; k < count; ++k) {
    const std::string_view word = next_token(text);
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), out[k]);
    if (word.empty() || error != std::errc() || end != word.data() + word.size() || !std::isfinite(out[k])) return false;
  }
  return true;
}

}  // namespace

std::string numbers_text(const PictureNumbers& n) {
  std::string text = fmt::format("vertices {} hash {} lower {:.17g} {:.17g} {:.17g} upper {:.17g} {:.17g} {:.17g}", n.vertices, n.hash,
                                 n.lower.x, n.lower.y, n.lower.z, n.upper.x, n.upper.y, n.upper.z);
  if (n.colors) text += fmt::format(" colors {:.17g} {:.17g}", n.colors->first, n.colors->second);
  return text;
}

std::optional<PictureNumbers> parse_numbers(std::string_view text) {
  PictureNumbers n;
  double count = 0.0, ends[2];
  if (next_token(text) != "vertices" || !read_numbers(text, 1, &count) || count < 0.0 || count > 1e15 || count != std::floor(count))
    return std::nullopt;
  n.vertices = static_cast<long>(count);
  if (next_token(text) != "hash") return std::nullopt;
  n.hash = next_token(text);
  if (n.hash.empty() || n.hash.find_first_not_of("0123456789abcdef") != std::string::npos) return std::nullopt;
  if (next_token(text) != "lower" || !read_numbers(text, 3, &n.lower.x) || next_token(text) != "upper" ||
      !read_numbers(text, 3, &n.upper.x))
    return std::nullopt;
  const std::string_view more = next_token(text);
  if (more.empty()) return n;
  if (more != "colors" || !read_numbers(text, 2, ends) || !next_token(text).empty()) return std::nullopt;
  n.colors = {ends[0], ends[1]};
  return n;
}

std::string numbers_difference(const PictureNumbers& a, const PictureNumbers& b) {
  if (a.vertices != b.vertices) return fmt::format("{} vertices, baseline {}", b.vertices, a.vertices);
  if (a.colors.has_value() != b.colors.has_value())
    return b.colors ? "coloured by values, the baseline is not" : "not coloured by values, the baseline is";
  if (a.colors) {
    const double range = std::abs(a.colors->second - a.colors->first);
    if (std::max(std::abs(a.colors->first - b.colors->first), std::abs(a.colors->second - b.colors->second)) > agreement * range)
      return fmt::format("colour range {:.6g} to {:.6g}, baseline {:.6g} to {:.6g}", b.colors->first, b.colors->second, a.colors->first,
                         a.colors->second);
  }
  if (a.hash == b.hash) return {};
  const double size = glm::length(a.upper - a.lower);
  for (int c = 0; c < 3; ++c) {
    const double off = std::max(std::abs(a.lower[c] - b.lower[c]), std::abs(a.upper[c] - b.upper[c]));
    if (off > agreement * size)
      return fmt::format("the surfaces reach from {:.6g} to {:.6g} m along {}, baseline {:.6g} to {:.6g} m", b.lower[c], b.upper[c],
                         "xyz"[c], a.lower[c], a.upper[c]);
  }
  return {};
}

}  // namespace flexframe::render
