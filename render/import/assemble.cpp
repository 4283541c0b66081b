#include "render/import/assemble.h"

#include "sim/base/spatial.h"
#include "sim/base/words.h"
#include "sim/bodies/body_file.h"
#include "sim/scene/units.h"

#include <fmt/format.h>

#include <set>

namespace flexframe::imports {
namespace {

constexpr sim::Dimension metres{.metre = 1}, radians{.radian = 1}, plain{};

// Takes columns of the table in SI units and remembers which were taken.
class Taker {
 public:
  Taker(const Table& table, const Mapping& mapping) : table_(table), mapping_(mapping) {
    for (const Column& column : table.columns) names_.push_back(column.name);
  }

  // nt values of a source whose numbers are of this dimension.
  sim::VecX take(const Source& source, const sim::Dimension& wanted, const std::string& what) {
    const double unit = wanted == metres ? mapping_.length_unit : wanted == radians ? mapping_.angle_unit : 1.0;
    if (source.column.empty()) return sim::VecX::Constant(table_.times.size(), unit * source.constant);
    const Column* column = table_.find(source.column);
    if (!column)
      throw InputError(fmt::format("{}{}: {} has no column {}{}; its columns: {}", place(source.line), what, table_.file,
                                   sim::quote(source.column), sim::did_you_mean(source.column, names_), sim::list_words(names_, 12)));
    double factor = unit;
    if (!column->unit.empty() && column->unit != "1") {
      const auto parsed = sim::parse_unit(column->unit);
      if (!parsed || !sim::fits(parsed->dimension, wanted))
        throw InputError(fmt::format("{}{}: column {} of {} has the unit {}; {} is needed", place(source.line), what,
                                     sim::quote(source.column), table_.file, sim::quote(column->unit),
                                     wanted == metres    ? "a length"
                                     : wanted == radians ? "an angle"
                                                         : "a number without unit"));
      factor = parsed->factor;
    } else if (!mapping_.units_given && wanted != plain) {
      unsaid_ = true;
    }
    taken_.insert(column->name);
    return factor * (source.factor * table_.series(*column).array() + source.constant).matrix();
  }

  Eigen::MatrixX3d take3(const std::array<Source, 3>& sources, const sim::Dimension& wanted, const std::string& what) {
    Eigen::MatrixX3d out(table_.times.size(), 3);
    for (int k = 0; k < 3; ++k) out.col(k) = take(sources[k], wanted, what);
    return out;
  }

  // nt quaternions w x y z.
  Eigen::MatrixX4d take_turn(const TurnSource& turn, const std::string& what) {
    const Eigen::Index nt = table_.times.size();
    Eigen::MatrixX4d out(nt, 4);
    const bool angles =
        turn.writing.form == TurnForm::euler || turn.writing.form == TurnForm::vector || turn.writing.form == TurnForm::angle;
    const int count = turn_count(turn.writing.form);
    sim::MatX numbers(nt, count);
    for (int k = 0; k < count; ++k) numbers.col(k) = take(turn.numbers[k], angles ? radians : plain, what);
    for (Eigen::Index i = 0; i < nt; ++i) {
      std::array<double, 9> row{};
      for (int k = 0; k < count; ++k) row[k] = numbers(i, k);
      const sim::Quat q =
          to_quaternion(turn.writing, row, fmt::format("{}: {}: the orientation at t = {:g} s ", table_.file, what, table_.times[i]));
      out.row(i) << q.w(), q.x(), q.y(), q.z();
    }
    keep_hemisphere(out);
    return out;
  }

  bool is_taken(const std::string& name) const { return taken_.count(name) > 0; }
  bool unsaid_units() const { return unsaid_; }

 private:
  std::string place(int line) const { return line > 0 ? fmt::format("{}:{}: ", mapping_.file, line) : ""; }

