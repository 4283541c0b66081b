// Parser and evaluation; derivatives by forward differentiation of second order (Griewank, Walther: Evaluating Derivatives, 2008,
// chapter 13).
#include "sim/scene/expression.h"

#include "sim/base/words.h"
#include "sim/scene/expression_code.h"

#include <algorithm>
#include <charconv>
#include <map>

#include <fmt/format.h>

namespace flexframe::sim {

namespace expression {

namespace {

struct Jet {
  double v, d, dd;
  Jet() = default;  // no values: the stack is not cleared
  Jet(double value) : v(value), d(0.0), dd(0.0) {}
  Jet(double value, double first, double second) : v(value), d(first), dd(second) {}
  bool constant() const { return d == 0.0 && dd == 0.0; }
};

Jet operator+(const Jet& a, const Jet& b) { return {a.v + b.v, a.d + b.d, a.dd + b.dd}; }
Jet operator-(const Jet& a, const Jet& b) { return {a.v - b.v, a.d - b.d, a.dd - b.dd}; }
Jet operator-(const Jet& a) { return {-a.v, -a.d, -a.dd}; }
Jet operator*(const Jet& a, const Jet& b) { return {a.v * b.v, a.d * b.v + a.v * b.d, a.dd * b.v + 2.0 * a.d * b.d + a.v * b.dd}; }
Jet operator/(const Jet& a, const Jet& b) {
  const double v = a.v / b.v;
  const double d = (a.d - v * b.d) / b.v;
  return {v, d, (a.dd - 2.0 * d * b.d - v * b.dd) / b.v};
}

// f(u) from f, f', f'' at u.v; a constant has no derivatives even where f' is infinite
Jet chain(const Jet& u, double f, double f1, double f2) { return u.constant() ? Jet(f) : Jet(f, f1 * u.d, f2 * u.d * u.d + f1 * u.dd); }

Jet sin(const Jet& u) {
  const double s = std::sin(u.v);
  return chain(u, s, std::cos(u.v), -s);
}
Jet cos(const Jet& u) {
  const double c = std::cos(u.v);
  return chain(u, c, -std::sin(u.v), -c);
}
Jet tan(const Jet& u) {
  const double f = std::tan(u.v), f1 = 1.0 + f * f;
  return chain(u, f, f1, 2.0 * f * f1);
}
Jet asin(const Jet& u) {
  const double r = 1.0 / std::sqrt((1.0 - u.v) * (1.0 + u.v));
  return chain(u, std::asin(u.v), r, u.v * r * r * r);
}
Jet acos(const Jet& u) {
  const double r = 1.0 / std::sqrt((1.0 - u.v) * (1.0 + u.v));
  return chain(u, std::acos(u.v), -r, -u.v * r * r * r);
}
Jet atan(const Jet& u) {
  const double r = 1.0 / (1.0 + u.v * u.v);
  return chain(u, std::atan(u.v), r, -2.0 * u.v * r * r);
}
Jet sinh(const Jet& u) {
  const double s = std::sinh(u.v);
  return chain(u, s, std::cosh(u.v), s);
}
Jet cosh(const Jet& u) {
  const double c = std::cosh(u.v);
  return chain(u, c, std::sinh(u.v), c);
}
Jet tanh(const Jet& u) {
  const double f = std::tanh(u.v), c = 1.0 / std::cosh(u.v), f1 = c * c;  // 1 - f^2 would cancel
  return chain(u, f, f1, -2.0 * f * f1);
}
Jet asinh(const Jet& u) {
  const double r = 1.0 / std::hypot(1.0, u.v);
  return chain(u, std::asinh(u.v), r, -u.v * r * r * r);
}
Jet acosh(const Jet& u) {
  const double r = 1.0 / std::sqrt((u.v - 1.0) * (u.v + 1.0));
  return chain(u, std::acosh(u.v), r, -u.v * r * r * r);
}
Jet atanh(const Jet& u) {
  const double r = 1.0 / ((1.0 - u.v) * (1.0 + u.v));
  return chain(u, std::atanh(u.v), r, 2.0 * u.v * r * r);
}
Jet exp(const Jet& u) {
  const double f = std::exp(u.v);
  return chain(u, f, f, f);
}
Jet log(const Jet& u) { return chain(u, std::log(u.v), 1.0 / u.v, -1.0 / (u.v * u.v)); }
Jet log2(const Jet& u) { return chain(u, std::log2(u.v), M_LOG2E / u.v, -M_LOG2E / (u.v * u.v)); }
Jet log10(const Jet& u) { return chain(u, std::log10(u.v), M_LOG10E / u.v, -M_LOG10E / (u.v * u.v)); }
Jet sqrt(const Jet& u) {
  const double f = std::sqrt(u.v);
  return chain(u, f, 0.5 / f, -0.25 / (f * u.v));
}

Jet power(const Jet& a, const Jet& b) {
  if (b.constant() && b.v == 2.0) return a * a;
  const double f = std::pow(a.v, b.v);
  if (b.constant()) {
    // the vanishing factors first: 0 * pow(0, negative) is not a number
    const double c = b.v;
    return chain(a, f, c == 0.0 ? 0.0 : c * std::pow(a.v, c - 1.0), c == 0.0 || c == 1.0 ? 0.0 : c * (c - 1.0) * std::pow(a.v, c - 2.0));
  }
  const Jet exponent = b * log(a);
  return {f, f * exponent.d, f * (exponent.d * exponent.d + exponent.dd)};
}

double number_of(const Jet& u) { return u.v; }

Jet atan2_on_side(const Jet& y, const Jet& x, double side) {
  // the angle's rate is (x y' - y x') / r^2
  const Jet r2 = x * x + y * y;
  const Jet turn = Jet(x.v, x.d, 0.0) * Jet(y.d, y.dd, 0.0) - Jet(y.v, y.d, 0.0) * Jet(x.d, x.dd, 0.0);
  const Jet rate = turn / r2;
  return {expression::atan2_on_side(y.v, x.v, side), rate.v, rate.d};
}

double select_after(Op op, const Jet& a, const Jet& b) {
  const auto after = [](const Jet& x) { return x.v != 0.0 ? x.v : x.d != 0.0 ? x.d : x.dd; };
  switch (op) {
    case Op::truth:
    case Op::abs:
    case Op::sign:
      return select(op, after(a), 0.0);
    case Op::rint: {
      const bool falls_from_half = a.v - std::floor(a.v) == 0.5 && (a.d < 0.0 || (a.d == 0.0 && a.dd < 0.0));
      return falls_from_half ? std::floor(a.v) : select(op, a.v, 0.0);
    }
    case Op::atan2:
      return select(op, after(a), after(b));
    default:
      return a.v == b.v ? select(op, after(a - b), 0.0) : select(op, a.v, b.v);
  }
}

// Recursive descent over the text, one function a level of precedence; leaves postfix code.
class Compiler {
 public:
  Compiler(std::string_view text, std::vector<Expression::Instruction>& code, std::vector<Expression::Selector>& selectors,
           std::span<const std::string> names, std::vector<std::string>* used)
      : text_(text), code_(code), selectors_(selectors), names_(names), used_(used) {}

