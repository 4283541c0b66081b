// Expressions: the language against muParser, derivatives against analysis, switch times against arithmetic.
#include "sim/scene/expression.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <random>

#include <fmt/format.h>
#include <muParser.h>

namespace flexframe::sim::test_expression {

namespace {

// muParser with t, pi and e, the language's reference.
struct Reference {
  mu::Parser parser;
  double t = 0.0;
  Reference() {
    parser.DefineVar("t", &t);
    parser.DefineConst("pi", M_PI);
    parser.DefineConst("e", M_E);
  }
  double value(const std::string& text, double at) {
    t = at;
    parser.SetExpr(text);
    return parser.Eval();
  }
};

double value_or_nan(const Expression& expression, double t) {
  try {
    return expression.value(t);
  } catch (const SimulationError&) {
    return std::nan("");
  }
}

// Random texts of the language; `depth` bounds them.
class Writer {
 public:
  explicit Writer(unsigned seed) : random_(seed) {}

  std::string any(int depth) {
    if (depth == 0) return leaf();
    switch (pick(14)) {
      case 0:
      case 1:
        return join({any(depth - 1), " + ", any(depth - 1)});
      case 2:
        return join({any(depth - 1), "-", any(depth - 1)});
      case 3:
      case 4:
        return join({any(depth - 1), "*", any(depth - 1)});
      case 5:
        return join({any(depth - 1), "/", any(depth - 1)});
      case 6:
        return join({"(", any(depth - 1), ")"});
      case 7:
        return join({leaf(), "^", word({"2", "3", "-1", "0.5", "2^0.5", "-t", "(1+t)"})});
      case 8:
        return join({"-(", any(depth - 1), ")"});  // muParser refuses --
      case 9:
        return join({word({"sin",   "cos", "tan", "asin", "acos", "atan",  "sinh", "cosh", "tanh", "asinh", "acosh",
                           "atanh", "exp", "ln",  "log",  "log2", "log10", "sqrt", "abs",  "sign", "rint"}),
                     "(", any(depth - 1), ")"});
      case 10:
        return join({word({"min", "max", "sum", "avg"}), "(", any(depth - 1), ", ", any(depth - 1), ",", any(depth - 1), ")"});
      case 11:
        return join({"(", any(depth - 1), word({"<", "<=", ">", ">=", "==", "!="}), any(depth - 1), " ? ", any(depth - 1), " : ",
                     any(depth - 1), ")"});
      case 12:
        return join({"((", any(depth - 1), " < ", leaf(), word({"&&", "||"}), leaf(), " > ", any(depth - 1), ") ? ", leaf(), ":",
                     any(depth - 1), ")"});
      default:
        return join({"atan2(", any(depth - 1), ",", leaf(), ")"});
    }
  }

 private:
  // Of a list in braces the elements are made from left to right by every compiler; the operands of + are not.
  static std::string join(std::initializer_list<std::string> parts) {
    std::string all;
    for (const std::string& part : parts) all += part;
    return all;
  }
  int pick(int count) { return static_cast<int>(random_() % static_cast<unsigned>(count)); }
  std::string word(const std::vector<std::string>& words) { return words[static_cast<std::size_t>(pick(static_cast<int>(words.size())))]; }
  std::string leaf() { return pick(2) ? "t" : word({"1", "2.5", "0.1", "3e-1", "pi", "e", ".5", "7", "1e2"}); }

