// Units inside expressions: "60 deg + 0.1", "L + 5 mm*2", "sqrt((3 mm)^2 + L^2)".
//
// A unit stands behind a number or a closing bracket and belongs to that alone. What has no unit is a plain number: beside a quantity it
// counts in SI. A name (a parameter) may be of any dimension.
#pragma once

#include "sim/scene/units.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexframe::sim {

// The expression with every unit replaced by its factor, and the dimension that it has then; none: it follows from what has no unit.
struct UnitTerms {
  std::string text;
  std::optional<Dimension> dimension;
};

// None where no unit stands in the text, or where it is no expression. Throws InputError where dimensions do not fit each other:
// "5 mm + 2 kg", "sin(3 N)".
std::optional<UnitTerms> resolve_units(std::string_view text);

// The text of an expression of t with its units replaced, where a number in `unit` (as Range::unit) is wanted; none where there is none
// inside, or one behind a whole without t. What is multiplied by t is multiplied by the time. Throws InputError where they make another
// dimension.
std::optional<std::string> replace_units(std::string_view text, const char* unit);

// A unit that stands in a text behind a number, a closing bracket or, apart from it, a name.
struct UnitInText {
  std::size_t at, length;
};
// In order of appearance, in expressions and in arrays of them; "*t" is the time, not the tonne.
std::vector<UnitInText> units_in(std::string_view text);

// A word of a unit, where it stands in the text, and what joins it to the word before: '*', '/', ' ', or none for the first.
struct UnitWord {
  std::size_t at, length;
  char joined;
  UnitInText unit;
};
// The words of all units in a text, in order of appearance.
std::vector<UnitWord> unit_words(std::string_view text);

// Whether a '+' or '-' joins two terms outside all brackets: "L + 2", not "-2*(a + b)" or "1e-3".
bool is_sum(std::string_view text);

}  // namespace flexframe::sim