  static bool knows(std::string_view word) {
    for (const char* other : {"t", "pi", "_pi", "e", "_e", "atan2", "min", "max", "sum", "avg"})
      if (word == other) return true;
    return unary_functions().contains(word);
  }

  void compile() {
    if (text_.size() > longest_text) fail(fmt::format("the expression is longer than {} characters", longest_text));
    skip_space();
    if (at_end()) fail("the expression is empty");
    ternary();
    if (!at_end()) unexpected();
  }

 private:
  static constexpr std::size_t longest_text = 1'000'000;
  static constexpr int deepest_nesting = 500;

  // A value on the stack: is it surely 0 or 1?
  using IsTruth = bool;

  struct Nesting {
    Compiler& compiler;
    explicit Nesting(Compiler& c) : compiler(c) {
      if (++compiler.nesting_ > deepest_nesting) compiler.fail(fmt::format("nested deeper than {} levels", deepest_nesting));
    }
    ~Nesting() { --compiler.nesting_; }
    Nesting(const Nesting&) = delete;
    Nesting& operator=(const Nesting&) = delete;
  };

  [[noreturn]] void fail(const std::string& message) const { throw InputError(fmt::format("column {}: {}", position_ + 1, message)); }

  [[noreturn]] void unexpected() const {
    if (at_end()) fail("the expression ends too early; a number, t, a function or '(' is expected");
    const char c = text_[position_];
    if (c == ')') fail("')' without '('");
    if (c == ',') fail("',' outside a function's arguments");
    if (c == '=') fail("'=' is no operator here; to compare write '=='");
    if (c == '&' || c == '|') fail(fmt::format("'{0}' is no operator; write '{0}{0}'", c));
    if (c == '!') fail("'!' is no operator here; write '!=' or compare with == 0");
    fail(fmt::format("unexpected {}", quote(text_.substr(position_, 12))));
  }

