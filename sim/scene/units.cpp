#include "sim/scene/units.h"

#include <array>
#include <charconv>
#include <numbers>
#include <utility>

namespace flexframe::sim {
namespace {

struct Word {
  std::string_view name;
  Unit unit;
};

constexpr Dimension length{.metre = 1}, mass{.kilogram = 1}, duration{.second = 1}, angle{.radian = 1};
constexpr Dimension force{.metre = 1, .kilogram = 1, .second = -2}, pressure{.metre = -1, .kilogram = 1, .second = -2};
constexpr Dimension energy{.metre = 2, .kilogram = 1, .second = -2}, power{.metre = 2, .kilogram = 1, .second = -3};
constexpr Dimension frequency{.second = -1, .cycle = 1}, angular_velocity{.second = -1, .radian = 1};
constexpr double turn = 2.0 * std::numbers::pi, pound = 0.45359237, pound_force = pound * 9.80665, inch = 0.0254;

// Pound, inch and foot by the international agreement of 1959, the pound-force with the standard acceleration of 1901.
constexpr std::array words{
    Word{"m", {1.0, length}},      Word{"mm", {1e-3, length}},
    Word{"cm", {1e-2, length}},    Word{"km", {1e3, length}},
    Word{"um", {1e-6, length}},    Word{"nm", {1e-9, length}},
    Word{"in", {inch, length}},    Word{"ft", {12.0 * inch, length}},
    Word{"kg", {1.0, mass}},       Word{"g", {1e-3, mass}},
    Word{"t", {1e3, mass}},        Word{"lb", {pound, mass}},
    Word{"s", {1.0, duration}},    Word{"ms", {1e-3, duration}},
    Word{"us", {1e-6, duration}},  Word{"min", {60.0, duration}},
    Word{"h", {3600.0, duration}}, Word{"rad", {1.0, angle}},
    Word{"mrad", {1e-3, angle}},   Word{"deg", {turn / 360.0, angle}},
    Word{"rev", {turn, angle}},    Word{"N", {1.0, force}},
    Word{"mN", {1e-3, force}},     Word{"kN", {1e3, force}},
    Word{"MN", {1e6, force}},      Word{"lbf", {pound_force, force}},
    Word{"Pa", {1.0, pressure}},   Word{"kPa", {1e3, pressure}},
    Word{"MPa", {1e6, pressure}},  Word{"GPa", {1e9, pressure}},
    Word{"bar", {1e5, pressure}},  Word{"psi", {pound_force / (inch * inch), pressure}},
    Word{"Nm", {1.0, energy}},     Word{"J", {1.0, energy}},
    Word{"kJ", {1e3, energy}},     Word{"W", {1.0, power}},
    Word{"kW", {1e3, power}},      Word{"Hz", {1.0, frequency}},
    Word{"kHz", {1e3, frequency}}, Word{"rpm", {turn / 60.0, angular_velocity}},
    Word{"%", {1e-2, {}}},
};

void multiply(Unit& product, const Unit& by, int times) {
  for (int k = 0; k < std::abs(times); ++k) product.factor = times > 0 ? product.factor * by.factor : product.factor / by.factor;
  product.dimension.metre += times * by.dimension.metre;
  product.dimension.kilogram += times * by.dimension.kilogram;
  product.dimension.second += times * by.dimension.second;
  product.dimension.radian += times * by.dimension.radian;
  product.dimension.cycle += times * by.dimension.cycle;
}

bool is_unit_character(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '%'; }

// The end of "word" or "word^power" that begins at `at`, or npos; adds it to the product.
std::size_t read_word(std::string_view text, std::size_t at, bool divided, Unit& product) {
  std::size_t end = at;
  while (end < text.size() && is_unit_character(text[end])) ++end;
  const std::string_view name = text.substr(at, end - at);
  const Word* found = nullptr;
  for (const Word& word : words)
    if (word.name == name) found = &word;
  if (!found && name.empty() && text.substr(at, 1) == "1") return at + 1;
  if (!found) return std::string_view::npos;
  int times = 1;
  if (end < text.size() && text[end] == '^') {
    const auto [next, error] = std::from_chars(text.data() + end + 1, text.data() + text.size(), times);
    if (error != std::errc{} || times == 0 || std::abs(times) > 9) return std::string_view::npos;
    end = static_cast<std::size_t>(next - text.data());
  }
  multiply(product, found->unit, divided ? -times : times);
  return end;
}

}  // namespace

std::optional<Unit> parse_unit(std::string_view text) {
  Unit product;
  if (text.empty()) return product;
  bool divided = false;
  for (std::size_t at = 0; at < text.size();) {
    at = read_word(text, at, divided, product);
    if (at == std::string_view::npos) return std::nullopt;
    if (at == text.size()) return product;
    const char between = text[at++];
    if (between != ' ' && between != '*' && between != '/') return std::nullopt;
    divided = between == '/';
  }
  return std::nullopt;
}

bool fits(const Dimension& given, const Dimension& wanted) {
  return given.metre == wanted.metre && given.kilogram == wanted.kilogram && given.second == wanted.second &&
         (given.radian == 0 || given.radian == wanted.radian) && (given.cycle == 0 || given.cycle == wanted.cycle);
}

std::pair<std::string_view, std::string_view> split_unit(std::string_view text) {
  const auto trim = [](std::string_view part) {
    while (!part.empty() && part.back() == ' ') part.remove_suffix(1);
    while (!part.empty() && part.front() == ' ') part.remove_prefix(1);
    return part;
  };
  text = trim(text);
  // The longest end that is a unit: "3 N m" is newton metres, not "3 N" metres.
  for (std::size_t at = 1; at < text.size(); ++at) {
    if (!is_unit_character(text[at]) || is_unit_character(text[at - 1])) continue;
    const char before = text[at - 1];
    const bool number_before = (before >= '0' && before <= '9') || before == '.' || before == ')' || before == ' ';
    const std::string_view number = trim(text.substr(0, at));
    if (!number_before || number.empty() || std::string_view("+-*/^(,").find(number.back()) != std::string_view::npos) continue;
    if (parse_unit(text.substr(at))) return {number, text.substr(at)};
  }
  return {text, {}};
}

}  // namespace flexframe::sim
