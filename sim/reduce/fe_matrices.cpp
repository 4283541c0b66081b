// K and M from files: Matrix Market, CalculiX matrix storage. See read_fe_matrices in fe_model.h.
#include "sim/reduce/fe_model.h"

#include "sim/base/files_read.h"
#include "sim/base/plain_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <set>
#include <unordered_map>

namespace flexframe::sim {
namespace {

std::ifstream open(const std::filesystem::path& path) {
  std::error_code error;
  std::ifstream in(path);
  if (!in || std::filesystem::is_directory(path, error)) throw InputError(fmt::format("{}: cannot be opened", path.string()));
  note_file_read(path);
  return in;
}

struct Entries {
  long rows = 0;
  bool market = false;
  std::vector<Eigen::Triplet<double>> triplets;
};

// "row column value" a line; Matrix Market has a banner and a size line, CalculiX writes the upper triangle without either.
Entries read_entries(const std::filesystem::path& path, double factor) {
  std::ifstream in = open(path);
  Entries out;
  std::string line;
  int number = 0;
  bool symmetric = true, sized = true;
  bool& market = out.market;
  long announced = 0, found = 0;
  const auto fail = [&](const std::string& text) { throw InputError(fmt::format("{}:{}: {}", path.string(), number, text)); };
  while (std::getline(in, line)) {
    ++number;
    if (number == 1 && line.starts_with("%%MatrixMarket")) {
      market = true;
      sized = false;
      std::string lower;
      lower = plain_lower(line);
      if (lower.find("coordinate") == std::string::npos ||
          (lower.find("real") == std::string::npos && lower.find("integer") == std::string::npos))
        fail("Matrix Market: 'matrix coordinate real' is expected");
      symmetric = lower.find("symmetric") != std::string::npos;
      if (!symmetric && lower.find("general") == std::string::npos) fail("Matrix Market: 'symmetric' or 'general' is expected");
      continue;
    }
    if (line.empty() || line[0] == '%' || line.find_first_not_of(" \t\r") == std::string::npos) continue;
    char* end = nullptr;
    const long row = std::strtol(line.c_str(), &end, 10);
    char* next = nullptr;
    const long column = std::strtol(end, &next, 10);
    if (end == line.c_str() || next == end) fail(fmt::format("'row column value' is expected, found '{}'", line.substr(0, 40)));
    if (!sized) {
      sized = true;
      out.rows = row;
      char* after = nullptr;
      announced = std::strtol(next, &after, 10);
      if (after == next || announced < 1) fail("'rows columns entries' is expected");
      if (row != column || row < 1 || row > 100000000L) fail(fmt::format("a square matrix is expected, found {} x {}", row, column));
      continue;
    }
    for (char* c = next; *c; ++c)
      if (*c == 'D' || *c == 'd') *c = 'e';
    const char* behind = nullptr;
    const double value = leading_number(next, &behind);
    if (behind == next || !std::isfinite(value)) fail(fmt::format("'row column value' is expected, found '{}'", line.substr(0, 40)));
    if (row < 1 || column < 1 || (market && (row > out.rows || column > out.rows)) || row > 100000000L || column > 100000000L)
      fail(fmt::format("entry ({}, {}) is outside of the matrix", row, column));
    ++found;
    if (!market) out.rows = std::max({out.rows, row, column});
    const int r = static_cast<int>(row) - 1, c = static_cast<int>(column) - 1;
    out.triplets.emplace_back(r, c, factor * value);
    if (symmetric && r != c) out.triplets.emplace_back(c, r, factor * value);
  }
  require_whole(in, path);
  if (out.triplets.empty()) fail("the matrix has no entries");
  if (market && found != announced)
    throw InputError(fmt::format("{}: {} entries are announced, {} are there", path.string(), announced, found));
  return out;
}

Eigen::SparseMatrix<double> matrix(const Entries& entries, int n, const std::filesystem::path& path) {
  Eigen::SparseMatrix<double> A(n, n);
  A.setFromTriplets(entries.triplets.begin(), entries.triplets.end());
  const Eigen::SparseMatrix<double> difference = A - Eigen::SparseMatrix<double>(A.transpose());
  double largest = 0.0, skew = 0.0;
  for (int k = 0; k < A.nonZeros(); ++k) largest = std::max(largest, std::abs(A.valuePtr()[k]));
  for (int k = 0; k < difference.nonZeros(); ++k) skew = std::max(skew, std::abs(difference.valuePtr()[k]));
  if (skew > 1e-8 * largest) throw InputError(fmt::format("{}: the matrix is not symmetric", path.string()));
  return A;
}

// A file without a size line that is cut short shows it only by this: CalculiX writes every diagonal entry, zeros too.
void warn_of_missing_rows(const Entries& mass, long n, const std::filesystem::path& path, std::vector<std::string>& warnings) {
  if (mass.market) return;
  std::vector<bool> there(static_cast<size_t>(n));
  for (const Eigen::Triplet<double>& t : mass.triplets)
    if (t.row() == t.col()) there[static_cast<size_t>(t.row())] = true;
  const long missing = std::count(there.begin(), there.end(), false);
  if (missing == 0) return;
  const auto first = std::find(there.begin(), there.end(), false) - there.begin() + 1;
  warnings.push_back(
      fmt::format("{}: {} of {} rows have no diagonal entry (the first: {}) and are taken as without mass; CalculiX writes "
                  "each of them, so the file may be cut short",
                  path.string(), missing, n, first));
}

}  // namespace

FeModel read_fe_matrices(const std::filesystem::path& stiffness, const std::filesystem::path& mass, const std::filesystem::path& nodes,
                         const std::filesystem::path& dofs, const FeUnits& units) {
  FeModel model;
  const std::string ending = nodes.extension().string();
  if (ending == ".inp") {
    // The mesh stays with the matrices: it gives the surface, and the neighbourhoods for node rotations.
    model = read_inp(nodes, units);
  } else {
    std::ifstream in = open(nodes);
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
      if (line.find_first_not_of(" \t\r") == std::string::npos || line[0] == '#' || line[0] == '%') continue;
      std::replace(line.begin(), line.end(), ',', ' ');
      char* end = nullptr;
      const long id = std::strtol(line.c_str(), &end, 10);
      const char* at = end;
      Vec3 x;
      bool good = end != line.c_str() && id > 0 && id <= 2147483647L;
      for (int d = 0; d < 3 && good; ++d) {
        const char* next = nullptr;
        x(d) = leading_number(at, &next);
        good = next != at && std::isfinite(x(d));
        at = next;
      }
      if (!good) throw InputError(fmt::format("{}:{}: 'id x y z' is expected, found '{}'", nodes.string(), number, line.substr(0, 40)));
      model.node_ids.push_back(static_cast<int>(id));
      model.nodes.push_back(units.length * x);
    }
    require_whole(in, nodes);
  }
  model.file = stiffness.string();
  std::unordered_map<int, int> index;
  for (size_t i = 0; i < model.node_ids.size(); ++i)
    if (!index.emplace(model.node_ids[i], static_cast<int>(i)).second)
      throw InputError(fmt::format("{}: node {} is there twice", nodes.string(), model.node_ids[i]));