  bool at_end() const { return position_ >= text_.size(); }
  void skip_space() {
    while (!at_end() && (text_[position_] == ' ' || text_[position_] == '\t' || text_[position_] == '\n' || text_[position_] == '\r'))
      ++position_;
  }
  bool next_is(std::string_view token) const { return text_.substr(position_).starts_with(token); }
  bool accept(std::string_view token) {
    if (!next_is(token)) return false;
    position_ += token.size();
    skip_space();
    return true;
  }

  int here() const { return static_cast<int>(code_.size()); }

  void push(Op op, double number = 0.0) {
    if (++depth_ > stack_size) fail(fmt::format("needs more than {} intermediate values; split it up", stack_size));
    code_.push_back({op, 0, number});
  }

  // Replaces two values by one; numbers are combined at once unless a jump lands between them.
  void binary(Op op) {
    --depth_;
    const std::size_t n = code_.size();
    if (n >= 2 && here() - 2 >= last_label_ && code_[n - 1].op == Op::number && code_[n - 2].op == Op::number) {
      const std::vector<Expression::Instruction> pair{code_[n - 2], code_[n - 1], {op, 0, 0.0}};
      const double folded = run(Piece(pair), 0.0, [](int, Op, double, double) { return 0.0; });
      code_.resize(n - 2);
      code_.push_back({Op::number, 0, folded});
    } else {
      code_.push_back({op, 0, 0.0});
    }
  }

  void select(Op op, int begin) {
    if (is_binary_selector(op)) --depth_;
    selectors_.push_back({begin, here(), op});
    code_.push_back({op, static_cast<int>(selectors_.size()) - 1, 0.0});
  }

  void make_truth(IsTruth truth, int begin) {
    if (!truth) select(Op::truth, begin);
  }

  IsTruth ternary() {
    const Nesting nesting(*this);
    const int begin = here();
    const IsTruth truth = either();
    if (!accept("?")) return truth;
    make_truth(truth, begin);
    const int to_else = here();
    code_.push_back({Op::jump_if_false, 0, 0.0});
    --depth_;
    ternary();
    if (!accept(":")) fail("':' is expected (condition ? value : value)");
    const int to_end = here();
    code_.push_back({Op::jump, 0, 0.0});
    --depth_;  // only one of the branches leaves its value
    code_[to_else].index = last_label_ = here();
    ternary();
    code_[to_end].index = last_label_ = here();
    return false;
  }

  IsTruth either() {
    const int begin = here();
    IsTruth truth = both();
    while (accept("||")) {
      make_truth(truth, begin);
      const int second = here();
      make_truth(both(), second);
      binary(Op::either);
      truth = true;
    }
    return truth;
  }

  IsTruth both() {
    const int begin = here();
    IsTruth truth = comparison();
    while (accept("&&")) {
      make_truth(truth, begin);
      const int second = here();
      make_truth(comparison(), second);
      binary(Op::both);
      truth = true;
    }
    return truth;
  }

  IsTruth comparison() {
    const int begin = here();
    IsTruth truth = sum();
    for (;;) {
      Op op;
      if (accept("<=")) op = Op::less_equal;
      else if (accept(">=")) op = Op::greater_equal;
      else if (accept("==")) op = Op::equal;
      else if (accept("!=")) op = Op::not_equal;
      else if (accept("<")) op = Op::less;
      else if (accept(">")) op = Op::greater;
      else return truth;
      sum();
      select(op, begin);
      truth = true;
    }
  }

  IsTruth sum() {
    IsTruth truth = product();
    for (;;) {
      Op op;
      if (accept("+")) op = Op::add;
      else if (accept("-")) op = Op::subtract;
      else return truth;
      product();
      binary(op);
      truth = false;
    }
  }

