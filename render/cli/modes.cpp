// flexframe modes: mode shapes of a SID body swinging on its mesh, one film a mode.
#include "render/cli/commands.h"
#include "render/cli/jobs.h"

#include "sim/bodies/sid.h"
#include "sim/results/results_file.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <numbers>

namespace flexframe::cli {
namespace {

// One swing of mode k, in equal steps, so that the film loops. amplitude: largest node displacement, m.
sim::Results swing(const sim::FlexibleBody& body, int k, double amplitude, int pictures, double frame_rate) {
  sim::Results r;
  const int n = body.n, nodes = static_cast<int>(body.nodes.size());
  sim::ResultBody b;
  b.name = "body";
  b.kind = "modal";
  b.labels = body.labels;
  b.node_phi.resize(3 * static_cast<Eigen::Index>(nodes), n);
  b.node_psi.resize(3 * static_cast<Eigen::Index>(nodes), n);
  double largest = 0.0;
  for (int i = 0; i < nodes; ++i) {
    b.nodes.push_back({body.nodes[i].name, body.nodes[i].origin});
    const Eigen::Index row = 3 * static_cast<Eigen::Index>(i);
    b.node_phi.middleRows(row, 3) = body.nodes[i].phi;
    b.node_psi.middleRows(row, 3) = body.nodes[i].psi;
    if (body.nodes[i].sigma.cols() == n) {
      b.stress_nodes.push_back(i);
      b.node_stress.conservativeResize(6 * static_cast<Eigen::Index>(b.stress_nodes.size()), n);
      b.node_stress.bottomRows(6) = body.nodes[i].sigma;
    }
    largest = std::max(largest, body.nodes[i].phi.col(k).norm());
  }
  if (!(largest > 0.0)) throw sim::InputError(fmt::format("mode {} does not move any node of the body", k + 1));
  r.times = sim::VecX::LinSpaced(pictures, 0.0, (pictures - 1) / frame_rate);
  b.position = Eigen::MatrixX3d::Zero(pictures, 3);
  b.orientation = Eigen::MatrixX4d::Zero(pictures, 4);
  b.orientation.col(0).setOnes();
  b.q = sim::MatX::Zero(pictures, n);
  b.qd = sim::MatX::Zero(pictures, n);
  for (int i = 0; i < pictures; ++i) b.q(i, k) = amplitude / largest * std::sin(2.0 * std::numbers::pi * i / pictures);
  b.displacement = b.q * b.node_phi.transpose();
  b.rotation = b.q * b.node_psi.transpose();
  r.bodies.push_back(std::move(b));
  r.kinetic = r.strain = r.potential = r.supplied = r.dissipated = sim::VecX::Zero(pictures);
  return r;
}

}  // namespace

Command add_modes(Program& program) {
  struct Words {
    std::string body, mesh, out;
    std::vector<int> modes;
    double amplitude = 0.0;
    int pictures = 40;
    bool json = false;
    RenderWords render;
  };
  const auto w = std::make_shared<Words>();
  Subcommand app = program.subcommand("modes", "animate the mode shapes of a body (SID)");
  app.option("BODY", w->body, "SID file").required();
  app.option("--mesh", w->mesh, "Wavefront mesh of the undeformed body; default: BODY.obj beside it").as("FILE");
  app.option("-o,--out", w->out, "output folder; default: the name of the body").as("DIR");
  app.option("--mode", w->modes, "which modes, from 1; default: all").as("LIST").list(Option::is_number).separated_by(',');
  app.option("--amplitude", w->amplitude, "largest displacement drawn, m; default: 5 % of the body's size").positive();
  app.option("--pictures", w->pictures, "number of pictures of one period").range(2, 10000).show_default();
  app.flag("--json", w->json, "summary as JSON: one entry a mode");
  add_render_words(app, w->render);
  app.example("part.sid", "every mode of part.sid on part.obj: part-modes/mode_001/...");
  app.example("part.sid --mode 1,2 --size 640x360 -o swing", "the first two");
  return {app, [w] {
            namespace fs = std::filesystem;
            const sim::SidReading reading = sim::read_sid(w->body);
            const sim::FlexibleBody body = sim::to_flexible_body(reading.file, w->body);
            if (body.n == 0) throw sim::InputError(fmt::format("{}: a rigid body has no modes", w->body));
            if (body.nodes.empty()) throw sim::InputError(fmt::format("{}: the body has no nodes", w->body));
            std::vector<int> modes = w->modes;
            if (modes.empty())
              for (int k = 1; k <= body.n; ++k) modes.push_back(k);
            for (int k : modes)
              if (k < 1 || k > body.n) throw sim::InputError(fmt::format("{}: mode {}: there are 1 to {}", w->body, k, body.n));
            fs::path mesh = w->mesh;
            if (mesh.empty()) {
              const fs::path beside = fs::path(w->body).replace_extension(".obj");
              if (fs::exists(beside)) mesh = beside;
            } else if (!fs::exists(mesh)) {
              throw sim::InputError(fmt::format("{}: no such file", mesh.string()));
            }
            sim::Vec3 lower = body.nodes[0].origin, upper = lower;
            for (const sim::FlexibleNode& node : body.nodes) {
              lower = lower.cwiseMin(node.origin);
              upper = upper.cwiseMax(node.origin);
            }
            const double amplitude = w->amplitude > 0.0 ? w->amplitude : 0.05 * (upper - lower).norm();
            const std::string name = fs::path(w->body).stem().string();
            const fs::path out = w->out.empty() ? fs::path(name + "-modes") : fs::path(w->out);
            require_writable(out);
            nlohmann::ordered_json json = nlohmann::ordered_json::array();
            for (int k : modes) {
              film::RenderSettings settings;
              settings.scales = {1.0};
              settings.speed = 1.0;  // the swing is made for the playback, however short
              settings.ground = false;
              settings.undeformed = true;
              apply_words(w->render, settings);
              const std::string label = body.labels.empty() ? fmt::format("mode {}", k) : body.labels[k - 1];
              sim::Results results = swing(body, k - 1, amplitude, w->pictures, settings.frame_rate);
              results.title = fmt::format("{}: {}", name, label);
              if (!mesh.empty()) results.bodies[0].mesh = fs::absolute(mesh).string();
              const std::string part = modes.size() == 1 ? name : fmt::format("mode_{:03}", k);
              const DrawingReport report = run_drawing(results, settings, nullptr, w->render, modes.size() == 1 ? out : out / part, part);
              if (!w->json) print_drawing(report);
              json.push_back({{"mode", k}, {"label", label}, {"drawing", drawing_json(report)}});
            }
            if (w->json) fmt::print("{}\n", json.dump(2));
            return 0;
          }};
}

}  // namespace flexframe::cli