  const Entries K = read_entries(stiffness, units.mass / (units.time * units.time)), M = read_entries(mass, units.mass);
  const long n = std::max(K.rows, M.rows);
  FeMatrices matrices;
  std::set<std::pair<int, long>> described;
  if (!dofs.empty()) {
    std::ifstream in = open(dofs);
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
      if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
      char* end = nullptr;
      const long node = std::strtol(line.c_str(), &end, 10);
      const long dof = *end == '.' ? std::strtol(end + 1, nullptr, 10) : 0;
      const auto at = index.find(static_cast<int>(node));
      if (dof < 1 || dof > 6)
        throw InputError(
            fmt::format("{}:{}: 'node.dof' with dof 1 to 6 is expected, found '{}'", dofs.string(), number, line.substr(0, 40)));
      if (at != index.end() && !described.emplace(at->second, dof).second)
        throw InputError(fmt::format("{}:{}: {}.{} is there twice", dofs.string(), number, node, dof));
      if (at == index.end()) throw InputError(fmt::format("{}:{}: node {} is not in {}", dofs.string(), number, node, nodes.string()));
      matrices.node.push_back(at->second);
      matrices.dof.push_back(static_cast<int>(dof) - 1);
    }
    require_whole(in, dofs);
  } else {
    for (size_t i = 0; i < model.nodes.size(); ++i)
      for (int d = 0; d < 3; ++d) {
        matrices.node.push_back(static_cast<int>(i));
        matrices.dof.push_back(d);
      }
  }
  if (static_cast<long>(matrices.node.size()) != n)
    throw InputError(
        fmt::format("{}: the matrices have {} rows, {} degrees of freedom are described", stiffness.string(), n, matrices.node.size()));
  matrices.K = matrix(K, static_cast<int>(n), stiffness);
  matrices.M = matrix(M, static_cast<int>(n), mass);
  warn_of_missing_rows(M, n, mass, model.warnings);
  model.matrices = std::move(matrices);
  model.constraints.clear();
  model.spiders.clear();
  return model;
}

}  // namespace flexframe::sim