  IsTruth product() {
    IsTruth truth = signed_power();
    for (;;) {
      Op op;
      if (accept("*")) op = Op::multiply;
      else if (accept("/")) op = Op::divide;
      else return truth;
      signed_power();
      binary(op);
      truth = false;
    }
  }

  IsTruth signed_power() {
    const Nesting nesting(*this);
    if (accept("-")) {
      signed_power();
      if (code_.back().op == Op::number && here() - 1 >= last_label_) code_.back().number = -code_.back().number;
      else code_.push_back({Op::negate, 0, 0.0});
      return false;
    }
    if (accept("+")) return signed_power();
    const IsTruth truth = primary();
    if (!accept("^")) return truth;
    signed_power();
    binary(Op::power);
    return false;
  }

  IsTruth primary() {
    if (accept("(")) {
      const IsTruth truth = ternary();
      if (!accept(")")) fail("')' is expected");
      return truth;
    }
    if (at_end()) unexpected();
    const char c = text_[position_];
    if ((c >= '0' && c <= '9') || c == '.') return number();
    if (is_letter(c)) return name();
    unexpected();
  }

  static bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

  IsTruth number() {
    double value = 0.0;
    const char* begin = text_.data() + position_;
    const auto [end, error] = std::from_chars(begin, text_.data() + text_.size(), value);
    if (error == std::errc::result_out_of_range) fail("a number is too large or too small");
    if (error != std::errc{}) unexpected();
    position_ += end - begin;
    if (!at_end() && (is_letter(text_[position_]) || text_[position_] == '.'))
      fail(fmt::format("an operator is missing after the number (write 2*t, not 2t), found {}", quote(text_.substr(position_, 12))));
    skip_space();
    push(Op::number, value);
    return value == 0.0 || value == 1.0;
  }

  // The longest name of a variable that stands here, alone; empty: none.
  std::string_view variable_here() const {
    std::string_view best;
    for (const std::string& name : names_) {
      if (name.size() <= best.size() || !next_is(name)) continue;
      const std::size_t end = position_ + name.size();
      const bool goes_on = end < text_.size() && (is_letter(text_[end]) || (text_[end] >= '0' && text_[end] <= '9'));
      if (!goes_on) best = name;
    }
    return best;
  }

  void variable(std::string_view name) {
    position_ += name.size();
    skip_space();
    const auto known = std::find(used_->begin(), used_->end(), name);
    const int index = static_cast<int>(known - used_->begin());
    if (known == used_->end()) used_->emplace_back(name);
    push(Op::variable);
    code_.back().index = index;
  }

  IsTruth name() {
    const std::size_t begin = position_;
    std::size_t end = position_;
    while (end < text_.size() && (is_letter(text_[end]) || (text_[end] >= '0' && text_[end] <= '9'))) ++end;
    const std::string word(text_.substr(begin, end - begin));
    const bool own = word == "t" || word == "pi" || word == "_pi" || word == "e" || word == "_e";
    std::size_t next = end;
    while (next < text_.size() && text_[next] == ' ') ++next;
    const bool called = next < text_.size() && text_[next] == '(';
    if (const std::string_view name = variable_here(); !name.empty() && ((!own && !called) || name.size() > word.size())) {
      variable(name);
      return false;
    }
    position_ = end;
    skip_space();
    if (next_is("(")) {
      function(word, begin);
      return false;
    }
    if (word == "t") push(Op::time);
    else if (word == "pi" || word == "_pi") push(Op::number, M_PI);
    else if (word == "e" || word == "_e") push(Op::number, M_E);
    else {
      position_ = begin;
      std::vector<std::string> known = names();
      known.insert(known.end(), names_.begin(), names_.end());
      const std::string hint = did_you_mean(word, known);
      fail(fmt::format("{} is unknown{}{} allowed: {}", quote(word), hint, hint.empty() ? ";" : "", list_words(known)));
    }
    return false;
  }

