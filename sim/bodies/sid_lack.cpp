#include "sim/bodies/sid_lack.h"

#include <charconv>

#include <fmt/format.h>

namespace flexframe::sim {
namespace {

constexpr std::string_view made = "made by flexframe reduce from ";
constexpr std::string_view words = "; its modes lack of the static deflection at ";
constexpr std::string_view turning = "; nothing resists turns of ";
constexpr std::string_view interfaces = "; interfaces ", none = "; no interfaces";
constexpr double told = 0.01;  // what effects that are left out may be worth, too

// Names in quotes, with commas between them.
std::vector<std::string> names_in(std::string_view text) {
  std::vector<std::string> out;
  while (text.starts_with('\'')) {
    const size_t end = text.find('\'', 1);
    if (end == std::string_view::npos) break;
    out.emplace_back(text.substr(1, end - 1));
    text.remove_prefix(end + 1);
    if (!text.starts_with(", ")) break;
    text.remove_prefix(2);
  }
  return out;
}

}  // namespace

std::string reduced_comment(const std::string& model, const std::vector<InterfaceLack>& lacks) {
  std::string out = std::string(made) + model;
  bool first = true;
  for (const InterfaceLack& lack : lacks) {
    if (!lack.turns) continue;
    out += fmt::format("{}'{}'", first ? turning : ", ", lack.interface);
    first = false;
  }
  first = true;
  for (const InterfaceLack& lack : lacks) {
    if (!(lack.share > told)) continue;
    out += fmt::format("{}'{}' {:.2g} %", first ? words : ", ", lack.interface, 100.0 * lack.share);
    first = false;
  }
  if (lacks.empty()) out += none;
  for (size_t k = 0; k < lacks.size(); ++k) out += fmt::format("{}'{}'", k == 0 ? interfaces : ", ", lacks[k].interface);
  return out;
}

std::optional<std::vector<std::string>> interfaces_of_comment(std::string_view comment) {
  if (!comment.starts_with(made)) return std::nullopt;
  const size_t at = comment.find(interfaces);
  if (at != std::string_view::npos) return names_in(comment.substr(at + interfaces.size()));
  if (comment.ends_with(none)) return std::vector<std::string>{};
  return std::nullopt;
}

bool knows_lacks(std::string_view comment) { return comment.starts_with(made); }

std::vector<InterfaceLack> lacks_of_comment(std::string_view comment) {
  std::vector<InterfaceLack> out;
  const size_t at = comment.find(words);
  if (at == std::string_view::npos) return out;
  comment.remove_prefix(at + words.size());
  while (comment.starts_with('\'')) {
    const size_t end = comment.find("' ", 1);
    if (end == std::string_view::npos) break;
    InterfaceLack lack{std::string(comment.substr(1, end - 1)), 0.0};
    const char* from = comment.data() + end + 2;
    const auto [stop, failed] = std::from_chars(from, comment.data() + comment.size(), lack.share);
    if (failed != std::errc{}) break;
    lack.share /= 100.0;
    out.push_back(std::move(lack));
    comment.remove_prefix(stop - comment.data());
    if (!comment.starts_with(" %, ")) break;
    comment.remove_prefix(4);
  }
  return out;
}

std::vector<std::string> turning_of_comment(std::string_view comment) {
  const size_t at = comment.find(turning);
  return at == std::string_view::npos ? std::vector<std::string>{} : names_in(comment.substr(at + turning.size()));
}

}  // namespace flexframe::sim
