#include "sim/bodies/sid_lack.h"

#include <charconv>

#include <fmt/format.h>

namespace flexframe::sim {
namespace {

constexpr std::string_view made = "made by flexframe reduce from ";
constexpr std::string_view words = "; its modes lack of the static deflection at ";
constexpr std::string_view turning = "; nothing resists turns of ";
constexpr double told = 0.01;  // what effects that are left out may be worth, too

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
  return out;
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
  std::vector<std::string> out;
  const size_t at = comment.find(turning);
  if (at == std::string_view::npos) return out;
  comment.remove_prefix(at + turning.size());
  while (comment.starts_with('\'')) {
    const size_t end = comment.find('\'', 1);
    if (end == std::string_view::npos) break;
    out.emplace_back(comment.substr(1, end - 1));
    comment.remove_prefix(end + 1);
    if (!comment.starts_with(", ")) break;
    comment.remove_prefix(2);
  }
  return out;
}

}  // namespace flexframe::sim
