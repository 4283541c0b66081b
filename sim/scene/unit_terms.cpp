#include "sim/scene/unit_terms.h"

#include "sim/base/types.h"
#include "sim/base/words.h"

#include <cctype>
#include <charconv>

#include <fmt/format.h>

namespace flexframe::sim {
namespace {

struct NoExpression {};

// A plain number, a quantity of known dimension, or what only names (parameters) say.
struct Term {
  enum Kind { number, known, open } kind = number;
  Dimension dimension;
  std::optional<int> whole;  // a plain whole number, as a power needs
};

bool alike(const Dimension& a, const Dimension& b) { return fits(a, b) || fits(b, a); }

std::string in_words(const Dimension& d) {
  std::string out;
  for (const auto& [word, power] : {std::pair{"m", d.metre}, {"kg", d.kilogram}, {"s", d.second}, {"rad", d.radian}, {"cycles", d.cycle}})
    if (power != 0) out += fmt::format("{}{}{}", out.empty() ? "" : " ", word, power == 1 ? "" : fmt::format("^{}", power));
  return out.empty() ? "no unit" : out;
}

Term together(const Term& a, const Term& b) {
  if (a.kind == Term::known && b.kind == Term::known && !alike(a.dimension, b.dimension))
    throw InputError(fmt::format("{} and {} do not go together", in_words(a.dimension), in_words(b.dimension)));
  if (a.kind == Term::known) return a;
  if (b.kind == Term::known) return b;
  return {a.kind == Term::open || b.kind == Term::open ? Term::open : Term::number, {}, {}};
}

Dimension times(const Dimension& d, int n) { return {n * d.metre, n * d.kilogram, n * d.second, n * d.radian, n * d.cycle}; }

Term product(const Term& a, const Term& b, int sign) {
  if (a.kind == Term::open || b.kind == Term::open) return {Term::open, {}, {}};
  const Dimension x = a.dimension, y = times(b.dimension, sign);
  const Dimension d{x.metre + y.metre, x.kilogram + y.kilogram, x.second + y.second, x.radian + y.radian, x.cycle + y.cycle};
  return {a.kind == Term::known || b.kind == Term::known ? Term::known : Term::number, d, {}};
}

Term raised(const Term& base, const Term& exponent) {
  if (exponent.kind == Term::known && exponent.dimension != Dimension{})
    throw InputError(fmt::format("a power is a plain number, found {}", in_words(exponent.dimension)));
  if (base.kind != Term::known) return {base.kind, {}, {}};
  if (!exponent.whole) return {Term::open, {}, {}};
  return {Term::known, times(base.dimension, *exponent.whole), {}};
}

Term function(std::string_view name, const std::vector<Term>& arguments) {
  Term all = arguments.empty() ? Term{} : arguments.front();
  for (const Term& one : arguments) all = together(all, one);
  all.whole.reset();
  for (const std::string_view keeps : {"abs", "min", "max", "sum", "avg"})
    if (name == keeps) return all;
  if (name == "atan2" || name == "sign" || all.kind != Term::known) return {all.kind == Term::open ? Term::open : Term::number, {}, {}};
  const Dimension& d = all.dimension;
  if (name == "sqrt") {
    const bool even = d.metre % 2 == 0 && d.kilogram % 2 == 0 && d.second % 2 == 0 && d.radian % 2 == 0 && d.cycle % 2 == 0;
    if (!even) return {Term::open, {}, {}};
    return {Term::known, {d.metre / 2, d.kilogram / 2, d.second / 2, d.radian / 2, d.cycle / 2}, {}};
  }
  const bool turns = name == "sin" || name == "cos" || name == "tan";
  if (d != Dimension{} && !(turns && d == Dimension{.radian = 1}))
    throw InputError(fmt::format("{} needs {}, found {}", name, turns ? "an angle" : "a plain number", in_words(d)));
  return {};
}

// The longest unit that begins at a place, behind blanks; of length 0: none.
UnitInText unit_from(std::string_view text, std::size_t from) {
  while (from < text.size() && text[from] == ' ') ++from;
  std::size_t end = from, best = 0;
  const auto is_word = [&](std::size_t k) { return k < text.size() && std::isalnum(static_cast<unsigned char>(text[k])); };
  while (end < text.size() && std::string_view("+-(),?:<>=!&|").find(text[end]) == std::string_view::npos) {
    ++end;
    // A power may be negative.
    if (text[end - 1] == '^' && end < text.size() && text[end] == '-') ++end;
    if (is_word(end - 1) && is_word(end)) continue;
    if (parse_unit(text.substr(from, end - from))) best = end - from;
  }
  return {from, best};
}

class Scanner {
 public:
  explicit Scanner(std::string_view text) : text_(text) {}

