#include "render/import/mbdyn.h"

#include "render/base/file.h"
#include "render/import/rotations.h"
#include "sim/base/late_library.h"
#include "sim/base/words.h"

#include <fmt/format.h>
#include <netcdf.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

namespace flexframe::imports {
namespace {

using sim::InputError;

// "123" to a sequence about the axes as they lie by then: R = R1(a) R2(b) R3(c), angles in this order.
TurnWriting euler(std::string_view digits) {
  TurnWriting writing;
  writing.form = TurnForm::euler;
  for (size_t k = 0; k < 3; ++k) writing.sequence[k] = static_cast<char>('x' + (digits[k] - '1'));
  return writing;
}

// A word of the .log file to how a node's orientation is written; none: unknown.
std::optional<TurnWriting> writing_of(const std::string& word) {
  TurnWriting writing;
  if (word == "euler123" || word == "euler313" || word == "euler321") return euler(word.substr(5));
  if (word == "phi") writing.form = TurnForm::vector;
  else if (word == "mat") writing.form = TurnForm::matrix;
  else return std::nullopt;
  return writing;
}

std::string read_text(const std::filesystem::path& path) {
  const std::vector<std::uint8_t> bytes = render::read_file(path);
  return {bytes.begin(), bytes.end()};
}

// Numbers of a line; false where a word is none.
bool read_numbers(std::string_view line, std::vector<double>& out) {
  out.clear();
  const char *at = line.data(), *end = line.data() + line.size();
  while (true) {
    while (at < end && (*at == ' ' || *at == '\t' || *at == '\r')) ++at;
    if (at == end) return true;
    double value = 0.0;
    if (*at == '+') ++at;
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc() || !std::isfinite(value)) return false;
    out.push_back(value);
    at = next;
  }
}

// By label: how the node's orientation is written.
std::map<int, TurnWriting> read_log(const std::filesystem::path& path) {
  std::map<int, TurnWriting> out;
  if (!std::filesystem::is_regular_file(path)) return out;
  std::istringstream text(read_text(path));
  for (std::string line; std::getline(text, line);) {
    if (!line.starts_with("structural node:")) continue;
    std::istringstream words(line.substr(16));
    int label = 0;
    double x = 0.0;
    std::string word;
    if (!(words >> label >> x >> x >> x)) continue;
    if (!(words >> word)) out[label] = TurnWriting{};  // a node without rotation
    else if (const auto writing = writing_of(word)) out[label] = *writing;
  }
  return out;
}

// Times of the steps that were written: lines "Step number time ...", of which the last number says whether, where a head names it Out.
std::vector<double> read_times(const std::filesystem::path& path) {
  std::vector<double> times, numbers;
  if (!std::filesystem::is_regular_file(path)) return times;
  bool says_output = false;
  std::istringstream text(read_text(path));
  for (std::string line; std::getline(text, line);) {
    if (line.starts_with("#") && line.find("Step Time") != std::string::npos) says_output = line.find(" Out") != std::string::npos;
    if (!line.starts_with("Step ") || !read_numbers(std::string_view(line).substr(5), numbers) || numbers.size() < 2) continue;
    if (!says_output || numbers.back() != 0.0) times.push_back(numbers[1]);
  }
  return times;
}

// A body being filled sample by sample.
struct Path {
  std::vector<double> position, orientation;  // 3 and 4 a sample
};

sim::ResultBody to_body(int label, const Path& path) {
  sim::ResultBody body;
  body.name = fmt::format("node {}", label);
  body.kind = "rigid";
  const auto nt = std::ssize(path.position) / 3;
  body.position = Eigen::Map<const Eigen::Matrix<double, -1, 3, Eigen::RowMajor>>(path.position.data(), nt, 3);
  body.orientation = Eigen::Map<const Eigen::Matrix<double, -1, 4, Eigen::RowMajor>>(path.orientation.data(), nt, 4);
  keep_hemisphere(body.orientation);
  return body;
}

void add_turn(const TurnWriting& writing, std::array<double, 9> numbers, const std::string& what, Path& path) {
  if (writing.form == TurnForm::euler)
    for (double& angle : numbers) angle *= M_PI / 180.0;
  const sim::Quat q = to_quaternion(writing, numbers, what);
  path.orientation.insert(path.orientation.end(), {q.w(), q.x(), q.y(), q.z()});
}

}  // namespace