  static const std::map<std::string, Op, std::less<>>& unary_functions() {
    static const std::map<std::string, Op, std::less<>> functions{
        {"sin", Op::sin},   {"cos", Op::cos},   {"tan", Op::tan},   {"asin", Op::asin},   {"acos", Op::acos},   {"atan", Op::atan},
        {"sinh", Op::sinh}, {"cosh", Op::cosh}, {"tanh", Op::tanh}, {"asinh", Op::asinh}, {"acosh", Op::acosh}, {"atanh", Op::atanh},
        {"exp", Op::exp},   {"ln", Op::ln},     {"log", Op::ln},    {"log2", Op::log2},   {"log10", Op::log10}, {"sqrt", Op::sqrt},
        {"abs", Op::abs},   {"sign", Op::sign}, {"rint", Op::rint}};
    return functions;
  }

  static std::vector<std::string> names() {
    std::vector<std::string> known{"t", "pi", "e"};
    for (const auto& entry : unary_functions()) known.push_back(entry.first);
    for (const char* word : {"atan2", "min", "max", "sum", "avg"}) known.emplace_back(word);
    return known;
  }

  void function(const std::string& word, std::size_t at) {
    accept("(");
    const int begin = here();
    const auto unary = unary_functions().find(word);
    const bool many = word == "min" || word == "max" || word == "sum" || word == "avg";
    if (unary == unary_functions().end() && !many && word != "atan2") {
      position_ = at;
      const std::vector<std::string> known = names();
      const std::string hint = did_you_mean(word, known);
      fail(fmt::format("the function {} is unknown{}{} allowed: {}", quote(word), hint, hint.empty() ? ";" : "", list_words(known)));
    }
    // arguments are combined as they come
    int count = 0;
    if (!next_is(")")) {
      do {
        ternary();
        ++count;
        if (count > 1 && (word == "sum" || word == "avg")) binary(Op::add);
        if (count > 1 && word == "min") select(Op::min, begin);
        if (count > 1 && word == "max") select(Op::max, begin);
        if (!many && count > (word == "atan2" ? 2 : 1)) break;
      } while (accept(","));
    }
    const int wanted = word == "atan2" ? 2 : 1;
    if ((!many && count != wanted) || count == 0) {
      position_ = at;
      fail(fmt::format("'{}' takes {}, found {}", word,
                       many          ? "one or more arguments"
                       : wanted == 1 ? "one argument"
                                     : "two arguments",
                       count > wanted ? "more" : fmt::format("{}", count)));
    }
    if (!accept(")")) fail(fmt::format("')' is expected after the arguments of '{}'", word));
    if (word == "avg") {
      push(Op::number, count);
      binary(Op::divide);
    } else if (word == "atan2") {
      select(Op::atan2, begin);
    } else if (!many) {
      if (is_selector(unary->second)) select(unary->second, begin);
      else code_.push_back({unary->second, 0, 0.0});
    }
  }