  std::optional<UnitTerms> run() {
    const Term all = choice();
    skip();
    if (at_ != text_.size()) throw NoExpression{};
    if (!found_) return std::nullopt;
    return UnitTerms{out_, all.kind == Term::known ? std::optional(all.dimension) : std::nullopt};
  }

 private:
  char peek() {
    skip();
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  void skip() {
    while (at_ < text_.size() && text_[at_] == ' ') out_ += text_[at_++];
  }
  bool take(std::string_view word) {
    skip();
    if (text_.substr(at_, word.size()) != word) return false;
    out_ += word;
    at_ += word.size();
    return true;
  }

  // ?: , the logic and comparisons below it as one level: what they compare must go together, the result is a plain number.
  Term choice() {
    // Brackets and signs lead back here.
    if (++depth_ > 200) throw NoExpression{};
    Term first = sum();
    for (bool more = true; more;) {
      more = false;
      for (const std::string_view word : {"||", "&&", "==", "!=", "<=", ">=", "<", ">"})
        if (take(word)) {
          together(first, sum());
          first = {};
          more = true;
          break;
        }
    }
    if (take("?")) {
      const Term yes = choice();
      if (!take(":")) throw NoExpression{};
      first = together(yes, choice());
    }
    --depth_;
    return first;
  }
  Term sum() {
    Term all = factors();
    while (peek() == '+' || peek() == '-') {
      out_ += text_[at_++];
      all = together(all, factors());
      all.whole.reset();
    }
    return all;
  }
  Term factors() {
    Term all = sign();
    while (peek() == '*' || peek() == '/') {
      const int way = text_[at_] == '*' ? 1 : -1;
      out_ += text_[at_++];
      all = product(all, sign(), way);
    }
    return all;
  }
  Term sign() {
    if (peek() == '-' || peek() == '+') {
      const bool minus = text_[at_] == '-';
      out_ += text_[at_++];
      if (++depth_ > 200) throw NoExpression{};
      Term one = sign();
      --depth_;
      if (one.whole && minus) one.whole = -*one.whole;
      return one;
    }
    const Term base = quantity();
    if (peek() != '^') return base;
    out_ += text_[at_++];
    return raised(base, sign());
  }

  // A number, name, call or bracket, and the unit behind it.
  Term quantity() {
    const char c = peek();
    const std::size_t begin = out_.size();
    Term one;
    if (std::isdigit(static_cast<unsigned char>(c)) || c == '.') one = number();
    else if (c == '(') one = bracket({});
    else if (std::isalpha(static_cast<unsigned char>(c)) || c == '_') return name();
    else throw NoExpression{};
    const std::size_t length = unit_length();
    if (length == 0) return one;
    const std::string_view word = text_.substr(at_, length);
    const Unit unit = *parse_unit(word);
    if (one.kind == Term::known) throw InputError(fmt::format("the unit {} stands behind what has a unit already", quote(word)));
    out_ = out_.substr(0, begin) + fmt::format("({}*{})", out_.substr(begin), unit.factor);
    at_ += length;
    found_ = true;
    return {Term::known, unit.dimension, {}};
  }

  Term number() {
    double value = 0.0;
    const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
    if (error != std::errc{}) throw NoExpression{};
    const auto length = static_cast<std::size_t>(end - text_.data()) - at_;
    out_ += text_.substr(at_, length);
    at_ += length;
    const bool whole = value >= 0.0 && value < 100.0 && value == static_cast<double>(static_cast<int>(value));
    return {Term::number, {}, whole ? std::optional(static_cast<int>(value)) : std::nullopt};
  }

  Term bracket(std::string_view called) {
    std::vector<Term> inside;
    if (!take("(")) throw NoExpression{};
    if (peek() != ')') do
        inside.push_back(choice());
      while (take(","));
    if (!take(")")) throw NoExpression{};
    if (!called.empty()) return function(called, inside);
    if (inside.size() != 1) throw NoExpression{};
    return inside.front();
  }

  Term name() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && (std::isalnum(static_cast<unsigned char>(text_[at_])) || text_[at_] == '_')) out_ += text_[at_++];
    const std::string_view word = text_.substr(begin, at_ - begin);
    if (peek() == '(') return bracket(word);
    if (word == "pi" || word == "e" || word == "_pi" || word == "_e") return {};
    return {Term::open, {}, {}};
  }