sim::Results read_mbdyn_mov(const std::filesystem::path& path, std::optional<double> step, bool need_times) {
  const std::string file = path.string(), text = read_text(path);
  const std::filesystem::path stem = path.parent_path() / path.stem();
  const std::map<int, TurnWriting> log = read_log(stem.string() + ".log");
  std::map<int, Path> paths;
  std::vector<int> order;
  std::vector<double> numbers;
  size_t samples = 0;
  int number = 0;
  bool assumed = false;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size());
    const std::string_view line = std::string_view(text).substr(at, end - at);
    at = end + 1;
    ++number;
    const auto fail = [&](const std::string& message) { throw InputError(fmt::format("{}:{}: {}", file, number, message)); };
    if (!read_numbers(line, numbers)) fail(fmt::format("holds no line of numbers, but {}", sim::quote(line)));
    if (numbers.empty()) continue;
    if (numbers.size() < 7 || numbers[0] != std::floor(numbers[0]) || std::abs(numbers[0]) > 2e9)
      fail("a node's label, position, orientation and velocities are needed");
    const int label = static_cast<int>(numbers[0]);
    if (!order.empty() && label == order.front()) ++samples;
    if (paths.find(label) == paths.end()) {
      if (samples > 1) fail(fmt::format("node {} was not there before", label));
      order.push_back(label);
      samples = std::max<size_t>(samples, 1);
    }
    TurnWriting writing = euler("123");
    const auto known = log.find(label);
    if (known != log.end()) writing = known->second;
    else if (numbers.size() <= 10) writing = TurnWriting{};
    else if (numbers.size() == 25 || (numbers.size() == 19 && log.empty()))
      fail("its orientation may be a matrix or accelerations follow: the .log file, which says so, is missing beside it");
    else assumed = true;
    const size_t count = turn_count(writing.form);
    if (numbers.size() < 4 + count) fail(fmt::format("has {} numbers, {} are needed", numbers.size(), 4 + count));
    Path& of_node = paths[label];
    if (of_node.position.size() != 3 * (samples - 1)) fail(fmt::format("node {} is there twice, or was left out before", label));
    of_node.position.insert(of_node.position.end(), numbers.begin() + 1, numbers.begin() + 4);
    std::array<double, 9> turn{};
    std::copy_n(numbers.begin() + 4, count, turn.begin());
    add_turn(writing, turn, fmt::format("{}:{}: the orientation of node {} ", file, number, label), of_node);
  }
  if (paths.empty()) throw InputError(fmt::format("{}: holds no nodes", file));
  sim::Results results;
  results.title = path.stem().string();
  for (const int label : order) {
    if (paths[label].position.size() != 3 * samples)
      throw InputError(fmt::format("{}: node {} has {} samples, node {} has {}: the file ends within a step", file, label,
                                   paths[label].position.size() / 3, order.front(), samples));
    results.bodies.push_back(to_body(label, paths[label]));
  }
  const std::vector<double> times = step ? std::vector<double>{} : read_times(stem.string() + ".out");
  if (!step && times.size() != samples) {
    const std::string found = fmt::format("has {} samples, {}.out beside it tells {} times", samples, stem.string(), times.size());
    if (need_times) throw InputError(fmt::format("{}: {}; give --step SECONDS", file, found));
    results.statistics.notes.tell("", fmt::format("{}: samples stand for seconds here; flexframe import wants --step SECONDS", found));
    step = 1.0;
  }
  results.times.resize(static_cast<Eigen::Index>(samples));
  for (size_t i = 0; i < samples; ++i) results.times[static_cast<Eigen::Index>(i)] = step ? *step * static_cast<double>(i) : times[i];
  if (assumed)
    results.statistics.notes.tell(
        "",
        fmt::format("{}.log, which says how orientations are written, is missing: angles are taken as euler123 in degrees, MBDyn's default",
                    stem.string()));
  return results;
}

