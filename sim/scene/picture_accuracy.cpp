#include "sim/scene/picture_accuracy.h"

#include "sim/base/error.h"
#include "sim/base/words.h"
#include "sim/scene/parameters.h"
#include "sim/scene/units.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <string>

namespace flexframe::sim {

namespace {

[[noreturn]] void refuse_accuracy(std::string_view text, const std::string& why) {
  throw InputError(
      fmt::format("must be a number from 1e-12 to 0.5 (a share of the outputs' ranges), or a distance in the pictures such as "
                  "\"0.5 px\" or \"0.1 mm\", found {}{}{}",
                  quote(std::string(text)), why.empty() ? "" : ": ", why));
}

}  // namespace

double parse_share_of_ranges(std::string_view text) {
  double share = 0.0;
  try {
    share = Parameters{}.number(text, nullptr);
  } catch (const InputError& error) {
    refuse_accuracy(text, error.what());
  }
  if (!(share >= 1e-12 && share <= 0.5)) refuse_accuracy(text, "");
  return share;
}

std::optional<PictureAccuracy> parse_picture_accuracy(std::string_view text) {
  const auto trimmed = [](std::string_view t) {
    while (!t.empty() && (t.front() == ' ' || t.front() == '\t')) t.remove_prefix(1);
    while (!t.empty() && (t.back() == ' ' || t.back() == '\t')) t.remove_suffix(1);
    return t;
  };
  text = trimmed(text);
  PictureAccuracy out;
  const char* const end = text.data() + text.size();
  const auto [after, error] = std::from_chars(text.data(), end, out.value);
  if (error != std::errc()) return std::nullopt;
  const std::string unit(trimmed({after, static_cast<size_t>(end - after)}));
  // A number: "1e-3", "1 %", "2*a".
  if (unit.empty() || std::string_view("+-*/^%").find(unit.front()) != std::string_view::npos) return std::nullopt;
  const auto refuse = [&](const std::string& why) { refuse_accuracy(text, why); };
  if (unit == "px" || unit == "pixel" || unit == "pixels") {
    out.pixels = true;
  } else {
    const std::optional<Unit> known = parse_unit(unit);
    if (!known) refuse(fmt::format("the unit {} is unknown; allowed: px, and units of length such as mm", quote(unit)));
    if (known->dimension != Dimension{.metre = 1}) refuse(fmt::format("{} is no unit of length", quote(unit)));
    out.value *= known->factor;
  }
  if (!(out.value > 0.0) || !std::isfinite(out.value)) refuse("the distance must be above 0");
  out.words = std::string(text);
  return out;
}

}  // namespace flexframe::sim