  // Of the unit that begins here (blanks before it are passed over where there is one).
  std::size_t unit_length() {
    const UnitInText unit = unit_from(text_, at_);
    if (unit.length > 0) at_ = unit.at;
    return unit.length;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int depth_ = 0;
  bool found_ = false;
  std::string out_;
};

}  // namespace

std::optional<UnitTerms> resolve_units(std::string_view text) {
  try {
    return Scanner(text).run();
  } catch (const NoExpression&) {
    return std::nullopt;
  }
}

namespace {

bool in_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }

// Does "*t" stand at k, with nothing behind it that belongs to the word?
bool times_time(std::string_view text, std::size_t k) {
  return text[k] == '*' && k + 1 < text.size() && text[k + 1] == 't' && (k + 2 == text.size() || !in_word(text[k + 2]));
}

// "90 deg * t" for "90 deg*t": where the time is known it is meant, not the tonne.
std::string time_apart(std::string_view text) {
  std::string out;
  for (std::size_t k = 0; k < text.size(); ++k)
    if (times_time(text, k)) out += " * ";
    else out += text[k];
  return out;
}

bool names_time(std::string_view text) {
  for (std::size_t k = 0; k < text.size(); ++k)
    if (text[k] == 't' && (k == 0 || !in_word(text[k - 1])) && (k + 1 == text.size() || !in_word(text[k + 1]))) return true;
  return false;
}

}  // namespace

std::optional<std::string> replace_units(std::string_view given, const char* unit) {
  const std::string text = time_apart(given);
  const std::optional<Unit> wanted = unit ? parse_unit(unit) : std::nullopt;
  if (const auto [number, behind] = split_unit(text); !behind.empty() && !resolve_units(number)) {
    // "t*90 deg": a unit behind the whole expression.
    const Unit whole = *parse_unit(behind);
    if (!names_time(number) || is_sum(number) || !wanted || !fits(whole.dimension, wanted->dimension)) return std::nullopt;
    return fmt::format("({})*{:.17g}", number, whole.factor / wanted->factor);
  }
  const std::optional<UnitTerms> terms = resolve_units(text);
  if (!terms) return std::nullopt;
  if (terms->dimension && wanted && !fits(*terms->dimension, wanted->dimension))
    throw InputError(fmt::format("its units do not make {}", *unit ? unit : "a plain number"));
  return terms->text;
}

std::vector<UnitInText> units_in(std::string_view given) {
  // No unit goes on over what it has in place of a '*' before the time.
  std::string text(given);
  for (std::size_t k = 0; k < text.size(); ++k)
    if (times_time(given, k)) text[k] = '|';
  std::vector<UnitInText> out;
  const auto is_digit = [&](std::size_t k) { return k < text.size() && std::isdigit(static_cast<unsigned char>(text[k])); };
  for (std::size_t at = 0; at < text.size();) {
    bool apart = false;
    if (is_digit(at) || (text[at] == '.' && is_digit(at + 1))) {
      double value = 0.0;
      at = static_cast<std::size_t>(std::from_chars(text.data() + at, text.data() + text.size(), value).ptr - text.data());
    } else if (in_word(text[at])) {
      // With its component: "tip.x", "joint.1".
      while (at < text.size() && (in_word(text[at]) || text[at] == '.')) ++at;
      apart = true;
    } else if (text[at++] != ')') {
      continue;
    }
    if (apart && (at >= text.size() || text[at] != ' ')) continue;
    const UnitInText unit = unit_from(text, at);
    if (unit.length == 0) continue;
    out.push_back(unit);
    at = unit.at + unit.length;
  }
  return out;
}

std::vector<UnitWord> unit_words(std::string_view text) {
  std::vector<UnitWord> out;
  for (const UnitInText& unit : units_in(text)) {
    char joined = '\0';
    for (std::size_t at = unit.at; at < unit.at + unit.length;) {
      if (!std::isalpha(static_cast<unsigned char>(text[at]))) {
        if (text[at] == '*' || text[at] == '/' || text[at] == ' ') joined = text[at];
        ++at;
        continue;
      }
      const std::size_t begin = at;
      while (at < unit.at + unit.length && std::isalpha(static_cast<unsigned char>(text[at]))) ++at;
      out.push_back({begin, at - begin, joined, unit});
    }
  }
  return out;
}

bool is_sum(std::string_view text) {
  int depth = 0;
  char before = '(';  // the last one that is no blank
  for (std::size_t k = 0; k < text.size(); ++k) {
    const char c = text[k];
    if (c == ' ') continue;
    if (c == '(') ++depth;
    if (c == ')') --depth;
    const bool exponent =
        (before == 'e' || before == 'E') && k >= 2 && (std::isdigit(static_cast<unsigned char>(text[k - 2])) || text[k - 2] == '.');
    if ((c == '+' || c == '-') && depth == 0 && !exponent && std::string_view("(*/^+-,?:<>=&|").find(before) == std::string_view::npos)
      return true;
    before = c;
  }
  return false;
}

}  // namespace flexframe::sim