namespace {

// NetCDF's functions; it is opened with the first of its files.
struct NetCdfLibrary : sim::LateLibrary {
  NetCdfLibrary() : LateLibrary(FLEXFRAME_NETCDF_FILE, "NetCDF files") {}
  decltype(&nc_close) close = function("nc_close");
  decltype(&nc_free_string) free_string = function("nc_free_string");
  decltype(&nc_get_att_string) get_att_string = function("nc_get_att_string");
  decltype(&nc_get_att_text) get_att_text = function("nc_get_att_text");
  decltype(&nc_get_var_double) get_var_double = function("nc_get_var_double");
  decltype(&nc_inq_att) inq_att = function("nc_inq_att");
  decltype(&nc_inq_dimlen) inq_dimlen = function("nc_inq_dimlen");
  decltype(&nc_inq_nvars) inq_nvars = function("nc_inq_nvars");
  decltype(&nc_inq_vardimid) inq_vardimid = function("nc_inq_vardimid");
  decltype(&nc_inq_varid) inq_varid = function("nc_inq_varid");
  decltype(&nc_inq_varname) inq_varname = function("nc_inq_varname");
  decltype(&nc_inq_varndims) inq_varndims = function("nc_inq_varndims");
  decltype(&nc_open) open = function("nc_open");
  decltype(&nc_strerror) strerror = function("nc_strerror");
};
const NetCdfLibrary& netcdf() {
  static const NetCdfLibrary library;
  return library;
}

// An open NetCDF file.
class NetCdf {
 public:
  explicit NetCdf(const std::filesystem::path& path) : name_(path.string()) {
    if (const int status = netcdf().open(name_.c_str(), NC_NOWRITE, &file_); status != NC_NOERR)
      throw InputError(fmt::format("{}: is no NetCDF file that can be read: {}", name_, netcdf().strerror(status)));
  }
  ~NetCdf() { netcdf().close(file_); }
  NetCdf(const NetCdf&) = delete;
  NetCdf& operator=(const NetCdf&) = delete;

  [[noreturn]] void fail(const std::string& message) const { throw InputError(fmt::format("{}: {}", name_, message)); }
  int find(const std::string& name) const {
    int variable = -1;
    return netcdf().inq_varid(file_, name.c_str(), &variable) == NC_NOERR ? variable : -1;
  }

