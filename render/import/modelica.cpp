// Modelica result files. Layout: Modelica Association / Dymola User Manual, "result file format": MAT level 4 with
//   Aclass      4 rows of text: "Atrajectory", "1.1", "", "binTrans" or "binNormal" (binTrans: all matrices but this one are transposed)
//   name        of each variable; description: its text with the unit in brackets at the end
//   dataInfo    of each variable: matrix (0: time, 1, 2), column with sign (an alias that is negated), two numbers of no use here
//   data_1      parameters, two rows (start and stop); data_2: variables, a row a time, the first column the time
#include "render/import/table.h"

#include "sim/base/late_library.h"
#include "sim/base/words.h"

#include <fmt/format.h>
#include <matio.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace flexframe::imports {
namespace {

// matio's functions; it is opened with the first of its files.
struct Matio : sim::LateLibrary {
  Matio() : LateLibrary(FLEXFRAME_MATIO_FILE, "MAT files (matio)") {}
  decltype(&Mat_Close) close = function("Mat_Close");
  decltype(&Mat_LogInitFunc) set_log = function("Mat_LogInitFunc");
  decltype(&Mat_Open) open = function("Mat_Open");
  decltype(&Mat_Rewind) rewind = function("Mat_Rewind");
  decltype(&Mat_VarFree) free = function("Mat_VarFree");
  decltype(&Mat_VarRead) read = function("Mat_VarRead");
};
const Matio& matio() {
  static const Matio library;
  return library;
}

struct FileCloser {
  void operator()(mat_t* file) const { matio().close(file); }
};
struct VariableFreer {
  void operator()(matvar_t* variable) const { matio().free(variable); }
};
using Variable = std::unique_ptr<matvar_t, VariableFreer>;

// Reads one file; messages begin with its name.
class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : name_(path.string()) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) throw InputError(fmt::format("{}: no such file", name_));
    matio().set_log("flexframe", [](int, char*) {});  // matio would print
    file_.reset(matio().open(name_.c_str(), MAT_ACC_RDONLY));
    if (!file_) throw InputError(fmt::format("{}: is no MAT file that can be read", name_));
  }

  [[noreturn]] void fail(const std::string& message) const { throw InputError(fmt::format("{}: {}", name_, message)); }

  Variable find(const char* name) const {
    matio().rewind(file_.get());
    Variable found(matio().read(file_.get(), name));
    if (found && (found->rank != 2 || !found->data)) fail(fmt::format("matrix '{}' is no table of two dimensions with values", name));
    return found;
  }
  Variable need(const char* name) const {
    Variable found = find(name);
    if (!found)
      fail(fmt::format(
          "is no Modelica result: it lacks the matrix '{}'; such a file has Aclass, name, description, dataInfo, data_1, data_2", name));
    return found;
  }

  sim::MatX numbers(const matvar_t& v) const {
    const auto rows = static_cast<Eigen::Index>(v.dims[0]), cols = static_cast<Eigen::Index>(v.dims[1]);
    const auto as = [&](auto* data) {
      return Eigen::Map<Eigen::Matrix<std::remove_pointer_t<decltype(data)>, -1, -1>>(data, rows, cols).template cast<double>().eval();
    };
    switch (v.data_type) {
      case MAT_T_DOUBLE:
        return as(static_cast<double*>(v.data));
      case MAT_T_SINGLE:
        return as(static_cast<float*>(v.data));
      case MAT_T_INT32:
        return as(static_cast<std::int32_t*>(v.data));
      case MAT_T_INT16:
        return as(static_cast<std::int16_t*>(v.data));
      case MAT_T_UINT8:
        return as(static_cast<std::uint8_t*>(v.data));
      default:
        fail(fmt::format("matrix '{}' holds numbers of a kind that a Modelica result does not have", v.name ? v.name : ""));
    }
  }

  // Rows of text, blanks and zeros at their ends removed; transposed: a text a column.
  std::vector<std::string> texts(const matvar_t& v, bool transposed) const {
    const auto rows = v.dims[0], cols = v.dims[1];
    const auto letter = [&](size_t i, size_t j) -> char {
      const size_t at = j * rows + i;
      switch (v.data_size) {
        case 1:
          return static_cast<const char*>(v.data)[at];
        case 2:
          return static_cast<char>(static_cast<const std::uint16_t*>(v.data)[at]);
        case 8:
          return static_cast<char>(static_cast<const double*>(v.data)[at]);
        default:
          fail(fmt::format("matrix '{}' is no text", v.name ? v.name : ""));
      }
    };
    std::vector<std::string> out(transposed ? cols : rows);
    for (size_t k = 0; k < out.size(); ++k) {
      for (size_t j = 0; j < (transposed ? rows : cols); ++j) out[k] += transposed ? letter(j, k) : letter(k, j);
      out[k].erase(std::find(out[k].begin(), out[k].end(), '\0'), out[k].end());
      while (!out[k].empty() && out[k].back() == ' ') out[k].pop_back();
    }
    return out;
  }

 private:
  std::string name_;
  std::unique_ptr<mat_t, FileCloser> file_;
};

