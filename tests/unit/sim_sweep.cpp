// Designs, responses, rows and workers of sweeps.
#include "sim/base/error.h"
#include "sim/sweep/design.h"
#include "sim/sweep/response.h"
#include "sim/sweep/rows.h"
#include "sim/sweep/sensitivity.h"
#include "sim/sweep/workers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <set>

#include <unistd.h>

namespace flexframe::sim::test_sweep {

namespace {

std::string message_of(const DesignWords& words) {
  try {
    const Design design(words);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(SweepDesign, GridIsAllCombinationsWithTheFirstKeySlowest) {
  const Design design({{"L=0.2:0.4:3", "mu=1e-3:1e-1:3:log", "simulation.method=erk,dirk", "simulation.tolerance=1e-8"}, "", "", 1});
  ASSERT_EQ(design.size(), 18);
  const std::vector<std::string> last = design.settings(17);
  EXPECT_EQ(last, (std::vector<std::string>{"simulation.tolerance=1e-8", "L=0.4", "mu=0.1", "simulation.method=dirk"}));
  EXPECT_EQ(design.settings(1)[3], "simulation.method=dirk");
  EXPECT_EQ(design.settings(2)[2], "mu=0.01");
  EXPECT_EQ(design.settings(6)[1], "L=0.3");
  std::set<std::vector<std::string>> all;
  for (long k = 0; k < design.size(); ++k) all.insert(design.settings(k));
  EXPECT_EQ(all.size(), 18u);
}

TEST(SweepDesign, ListsKeepBracketsAndUnits) {
  const Design design({{"simulation.gravity=[0,0,0],[0,-9.81,0]", "L=200 mm,0.5 m"}, "", "", 1});
  ASSERT_EQ(design.size(), 4);
  EXPECT_EQ(design.settings(3), (std::vector<std::string>{"simulation.gravity=[0,-9.81,0]", "L=0.5 m"}));
  EXPECT_DOUBLE_EQ(design.point(0)[1].number, 0.2);
}

TEST(SweepDesign, LatinHypercubeHasOnePointInEachPart) {
  for (const long n : {1L, 7L, 100L, 1000L}) {
    const Design design({{"a=0:1", "b=-2:2", "c=uniform(5,6)"}, "lhs:" + std::to_string(n), "", 3});
    ASSERT_EQ(design.size(), n);
    std::vector<std::set<long>> parts(3);
    for (long k = 0; k < n; ++k) {
      const auto p = design.point(k);
      parts[0].insert(static_cast<long>(p[0].number * static_cast<double>(n)));
      parts[1].insert(static_cast<long>((p[1].number + 2.0) / 4.0 * static_cast<double>(n)));
      parts[2].insert(static_cast<long>((p[2].number - 5.0) * static_cast<double>(n)));
    }
    for (const auto& axis : parts) EXPECT_EQ(static_cast<long>(axis.size()), n);
  }
}

// scipy.stats.qmc.Sobol(4, scramble=False).random(6)[1:], which has the directions of Joe and Kuo too.
TEST(SweepDesign, SobolSequenceIsThatOfScipy) {
  const Design design({{"a=0:1", "b=0:1", "c=0:1", "d=0:1"}, "sobol:5", "", 1});
  const double wanted[5][4] = {
      {0.5, 0.5, 0.5, 0.5}, {0.75, 0.25, 0.25, 0.25}, {0.25, 0.75, 0.75, 0.75}, {0.375, 0.375, 0.625, 0.875}, {0.875, 0.875, 0.125, 0.375}};
  for (long k = 0; k < 5; ++k)
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(design.point(k)[i].number, wanted[k][i], 1e-14) << k << " " << i;
}

TEST(SweepDesign, DistributionsHaveTheirQuantiles) {
  // scipy.stats.norm.ppf(0.975), truncnorm.ppf(0.9, -1, 2), loguniform(1e-3, 10).ppf(0.25)
  EXPECT_NEAR((Distribution{Distribution::Kind::normal, 2.0, 0.5}.quantile(0.975)), 2.0 + 0.5 * 1.959963984540054, 1e-12);
  EXPECT_NEAR((Distribution{Distribution::Kind::normal, 0.0, 1.0, -1.0, 2.0}.quantile(0.9)), 1.2557153641502148, 1e-10);
  EXPECT_NEAR((Distribution{Distribution::Kind::loguniform, 1e-3, 10.0}.quantile(0.25)), 0.01, 1e-15);
  const Design design({{"x=normal(3,0.1)"}, "lhs:2000", "", 5});
  double mean = 0.0, square = 0.0;
  for (long k = 0; k < 2000; ++k) {
    const double x = design.point(k)[0].number - 3.0;
    mean += x / 2000.0, square += x * x / 2000.0;
  }
  EXPECT_NEAR(mean, 0.0, 1e-4);  // stratified: far below 0.1 / sqrt(2000)
  EXPECT_NEAR(std::sqrt(square), 0.1, 1e-3);
}

TEST(SweepDesign, AnyPointIsMadeFromItsNumberAlone) {
  const DesignWords words{{"a=0:1", "b=1,2,3", "c=normal(0,1)"}, "random:40", "", 9};
  const Design first(words), second(words);
  for (const long k : {119L, 3L, 77L, 3L}) EXPECT_EQ(first.settings(k), second.settings(k));
  DesignWords other = words;
  other.seed = 10;
  EXPECT_NE(Design(other).settings(3), first.settings(3));
}

TEST(SweepDesign, MorrisMovesOneKeyATime) {
  const Design design({{"a=0:1", "b=0:1", "c=0:1"}, "", "morris:50", 2});
  ASSERT_EQ(design.size(), 200);
  std::map<std::size_t, int> first;
  for (long path = 0; path < 50; ++path) {
    std::set<std::size_t> moved;
    for (long k = 0; k < 3; ++k) {
      const Design::Move move = design.move(path, k);
      moved.insert(move.axis);
      if (k == 0) ++first[move.axis];
      const auto a = design.point(4 * path + k), b = design.point(4 * path + k + 1);
      for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(b[i].number - a[i].number, i == move.axis ? move.step : 0.0, 1e-15);
    }
    EXPECT_EQ(moved.size(), 3u);
    for (const auto& value : design.point(4 * path)) EXPECT_TRUE(value.number > -1e-15 && value.number < 1.0 + 1e-15);
  }
  EXPECT_EQ(first.size(), 3u);
}

TEST(SweepDesign, RefusesWhatMakesNoDesign) {
  const std::vector<std::pair<DesignWords, std::string>> wrong = {
      {{{"L"}, "", "", 1}, "KEY=VALUES"},
      {{{"L=1"}, "", "", 1}, "at least one --set with several values"},
      {{{"L=1:2"}, "", "", 1}, "--sample"},
      {{{"L=1:2:3"}, "lhs:5", "", 1}, "LOW:HIGH"},
      {{{"L=1:2"}, "lsh:5", "", 1}, "lhs"},
      {{{"L=1:2"}, "lhs", "", 1}, "N >= 1"},
      {{{"L=1:2"}, "lhs:5", "morris:5", 1}, "excludes"},
      {{{"L=1:2", "L=3,4"}, "lhs:5", "", 1}, "twice"},
      {{{"L=2:1"}, "lhs:5", "", 1}, "larger"},
      {{{"L=-1:1:5:log"}, "", "", 1}, "> 0"},
      {{{"L=normal(1,0)"}, "lhs:5", "", 1}, "deviation"},
      {{{"L=normal(1)"}, "lhs:5", "", 1}, "mean and deviation"},
      {{{"L=normal(0,1,50,60)"}, "lhs:5", "", 1}, "hardly"},
      {{{"L=1:2:2000000"}, "", "", 1}, "1000000"},
      {{{"L=1:2", "mu=1,2"}, "", "sobol:4", 1}, "by chance only"},
      {{{"L=1:2:1000000", "M=1:2:1000"}, "", "", 1}, "at most"},
  };
  for (const auto& [words, part] : wrong) EXPECT_NE(message_of(words).find(part), std::string::npos) << message_of(words);
}

// A history whose numbers are known: x = 2 + 3 sin(2 pi 5 t), v = t over one second.
Histories sine() {
  Histories h;
  const int n = 2000;
  h.columns = {"arm.x", "v"};
  h.units = {"m", "s"};
  h.times.resize(n + 1);
  h.values.resize(2, n + 1);
  for (int i = 0; i <= n; ++i) {
    h.times[i] = static_cast<double>(i) / n;
    h.values(0, i) = 2.0 + 3.0 * std::sin(10.0 * std::numbers::pi * h.times[i]);
    h.values(1, i) = h.times[i];
  }
  return h;
}

TEST(SweepResponse, NumbersOfAHistory) {
  const Histories h = sine();
  const std::vector<std::string> settings = {"L", "body.rod.length"};
  const std::vector<double> values = {0.5, 4.0};
  const std::vector<std::pair<std::string, double>> wanted = {
      {"max(arm.x)", 5.0},
      {"min(arm.x)", -1.0},
      {"mean(arm.x)", 2.0},
      {"rms(arm.x - mean(arm.x))", 3.0 / std::numbers::sqrt2},
      {"range(arm.x)/body.rod.length", 1.5},
      {"final(v) - initial(v)", 1.0},
      {"integral(v)", 0.5},
      {"time_of_max(arm.x)", 0.05},
      {"time_of_min(arm.x)", 0.15},
      {"time_of(v > 0.25)", 0.2505},
      {"max(min(arm.x), L)", 0.5},
      {"max(max(arm.x, 4.5*v))", 5.0},
      {"max(t*arm.x*0 + t)", 1.0},
      {"peak = max(abs(arm.x)) + 2*L", 6.0},
  };
  for (const auto& [text, number] : wanted) EXPECT_NEAR(Response(text, h.columns, settings).value(h, values), number, 1e-5) << text;
  EXPECT_NEAR(Response("frequency(arm.x)", h.columns, settings).value(h, values), 5.0, 0.02);
  for (const double periods : {0.3, 1.2, 1.6, 2.4, 5.0}) {
    Histories slow = h;
    const double duration = h.times[h.times.size() - 1] - h.times[0];
    for (Eigen::Index i = 0; i < h.times.size(); ++i)
      slow.values(0, i) = std::sin(2.0 * std::numbers::pi * periods * h.times[i] / duration + 1.0);
    const Response response("2*frequency(arm.x)", h.columns, settings);
    const double told = 0.5 * response.value(slow, values) * duration;
    const bool warned = !response.too_few_periods(slow, values).empty();
    EXPECT_EQ(warned, periods < 2.0) << periods;
    EXPECT_TRUE(warned || std::abs(told - periods) < 0.03 * periods) << periods << " told as " << told;
  }
  try {
    Response("range(v)/(max(v) - max(v))", h.columns, settings).value(h, values);
    ADD_FAILURE() << "a division by zero was taken";
  } catch (const SimulationError& error) {
    EXPECT_NE(std::string(error.what()).find("'range(v)/(max(v) - max(v))'"), std::string::npos) << error.what();
    EXPECT_EQ(std::string(error.what()).find("t = 0"), std::string::npos) << error.what();
  }
  EXPECT_EQ(Response("peak = max(arm.x)", h.columns, settings).name(), "peak");
  EXPECT_EQ(Response("max(arm.x)", h.columns, settings).name(), "max(arm.x)");
}

// Samples of x(t) over 1 s, so many a second, and whether a response of it is told to hang on them.
bool hangs_on_samples(const std::string& text, int rate, const std::function<double(double)>& x) {
  Histories h;
  h.columns = {"x"};
  h.units = {"m"};
  h.times = VecX::LinSpaced(rate + 1, 0.0, 1.0);
  h.values = h.times.unaryExpr(x).transpose();
  const auto share = Response(text, h.columns, {}).share_of_sampling(h, {});
  return share && *share > 0.01;
}

// 100 samples a second show a peak of 3 ms as 0.83 of it, and one of 30 ms to 0.4 %; seven of a vibration of 3 Hz told a time of
// 0.43 s for 0.026 s. Every second sample shows it, whichever is left out, and beside a last value too.
TEST(SweepResponse, TooFewSamplesAreTold) {
  const auto peak = [](double width) { return [width](double t) { return std::exp(-std::pow((t - 0.5013) / width, 2)); }; };
  for (const char* text :
       {"max(x)", "range(x)", "-min(-x)", "max(x) - final(x)", "max(x)/(1 + initial(x))", "rms(x)", "rms(x - mean(x))"}) {
    EXPECT_TRUE(hangs_on_samples(text, 100, peak(0.003))) << text;
    EXPECT_FALSE(hangs_on_samples(text, 100, peak(0.03))) << text;
  }
  EXPECT_TRUE(hangs_on_samples("time_of(x > 0.5)", 100, peak(0.003)));
  EXPECT_FALSE(hangs_on_samples("time_of(x > 0.5)", 100, peak(0.03)));
  const auto sine = [](double t) { return std::sin(20.0 * t); };
  for (const char* text : {"rms(x - mean(x))", "mean(x)", "time_of(x > 0.5)", "time_of_max(x)"})
    EXPECT_TRUE(hangs_on_samples(text, 7, sine)) << text;
  for (const char* text : {"rms(x)", "max(x)", "range(x)", "time_of(x > 0.5)", "integral(abs(x))"})
    EXPECT_FALSE(hangs_on_samples(text, 200, sine)) << text;
  // Two samples show nothing of what lies between them, a constant nothing else; a mean that is zero but for rounding does not change.
  EXPECT_TRUE(hangs_on_samples("max(x)", 1, sine));
  EXPECT_FALSE(hangs_on_samples("max(x)", 1, [](double) { return 0.3; }));
  EXPECT_FALSE(hangs_on_samples("mean(x)", 1000, [](double t) { return std::sin(6.0 * std::numbers::pi * t); }));
  EXPECT_FALSE(hangs_on_samples("final(x) - initial(x)", 7, sine));
}

TEST(SweepResponse, SaysWhatIsWrong) {
  const Histories h = sine();
  const std::vector<std::string> settings = {"L"};
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"arm.x", "is a history"}, {"max(arm.y)", "arm.x"}, {"rage(arm.x)", "rage"}, {"max(arm.x", "max"}, {"t", "time"}, {"", "--response"}};
  for (const auto& [text, part] : wrong) {
    try {
      const Response response(text, h.columns, settings);
      ADD_FAILURE() << text << " was taken";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(Response("time_of(v > 2)", h.columns, settings).value(h, std::vector<double>{1.0}), SimulationError);
  EXPECT_THROW(Response("sqrt(min(arm.x))", h.columns, settings).value(h, std::vector<double>{1.0}), SimulationError);
}

TEST(SweepRows, DamagedLinesAreFound) {
  SweepRow row{12, PointEnd::lacking, 0.25, 1e-3, "arm.x", {1.0 / 3.0, std::nullopt, -2e-300}, "one\ttwo\nthree"};
  const std::string line = row_line(row);
  const std::optional<SweepRow> back = read_row_line(line, 3);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->point, 12);
  EXPECT_EQ(back->responses[0], row.responses[0]);
  EXPECT_FALSE(back->responses[1]);
  EXPECT_EQ(back->message, "one two three");
  for (std::size_t k = 0; k + 1 < line.size(); ++k) {
    std::string other = line;
    other[k] = other[k] == '7' ? '8' : '7';
    EXPECT_FALSE(read_row_line(other, 3)) << k;
    EXPECT_FALSE(read_row_line(line.substr(0, k), 3)) << k;
  }
  EXPECT_FALSE(read_row_line(line, 2));
}

TEST(SweepRows, AFileThatWasCutOffGoesOnBehindItsWholeRows) {
  const std::filesystem::path path = std::filesystem::temp_directory_path() / ("rows_" + std::to_string(::getpid()));
  const auto line = [](long point) { return row_line({point, PointEnd::done, 0.0, -1.0, "", {static_cast<double>(point)}, ""}); };
  {
    RowsWriter writer(path, "me", false, 0);
    for (long k = 0; k < 5; ++k) writer.append(line(k));
    EXPECT_THROW(RowsWriter(path, "me", true, 0), FileError);  // one process a file
  }
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - 7);
  std::vector<long> points;
  const auto take = [&](SweepRow&& row) { points.push_back(row.point); };
  const RowsFile cut = read_rows(path, 1, take);
  EXPECT_EQ(cut.identity, "me");
  EXPECT_EQ(cut.damaged, 1);
  EXPECT_EQ(points, (std::vector<long>{0, 1, 2, 3}));
  {
    RowsWriter writer(path, "me", true, cut.bytes);
    writer.append(line(9));
  }
  points.clear();
  EXPECT_EQ(read_rows(path, 1, take).damaged, 0);
  EXPECT_EQ(points, (std::vector<long>{0, 1, 2, 3, 9}));
  std::filesystem::remove(path);
}

TEST(SweepWorkers, AProcessThatDiesTakesOnlyItsPointWithIt) {
  std::map<long, std::string> results, lost;
  long next = 0;
  WorkersPlan plan;
  plan.workers = 3;
  plan.next = [&]() -> std::optional<long> { return next < 40 ? std::optional<long>(next++) : std::nullopt; };
  plan.work = [](long point) -> std::string {
    if (point == 7) {
      ::signal(SIGSEGV, SIG_DFL);  // a sanitizer's handler would end it with an exit code
      ::raise(SIGSEGV);
    }
    if (point == 11) ::_exit(3);
    if (point == 13) throw std::runtime_error("no");
    return std::string(static_cast<std::size_t>(point) * 10000, 'x');
  };
  plan.done = [&](long point, std::string&& result) { results[point] = std::move(result); };
  plan.lost = [&](long point, const std::string& why) { lost[point] = why; };
  work_at_points(plan);
  EXPECT_EQ(results.size(), 37u);
  for (const auto& [point, result] : results) EXPECT_EQ(result.size(), static_cast<std::size_t>(point) * 10000);
  ASSERT_EQ(lost.size(), 3u);
  EXPECT_NE(lost[7].find("signal 11"), std::string::npos);
  EXPECT_EQ(lost[11], "exit code 3");
}

TEST(SweepWorkers, APointWithoutEndIsStopped) {
  long next = 0;
  std::map<long, std::string> lost;
  int results = 0;
  WorkersPlan plan;
  plan.workers = 2;
  plan.longest = 0.1;
  plan.next = [&]() -> std::optional<long> { return next < 4 ? std::optional<long>(next++) : std::nullopt; };
  plan.work = [](long point) -> std::string {
    volatile long turns = point == 2;
    while (turns > 0) turns = turns % 1000 + 1;
    return "";
  };
  plan.done = [&](long, std::string&&) { ++results; };
  plan.lost = [&](long point, const std::string& why) { lost[point] = why; };
  work_at_points(plan);
  EXPECT_EQ(results, 3);
  EXPECT_EQ(lost, (std::map<long, std::string>{{2, ""}}));
}

// A table whose response is a function of the keys.
SweepTable table_of(const Sweep& sweep, const std::function<double(const std::vector<double>&)>& f) {
  SweepTable table;
  table.responses.resize(sweep.design.size(), 1);
  for (long i = 0; i < sweep.design.size(); ++i) {
    std::vector<double> x;
    for (const Design::Value& value : sweep.design.point(i)) x.push_back(value.number);
    table.responses(i, 0) = f(x);
  }
  return table;
}
Sweep sweep_of(const DesignWords& words) { return {{}, {}, Design(words), {}, {}, {}, {}, {}, {}, {"f"}, {}, 1}; }

// Ishigami and Homma 1990: f = sin x1 + a sin^2 x2 + b x3^4 sin x1 on (-pi, pi), a = 7, b = 0.1. In closed form the variance is
// a^2/8 + b pi^4/5 + b^2 pi^8/18 + 1/2.
TEST(SweepSensitivity, IshigamiHasItsClosedIndices) {
  const Sweep sweep = sweep_of({{"x1=uniform(-pi,pi)", "x2=uniform(-pi,pi)", "x3=uniform(-pi,pi)"}, "", "sobol:8192", 1});
  ASSERT_EQ(sweep.design.size(), 8192 * 5);
  SweepTable table = table_of(sweep, [](const std::vector<double>& x) {
    return std::sin(x[0]) + 7.0 * std::pow(std::sin(x[1]), 2) + 0.1 * std::pow(x[2], 4) * std::sin(x[0]);
  });
  const auto check = [&](double tolerance) {
    const std::vector<Sensitivity> all = sensitivities(sweep, table);
    ASSERT_EQ(all.size(), 1u);
    ASSERT_EQ(all[0].sobol.size(), 3u);
    const double pi4 = std::pow(std::numbers::pi, 4);
    const double variance = 49.0 / 8.0 + 0.1 * pi4 / 5.0 + 0.01 * pi4 * pi4 / 18.0 + 0.5;
    EXPECT_NEAR(all[0].variance / variance, 1.0, tolerance);
    const double first[3] = {0.3139, 0.4424, 0.0}, total[3] = {0.5576, 0.4424, 0.2437};
    for (std::size_t k = 0; k < 3; ++k) {
      const SobolIndex& index = all[0].sobol[k];
      EXPECT_NEAR(index.first, first[k], tolerance);
      EXPECT_NEAR(index.total, total[k], tolerance);
      EXPECT_TRUE(index.first_low < first[k] && first[k] < index.first_high);
      EXPECT_TRUE(index.total_low < total[k] && total[k] < index.total_high);
    }
  };
  check(0.005);
  // Points that failed take their block with them and no more.
  for (long i = 3; i < sweep.design.size(); i += 401) table.responses(i, 0) = std::numeric_limits<double>::quiet_NaN();
  check(0.02);
  EXPECT_GT(sensitivities(sweep, table)[0].left_out, 90);
}

// Of a linear function each effect is its factor times the width of the key, without deviation; a product has one.
TEST(SweepSensitivity, MorrisOfALinearFunctionIsItsFactors) {
  const Sweep sweep = sweep_of({{"a=0:2", "b=-1:1", "c=10:20"}, "", "morris:20", 4});
  const std::vector<Sensitivity> all =
      sensitivities(sweep, table_of(sweep, [](const std::vector<double>& x) { return 3.0 * x[0] - 0.5 * x[1] + 0.0 * x[2]; }));
  ASSERT_EQ(all[0].morris.size(), 3u);
  const double wanted[3] = {6.0, -1.0, 0.0};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(all[0].morris[k].mean, wanted[k], 1e-12);
    EXPECT_NEAR(all[0].morris[k].mean_size, std::abs(wanted[k]), 1e-12);
    EXPECT_NEAR(all[0].morris[k].deviation, 0.0, 1e-12);
  }
  const std::vector<Sensitivity> product = sensitivities(sweep, table_of(sweep, [](const std::vector<double>& x) { return x[0] * x[1]; }));
  EXPECT_GT(product[0].morris[0].deviation, 0.1);
}

TEST(SweepSensitivity, AConstantHasNoIndices) {
  const Sweep sweep = sweep_of({{"a=0:1", "b=0:1"}, "", "sobol:64", 1});
  EXPECT_TRUE(sensitivities(sweep, table_of(sweep, [](const std::vector<double>&) { return 0.1; }))[0].sobol.empty());
}

}  // namespace

}  // namespace flexframe::sim::test_sweep