  std::mt19937 random_;
};

std::string message_of(const std::string& text) {
  try {
    const Expression expression(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "(no error)";
}

}  // namespace

TEST(Expression, PrecedenceIsMuParsers) {
  Reference reference;
  for (const char* text : {"-2^2",
                           "2^3^2",
                           "2^-2",
                           "-t^2",
                           "2*-3",
                           "1-2-3",
                           "8/4/2",
                           "2^-1^2",
                           "1+2*3^2",
                           "1 < 2 == 1",
                           "3 > 2 > 1",
                           "1 == 1 && 0 || 1",
                           "0 && 0 || 1",
                           "1 || 0 && 0",
                           "t < 1 ? 2 : 3",
                           "t > 1 ? 2 : t > 0.2 ? 5 : 3",
                           "t > 1 ? t > 2 ? 1 : 2 : 3",
                           "1 ? 2 : 3 + 4",
                           "(t<1)*5",
                           "2 && 3",
                           "2 || 0",
                           "1 + (t<1 ? 2 : 3)*2",
                           "avg(1,2,6)",
                           "sum(1,2,3)",
                           "min(3,1,2)",
                           "max(3)",
                           "log(e)",
                           "ln(e^2)",
                           "log10(1000)",
                           "log2(8)",
                           "rint(2.5)",
                           "rint(-0.5)",
                           "sign(-3)",
                           "sign(0)",
                           "abs(-t)",
                           "atan2(1,-1)",
                           "1e3*t",
                           ".5+5.",
                           "t<=0.3",
                           "t==0.3",
                           "t!=0.3",
                           "(1 < 2) + 1",
                           "+3",
                           "2-+3",
                           "t < 1 && t > 0 ? 7 : 8"})
    EXPECT_EQ(Expression(text).value(0.3), reference.value(text, 0.3)) << text;
}

TEST(Expression, RandomTextsHaveMuParsersValue) {
  Writer writer(1);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> times(-2.0, 2.0);
  Reference reference;
  int finite = 0;
  for (int i = 0; i < 4000; ++i) {
    const std::string text = writer.any(1 + i % 4);
    double expected = 0.0;
    const double t = times(random);
    try {
      expected = reference.value(text, t);
    } catch (const mu::ParserError& error) {
      ADD_FAILURE() << text << ": " << error.GetMsg();
      continue;
    }
    double found = 0.0;
    try {
      found = value_or_nan(Expression(text), t);
    } catch (const InputError&) {
      found = std::nan("");  // a constant that is not finite
    }
    if (!std::isfinite(expected)) {
      EXPECT_FALSE(std::isfinite(found)) << text << " at " << t;
      continue;
    }
    ++finite;
    EXPECT_NEAR(found, expected, 1e-9 * (1.0 + std::abs(expected))) << text << " at " << t;
  }
  EXPECT_GT(finite, 2500);
}

TEST(Expression, ConstantsAreKnown) {
  EXPECT_TRUE(Expression("2*pi/3").constant());
  EXPECT_TRUE(Expression(4.5).constant());
  EXPECT_EQ(Expression(0.1).text(), "0.1");
  EXPECT_EQ(Expression(Expression(0.1).text()).value(0.0), 0.1);
  EXPECT_FALSE(Expression("0*t").constant());
  EXPECT_EQ(Expression("_pi + _e").value(0.0), M_PI + M_E);
  EXPECT_EQ(Expression().value(3.0), 0.0);
}

TEST(Expression, WrongTexts) {
  const std::pair<const char*, const char*> cases[] = {
      {"", "column 1: the expression is empty"},
      {"   ", "the expression is empty"},
      {"2*", "column 3: the expression ends too early"},
      {"2t", "column 2: an operator is missing after the number"},
      {"sin t", "'sin' is unknown"},
      {"sine(t)", "column 1: the function 'sine' is unknown; did you mean 'sin'?"},
      {"2 + x", "column 5: 'x' is unknown"},
      {"(t", "column 3: ')' is expected"},
      {"t)", "column 2: ')' without '('"},
      {"sin()", "'sin' takes one argument, found 0"},
      {"sin(t, 2)", "'sin' takes one argument, found more"},
      {"atan2(t)", "'atan2' takes two arguments, found 1"},
      {"min()", "'min' takes one or more arguments"},
      {"t = 3", "column 3: '=' is no operator here; to compare write '=='"},
      {"t & 1", "'&' is no operator; write '&&'"},
      {"!t", "'!' is no operator here"},
      {"t ? 1", "':' is expected"},
      {"1, 2", "',' outside a function's arguments"},
      {"t $ 2", "unexpected '$ 2'"},
      {"1e999", "a number is too large"},
      {"1/0", "its value is inf, which is not finite"},
      {"sqrt(-1)", "which is not finite"},
      {"1..2", "an operator is missing after the number"},
      {"t\xff", "unexpected '\\xff'"},
  };
  for (const auto& [text, expected] : cases)
    EXPECT_NE(message_of(text).find(expected), std::string::npos) << text << "\n" << message_of(text);
}

TEST(Expression, HugeTextsAreRefusedNotFollowed) {
  EXPECT_NE(message_of(std::string(100000, '(')).find("nested deeper"), std::string::npos);
  EXPECT_NE(message_of(std::string(100000, '-') + "1").find("nested deeper"), std::string::npos);
  EXPECT_NE(message_of(std::string(2'000'000, '1')).find("longer than"), std::string::npos);
  std::string powers = "2", right = "t";
  for (int i = 0; i < 100000; ++i) powers += "^1";
  EXPECT_NE(message_of(powers).find("intermediate values"), std::string::npos);
  for (int i = 0; i < 200; ++i) right = "t+(" + right + ")";
  EXPECT_NE(message_of(right).find("intermediate values"), std::string::npos);
  // long but flat texts are fine
  std::string sum = "t";
  for (int i = 0; i < 50000; ++i) sum += "+t";
  EXPECT_EQ(Expression(sum).value(1.0), 50001.0);
  std::string table = "0";
  for (int i = 300; i > 0; --i) table = fmt::format("t < {} ? {} : {}", i, i, i == 300 ? "0" : "(" + table + ")");
  EXPECT_EQ(Expression("t < 1 ? 1 : t < 2 ? 2 : t < 3 ? 3 : 4").value(2.5), 3.0);
}

TEST(Expression, NotFiniteValuesAreNamed) {
  try {
    Expression("1/(t - 1)").value(1.0);
    FAIL();
  } catch (const SimulationError& error) {
    EXPECT_NE(std::string(error.what()).find("'1/(t - 1)' has the value inf at t = 1 s"), std::string::npos) << error.what();
  }
  EXPECT_THROW(Expression("sqrt(t)").jet(0.0), SimulationError);
  EXPECT_THROW(Expression("log(t)").value(-1.0), SimulationError);
}

// Derivatives against analysis over eight decades of time scale.
TEST(ExpressionJet, AgreesWithAnalysis) {
  struct Law {
    const char* text;
    std::function<TimeJet(double)> exact;
  };
  const double w = 2.0 * M_PI;
  const std::vector<Law> laws = {
      {"150*t",
       [](double t) {
         return TimeJet{150.0 * t, 150.0, 0.0};
       }},
      {"3*t^2 - 2*t + 1",
       [](double t) {
         return TimeJet{3.0 * t * t - 2.0 * t + 1.0, 6.0 * t - 2.0, 6.0};
       }},
      {"t^3.5",
       [](double t) {
         return TimeJet{std::pow(t, 3.5), 3.5 * std::pow(t, 2.5), 8.75 * std::pow(t, 1.5)};
       }},
      {"0.4*(t^2/2 + (15/(2*pi))^2*(cos(2*pi*t/15) - 1))",
       [](double t) {
         const double k = 2.0 * M_PI / 15.0;
         return TimeJet{0.4 * (t * t / 2.0 + (std::cos(k * t) - 1.0) / (k * k)), 0.4 * (t - std::sin(k * t) / k),
                        0.4 * (1.0 - std::cos(k * t))};
       }},
      {"sin(2*pi*t)",
       [w](double t) {
         return TimeJet{std::sin(w * t), w * std::cos(w * t), -w * w * std::sin(w * t)};
       }},
      {"sin(2*pi*1e4*t)",
       [](double t) {
         const double k = 2.0 * M_PI * 1e4;
         return TimeJet{std::sin(k * t), k * std::cos(k * t), -k * k * std::sin(k * t)};
       }},
      {"exp(-t/1e4)",
       [](double t) {
         const double f = std::exp(-t / 1e4);
         return TimeJet{f, -f / 1e4, f / 1e8};
       }},
      {"exp(-t/0.167)*cos(t)",
       [](double t) {
         const double a = -1.0 / 0.167, f = std::exp(a * t), c = std::cos(t), s = std::sin(t);
         return TimeJet{f * c, f * (a * c - s), f * (a * a * c - 2.0 * a * s - c)};
       }},
      {"tanh(t)",
       [](double t) {
         const double f = std::tanh(t), g = 1.0 / (std::cosh(t) * std::cosh(t));
         return TimeJet{f, g, -2.0 * f * g};
       }},
      {"t/(1+t)",
       [](double t) {
         return TimeJet{t / (1 + t), 1 / ((1 + t) * (1 + t)), -2 / ((1 + t) * (1 + t) * (1 + t))};
       }},
      {"2^t",
       [](double t) {
         const double l = std::log(2.0), f = std::pow(2.0, t);
         return TimeJet{f, l * f, l * l * f};
       }},
      {"t^t",
       [](double t) {
         const double f = std::pow(t, t), l = std::log(t) + 1.0;
         return TimeJet{f, f * l, f * (l * l + 1.0 / t)};
       }},
      {"atan2(sin(t), cos(t))",
       [](double t) {
         return TimeJet{std::atan2(std::sin(t), std::cos(t)), 1.0, 0.0};
       }},
      {"abs(t-7)",
       [](double t) {
         return TimeJet{std::abs(t - 7.0), t < 7.0 ? -1.0 : 1.0, 0.0};
       }},
      {"max(t, 2)*2",
       [](double t) {
         return TimeJet{2.0 * std::max(t, 2.0), t > 2.0 ? 2.0 : 0.0, 0.0};
       }},
  };
  for (const Law& law : laws) {
    const Expression expression(law.text);
    for (const double t : {1e-4, 3.7e-3, 0.21, 1.3, 9.7, 13.0}) {
      const TimeJet found = expression.jet(t), exact = law.exact(t);
      const auto near = [&](double a, double b, double scale) { return std::abs(a - b) <= 1e-12 * (std::abs(b) + scale); };
      EXPECT_EQ(found.value, expression.value(t)) << law.text;
      EXPECT_TRUE(near(found.value, exact.value, 1e-3)) << law.text << " " << t << ": " << found.value << " " << exact.value;
      EXPECT_TRUE(near(found.rate, exact.rate, std::abs(exact.value) + 1e-3 * t))
          << law.text << " " << t << ": " << found.rate << " " << exact.rate;
      EXPECT_TRUE(near(found.acceleration, exact.acceleration, std::abs(exact.value) + std::abs(exact.rate) + 1e-3))
          << law.text << " " << t << ": " << found.acceleration << " " << exact.acceleration;
    }
  }
}

// Every function's derivatives against differences of fourth order.
TEST(ExpressionJet, EveryFunctionAgreesWithDifferences) {
  for (const char* text : {"sin(t)",
                           "cos(t)",
                           "tan(t)",
                           "asin(t)",
                           "acos(t)",
                           "atan(t)",
                           "sinh(t)",
                           "cosh(t)",
                           "tanh(t)",
                           "asinh(t)",
                           "acosh(t+1)",
                           "atanh(t)",
                           "exp(t)",
                           "ln(t)",
                           "log(t)",
                           "log2(t)",
                           "log10(t)",
                           "sqrt(t)",
                           "t^3",
                           "t^-2",
                           "t^0.3",
                           "(1+t)^t",
                           "2^t",
                           "1/t",
                           "atan2(t, 2)",
                           "atan2(2, t-1)",
                           "atan2(-t, -2)",
                           "min(t, t^2)",
                           "max(t, t^2)",
                           "sum(t, t^2, 3)",
                           "avg(t, exp(t))",
                           "abs(sin(9*t))",
                           "t < 0.5 ? t^3 : t^4",
                           "-t^2*sin(t)/exp(cos(t))"}) {
    const Expression f(text);
    for (const double t : {0.21, 0.43, 0.77}) {
      const double h = 2e-3;
      const auto v = [&](int k) { return f.value(t + k * h); };
      const double first = (v(-3) * -1 + v(-2) * 9 + v(-1) * -45 + v(1) * 45 + v(2) * -9 + v(3)) / (60 * h);
      const double second = (2 * v(-3) - 27 * v(-2) + 270 * v(-1) - 490 * v(0) + 270 * v(1) - 27 * v(2) + 2 * v(3)) / (180 * h * h);
      const TimeJet jet = f.jet(t);
      EXPECT_NEAR(jet.rate, first, 1e-8 * (1 + std::abs(first))) << text << " at " << t;
      EXPECT_NEAR(jet.acceleration, second, 1e-6 * (1 + std::abs(second))) << text << " at " << t;
    }
  }
}

TEST(ExpressionSwitches, AreExactWhereTheThresholdIs) {
  const auto times = [](const char* text, double t0, double t1) { return Expression(text).switch_times(t0, t1); };
  using Times = std::vector<double>;
  EXPECT_EQ(times("t <= 0.7 ? 0.01*(1 - exp(-t/0.167)) : 0", 0, 1.6), Times{0.7});
  EXPECT_EQ(times("t < 0.7 ? 1 : 0", 0, 1.6), Times{0.7});
  EXPECT_EQ(times("t < 15 ? t^2 : 6*t - 45", 0, 20), Times{15});
  EXPECT_EQ(times("(t > 0.2)*(t < 0.4)*5", 0, 1), (Times{0.2, 0.4}));
  EXPECT_EQ(times("t > 1 && t < 1.0000001 ? 5 : 0", 0, 1e4), (Times{1, 1.0000001}));
  EXPECT_EQ(times("abs(t - 1)", 0, 3), Times{1});
  EXPECT_EQ(times("max(t, 2)", 0, 3), Times{2});
  EXPECT_EQ(times("sign(t - 1)", 0, 3), Times{1});
  EXPECT_EQ(times("0.3 > t ? 1 : t > 0.6 ? 2 : 3", 0, 1), (Times{0.3, 0.6}));
  EXPECT_EQ(times("rint(t)", 0, 3), (Times{0.5, 1.5, 2.5}));
  EXPECT_EQ(times("t ? 1 : 2", -1, 1), Times{});  // differs at one point only
  EXPECT_EQ(times("t == 0.5 ? 1 : 2", 0, 1), Times{});
  EXPECT_EQ(times("(t < 1 ? t : 3 - t) > 0.5 ? 1 : 0", 0, 4), (Times{0.5, 1, 2.5}));
  // nothing to switch
  EXPECT_EQ(times("sin(t)", 0, 100), Times{});
  EXPECT_EQ(times("1 < 2 ? t : 0", 0, 100), Times{});
  EXPECT_EQ(times("t < 5 ? 1 : 2", 0, 5), Times{});
  EXPECT_EQ(times("t < 5 ? 1 : 2", 6, 9), Times{});
  EXPECT_EQ(times("t < 5 ? 1 : 2", 9, 6), Times{});
  // in a branch that is never taken
  EXPECT_EQ(times("t < 5 ? 1 : t < 2 ? 3 : 4", 0, 9), Times{5});
  EXPECT_EQ(times("t < 1 ? 0 : (log(t-1) > -2 ? 1 : 0)", 0, 9).size(), 2u);
}

TEST(ExpressionSwitches, OscillatingConditionsAreAllFound) {
  const double tiny = 1e-13;
  const auto square = Expression("sin(2*pi*1000*t) > 0 ? 1 : -1").switch_times(0.0, 1.00025);
  ASSERT_EQ(square.size(), 2000u);
  for (std::size_t i = 0; i < square.size(); ++i) EXPECT_NEAR(square[i], 0.0005 * static_cast<double>(i + 1), tiny);
  const auto rectified = Expression("abs(sin(50*t))").switch_times(0.0, 1.0);
  ASSERT_EQ(rectified.size(), 15u);
  for (std::size_t i = 0; i < rectified.size(); ++i) EXPECT_NEAR(rectified[i], M_PI / 50.0 * static_cast<double>(i + 1), tiny);
}

TEST(ExpressionSwitches, ShortPulsesAreFound) {
  // 1.3e-9 s wide, at a place no grid hits
  const auto pulse = Expression("(t - 0.1234567)^2 < 1e-18 ? 1 : 0").switch_times(0.0, 2.0);
  ASSERT_EQ(pulse.size(), 2u);
  EXPECT_NEAR(pulse[0], 0.1234567 - 1e-9, 1e-15);
  EXPECT_NEAR(pulse[1], 0.1234567 + 1e-9, 1e-15);
  EXPECT_EQ(Expression("abs(t - 0.123) < 1e-12 ? 1 : 0").switch_times(0.0, 1e4).size(), 3u);  // and the kink of abs
  EXPECT_EQ(Expression("cos(t) > 1 - 1e-12 ? 1 : 0").switch_times(0.5, 20.0).size(), 6u);
  EXPECT_EQ(Expression("sin(1/t) > 0 ? 1 : 0").switch_times(0.001, 1.0).size(), 318u);
  EXPECT_EQ(Expression("exp(-((t-5)/1e-6)^2) > 0.5 ? 1 : 0").switch_times(0.0, 100.0).size(), 2u);
}

TEST(ExpressionSwitches, CutsAndPolesAreFound) {
  EXPECT_EQ(Expression("atan2(sin(t), cos(t))").switch_times(0.5, 9.0).size(), 4u);  // the cut at pi; x changes sign at three times
  EXPECT_EQ(Expression("tan(t) > 0 ? 1 : 0").switch_times(0.1, 3.0).size(), 1u);
  const auto pole = Expression("1/(t-1) > 0 ? 1 : 0").switch_times(0.0, 3.0);
  ASSERT_EQ(pole.size(), 1u);
  EXPECT_DOUBLE_EQ(pole[0], 1.0);
}

TEST(ExpressionSwitches, TooManyAreAnError) {
  EXPECT_THROW(Expression("sin(1/t) > 0 ? 1 : 0").switch_times(0.0, 1.0), SimulationError);
  EXPECT_THROW(Expression("sin(1e9*t) > 0 ? 1 : 0").switch_times(0.0, 1.0), SimulationError);
}

TEST(ExpressionSwitches, DependencyDoesNotExplode) {
  // (t-1)^3 multiplied out: interval arithmetic alone sees zero everywhere near 1
  const auto start = std::chrono::steady_clock::now();
  const auto times = Expression("t^3 - 3*t^2 + 3*t - 1 > 0 ? 1 : 0").switch_times(0.0, 3.0);
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 2.0);
  ASSERT_FALSE(times.empty());
  // its rounding errors reach 1e-16 where (t-1)^3 does
  for (const double t : times) EXPECT_NEAR(t, 1.0, 2e-5);
}

// Between switch times the choices never change, at random times and right beside the ends.
TEST(ExpressionSwitches, RandomTextsAreConstantBetween) {
  Writer writer(5);
  std::mt19937 random(6);
  int switched = 0;
  for (int i = 0; i < 1500; ++i) {
    const std::string text = writer.any(1 + i % 4);
    std::vector<double> ends{0.013};
    try {
      const Expression e(text);
      const auto found = e.switch_times(0.013, 1.7);
      switched += !found.empty();
      ends.insert(ends.end(), found.begin(), found.end());
      ends.push_back(1.7);
      for (std::size_t p = 0; p + 1 < ends.size(); ++p) {
        Expression frozen = e;
        const double width = ends[p + 1] - ends[p];
        frozen.freeze(ends[p] + 0.5 * width);
        for (const double part : {1e-6, 0.1 + 0.8 * static_cast<double>(random()) * 0x1p-32, 1 - 1e-6}) {
          const double t = ends[p] + part * width, live = value_or_nan(e, t), held = value_or_nan(frozen, t);
          if (width < 1e-9) continue;
          if (std::isnan(live)) EXPECT_TRUE(std::isnan(held)) << text << " at " << t;
          else EXPECT_NEAR(live, held, 1e-9 * (1.0 + std::abs(live))) << text << " at " << t;
        }
      }
    } catch (const InputError&) {
    } catch (const SimulationError& error) {
      // The first jumps without end before pi/2; in the second minus infinity is multiplied. No other text of this list may be refused.
      EXPECT_TRUE(text == "rint(tan(t*1))" || text == "atan2(min(-(t), t + .5,tanh(pi))*log10(t-t),t)") << text << "\n" << error.what();
    }
  }
  EXPECT_GT(switched, 150);
}

TEST(ExpressionJet, NumberTimesTime) {
  const TimeJet jet = Expression("150*t").jet(0.3);
  EXPECT_EQ(jet.value, 45.0);
  EXPECT_EQ(jet.rate, 150.0);
  EXPECT_EQ(jet.acceleration, 0.0);
  EXPECT_THROW(Expression("1e308*t").jet(10.0), SimulationError);
}

TEST(ExpressionFreeze, SmoothBeyondTheEnds) {
  Expression e("t <= 0.7 ? t^2 : 0");
  e.freeze(0.3);
  EXPECT_EQ(e.value(0.8), 0.8 * 0.8);
  EXPECT_EQ(e.jet(0.9).rate, 1.8);
  Expression copy = e;
  copy.freeze(1.0);
  EXPECT_EQ(copy.value(0.3), 0.0);
  EXPECT_EQ(e.value(0.8), 0.8 * 0.8);
  e.unfreeze();
  EXPECT_EQ(e.value(0.8), 0.0);
  Expression angle("atan2(sin(t), cos(t))");
  angle.freeze(3.0);
  EXPECT_NEAR(angle.value(3.3), 3.3, 1e-15);  // continued across the cut
}

TEST(ExpressionReadings, LongestNameCountsAndWordsGoFirst) {
  const std::vector<std::string> names{"tip", "tip.x", "speed of tip", "b1:tip", "sin", "t"};
  const Expression e("2*tip.x - tip + speed of tip*t + b1:tip + sin(0) + sin", names);
  EXPECT_EQ(e.variables(), (std::vector<std::string>{"tip.x", "tip", "speed of tip", "b1:tip", "sin"}));
  const double values[] = {3.0, 4.0, 5.0, 7.0, 11.0};
  EXPECT_EQ(e.value(2.0, values), 2.0 * 3.0 - 4.0 + 5.0 * 2.0 + 7.0 + 11.0);
  EXPECT_TRUE(e.depends_on_time());
  EXPECT_FALSE(e.constant());
  EXPECT_THROW(Expression("tip.y", names), InputError);
}

// Every selector: held beyond its threshold, its margin zero there, the next piece after it.
TEST(ExpressionReadings, SwitchesByTheState) {
  const std::vector<std::string> names{"x", "y"};
  struct Case {
    const char* text;
    double before[2], after[2];  // on both sides of the threshold, as far from it; in the order in which the text names them
  };
  for (const Case& c : std::initializer_list<Case>{{"x > 1 ? 5*x : 7", {0.9, 0}, {1.1, 0}},
                                                   {"x <= y ? 2 : 3*x", {0.4, 0.5}, {0.6, 0.5}},
                                                   {"abs(x - y)", {0.3, 0.4}, {0.5, 0.4}},
                                                   {"sign(x)", {-0.1, 0}, {0.1, 0}},
                                                   {"rint(x)", {1.4, 0}, {1.6, 0}},
                                                   {"min(x, y^2)", {0.8, 1}, {1.2, 1}},
                                                   {"max(x, 2*y)", {0.8, 0.5}, {1.2, 0.5}},
                                                   {"atan2(y, x)", {0.1, -1}, {-0.1, -1}}}) {
    Expression held(c.text, names);
    const Expression live(c.text, names);
    ASSERT_EQ(held.state_switches(), 1) << c.text;
    held.freeze(0.0);
    held.hold(0.0, c.before);
    EXPECT_EQ(held.value(0.0, c.before), live.value(0.0, c.before)) << c.text;
    const double margin = held.margin(0, 0.0, c.before);
    EXPECT_GT(margin, 0.0) << c.text;
    EXPECT_NEAR(held.margin(0, 0.0, c.after), -margin, 1e-12) << c.text;
    // Away from a kink the two pieces differ beyond the threshold.
    EXPECT_NE(held.value(0.0, c.after), live.value(0.0, c.after)) << c.text;
    held.pass({true}, 0.0, c.after);
    EXPECT_EQ(held.value(0.0, c.after), live.value(0.0, c.after)) << c.text;
    EXPECT_GT(held.margin(0, 0.0, c.after), 0.0) << c.text;
  }
}

// Times are found beside readings, in branches that the state chooses too.
TEST(ExpressionReadings, TimesBesideTheState) {
  const std::vector<std::string> names{"x"};
  Expression e("x > 0 ? (t < 1 ? 1 : 2) : 0", names);
  const std::vector<double> times = e.switch_times(0.0, 3.0);
  ASSERT_EQ(times.size(), 1u);
  EXPECT_NEAR(times[0], 1.0, 1e-15);
  const double on = 1.0;
  e.freeze(2.0);
  e.hold(1.0, &on);
  EXPECT_EQ(e.value(1.0, &on), 2.0);
  e.freeze(0.5);
  e.hold(1.0, &on);
  EXPECT_EQ(e.value(1.0, &on), 1.0);
}

}  // namespace flexframe::sim::test_expression
