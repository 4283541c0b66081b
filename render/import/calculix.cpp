#include "render/import/calculix.h"

#include "render/base/file.h"
#include "sim/base/words.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdint>
#include <map>
#include <string_view>
#include <unordered_map>

namespace flexframe::imports {
namespace {

using sim::InputError;

// How the elements of a .frd file are numbered (CalculiX GraphiX manual, "Element types").
struct FrdElement {
  CellShape shape = CellShape::none;
  bool quadratic = false;
};
FrdElement element_of(int type) {
  static const std::map<int, FrdElement> all = {{1, {CellShape::hexahedron, false}},  {2, {CellShape::wedge, false}},
                                                {3, {CellShape::tetrahedron, false}}, {4, {CellShape::hexahedron, true}},
                                                {5, {CellShape::wedge, true}},        {6, {CellShape::tetrahedron, true}},
                                                {7, {CellShape::triangle, false}},    {8, {CellShape::triangle, true}},
                                                {9, {CellShape::quad, false}},        {10, {CellShape::quad, true}}};
  const auto at = all.find(type);
  return at == all.end() ? FrdElement{} : at->second;
}

// Reads the file line by line in its fixed columns.
class Reader {
 public:
  Reader(const std::filesystem::path& path, double unit, double stress) : unit_(unit), stress_(stress) {
    series_.file = path.string();
    series_.kind = "CalculiX .frd";
    const std::vector<std::uint8_t> bytes = render::read_file(path);
    text_.assign(bytes.begin(), bytes.end());
  }

  NodalSeries read() {
    if (!next() || !line_.starts_with("    1C")) fail("is no CalculiX result file: its first line must begin with '    1C'");
    while (next()) {
      if (line_.starts_with("    2C")) read_nodes();
      else if (line_.starts_with("    3C")) read_elements();
      else if (line_.starts_with("  100C")) read_field();
      else if (line_.starts_with(" 9999")) break;
    }
    return finish();
  }

 private:
  struct Step {
    double time = 0.0;
    std::vector<double> displacement, stress;  // 3 n, n
  };

  [[noreturn]] void fail(const std::string& message) const { throw InputError(fmt::format("{}:{}: {}", series_.file, number_, message)); }

  bool next() {
    if (at_ >= text_.size()) return false;
    const size_t end = std::min(text_.find('\n', at_), text_.size());
    line_ = std::string_view(text_).substr(at_, end - at_);
    if (!line_.empty() && line_.back() == '\r') line_.remove_suffix(1);
    at_ = end + 1;
    ++number_;
    return true;
  }
  void need_next(const char* what) {
    if (!next()) fail(fmt::format("the file ends among its {}", what));
  }

  std::string_view columns(size_t from, size_t width) const {
    if (from >= line_.size()) return {};
    std::string_view field = line_.substr(from, width);
    const auto first = field.find_first_not_of(' ');
    return first == field.npos ? std::string_view() : field.substr(first, field.find_last_not_of(' ') - first + 1);
  }
  int integer(size_t from, size_t width, const char* what) const {
    const std::string_view field = columns(from, width);
    int value = 0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (error != std::errc() || end != field.data() + field.size())
      fail(fmt::format("{} must stand in columns {} to {}, found {}", what, from + 1, from + width, sim::quote(field)));
    return value;
  }
  double real(size_t from, size_t width, const char* what) const {
    const std::string_view field = columns(from, width);
    double value = 0.0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (error != std::errc() || end != field.data() + field.size() || !std::isfinite(value))
      fail(fmt::format("{} must be a number in columns {} to {}, found {}", what, from + 1, from + width, sim::quote(field)));
    return value;
  }
  // Width of numbers of nodes by the block's format: 0 short, 1 long.
  size_t number_width() const {
    const std::string_view format = columns(73, 2);
    if (format == "0") return 5;
    if (format == "1" || format.empty()) return 10;
    fail("the block is binary; write text by *NODE FILE and *EL FILE in place of *NODE OUTPUT and *ELEMENT OUTPUT");
  }

  void read_nodes() {
    const size_t width = number_width();
    std::vector<double> places;
    for (need_next("nodes"); !line_.starts_with(" -3"); need_next("nodes")) {
      if (!line_.starts_with(" -1")) fail("a node must begin with ' -1'");
      const int node = integer(3, width, "the node's number");
      if (!index_.emplace(node, static_cast<int>(index_.size())).second) fail(fmt::format("node {} is there twice", node));
      series_.node_names.push_back(fmt::format("{}", node));
      for (size_t a = 0; a < 3; ++a) places.push_back(unit_ * real(3 + width + 12 * a, 12, "a coordinate"));
    }
    series_.points = Eigen::Map<Eigen::Matrix<double, -1, 3, Eigen::RowMajor>>(places.data(), std::ssize(places) / 3, 3);
  }

