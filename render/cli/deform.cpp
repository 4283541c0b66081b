// flexframe deform: nodes of any program move a mesh of any origin.
#include "render/cli/commands.h"
#include "render/cli/json_text.h"
#include "render/cli/overwrite.h"
#include "render/cli/terminal.h"

#include "render/film/deform.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <charconv>
#include <cmath>
#include <cstdio>
#include <memory>

namespace flexframe::cli {
namespace {

struct DeformWords {
  std::string nodes, mesh, output, scheme = "auto", scale = "1";
  bool corotated = false, json = false;
};

std::optional<double> parse_scale(const std::string& text) {
  if (text == "auto") return std::nullopt;
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value))
    throw UsageError(fmt::format("--scale {}: a number or auto is needed", text));
  return value;
}

int run(const DeformWords& words) {
  film::DeformOptions options;
  options.scheme = interp::scheme_from_name(words.scheme);
  options.scale = parse_scale(words.scale);
  options.corotated = words.corotated;
  require_not_read({words.output}, {words.nodes, words.mesh});
  const film::DeformReport report = film::deform(words.nodes, words.mesh, words.output, options);
  for (const std::string& warning : report.warnings) fmt::print(stderr, "warning: {}\n", warning);
  if (words.json) {
    nlohmann::ordered_json json = {
        {"nodes", report.nodes},       {"vertices", report.vertices},     {"scheme", interp::scheme_name(report.map.scheme)},
        {"reason", report.map.reason}, {"lebesgue", report.map.lebesgue}, {"largest_displacement", report.largest},
        {"scale", report.scale},       {"warnings", report.warnings},     {"written", words.output}};
    if (std::isfinite(report.leave_one_out.relative)) json["leave_one_out"] = report.leave_one_out.relative;
    fmt::print("{}\n", json_text(json));
    return 0;
  }
  if (verbosity() == Verbosity::quiet) return 0;
  fmt::print("{} nodes -> {} vertices\n", report.nodes, report.vertices);
  fmt::print("scheme               {} ({})\n", interp::scheme_name(report.map.scheme), report.map.reason);
  fmt::print("Lebesgue constant    {:.3g}\n", report.map.lebesgue);
  if (std::isfinite(report.leave_one_out.relative))
    fmt::print("leave-one-out error  {:.3g} % (worst {:.3g} at node {})\n", 100.0 * report.leave_one_out.relative,
               report.leave_one_out.maximum, report.leave_one_out.node);
  else fmt::print("leave-one-out error  not known: too few nodes\n");
  fmt::print("largest displacement {:.6g}{}\n", report.largest, report.scale != 1.0 ? fmt::format(", drawn x {:g}", report.scale) : "");
  fmt::print("time                 {:.1f} ms\n", 1e3 * report.map.setup_seconds);
  fmt::print("written              {}\n", words.output);
  return 0;
}

}  // namespace

Command add_deform(Program& program) {
  auto words = std::make_shared<DeformWords>();
  Subcommand command = program.subcommand("deform", "move a mesh by the displacements of sparse nodes");
  command.option("--nodes", words->nodes, "CSV with a header line x,y,z,ux,uy,uz[,rx,ry,rz]").as("FILE").required();
  command.option("--mesh", words->mesh, "OBJ, STL, PLY, glTF, ...").as("FILE").required();
  command.option("-o,--out,--output", words->output, "OUT.obj: deformed mesh; OUT.csv: ux,uy,uz of each vertex in the file's order")
      .as("FILE")
      .required();
  command.option("--scheme", words->scheme, "auto, kernel, elastic, lattice, r3, r or tps").as("WORD").show_default();
  command.option("--scale", words->scale, "factor of the displacements, or auto").as("N").show_default();
  command.flag("--corotated", words->corotated, "exaggerate by rotations, sections keep their size");
  command.flag("--json", words->json, "summary as JSON");
  command.example("--nodes nodes.csv --mesh part.obj -o bent.obj --scale 20", "a mesh moved by the nodes of any program, twenty times");
  return {command, [words] { return run(*words); }};
}

}  // namespace flexframe::cli
