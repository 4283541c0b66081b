#include "sim/scene/parameters.h"

#include "sim/base/types.h"
#include "sim/base/words.h"
#include "sim/scene/expression.h"
#include "sim/scene/expression_code.h"
#include "sim/scene/scene.h"
#include "sim/scene/unit_terms.h"
#include "sim/scene/units.h"

#include <algorithm>

#include <fmt/format.h>

namespace flexframe::sim {
namespace {

constexpr std::size_t deepest = 200;

bool starts_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

std::vector<NameInText> names_in(std::string_view text) {
  std::vector<NameInText> names;
  for (std::size_t at = 0; at < text.size();) {
    if (is_digit(text[at]) || text[at] == '.') {
      // A number with its exponent, whose e is no name.
      while (at < text.size() && (is_digit(text[at]) || text[at] == '.')) ++at;
      std::size_t exponent = at;
      if (exponent < text.size() && (text[exponent] == 'e' || text[exponent] == 'E')) {
        ++exponent;
        if (exponent < text.size() && (text[exponent] == '+' || text[exponent] == '-')) ++exponent;
        if (exponent < text.size() && is_digit(text[exponent])) {
          at = exponent;
          while (at < text.size() && is_digit(text[at])) ++at;
        }
      }
    } else if (starts_name(text[at])) {
      const std::size_t begin = at;
      while (at < text.size() && (starts_name(text[at]) || is_digit(text[at]))) ++at;
      std::size_t next = at;
      while (next < text.size() && text[next] == ' ') ++next;
      if (next >= text.size() || text[next] != '(') names.push_back({begin, at - begin});
    } else {
      ++at;
    }
  }
  return names;
}

void Parameters::add(const std::string& name, const std::string& text) {
  const bool good =
      !name.empty() && starts_name(name[0]) && std::all_of(name.begin(), name.end(), [](char c) { return starts_name(c) || is_digit(c); });
  if (!good) throw InputError("is no name for a parameter: letters, digits and _ only, no digit first");
  if (expression::is_word(name)) throw InputError("is a word of expressions already; choose another name");
  texts_[name] = text;
  values_.clear();
}

double Parameters::value(const std::string& name) const {
  if (const auto known = values_.find(name); known != values_.end()) return known->second;
  if (std::find(open_.begin(), open_.end(), name) != open_.end())
    throw InputError(fmt::format("the parameters {} and {} need each other", open_.back(), name));
  // Each stands on the stack while the next is worked out.
  if (open_.size() >= deepest) throw InputError(fmt::format("parameters lead to one another over more than {} steps", deepest));
  open_.push_back(name);
  try {
    const double result = number(texts_.at(name), "*");
    open_.pop_back();
    values_[name] = result;
    return result;
  } catch (const InputError& error) {
    open_.pop_back();
    const std::string message = error.what();
    // The innermost parameter is the one to change.
    if (message.starts_with("the parameter") || message.starts_with("parameters lead")) throw;
    throw InputError(fmt::format("the parameter {} = {}: {}", name, quote(texts_.at(name)), message));
  }
}

std::string Parameters::substitute_but(std::string_view text, const std::vector<std::size_t>& but) const {
  std::string out;
  std::size_t done = 0;
  for (const NameInText& name : names_in(text)) {
    const std::string word(text.substr(name.at, name.length));
    // "tip.x" is a reading of the scene, its x no parameter.
    const bool of_reading = name.at > 1 && text[name.at - 1] == '.' && (starts_name(text[name.at - 2]) || is_digit(text[name.at - 2]));
    if (!has(word) || of_reading || std::find(but.begin(), but.end(), name.at) != but.end()) continue;
    out.append(text, done, name.at - done);
    out += fmt::format("({})", value(word));
    done = name.at + name.length;
  }
  out.append(text, done, std::string_view::npos);
  return out;
}

void Parameters::doubt(const std::string& text) const {
  if (std::find(doubts_->begin(), doubts_->end(), text) == doubts_->end()) doubts_->push_back(text);
}

bool only_a_unit(const UnitWord& word, std::string_view text) {
  if (word.joined == '*') return false;
  const std::string_view name = text.substr(word.at, word.length);
  return word.joined != '/' || name == "m" || name == "s";
}

std::string Parameters::substitute_beside_units(std::string_view text) const {
  std::vector<std::size_t> but;
  for (const UnitWord& one : unit_words(text)) {
    const std::string word(text.substr(one.at, one.length));
    if (only_a_unit(one, text)) but.push_back(one.at);
    else if (has(word))
      doubt(
          fmt::format("in {} the group's parameter {} is read, which is a unit too: write blanks around the {}, or for the unit give the "
                      "parameter another name",
                      quote(std::string(text)), quote(word), one.joined));
  }
  return substitute_but(text, but);
}

void Parameters::doubt_units(std::string_view text, std::span<const std::string> others) const {
  for (const UnitWord& one : unit_words(text)) {
    const std::string word(text.substr(one.at, one.length));
    if (only_a_unit(one, text)) continue;
    const bool parameter = has(word);
    if (!parameter && std::find(others.begin(), others.end(), word) == others.end()) continue;
    const std::string before(text.substr(one.unit.at, one.at - 1 - one.unit.at));
    doubt(
        fmt::format("in {} the unit {} is read, though {} has the name {}: for its value write \"{} {} {}\", with blanks, for the unit "
                    "give it another name",
                    quote(std::string(text)), quote(std::string(text.substr(one.unit.at, one.unit.length))),
                    parameter ? "a parameter" : "an output or block", quote(word), before, one.joined, word));
  }
}

std::string with_inputs(std::string_view text, const std::vector<InputDef>& inputs) {
  if (inputs.empty()) return std::string(text);
  Parameters values;
  for (const InputDef& input : inputs) values.add(input.name, fmt::format("{}", input.value));
  return values.substitute(text);
}

namespace {

// What a text says: the expression, and what its value is multiplied with.
struct Quantified {
  std::string text;
  double factor = 1.0;
  bool certain = true;  // no units, or those that were wanted
};

std::string_view trimmed(std::string_view text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  return text;
}

void require_unit(const Dimension& given, const char* wanted_text, std::string_view found) {
  const std::optional<Unit> wanted = wanted_text ? parse_unit(wanted_text) : std::nullopt;
  if (!wanted_text && given == Dimension{}) return;  // "5 %"
  if (!wanted_text) throw InputError(fmt::format("a number without a unit is expected, found the unit {}", quote(found)));
  if (!wanted || !fits(given, wanted->dimension))
    throw InputError(
        fmt::format("the unit {} does not fit; a number in {} is expected", quote(found), *wanted_text ? wanted_text : "no unit"));
}

// One unit behind the whole, or units inside. "3 t" might be an expression of time elsewhere; a number has no t, so that what stands
// behind it is a unit. wanted: as in number(); "*": any.
Quantified take_units(std::string_view text, const char* wanted) {
  const bool any = wanted && std::string_view(wanted) == "*";
  const auto [number_text, unit_text] = split_unit(text);
  const std::optional<UnitTerms> inside = resolve_units(number_text), all = resolve_units(text);
  const double scale = !any && wanted && parse_unit(wanted) ? parse_unit(wanted)->factor : 1.0;
  if (!unit_text.empty() && !inside) {
    if (is_sum(number_text)) {
      const std::size_t last = number_text.find_last_of("+-");
      throw InputError(fmt::format("{} may belong to the whole sum or to its last term: write \"({}) {}\" or \"{} ({} {})\"",
                                   quote(unit_text), number_text, unit_text, number_text.substr(0, last + 1),
                                   trimmed(number_text.substr(last + 1)), unit_text));
    }
    const Unit given = *parse_unit(unit_text);
    if (!any) require_unit(given.dimension, wanted, unit_text);
    return {std::string(number_text), given.factor / scale, !any};
  }
  if (!all) return {std::string(text), 1.0};
  // A plain number may be made of quantities: "cos(60 deg)", "5 mm/L".
  if (!any && all->dimension && (wanted || *all->dimension != Dimension{})) require_unit(*all->dimension, wanted, text);
  return {all->text, 1.0 / scale, !any && all->dimension && wanted};
}

}  // namespace

double Parameters::number(std::string_view text, const char* unit) const {
  const auto [number_text, factor, certain] = take_units(text, unit);
  if (!certain) doubt_units(text);
  const std::string plain = substitute(number_text);
  try {
    const Expression expression(plain);
    if (!expression.constant()) throw InputError("it depends on the time t, which a number cannot");
    return expression.value(0.0) * factor;
  } catch (const InputError& error) {
    std::vector<std::string> known;
    for (const auto& entry : texts_) known.push_back(entry.first);
    for (const NameInText& name : names_in(plain)) {
      const std::string word = plain.substr(name.at, name.length);
      if (word != "t" && !expression::is_word(word))
        throw InputError(fmt::format("{} is no parameter{} {}", quote(word), did_you_mean(word, known),
                                     known.empty() ? "and the scene has none ([parameters])" : "(there are " + list_words(known) + ")"));
    }
    // Columns are those of the text with its values, which nobody sees.
    const std::string message = error.what();
    const std::size_t colon = message.find(": ");
    if (plain == text || !message.starts_with("column ") || colon == std::string::npos) throw;
    throw InputError(message.substr(colon + 2));
  } catch (const SimulationError& error) {
    throw InputError(error.what());
  }
}

std::string Parameters::values_in(std::string_view text) const {
  std::string out;
  std::vector<std::string> told;
  for (const NameInText& name : names_in(text)) {
    const std::string word(text.substr(name.at, name.length));
    if (!has(word) || std::find(told.begin(), told.end(), word) != told.end()) continue;
    told.push_back(word);
    out += fmt::format("{}{} = {}", out.empty() ? "" : ", ", word, value(word));
  }
  return out;
}

}  // namespace flexframe::sim