  std::string_view text_;
  std::vector<Expression::Instruction>& code_;
  std::vector<Expression::Selector>& selectors_;
  std::span<const std::string> names_;
  std::vector<std::string>* used_;
  std::size_t position_ = 0;
  int depth_ = 0, nesting_ = 0;
  int last_label_ = 0;
};

}  // namespace

bool is_word(std::string_view name) { return Compiler::knows(name); }

void compile(std::string_view text, std::vector<Expression::Instruction>& code, std::vector<Expression::Selector>& selectors,
             std::span<const std::string> names, std::vector<std::string>* used) {
  Compiler(text, code, selectors, names, used).compile();
}

void choices_after(const Piece& code, double t, std::vector<double>& choices) {
  run(code, Jet(t, 1.0, 0.0), [&](int index, Op op, const Jet& a, const Jet& b) { return choices[index] = select_after(op, a, b); });
}

}  // namespace expression

using expression::Piece, expression::run;

Expression::Expression(double constant) : text_(fmt::format("{}", constant)), code_{{Op::number, 0, constant}} {}

Expression::Expression(std::string_view text) : Expression(text, std::span<const std::string>()) {}

Expression::Expression(std::string_view text, std::span<const std::string> names) : text_(text) {
  expression::compile(text, code_, selectors_, names, &variables_);
  constant_ = std::none_of(code_.begin(), code_.end(), [](const Instruction& i) { return i.op == Op::time || i.op == Op::variable; });
  for (std::size_t s = 0; s < selectors_.size(); ++s)
    if (std::any_of(code_.begin() + selectors_[s].begin, code_.begin() + selectors_[s].end,
                    [](const Instruction& i) { return i.op == Op::variable; }))
      state_selectors_.push_back(static_cast<int>(s));
  if (constant_) {
    const double number = run(Piece(code_), 0.0, [](int, Op op, double a, double b) { return expression::select(op, a, b); });
    if (!std::isfinite(number)) throw InputError(fmt::format("its value is {}, which is not finite", number));
  }
}

bool Expression::depends_on_time() const {
  return std::any_of(code_.begin(), code_.end(), [](const Instruction& i) { return i.op == Op::time; });
}

void Expression::freeze(double t_inside) {
  // selectors in a branch that is not taken keep 0; the branch cannot be taken while its condition is frozen
  std::vector<double> chosen(selectors_.size(), 0.0);
  if (variables_.empty()) {
    expression::choices_after(Piece(code_), t_inside, chosen);
  } else {
    // Which branch is taken the state tells: each by itself, those that read variables stay as they are.
    if (!frozen_.empty()) chosen = frozen_;
    std::size_t by_state = 0;
    for (std::size_t s = 0; s < selectors_.size(); ++s) {
      const bool here = by_state < state_selectors_.size() && state_selectors_[by_state] == static_cast<int>(s);
      if (!here) expression::choices_after(Piece(code_, selectors_[s].begin, selectors_[s].end + 1), t_inside, chosen);
      by_state += here;
    }
  }
  frozen_ = std::move(chosen);
}

namespace {

[[noreturn]] void not_finite(double t, const std::string& text, const char* what, double found) {
  throw SimulationError(fmt::format("the expression {} has {} {} at t = {} s", quote(text), what, found, t));
}

}  // namespace

double Expression::value(double t) const {
  const double result = frozen_.empty() ? run(Piece(code_), t, [](int, Op op, double a, double b) { return expression::select(op, a, b); })
                                        : run(Piece(code_), t, [this](int index, Op, double, double) { return frozen_[index]; });
  if (!std::isfinite(result)) not_finite(t, text_, "the value", result);
  return result;
}

TimeJet Expression::jet(double t) const {
  // A number times t, as motions most often are.
  if (code_.size() == 3 && code_[0].op == Op::number && code_[1].op == Op::time && code_[2].op == Op::multiply) {
    const double speed = code_[0].number;
    if (std::isfinite(speed * t)) return {speed * t, speed, 0.0};
  }
  const expression::Jet time(t, 1.0, 0.0);
  using expression::Jet;
  const Jet result = frozen_.empty()
                         ? run(Piece(code_), time, [](int, Op op, const Jet& a, const Jet& b) { return expression::select(op, a.v, b.v); })
                         : run(Piece(code_), time, [this](int index, Op, const Jet&, const Jet&) { return frozen_[index]; });
  if (!std::isfinite(result.v)) not_finite(t, text_, "the value", result.v);
  if (!std::isfinite(result.d)) not_finite(t, text_, "the first derivative", result.d);
  if (!std::isfinite(result.dd)) not_finite(t, text_, "the second derivative", result.dd);
  return {result.v, result.d, result.dd};
}

namespace {

// A comparison of numbers this close, relative to their size, takes them as equal once it has.
constexpr double still_equal = 1e-12;

// How far the operands are from where a selector that is held at `chosen` ends.
double distance_to_change(expression::Op op, double chosen, double a, double b) {
  const double equal = still_equal * std::max({std::abs(a), std::abs(b), 1e-300});
  switch (op) {
    case expression::Op::less:
    case expression::Op::less_equal:
    case expression::Op::max:
      return chosen != 0.0 ? b - a : a - b;
    case expression::Op::greater:
    case expression::Op::greater_equal:
    case expression::Op::min:
      return chosen != 0.0 ? a - b : b - a;
    case expression::Op::equal:
      return chosen != 0.0 ? equal - std::abs(a - b) : 1.0;
    case expression::Op::not_equal:
      return chosen == 0.0 ? equal - std::abs(a - b) : 1.0;
    case expression::Op::truth:
      return 1.0;
    case expression::Op::abs:
    case expression::Op::sign:
      return chosen == 0.0 ? -std::abs(a) : chosen * a;
    case expression::Op::rint:
      return 0.5 - std::abs(a - chosen);
    default:
      // atan2 beside its cut; where it was chosen off the cut, by the side on which it comes to it.
      if (b >= 0.0) return std::hypot(a, b) + b;
      return chosen != 0.0 ? chosen * a : -1e-300;
  }
}

// What a selector is held at beyond that end.
double next_choice(expression::Op op, double chosen, double a, double b) {
  switch (op) {
    case expression::Op::abs:
      return -chosen;
    case expression::Op::sign:
      return chosen == 0.0 ? expression::select(op, a, b) : -chosen;
    case expression::Op::rint:
      return chosen + (a > chosen ? 1.0 : -1.0);
    case expression::Op::atan2:
      return chosen == 0.0 ? expression::select(op, a, b) : -chosen;
    default:
      return chosen == 0.0 ? 1.0 : 0.0;
  }
}

// What a selector chooses where what it is held at leads to no number: those that the motion switches what they see there.
double beyond(const std::vector<int>& by_state, const std::vector<double>& held, int index, expression::Op op, double a, double b) {
  return std::binary_search(by_state.begin(), by_state.end(), index) ? expression::select(op, a, b) : held[index];
}

}  // namespace

double Expression::value(double t, const double* variables) const {
  double* const none = nullptr;
  double result = frozen_.empty()
                      ? run(
                            Piece(code_), t, [](int, Op op, double a, double b) { return expression::select(op, a, b); }, none, variables)
                      : run(
                            Piece(code_), t, [this](int index, Op, double, double) { return frozen_[index]; }, none, variables);
  // Beyond the end of its piece a power or root may have no value ("abs(v)^1.7" once v has changed its sign): that of the next piece.
  if (!std::isfinite(result) && !frozen_.empty())
    result = run(
        Piece(code_), t, [this](int i, Op op, double a, double b) { return beyond(state_selectors_, frozen_, i, op, a, b); }, none,
        variables);
  if (!std::isfinite(result)) not_finite(t, text_, "the value", result);
  return result;
}

// Selectors inside the operands of another stand before it; those in a branch that is not taken are held too, for when it is.
void Expression::hold(double t, const double* variables) { pass(std::vector<bool>(state_selectors_.size(), false), t, variables); }

void Expression::pass(const std::vector<bool>& ended, double t, const double* variables) {
  // Those that read t alone keep what freeze() gave them: right at their time the numbers do not tell the piece that begins there.
  const bool timed = !frozen_.empty();
  std::vector<double> chosen = timed ? frozen_ : std::vector<double>(selectors_.size(), 0.0);
  std::size_t by_state = 0;
  for (std::size_t s = 0; s < selectors_.size(); ++s) {
    const bool here = by_state < state_selectors_.size() && state_selectors_[by_state] == static_cast<int>(s);
    if (here || !timed) {
      const auto [a, b] = operands(s, chosen, t, variables);
      const bool over = here && ended[by_state];
      chosen[s] = over ? next_choice(selectors_[s].op, frozen_[s], a, b) : expression::select(selectors_[s].op, a, b);
    }
    by_state += here;
  }
  frozen_ = std::move(chosen);
}

std::pair<double, double> Expression::operands(std::size_t s, const std::vector<double>& held, double t, const double* variables) const {
  const Selector& selector = selectors_[s];
  const bool two = expression::is_binary_selector(selector.op);
  double first = 0.0;
  double last = run(
      Piece(code_, selector.begin, selector.end), t, [&](int i, Op, double, double) { return held[i]; }, two ? &first : nullptr, variables);
  if (!std::isfinite(last) || !std::isfinite(first))
    last = run(
        Piece(code_, selector.begin, selector.end), t,
        [&](int i, Op op, double a, double b) { return beyond(state_selectors_, held, i, op, a, b); }, two ? &first : nullptr, variables);
  return two ? std::pair(first, last) : std::pair(last, 0.0);
}

double Expression::margin(int k, double t, const double* variables) const {
  if (frozen_.empty()) {
    Expression held = *this;
    held.hold(t, variables);
    return held.margin(k, t, variables);
  }
  const std::size_t s = state_selectors_[k];
  const auto [a, b] = operands(s, frozen_, t, variables);
  return distance_to_change(selectors_[s].op, frozen_[s], a, b);
}

}  // namespace flexframe::sim
