// [[block]] tables: PID controllers, transfer functions and state-space blocks, all as matrices.
#include "sim/base/words.h"
#include "sim/scene/read_states.h"
#include "sim/scene/readings.h"

#include <unsupported/Eigen/MatrixFunctions>

#include <fmt/format.h>

#include <algorithm>

namespace flexframe::sim {
namespace {

const std::vector<std::string> block_kinds{"pid", "transfer-function", "state-space"};
enum class BlockKind { pid, transfer_function, state_space };

// Samples of a run are kept as times at which the integration restarts.
constexpr double most_samples = 1e6;

// States: the integral and the filtered input. Inputs: what is controlled, and its rate where that is given.
void read_pid(const TableReader& reader, BlockDef& out) {
  reader.allow({"name", "kind", "input", "rate", "proportional", "integral", "derivative", "filter", "sample", "initial"});
  const double p = reader.number("proportional", 0.0, any_number), i = reader.number("integral", 0.0, any_number),
               d = reader.number("derivative", 0.0, any_number);
  if (p == 0.0 && i == 0.0 && d == 0.0) reader.fail("needs 'proportional', 'integral' or 'derivative'");
  const bool rate = reader.has("rate");
  if (d == 0.0 && rate) reader.fail("rate", "belongs to 'derivative', which is not given");
  if (rate == reader.has("filter") && d != 0.0)
    reader.fail("derivative",
                "needs either 'rate', an expression of the input's rate, or 'filter', the time constant over which the input is "
                "differentiated, s");
  if (rate) {
    out.A = MatX::Zero(1, 1);
    out.B = Eigen::RowVector2d(1.0, 0.0);
    out.C = MatX::Constant(1, 1, i);
    out.D = Eigen::RowVector2d(p, d);
    return;
  }
  const double filter = d != 0.0 ? reader.number("filter", positive.in("s")) : 1.0;
  out.A = MatX::Zero(2, 2);
  out.A(1, 1) = -1.0 / filter;
  out.B = Eigen::Vector2d(1.0, 1.0 / filter);
  out.C = Eigen::RowVector2d(i, -d / filter);
  out.D = MatX::Constant(1, 1, p + d / filter);
}

// Controllable canonical form; highest power first, as the scene says it.
void read_transfer_function(const TableReader& reader, BlockDef& out) {
  reader.allow({"name", "kind", "input", "numerator", "denominator", "sample", "initial"});
  std::vector<double> b = reader.numbers("numerator", 1, 20), a = reader.numbers("denominator", 1, 20);
  if (a.front() == 0.0) reader.fail("denominator", "must not begin with 0: it is the coefficient of the highest power of s");
  if (b.size() > a.size())
    reader.fail("numerator", fmt::format("has {} coefficients, the denominator {}: its order must not be higher (that would differentiate)",
                                         b.size(), a.size()));
  b.insert(b.begin(), a.size() - b.size(), 0.0);
  const Eigen::Index n = static_cast<Eigen::Index>(a.size()) - 1;
  const auto at = [](const std::vector<double>& c, Eigen::Index k) { return c[k]; };
  out.A = MatX::Zero(n, n);
  out.B = MatX::Zero(n, 1);
  out.C = MatX::Zero(1, n);
  out.D = MatX::Constant(1, 1, b.front() / a.front());
  for (Eigen::Index k = 0; k < n; ++k) {
    if (k + 1 < n) out.A(k, k + 1) = 1.0;
    out.A(n - 1, k) = -at(a, n - k) / a.front();
    out.C(0, k) = (at(b, n - k) - out.D(0, 0) * at(a, n - k)) / a.front();
  }
  if (n > 0) out.B(n - 1, 0) = 1.0;
}

void read_state_space(const TableReader& reader, BlockDef& out) {
  reader.allow({"name", "kind", "input", "A", "B", "C", "D", "sample", "discrete", "initial"});
  if (reader.has("A")) {
    out.A = reader.matrix("A");
    out.B = reader.matrix("B");
    out.C = reader.matrix("C");
  } else {
    reader.required("D");
  }
  const Eigen::Index n = out.A.rows();
  if (out.A.cols() != n) reader.fail("A", fmt::format("must be square, found {} x {}", n, out.A.cols()));
  if (reader.has("D")) out.D = reader.matrix("D");
  const Eigen::Index inputs = reader.has("D") ? out.D.cols() : out.B.cols(), outputs = reader.has("D") ? out.D.rows() : out.C.rows();
  if (!reader.has("D")) out.D = MatX::Zero(outputs, inputs);
  if (n == 0) {
    out.A.resize(0, 0);
    out.B.resize(0, inputs);
    out.C.resize(outputs, 0);
  }
  if (out.B.rows() != n || out.B.cols() != inputs)
    reader.fail("B",
                fmt::format("must have {} rows, as A, and {} columns, one an input; found {} x {}", n, inputs, out.B.rows(), out.B.cols()));
  if (out.C.cols() != n || out.C.rows() != outputs)
    reader.fail(
        "C", fmt::format("must have {} columns, as A, and {} rows, one an output; found {} x {}", n, outputs, out.C.rows(), out.C.cols()));
}

// x+ = exp(A h) x + int exp(A s) ds B u, exact for an input that is held.
void make_sampled(BlockDef& out) {
  const Eigen::Index n = out.A.rows(), m = out.B.cols();
  MatX both = MatX::Zero(n + m, n + m);
  both.topLeftCorner(n, n) = out.sample * out.A;
  both.topRightCorner(n, m) = out.sample * out.B;
  const MatX step = both.exp();
  out.A = step.topLeftCorner(n, n);
  out.B = step.topRightCorner(n, m);
}

void read_matrices(const TableReader& reader, const Scene& scene, BlockDef& out) {
  const auto kind = static_cast<BlockKind>(reader.word("kind", block_kinds));
  if (kind == BlockKind::pid) read_pid(reader, out);
  else if (kind == BlockKind::transfer_function) read_transfer_function(reader, out);
  else read_state_space(reader, out);
  out.sample = reader.number("sample", 0.0, positive.in("s"));
  if (out.sample > 0.0 && scene.simulation.duration / out.sample > most_samples)
    reader.fail("sample", fmt::format("makes {:.3g} samples in the run; at most {:.0e} are allowed", scene.simulation.duration / out.sample,
                                      most_samples));
  const bool discrete = kind == BlockKind::state_space && reader.boolean("discrete", false);
  if (discrete && out.sample == 0.0) reader.fail("discrete", "needs 'sample': the matrices lead from one sample to the next");
  if (out.sample > 0.0 && !discrete) make_sampled(out);
  out.initial = VecX::Zero(out.A.rows());
  if (!reader.has("initial")) return;
  const std::size_t n = out.A.rows();
  const std::vector<double> x = reader.number_or_numbers("initial", n, n);
  out.initial = Eigen::Map<const VecX>(x.data(), out.A.rows());
}

void read_inputs(const TableReader& reader, const Scene& scene, BlockDef& out) {
  const auto read = [&](const TableReader& from, const char* key) {
    StateExpression found = read_state_expression(from, key, nullptr, scene);
    out.inputs.push_back(std::move(found.text));
    out.driven.push_back(std::move(found.driven));
    out.reads.push_back(std::move(found.reads));
  };
  const TomlValue& input = reader.required("input");
  if (input.type != TomlValue::Type::array) {
    read(reader, "input");
  } else {
    // Each as if it stood alone, so that its errors are told alike.
    for (const TomlValue& item : input.items) {
      TomlValue alone;
      alone.line = item.line;
      alone.file = reader.value().file;
      alone.keys = {"input"};
      alone.key_lines = {item.line};
      alone.items = {item};
      TableReader one(alone, reader.file(), fmt::format("[[block]] {}", quote(out.name)));
      one.set_parameters(reader.parameters());
      read(one, "input");
    }
  }
  if (reader.has("rate")) read(reader, "rate");
  if (static_cast<Eigen::Index>(out.inputs.size()) != out.D.cols())
    reader.fail("input", fmt::format("must be {} expression{}, found {}", out.D.cols(), out.D.cols() == 1 ? "" : "s", out.inputs.size()));
}

}  // namespace

void read_block(TableReader& reader, Scene& scene, bool inputs) {
  const std::string name = reader.text("name");
  check_name(reader, "name", name, "block");
  reader.set_label(fmt::format("[[block]] {}", quote(name)));
  const auto known = std::find_if(scene.blocks.begin(), scene.blocks.end(), [&](const BlockDef& b) { return b.name == name; });
  if (inputs) {
    read_inputs(reader, scene, *known);
    return;
  }
  if (known != scene.blocks.end()) reader.fail("name", fmt::format("is already the name of the block in line {}", known->line));
  for (const OutputDef& output : scene.outputs)
    if (output.name == name) reader.fail("name", fmt::format("is already the name of the output in line {}", output.line));
  BlockDef out;
  out.line = reader.line();
  out.name = name;
  read_matrices(reader, scene, out);
  scene.blocks.push_back(std::move(out));
}

}  // namespace flexframe::sim
