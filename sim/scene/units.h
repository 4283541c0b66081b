// Units of numbers that are written as text: "10 mm", "210 GPa", "30 deg", "5 N/mm", "1200 rpm".
//
// A unit is a product of words with whole powers: "kg/m^3", "N m", "N*m/rad", "1/s". What stands behind a '/' divides, up to the next
// blank, '*' or '/'. Words: m mm cm km um nm in ft; kg g t lb; s ms us min h; rad mrad deg rev; N kN MN mN lbf; Pa kPa MPa GPa bar psi;
// J kJ; W kW; Hz kHz (cycles, not rad/s); rpm; %.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace flexframe::sim {

// Powers of metre, kilogram, second, radian and cycle.
struct Dimension {
  int metre = 0, kilogram = 0, second = 0, radian = 0, cycle = 0;
  bool operator==(const Dimension&) const = default;
};

struct Unit {
  double factor = 1.0;  // SI value of one unit
  Dimension dimension;
};

// None where a word is unknown or the text is no unit. "" and "1" have no dimension.
std::optional<Unit> parse_unit(std::string_view text);

// May a number of dimension `given` stand where `wanted` is expected? Radians and cycles may be left out, but not take each other's place:
// "1/s" stands for rad/s and for Hz, Hz does not stand for rad/s, an angle does not stand for a plain number.
bool fits(const Dimension& given, const Dimension& wanted);

// A text that ends in a unit, split before it: "2*L mm" -> {"2*L", "mm"}. Empty second part: no unit at its end.
// A single word ("mm", "pi") is no number with a unit.
std::pair<std::string_view, std::string_view> split_unit(std::string_view text);

}  // namespace flexframe::sim
