#include "sim/results/load_strain.h"

#include <algorithm>
#include <variant>

namespace flexframe::sim {
namespace {

// An interval of a cut beam, where it lies along the scene's beam.
struct Stretch {
  double from = 0.0, to = 0.0;
  int beam = 0, interval = 0;
};

std::vector<Stretch> stretches_of(const Model& model, const std::vector<CutBeam>& beams, int body) {
  std::vector<Stretch> out;
  for (size_t k = 0; k < beams.size(); ++k) {
    if (beams[k].body != body) continue;
    const double root = model.parts[beams[k].part].rest_in_body.p.x();
    for (size_t i = 0; i + 1 < beams[k].x.size(); ++i)
      out.push_back({root + beams[k].x[i], root + beams[k].x[i + 1], static_cast<int>(k), static_cast<int>(i)});
  }
  std::sort(out.begin(), out.end(), [](const Stretch& a, const Stretch& b) { return a.from < b.from; });
  return out;
}

}  // namespace

LoadStrain::LoadStrain(const Model& model, const Scene& scene, std::span<const ResultBody> bodies) : forces_(model, scene) {
  for (size_t b = 0; b < bodies.size(); ++b) {
    const auto* beam = std::get_if<BeamDef>(&scene.bodies[b].kind);
    const VecX& at = bodies[b].strain_stations;
    if (!beam || beam->axis || !beam->stations.empty() || at.size() == 0 || bodies[b].unstrained.empty()) continue;
    const std::vector<Stretch> stretches = stretches_of(model, forces_.beams(), static_cast<int>(b));
    if (stretches.empty()) continue;
    Body body;
    body.body = static_cast<int>(b);
    const double shear_modulus = 0.5 * beam->material.youngs_modulus / (1.0 + beam->material.poisson);
    for (const std::string& way : bodies[b].unstrained) {
      if (way == "axial") body.ways.push_back({0, 1.0 / (beam->material.youngs_modulus * beam->section.area)});
      else body.ways.push_back({3, 1.0 / (shear_modulus * beam->section.j)});
    }
    // Stations are rounded sums of lengths. The second of two at one place looks outboard, where forces may have jumped.
    const double near = 1e-9 * beam->length;
    for (Eigen::Index i = 0; i < at.size(); ++i) {
      const bool second = i > 0 && at[i] - at[i - 1] <= near;
      auto found = std::find_if(stretches.begin(), stretches.end(),
                                [&](const Stretch& s) { return second ? s.to > at[i] + near : s.to >= at[i] - near; });
      if (found == stretches.end()) --found;
      const double width = found->to - found->from;
      body.stations.push_back({found->beam, found->interval, width > 0.0 ? std::clamp((at[i] - found->from) / width, 0.0, 1.0) : 0.0});
    }
    bodies_.push_back(std::move(body));
  }
}

void LoadStrain::size(Eigen::Index nt, std::span<ResultBody> bodies) const {
  for (const Body& b : bodies_)
    bodies[static_cast<size_t>(b.body)].load_strain = MatX::Zero(nt, static_cast<Eigen::Index>(b.ways.size() * b.stations.size()));
}

void LoadStrain::record(const Model& model, Work& work, const Reactions& reactions, Eigen::Index row, std::span<ResultBody> bodies) {
  forces_.evaluate(model, work, reactions);
  for (const Body& b : bodies_) {
    MatX& out = bodies[static_cast<size_t>(b.body)].load_strain;
    Eigen::Index column = 0;
    for (const Way& way : b.ways)
      for (const Place& p : b.stations) {
        const CutBeam& beam = forces_.beams()[p.beam];
        const double left = beam.left[p.interval][way.component], right = beam.right[p.interval][way.component];
        out(row, column++) = way.flexibility * (left + p.share * (right - left));
      }
  }
}

}  // namespace flexframe::sim