  const Table& table_;
  const Mapping& mapping_;
  std::vector<std::string> names_;
  std::set<std::string> taken_;
  bool unsaid_ = false;
};

sim::Quat quaternion_of(const Eigen::MatrixX4d& rows, Eigen::Index i) { return {rows(i, 0), rows(i, 1), rows(i, 2), rows(i, 3)}; }

// Rotation vectors of a node relative to the undeformed body, body axes.
Eigen::MatrixX3d node_rotation(Taker& taker, const NodeSource& node, const sim::ResultBody& body, const std::string& what) {
  const Eigen::MatrixX4d turns = taker.take_turn(node.turn, what);
  Eigen::MatrixX3d out(turns.rows(), 3);
  for (Eigen::Index i = 0; i < turns.rows(); ++i) {
    const sim::Quat R = quaternion_of(body.orientation, i), given = quaternion_of(turns, i);
    // Of positions the node's own axes in the world; of displacements a rotation, in body or world axes.
    const sim::Quat relative = node.by_position ? R.conjugate() * given : node.world_axes ? R.conjugate() * given * R : given;
    out.row(i) = sim::rotation_log(relative).transpose();
  }
  return out;
}

void add_nodes(Taker& taker, const BodySource& source, sim::ResultBody& body) {
  const Eigen::Index nt = body.position.rows(), nn = std::ssize(source.nodes);
  const auto turning = std::count_if(source.nodes.begin(), source.nodes.end(), [](const NodeSource& n) { return n.has_turn; });
  if (turning > 0 && turning < nn)
    throw InputError(fmt::format("body '{}': {} of its {} nodes have a rotation: give it for all or for none", body.name, turning, nn));
  body.displacement.resize(nt, 3 * nn);
  if (turning > 0) body.rotation.resize(nt, 3 * nn);
  for (Eigen::Index k = 0; k < nn; ++k) {
    const NodeSource& node = source.nodes[k];
    const std::string what = fmt::format("body '{}': node '{}'", body.name, node.name);
    sim::Vec3 origin = node.origin;
    if (!node.rest[0].column.empty()) origin = taker.take3(node.rest, metres, what).row(0).transpose();
    body.nodes.push_back({node.name, origin});
    Eigen::MatrixX3d place = taker.take3(node.place, metres, what);
    for (Eigen::Index i = 0; i < nt; ++i) {
      const sim::Mat3 R = quaternion_of(body.orientation, i).toRotationMatrix();
      sim::Vec3 u = place.row(i).transpose();
      if (node.by_position) u = R.transpose() * (u - body.position.row(i).transpose()) - origin;
      else if (node.world_axes) u = R.transpose() * u;
      place.row(i) = u.transpose();
    }
    body.displacement.middleCols(3 * k, 3) = place;
    if (turning > 0) body.rotation.middleCols(3 * k, 3) = node_rotation(taker, node, body, what);
  }
}

// Nodes and mode shapes of a body's file, moved by the columns of its coordinates.
void add_modes(Taker& taker, const BodySource& source, sim::ResultBody& body) {
  const sim::FlexibleBody flexible = sim::read_body(source.sid, source.name).body;
  const Eigen::Index n = flexible.n, nt = body.position.rows(), nn = std::ssize(flexible.nodes);
  if (std::ssize(source.q) != n)
    throw InputError(
        fmt::format("body '{}': 'q' names {} columns, {} has {} elastic coordinates", body.name, source.q.size(), source.sid.string(), n));
  body.q.resize(nt, n);
  for (Eigen::Index k = 0; k < n; ++k) body.q.col(k) = taker.take(source.q[k], plain, fmt::format("body '{}'", body.name));
  body.node_phi.resize(3 * nn, n);
  body.node_psi.resize(3 * nn, n);
  for (Eigen::Index k = 0; k < nn; ++k) {
    const auto& node = flexible.nodes[k];
    body.nodes.push_back({node.name, node.origin});
    body.node_phi.middleRows(3 * k, 3) = node.phi;
    body.node_psi.middleRows(3 * k, 3) = node.psi;
  }
  body.displacement = body.q * body.node_phi.transpose();
  body.rotation = body.q * body.node_psi.transpose();
  // Displacements of second order, where the file has them.
  for (Eigen::Index k = 0; k < nn; ++k)
    for (int a = 0; a < 3; ++a)
      if (const sim::MatX& second = flexible.nodes[k].phi2[a]; second.size() > 0)
        body.displacement.col(3 * k + a) += 0.5 * (body.q * second).cwiseProduct(body.q).rowwise().sum();
}

void add_outputs(const Table& table, const Mapping& mapping, const Taker& taker, sim::Results& results) {
  std::vector<std::string> names, endless;
  for (const Column& column : table.columns) names.push_back(column.name);
  std::set<const Column*> asked;
  for (const std::string& name : mapping.outputs) {
    asked.insert(table.find(name));
    if (asked.count(nullptr))
      throw InputError(fmt::format("{}: 'outputs' names {}, which {} does not have{}", mapping.file, sim::quote(name), table.file,
                                   sim::did_you_mean(name, names)));
  }
  // Of thousands of variables only those asked for: a Modelica result holds every intermediate of the model.
  constexpr size_t most_unasked = 500;
  if (mapping.all_outputs && table.columns.size() > most_unasked) {
    results.statistics.notes.tell(
        "", fmt::format("{} holds {} columns: none is kept as an output; name those to keep by outputs = [...] in a mapping file",
                        table.file, table.columns.size()));
    return;
  }
  for (const Column& column : table.columns) {
    if (mapping.all_outputs ? taker.is_taken(column.name) : asked.count(&column) == 0) continue;
    const sim::VecX values = column.index < 0 ? sim::VecX::Constant(table.times.size(), column.factor)
                                              : sim::VecX(column.factor * table.values.col(column.index));
    if (!values.allFinite()) endless.push_back(column.name);
    else results.outputs.push_back({column.name, column.unit, values, column.description});
  }
  if (!endless.empty())
    results.statistics.notes.warn(
        "", fmt::format("columns that hold values which are not finite are left out: {}", sim::list_words(endless, 12)));
}

}  // namespace

sim::Results assemble(const Table& table, const Mapping& mapping) {
  sim::Results results;
  results.title = mapping.title.empty() ? std::filesystem::path(table.file).stem().string() : mapping.title;
  results.times = table.times;
  Taker taker(table, mapping);
  for (const BodySource& source : mapping.bodies) {
    sim::ResultBody body;
    body.name = source.name;
    body.kind = source.kind;
    body.length = source.length;
    body.color = source.color;
    body.mesh = source.mesh;
    const std::string what = fmt::format("body '{}'", source.name);
    body.position = taker.take3(source.position, metres, what);
    body.orientation = taker.take_turn(source.turn, what);
    for (Eigen::Index i = 0; i < body.position.rows(); ++i)
      body.position.row(i) -= (quaternion_of(body.orientation, i) * source.point).transpose();
    if (!source.nodes.empty()) add_nodes(taker, source, body);
    if (!source.sid.empty()) add_modes(taker, source, body);
    results.bodies.push_back(std::move(body));
  }
  results.statistics.notes.tell(table.notes);
  results.statistics.notes.tell(mapping.notes);
  if (taker.unsaid_units())
    results.statistics.notes.tell("", "columns without a unit are taken in m and rad; say otherwise by [units] in a mapping file");
  add_outputs(table, mapping, taker, results);
  return results;
}

}  // namespace flexframe::imports
