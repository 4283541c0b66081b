// The instructions of compiled expressions and the stack machine that runs them on numbers, jets or intervals; private to
// expression.cpp and expression_switches.cpp.
#pragma once

#include "sim/scene/expression.h"

#include <array>
#include <cmath>

namespace flexframe::sim {

enum class Expression::Op : std::uint8_t {
  number,
  time,
  variable,  // index: which
  add,
  subtract,
  multiply,
  divide,
  power,
  negate,
  sin,
  cos,
  tan,
  asin,
  acos,
  atan,
  sinh,
  cosh,
  tanh,
  asinh,
  acosh,
  atanh,
  exp,
  ln,
  log2,
  log10,
  sqrt,
  both,
  either,  // && and || of two truths
  jump_if_false,
  jump,
  // selectors
  less,
  less_equal,
  greater,
  greater_equal,
  equal,
  not_equal,
  truth,
  abs,
  sign,
  rint,
  min,
  max,
  atan2
};

namespace expression {

// Whether a name means something in the language: t, a constant, a function.
bool is_word(std::string_view name);

using Op = Expression::Op;

// Deepest stack an expression may need; the parser refuses more.
inline constexpr int stack_size = 64;

inline bool is_comparison(Op op) { return op >= Op::less && op <= Op::not_equal; }
inline bool is_selector(Op op) { return op >= Op::less; }
// Selectors with two operands; the others have one.
inline bool is_binary_selector(Op op) { return is_comparison(op) || op == Op::min || op == Op::max || op == Op::atan2; }

// What a selector chooses from its operands. atan2(y, x): which side of the cut along x < 0, 0 off the cut.
inline double select(Op op, double a, double b) {
  switch (op) {
    case Op::less:
      return a < b;
    case Op::less_equal:
      return a <= b;
    case Op::greater:
      return a > b;
    case Op::greater_equal:
      return a >= b;
    case Op::equal:
      return a == b;
    case Op::not_equal:
      return a != b;
    case Op::truth:
      return a != 0.0;
    case Op::abs:
      return std::signbit(a) ? -1.0 : 1.0;
    case Op::sign:
      return static_cast<double>((a > 0.0) - (a < 0.0));
    case Op::rint:
      return std::floor(a) + (a - std::floor(a) >= 0.5);  // halves go up, as in muParser
    case Op::min:
      return b < a;
    case Op::max:
      return b > a;
    case Op::atan2:
      return b < 0.0 ? (std::signbit(a) ? -1.0 : 1.0) : 0.0;
    default:
      return 0.0;
  }
}

inline double number_of(double x) { return x; }
// atan2 continued across its cut on the side that was chosen.
inline double atan2_on_side(double y, double x, double side) {
  const double angle = std::atan2(y, x);
  if (side > 0.0 && angle < 0.0) return angle + 2.0 * M_PI;
  if (side < 0.0 && angle > 0.0) return angle - 2.0 * M_PI;
  return angle;
}

inline double power(double a, double b) { return b == 2.0 ? a * a : std::pow(a, b); }

// Instructions [begin, end) of a compiled text; jumps inside count from the text's first one.
struct Piece {
  explicit Piece(const std::vector<Expression::Instruction>& code) : Piece(code, 0, static_cast<int>(code.size())) {}
  Piece(const std::vector<Expression::Instruction>& code, int first, int last) : all(code), begin(first), end(last) {}
  const std::vector<Expression::Instruction>& all;
  int begin, end;
};

// Runs the piece on a stack of T and returns its top; with `below`, the value under the top goes there.
// Long: one case an instruction. `selector(index, op, a, b)` answers what the selector chooses. T needs the arithmetic operators and the
// free functions used here, found in T's namespace or std.
template <class T, class Select, class Variable = double>
T run(const Piece& code, const T& t, Select&& selector, T* below = nullptr, const Variable* variables = nullptr) {
  using std::sin, std::cos, std::tan, std::asin, std::acos, std::atan, std::sinh, std::cosh, std::tanh, std::asinh, std::acosh, std::atanh,
      std::exp, std::log, std::log2, std::log10, std::sqrt;
  std::array<T, stack_size> stack;
  int top = -1;
  for (int i = code.begin; i < code.end; ++i) {
    const Expression::Instruction& now = code.all[i];
    const auto binary = [&]() -> T& {
      --top;
      return stack[top];
    };
    T& a = stack[top < 0 ? 0 : top];  // the top
    switch (now.op) {
      case Op::number:
        stack[++top] = T(now.number);
        break;
      case Op::time:
        stack[++top] = t;
        break;
      case Op::variable:
        stack[++top] = variables ? T(variables[now.index]) : T(0.0);
        break;
      case Op::add: {
        T& left = binary();
        left = left + a;
        break;
      }
      case Op::subtract: {
        T& left = binary();
        left = left - a;
        break;
      }
      case Op::multiply: {
        T& left = binary();
        left = left * a;
        break;
      }
      case Op::divide: {
        T& left = binary();
        left = left / a;
        break;
      }
      case Op::power: {
        T& left = binary();
        left = power(left, a);
        break;
      }
      case Op::negate:
        a = -a;
        break;
      case Op::sin:
        a = sin(a);
        break;
      case Op::cos:
        a = cos(a);
        break;
      case Op::tan:
        a = tan(a);
        break;
      case Op::asin:
        a = asin(a);
        break;
      case Op::acos:
        a = acos(a);
        break;
      case Op::atan:
        a = atan(a);
        break;
      case Op::sinh:
        a = sinh(a);
        break;
      case Op::cosh:
        a = cosh(a);
        break;
      case Op::tanh:
        a = tanh(a);
        break;
      case Op::asinh:
        a = asinh(a);
        break;
      case Op::acosh:
        a = acosh(a);
        break;
      case Op::atanh:
        a = atanh(a);
        break;
      case Op::exp:
        a = exp(a);
        break;
      case Op::ln:
        a = log(a);
        break;
      case Op::log2:
        a = log2(a);
        break;
      case Op::log10:
        a = log10(a);
        break;
      case Op::sqrt:
        a = sqrt(a);
        break;
      // truths are the numbers 0 and 1
      case Op::both: {
        T& left = binary();
        left = left * a;
        break;
      }
      case Op::either: {
        T& left = binary();
        left = left + a - left * a;
        break;
      }
      case Op::jump_if_false:
        --top;
        if (number_of(a) == 0.0) i = now.index - 1;
        break;
      case Op::jump:
        i = now.index - 1;
        break;
      default: {
        // a selector: replace its operands by what it chose
        T operand = a;
        if (is_binary_selector(now.op)) {
          T& left = binary();
          const double chosen = selector(now.index, now.op, left, operand);
          if (now.op == Op::min || now.op == Op::max) {
            if (chosen != 0.0) left = operand;
          } else if (now.op == Op::atan2) {
            left = atan2_on_side(left, operand, chosen);
          } else {
            left = T(chosen);
          }
        } else {
          const double chosen = selector(now.index, now.op, operand, operand);
          if (now.op == Op::abs) a = chosen < 0.0 ? -operand : operand;
          else a = T(chosen);
        }
      }
    }
  }
  if (below) *below = stack[top - 1];
  return stack[top];
}

// What the selectors in a piece choose right after t: where a threshold is met exactly, the derivatives decide.
// Entries of selectors in branches that are not taken stay as they are.
void choices_after(const Piece& code, double t, std::vector<double>& choices);

// Compiles a text; throws InputError as Expression does. names: of what it may read; used: those that it reads, numbered as the code does.
void compile(std::string_view text, std::vector<Expression::Instruction>& code, std::vector<Expression::Selector>& selectors,
             std::span<const std::string> names = {}, std::vector<std::string>* used = nullptr);

}  // namespace expression

}  // namespace flexframe::sim
