// Writing SID_FEM files. See sid.h.
#include "sim/base/file_output.h"
#include "sim/bodies/sid.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <utility>

namespace flexframe::sim {
namespace {

std::string real(double value) {
  if (!std::isfinite(value)) throw InputError("SID: a value that is no finite number cannot be written");
  char buffer[40];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::scientific);
  (void)error;  // 40 characters hold the shortest form of any double
  std::string text(buffer, end);
  for (char& c : text)
    if (c == 'e') c = 'E';
  return value < 0.0 || std::signbit(value) ? text : " " + text;
}

struct Writer {
  std::string out;

  void line(int indent, std::string_view text) {
    out.append(indent, ' ');
    out += text;
    out += '\n';
  }
  void key(int indent, const char* name, std::string_view value) { line(indent, fmt::format("{:<22}= {}", name, value)); }

  void taylor(int indent, const char* name, const std::optional<SidTaylor>& block) {
    if (!block) return;
    line(indent, name);
    const int inner = indent + 5;
    key(inner, "order", fmt::format("{:3}", block->order));
    key(inner, "nrow", fmt::format("{:3}", block->rows));
    key(inner, "ncol", fmt::format("{:3}", block->columns));
    key(inner, "nq", fmt::format("{:3}", block->modes));
    key(inner, "nqn", fmt::format("{:3}", block->nonlinear));
    key(inner, "structure", fmt::format("{:3}", block->structure));
    for (const SidEntry& e : block->entries)
      line(inner, e.mode == 0 ? fmt::format("m0({:3},{:3})            ={}", e.row, e.column, real(e.value))
                              : fmt::format("m1({:3},{:3},{:3})        ={}", e.row, e.mode, e.column, real(e.value)));
    for (const std::string& text : block->higher) line(inner, text);
    line(indent, fmt::format("end {}", name));
  }
  // A row a line.
  void rows(const char* name, const Eigen::Ref<const MatX>& values) {
    line(6, name);
    for (Eigen::Index i = 0; i < values.rows(); ++i) {
      std::string text;
      for (const double value : values.row(i)) text += " " + real(value);
      line(11, text);
    }
  }
  void further(const FurtherShapes& shapes) {
    if (shapes.count() == 0) return;
    line(1, fmt::format("further shapes = {}", shapes.count()));
    rows("stiffness", shapes.stiffness.transpose());
    rows("mass in common", shapes.coupling);
    rows("mdCM", shapes.md);
    rows("J", shapes.J);
    rows("Cr", shapes.Cr);
    rows("phi psi", shapes.motion);
    line(1, "end further shapes");
  }
  void text(int indent, const std::vector<SidText>& blocks) {
    for (const SidText& block : blocks)
      for (const std::string& l : block.lines) line(indent, l);
  }
};

}  // namespace

std::string write_sid_text(const SidFile& sid) {
  using Block = std::pair<const char*, const std::optional<SidTaylor>*>;
  Writer w;
  w.line(0, fmt::format("{:5}{:5}    : {}", sid.nodes.size(), sid.nelastq, sid.comment));
  w.line(1, "part");
  w.line(6, sid.name.empty() ? "new modal =" : fmt::format("new modal = {}", sid.name));
  w.line(11, "refmod");
  w.key(16, "mass", real(sid.mass));
  w.key(16, "nelastq", fmt::format("{}", sid.nelastq));
  for (size_t k = 0; k < sid.labels.size(); ++k) w.key(16, fmt::format("ielastq ({:4})", k + 1).c_str(), sid.labels[k]);
  for (const std::string& l : sid.refmod_others) w.line(16, l);
  w.line(11, "end refmod");
  w.line(11, "frame");
  for (const SidNode& node : sid.nodes) {
    w.line(16, fmt::format("new node = {}", node.id));
    w.line(21, fmt::format("rframe = {}", node.rframe));
    const Block blocks[] = {{"origin", &node.origin}, {"phi", &node.phi}, {"psi", &node.psi}, {"AP", &node.AP}, {"sigma", &node.sigma}};
    for (const auto& [name, block] : blocks) w.taylor(21, name, *block);
    w.text(21, node.others);
    w.line(16, "end node");
  }
  w.line(11, "end frame");
  const Block blocks[] = {{"mdCM", &sid.mdCM}, {"J", &sid.J},   {"Ct", &sid.Ct},         {"Cr", &sid.Cr}, {"Me", &sid.Me}, {"Gr", &sid.Gr},
                          {"Ge", &sid.Ge},     {"Oe", &sid.Oe}, {"ksigma", &sid.ksigma}, {"Ke", &sid.Ke}, {"De", &sid.De}};
  for (const auto& [name, block] : blocks) w.taylor(11, name, *block);
  w.text(11, sid.others);
  w.line(6, "end modal");
  w.line(1, "end part");
  w.further(sid.further);
  return std::move(w.out);
}

void write_sid(const SidFile& sid, const std::filesystem::path& path) { write_whole_file(path, write_sid_text(sid)); }

}  // namespace flexframe::sim