  // All values, rows first; `width` numbers a row.
  std::vector<double> numbers(const std::string& name, size_t rows, size_t width) const {
    const int variable = find(name);
    if (variable < 0) fail(fmt::format("lacks the variable {}", name));
    int rank = 0, dims[NC_MAX_VAR_DIMS];
    netcdf().inq_varndims(file_, variable, &rank);
    netcdf().inq_vardimid(file_, variable, dims);
    size_t count = rank > 0 ? 1 : 0, first = 0;
    for (int k = 0; k < rank; ++k) {
      size_t length = 0;
      netcdf().inq_dimlen(file_, dims[k], &length);
      if (k == 0) first = length;
      if (length > 0 && count > 1'000'000'000 / length) fail(fmt::format("variable {} is too large", name));
      count *= length;
    }
    if (rows == 0) rows = first;
    if (first != rows || count != rows * width)
      fail(fmt::format("variable {} has {} values in {} rows; {} in {} are needed", name, count, first, rows * width, rows));
    std::vector<double> out(count);
    if (const int status = netcdf().get_var_double(file_, variable, out.data()); status != NC_NOERR)
      fail(fmt::format("variable {} cannot be read: {}", name, netcdf().strerror(status)));
    for (const double value : out)
      if (!std::isfinite(value)) fail(fmt::format("variable {} holds a value that is not finite", name));
    return out;
  }

  std::string text(int variable, const char* attribute) const {
    size_t length = 0;
    nc_type type = NC_NAT;
    if (netcdf().inq_att(file_, variable, attribute, &type, &length) != NC_NOERR || length > 10000) return "";
    if (type == NC_CHAR) {
      std::string out(length, '\0');
      return netcdf().get_att_text(file_, variable, attribute, out.data()) == NC_NOERR ? out : "";
    }
    if (type != NC_STRING || length != 1) return "";
    char* one = nullptr;
    if (netcdf().get_att_string(file_, variable, attribute, &one) != NC_NOERR) return "";
    std::string out = one ? one : "";
    netcdf().free_string(1, &one);
    return out;
  }

  std::vector<std::string> names() const {
    int count = 0;
    netcdf().inq_nvars(file_, &count);
    std::vector<std::string> out;
    for (int k = 0; k < count; ++k) {
      char name[NC_MAX_NAME + 1] = {};
      if (netcdf().inq_varname(file_, k, name) == NC_NOERR) out.emplace_back(name);
    }
    return out;
  }

 private:
  std::string name_;
  int file_ = -1;
};

// The orientation of a node: R column by column, Phi, or E in degrees with its sequence in the description.
TurnWriting find_turn(const NetCdf& file, const std::string& base, std::string& variable) {
  TurnWriting writing;
  if (file.find(base + "R") >= 0) {
    variable = base + "R";
    writing.form = TurnForm::matrix;
    writing.by_columns = true;
  } else if (file.find(base + "Phi") >= 0) {
    variable = base + "Phi";
    writing.form = TurnForm::vector;
  } else if (file.find(base + "E") >= 0) {
    variable = base + "E";
    const std::string said = file.text(file.find(variable), "description");
    for (const char* digits : {"123", "313", "321"})
      if (said.find(digits) != std::string::npos) writing = euler(digits);
    if (writing.form == TurnForm::none)
      file.fail(fmt::format("variable {} does not say by its description whether its angles are 123, 313 or 321", variable));
  }
  return writing;
}

}  // namespace

sim::Results read_mbdyn_netcdf(const std::filesystem::path& path) {
  const NetCdf file(path);
  const std::vector<double> times = file.numbers("time", 0, 1);
  sim::Results results;
  results.title = path.stem().string();
  results.times = Eigen::Map<const sim::VecX>(times.data(), std::ssize(times));
  std::set<int> labels;
  for (const std::string& name : file.names()) {
    int label = 0;
    if (!name.starts_with("node.struct.") || !name.ends_with(".X")) continue;
    const auto [end, error] = std::from_chars(name.data() + 12, name.data() + name.size() - 2, label);
    if (error == std::errc() && end == name.data() + name.size() - 2) labels.insert(label);
  }
  if (labels.empty()) file.fail("holds no node of MBDyn (node.struct.LABEL.X)");
  for (const int label : labels) {
    const std::string base = fmt::format("node.struct.{}.", label);
    Path of_node;
    of_node.position = file.numbers(base + "X", times.size(), 3);
    std::string variable;
    const TurnWriting writing = find_turn(file, base, variable);
    const size_t count = turn_count(writing.form);
    const std::vector<double> turns = count > 0 ? file.numbers(variable, times.size(), count) : std::vector<double>{};
    for (size_t i = 0; i < times.size(); ++i) {
      std::array<double, 9> numbers{};
      std::copy_n(turns.begin() + static_cast<std::ptrdiff_t>(i * count), count, numbers.begin());
      add_turn(writing, numbers, fmt::format("{}: {} at sample {} ", path.string(), variable, i), of_node);
    }
    results.bodies.push_back(to_body(label, of_node));
  }
  return results;
}

}  // namespace flexframe::imports