// The unit at the end of "Position of slider [m]" or "[deg|rad]": values are in the first.
std::string unit_of(const std::string& description) {
  const auto open = description.rfind('['), close = description.rfind(']');
  if (open == std::string::npos || close == std::string::npos || close < open) return "";
  const std::string inside = description.substr(open + 1, close - open - 1);
  const std::string unit = inside.substr(0, inside.find('|'));
  return unit.starts_with(":#") ? "" : unit;
}

}  // namespace

Table read_modelica(const std::filesystem::path& path) {
  const Reader reader(path);
  const std::vector<std::string> aclass = reader.texts(*reader.need("Aclass"), false);
  if (aclass.size() < 4 || aclass[0] != "Atrajectory" || aclass[1] != "1.1" || (aclass[3] != "binTrans" && aclass[3] != "binNormal"))
    reader.fail(fmt::format("is no Modelica result of version 1.1: its Aclass is \"{}\"", fmt::join(aclass, "\", \"")));
  const bool transposed = aclass[3] == "binTrans";
  const std::vector<std::string> names = reader.texts(*reader.need("name"), transposed);
  std::vector<std::string> descriptions(names.size());
  if (const Variable found = reader.find("description")) descriptions = reader.texts(*found, transposed);
  sim::MatX info = reader.numbers(*reader.need("dataInfo")), parameters = reader.numbers(*reader.need("data_1")),
            series = reader.numbers(*reader.need("data_2"));
  if (!transposed) info.transposeInPlace();
  else parameters.transposeInPlace(), series.transposeInPlace();
  if (info.rows() < 2 || info.cols() != std::ssize(names) || descriptions.size() != names.size())
    reader.fail(fmt::format("names {} variables, but describes {} and places {}", names.size(), descriptions.size(), info.cols()));
  if (series.rows() == 0 || series.cols() == 0) reader.fail("holds no times");

  Table table;
  table.file = path.string();
  table.kind = modelica_kind;
  table.times = series.col(0);
  for (size_t k = 0; k < names.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    const double matrix = info(0, at), place = info(1, at);
    const double last = static_cast<double>(matrix == 1.0 ? parameters.cols() : series.cols());
    if (!((matrix == 0.0 || matrix == 1.0 || matrix == 2.0) && std::abs(place) >= 1.0 && std::abs(place) <= last &&
          place == std::floor(place)))
      reader.fail(
          fmt::format("places variable {} in column {} of matrix data_{}, which does not exist", sim::quote(names[k]), place, matrix));
    if (matrix == 0.0 || (k == 0 && std::abs(place) == 1.0 && matrix == 2.0 && (names[k] == "time" || names[k] == "Time"))) continue;
    const auto index = static_cast<Eigen::Index>(std::abs(place)) - 1;
    const double sign = place < 0.0 ? -1.0 : 1.0;
    Column column{.name = without_index_blanks(names[k]),
                  .unit = unit_of(descriptions[k]),
                  .description = descriptions[k],
                  .index = index,
                  .factor = sign};
    if (matrix == 1.0) {
      if (parameters.rows() == 0) reader.fail("its matrix data_1 has no rows");
      column.index = -1;
      column.factor = sign * parameters(0, index);
    }
    table.columns.push_back(std::move(column));
  }
  table.values = std::move(series);
  keep_last_of_each_time(table);
  return table;
}

}  // namespace flexframe::imports
