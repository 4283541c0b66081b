#include "render/film/runs.h"

#include "render/film/motion.h"
#include "render/frame/camera.h"
#include "render/picture/colormap.h"
#include "sim/base/spatial.h"
#include "sim/results/histories.h"

#include <fmt/format.h>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>

namespace flexframe::film {
namespace {

constexpr const char* later_opacity = "0.55";

template <class Series>
Series resampled(const Series& rows, const std::vector<SamplePlace>& places) {
  Series out;
  out.resize(rows.rows() == 0 ? 0 : std::ssize(places), rows.cols());
  for (Eigen::Index i = 0; i < out.rows(); ++i) {
    const SamplePlace& at = places[i];
    out.row(i) = rows.row(at.index);
    if (at.share > 0.0) out.row(i) += at.share * (rows.row(at.index + 1) - rows.row(at.index));
  }
  return out;
}

// A body at other times, as motion.h has it between samples.
sim::ResultBody body_at(const sim::ResultBody& body, const std::vector<SamplePlace>& places) {
  sim::ResultBody out = body;
  const Eigen::Index nt = std::ssize(places);
  out.position = resampled(body.position, places);
  out.orientation.resize(nt, 4);
  interp::Points displacement, rotation;
  if (body.rotation.size() > 0) out.rotation.resize(nt, body.rotation.cols());
  for (Eigen::Index i = 0; i < nt; ++i) {
    const SamplePlace& at = places[i];
    const auto quaternion = [&](Eigen::Index k) {
      return sim::Quat(body.orientation(k, 0), body.orientation(k, 1), body.orientation(k, 2), body.orientation(k, 3));
    };
    const sim::Quat q = at.share > 0.0 ? quaternion(at.index).slerp(at.share, quaternion(at.index + 1)) : quaternion(at.index);
    out.orientation.row(i) << q.w(), q.x(), q.y(), q.z();
    if (body.rotation.size() == 0) continue;
    node_motion(body, at, displacement, rotation);
    for (Eigen::Index k = 0; k < rotation.rows(); ++k) out.rotation.row(i).segment<3>(3 * k) = rotation.row(k);
  }
  out.displacement = resampled(body.displacement, places);
  out.q = resampled(body.q, places);
  out.qd = resampled(body.qd, places);
  out.held_position = resampled(body.held_position, places);
  out.held_rotation = resampled(body.held_rotation, places);
  out.node_von_mises = resampled(body.node_von_mises, places);
  return out;
}

// Origins and nodes at up to 50 samples.
std::vector<glm::dvec3> places_of(const sim::Results& results) {
  std::vector<glm::dvec3> points;
  const Eigen::Index step = std::max<Eigen::Index>(1, results.times.size() / 50);
  for (const sim::ResultBody& body : results.bodies)
    for (Eigen::Index i = 0; i < results.times.size(); i += step) {
      const glm::dmat4 pose = body_pose(body, {i, 0.0});
      points.emplace_back(pose[3]);
      for (const sim::ResultNode& node : body.nodes)
        points.emplace_back(pose * glm::dvec4(node.origin.x(), node.origin.y(), node.origin.z(), 1.0));
      for (const auto& p : body.surface.points.rowwise()) points.emplace_back(pose * glm::dvec4(p.x(), p.y(), p.z(), 1.0));
    }
  return points;
}

// To the right of the usual view, once the width of all that moves and a little more.
sim::Vec3 way_aside(const std::vector<glm::dvec3>& points, const sim::Scene& scene) {
  const sim::Vec3 g = scene.simulation.gravity;
  const render::FitOptions view = render::default_view(points, {g.x(), g.y(), g.z()});
  const glm::dvec3 turned = glm::cross(glm::dvec3(view.direction), glm::dvec3(view.up));
  // Along an axis of the world, so that grids and axes mean the same for all.
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(turned[k]) > std::abs(turned[axis])) axis = k;
  double low = 1e300, high = -1e300;
  for (const glm::dvec3& p : points) {
    low = std::min(low, p[axis]);
    high = std::max(high, p[axis]);
  }
  sim::Vec3 way = sim::Vec3::Zero();
  way[axis] = (turned[axis] >= 0.0 ? 1.0 : -1.0) * (high > low ? 1.25 * (high - low) : 1.0);
  return way;
}

// The scene's words for a body, those of a body without a scene where it has none.
sim::BodyDef definition_of(const sim::ResultBody& body, const sim::Scene* scene) {
  if (scene)
    for (const sim::BodyDef& def : scene->bodies)
      if (def.name == body.name) return def;
  sim::BodyDef def;
  def.kind = sim::RigidDef{};
  return def;
}

// How a run's bodies differ from those of the scene.
struct RunLook {
  sim::Vec3 aside;  // m
  bool see_through;
  std::optional<glm::vec3> color;  // none: the bodies' own
};

void add_bodies(const Run& run, size_t number, const std::vector<SamplePlace>& places, const RunLook& look, RunsTogether& together) {
  for (const sim::ResultBody& body : run.results->bodies) {
    sim::BodyDef def = definition_of(body, run.scene);
    sim::ResultBody copy = number == 0 ? body : body_at(body, places);
    if (number > 0) copy.name = run.name + ": " + body.name;
    copy.position.rowwise() += look.aside.transpose();
    def.name = copy.name;
    if (look.color) {
      def.drawing["color"] = fmt::format("[{:.4f}, {:.4f}, {:.4f}]", look.color->r, look.color->g, look.color->b);
      for (sim::ShapeDef& shape : def.shapes) shape.color.clear();
      copy.color.clear();
    }
    if (look.see_through) def.drawing["opacity"] = later_opacity;
    together.results.bodies.push_back(std::move(copy));
    together.scene.bodies.push_back(std::move(def));
  }
}

// Joints of a later run, for its symbols and for the shapes of bodies that joints hold.
void add_joints(const Run& run, const std::vector<SamplePlace>& places, const sim::Vec3& aside, RunsTogether& together) {
  if (!run.scene) return;
  const auto named = [&](const std::string& name) { return name == "ground" ? name : run.name + ": " + name; };
  for (sim::JointDef def : run.scene->joints) {
    def.name = named(def.name);
    def.parent.body = named(def.parent.body);
    def.child.body = named(def.child.body);
    together.scene.joints.push_back(std::move(def));
  }
  for (const sim::ResultJoint& joint : run.results->joints) {
    sim::ResultJoint copy{.name = named(joint.name), .kind = joint.kind, .position = {}, .orientation = {}, .value = {}, .rate = {}};
    if (joint.position.rows() > 0) {
      copy.position = resampled(joint.position, places);
      copy.position.rowwise() += aside.transpose();
      copy.orientation.resize(std::ssize(places), 4);
      for (size_t i = 0; i < places.size(); ++i) {
        const glm::dquat q = glm::quat_cast(glm::dmat3(joint_pose(joint, places[i])));
        copy.orientation.row(static_cast<Eigen::Index>(i)) << q.w, q.x, q.y, q.z;
      }
    }
    together.results.joints.push_back(std::move(copy));
  }
}

const sim::ResultOutput* find_output(const sim::Results& results, const std::string& column) {
  for (const sim::ResultOutput& output : results.outputs)
    if (output.column == column) return &output;
  return nullptr;
}

// The other runs' curves and their differences from the first; of one column they are plotted.
void add_outputs(std::span<const Run> runs, const std::vector<std::vector<SamplePlace>>& places, RenderSettings& settings,
                 RunsTogether& together) {
  const sim::Results& first = *runs[0].results;
  const sim::VecX ranges = sim::output_ranges(sim::to_histories(first));
  const std::vector<std::string> asked = settings.overlay.plot;
  std::string plotted;
  std::vector<std::string> curves, differences;
  for (size_t k = 0; k < first.outputs.size(); ++k) {
    const sim::ResultOutput& output = first.outputs[k];
    const double range = ranges[static_cast<Eigen::Index>(k)];
    const bool everywhere = std::all_of(runs.begin(), runs.end(), [&](const Run& run) { return find_output(*run.results, output.column); });
    // The first that is asked for, else the first that moves.
    if (plotted.empty() && everywhere && (asked.empty() ? range > 0.0 : names_column(asked.front(), output.column))) {
      plotted = output.column;
      curves.push_back(fmt::format("{}: {}", runs[0].name, output.column));
      together.results.outputs.push_back({curves.back(), output.unit, output.values, output.description});
    }
    for (size_t r = 1; r < runs.size(); ++r) {
      const sim::ResultOutput* other = find_output(*runs[r].results, output.column);
      if (!other || other->unit != output.unit) continue;
      const sim::VecX values = resampled(other->values, places[r]).col(0);
      // What lies beyond the end of a shorter run is no difference: the last one stays.
      const double end = runs[r].results->times[runs[r].results->times.size() - 1];
      const Eigen::Index shared = std::max<Eigen::Index>(1, (first.times.array() <= end * (1.0 + 1e-12)).count());
      sim::VecX apart = values - output.values;
      apart.tail(apart.size() - shared).setConstant(apart[shared - 1]);
      const std::string name = fmt::format("{}: {}", runs[r].name, output.column);
      const std::string difference_name = fmt::format("{} - {}: {}", runs[r].name, runs[0].name, output.column);
      RunDifference difference{.column = output.column, .unit = output.unit, .run = runs[r].name};
      Eigen::Index at = 0;
      difference.largest = apart.cwiseAbs().maxCoeff(&at);
      difference.at = first.times[at];
      difference.share = range > 0.0 ? difference.largest / range : 0.0;
      together.differences.push_back(difference);
      together.results.outputs.push_back({name, output.unit, values, other->description});
      together.results.outputs.push_back({difference_name, output.unit, apart, "difference"});
      if (output.column != plotted) continue;
      curves.push_back(name);
      differences.push_back(difference_name);
    }
  }
  settings.overlay.plot = curves;
  settings.overlay.plot.insert(settings.overlay.plot.end(), differences.begin(), differences.end());
}

}  // namespace