  void read_elements() {
    const size_t width = number_width();
    int left_out = 0;
    need_next("elements");
    while (!line_.starts_with(" -3")) {
      if (!line_.starts_with(" -1")) fail("an element must begin with ' -1'");
      const FrdElement element = element_of(integer(3 + width, 5, "the type of an element"));
      std::vector<int> nodes;
      for (need_next("elements"); line_.starts_with(" -2"); need_next("elements"))
        for (size_t at = 3; !columns(at, width).empty(); at += width) nodes.push_back(find_node(integer(at, width, "a node")));
      if (element.shape == CellShape::none) {
        ++left_out;
        continue;
      }
      const int wanted = element.quadratic ? quadratic_count(element.shape) : corner_count(element.shape);
      if (std::ssize(nodes) != wanted) fail(fmt::format("the element above has {} nodes, its type {}", nodes.size(), wanted));
      // CalculiX lists the upright edges before those of the top.
      if (element.quadratic && element.shape == CellShape::hexahedron) std::rotate(nodes.begin() + 12, nodes.begin() + 16, nodes.end());
      if (element.quadratic && element.shape == CellShape::wedge) std::rotate(nodes.begin() + 9, nodes.begin() + 12, nodes.end());
      series_.cells.add(element.shape, element.quadratic, nodes);
    }
    if (left_out > 0) series_.notes.push_back(fmt::format("{} beam elements have no surface and are left out", left_out));
  }

  int find_node(int node) const {
    const auto at = index_.find(node);
    if (at == index_.end()) fail(fmt::format("node {} is not among the nodes", node));
    return at->second;
  }

  void read_field() {
    const size_t width = number_width();
    const double time = real(12, 12, "the time");
    const int kind = integer(56, 2, "the kind of analysis");
    if (kind == 2)
      fail("the step holds eigenmodes, no history over time; flexframe reduce takes the model itself, and flexframe modes shows its modes");
    need_next("results");
    if (!line_.starts_with(" -4")) fail("the name of the results must begin with ' -4'");
    const std::string_view name = columns(5, 8);
    const bool displacement = name == "DISP", stress = name == "STRESS";
    while (next() && line_.starts_with(" -5")) {}
    if ((displacement || stress) && (steps_.empty() || steps_.back().time != time)) {
      if (!steps_.empty() && time < steps_.back().time)
        fail(fmt::format("times must rise, found {:g} after {:g}: give each analysis its own file", time, steps_.back().time));
      steps_.push_back({.time = time, .displacement = {}, .stress = {}});
    }
    if (displacement) steps_.back().displacement.assign(3 * index_.size(), 0.0);
    if (stress) steps_.back().stress.assign(index_.size(), 0.0);
    for (; !line_.starts_with(" -3"); need_next("results")) {
      if (!(displacement || stress) || !line_.starts_with(" -1")) continue;
      const size_t node = find_node(integer(3, width, "the node's number"));
      const size_t from = 3 + width;
      if (displacement)
        for (size_t a = 0; a < 3; ++a) steps_.back().displacement[3 * node + a] = unit_ * real(from + 12 * a, 12, "a displacement");
      if (stress) {
        double s[6];
        for (size_t a = 0; a < 6; ++a) s[a] = stress_ * real(from + 12 * a, 12, "a stress");
        steps_.back().stress[node] = von_mises(s);
      }
    }
  }

  NodalSeries finish() {
    if (series_.points.rows() == 0) throw InputError(fmt::format("{}: holds no nodes", series_.file));
    std::vector<Step> steps;
    for (Step& step : steps_)
      if (!step.displacement.empty()) steps.push_back(std::move(step));
    if (steps.empty())
      throw InputError(fmt::format("{}: holds no displacements: ask for them by *NODE FILE with the line U", series_.file));
    const Eigen::Index nt = std::ssize(steps), n = series_.points.rows();
    series_.times.resize(nt);
    series_.displacement.resize(nt, 3 * n);
    const bool stressed = std::all_of(steps.begin(), steps.end(), [](const Step& s) { return !s.stress.empty(); });
    if (stressed) series_.von_mises.resize(nt, n);
    else series_.notes.emplace_back("it holds no stress at every time (*EL FILE with the line S)");
    for (Eigen::Index i = 0; i < nt; ++i) {
      const Step& step = steps[i];
      series_.times[i] = step.time;
      series_.displacement.row(i) = Eigen::Map<const Eigen::RowVectorXd>(step.displacement.data(), 3 * n);
      if (stressed) series_.von_mises.row(i) = Eigen::Map<const Eigen::RowVectorXd>(step.stress.data(), n);
    }
    return std::move(series_);
  }

  double unit_, stress_;
  NodalSeries series_;
  std::string text_;
  std::string_view line_;
  size_t at_ = 0;
  int number_ = 0;
  std::unordered_map<int, int> index_;
  std::vector<Step> steps_;
};

}  // namespace

NodalSeries read_frd(const std::filesystem::path& path, double unit, double stress) { return Reader(path, unit, stress).read(); }

}  // namespace flexframe::imports