RunsTogether put_together(std::span<const Run> runs, bool beside, bool by_run, RenderSettings& settings) {
  if (runs.size() < 2 || runs.size() > 8) throw sim::InputError(fmt::format("two to eight runs make one picture, found {}", runs.size()));
  RunsTogether together;
  const sim::Results& first = *runs[0].results;
  together.results = first;
  together.results.bodies.clear();
  if (runs[0].scene) together.scene = *runs[0].scene;
  together.scene.bodies.clear();
  std::vector<glm::dvec3> points;
  for (const Run& run : runs)
    for (const glm::dvec3& p : places_of(*run.results)) points.push_back(p);
  const sim::Vec3 step = beside ? way_aside(points, together.scene) : sim::Vec3(sim::Vec3::Zero());
  std::vector<std::vector<SamplePlace>> places;
  settings.runs.clear();
  for (size_t r = 0; r < runs.size(); ++r) {
    const sim::Results& results = *runs[r].results;
    const Eigen::Index last = results.times.size() - 1;
    std::vector<SamplePlace>& of_run = places.emplace_back();
    for (const double t : first.times) of_run.push_back(find_sample(results.times, t));
    if (const double end = results.times[last], whole = first.times[first.times.size() - 1]; end < whole * (1.0 - 1e-9))
      together.notes.push_back(fmt::format("{} ends at {:g} s: it stands still until {:g} s", runs[r].name, end, whole));
    std::optional<glm::vec3> color;
    if (by_run) color = render::category_color(static_cast<int>(r));
    if (by_run) settings.runs.emplace_back(runs[r].name, *color);
    if (r > 0) add_joints(runs[r], of_run, static_cast<double>(r) * step, together);
    add_bodies(runs[r], r, of_run, {static_cast<double>(r) * step, r > 0 && !beside, color}, together);
  }
  add_outputs(runs, places, settings, together);
  return together;
}

}  // namespace flexframe::film
