#include "render/film/vertex_errors.h"

#include "render/film/body_points.h"
#include "render/film/overlay.h"
#include "render/frame/layout.h"
#include "sim/base/spatial.h"
#include "sim/bodies/beam_pieces.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <set>

namespace flexframe::film {
namespace {

const sim::BodyDef* definition(const sim::Scene* scene, const std::string& name) {
  if (!scene) return nullptr;
  const auto at = std::find_if(scene->bodies.begin(), scene->bodies.end(), [&](const sim::BodyDef& b) { return b.name == name; });
  return at == scene->bodies.end() ? nullptr : &*at;
}

glm::dvec3 placed(const glm::dmat4& pose, const glm::dvec3& p) { return glm::dvec3(pose * glm::dvec4(p, 1.0)); }

// Positions of the vertices in the body frame at a scale, in double.
void scaled_vertices(const Animation& animation, const BodyModel& model, double scale, BodyMemory& memory, std::vector<glm::dvec3>& out) {
  const size_t n = model.mesh.positions.size();
  out = model.mesh.positions;
  if (!model.flexible || memory.displacement.size() < 3 * n) return;
  if (animation.settings.corotated && model.corotated && scale != 1.0) {
    memory.scaled.resize(3 * n);
    model.corotated->apply(memory.displacement, scale, memory.scaled);
    for (size_t i = 0; i < n; ++i) out[i] += glm::dvec3(memory.scaled[3 * i], memory.scaled[3 * i + 1], memory.scaled[3 * i + 2]);
    return;
  }
  for (size_t i = 0; i < n; ++i)
    out[i] += scale * glm::dvec3(memory.displacement[3 * i], memory.displacement[3 * i + 1], memory.displacement[3 * i + 2]);
}

// Points of a body by which it is told how large it is seen.
constexpr size_t points_seen = 200;

// Where the body is seen largest.
glm::dvec3 where_seen_largest(const PictureViews& views, const BodyPoints& points, const SamplePlace& place) {
  std::vector<glm::dvec3> at;
  points.at(place, at);
  glm::dvec3 out(0.0);
  double most = -1.0;
  for (const glm::dvec3& p : at)
    if (const double here = views.pixels_per_metre(p); here > most) most = here, out = p;
  return out;
}

// Pixels a metre there.
double body_pixels_per_metre(const PictureViews& views, const BodyPoints& points, const SamplePlace& place) {
  return points.empty() ? 0.0 : views.pixels_per_metre(where_seen_largest(views, points, place));
}

// The results' body with the mesh of the animation, so that runs with other nodes are drawn on the same vertices.
sim::ResultBody with_mesh_of(const sim::ResultBody& body, const BodyModel& model) {
  sim::ResultBody out = body;
  if (!out.mesh.empty() || out.surface.triangles.rows() > 0 || out.kind != "beam" || model.mesh.triangles.empty()) return out;
  out.surface.points.resize(static_cast<Eigen::Index>(model.mesh.positions.size()), 3);
  for (size_t i = 0; i < model.mesh.positions.size(); ++i) {
    const glm::dvec3& p = model.mesh.positions[i];
    out.surface.points.row(static_cast<Eigen::Index>(i)) << p.x, p.y, p.z;
  }
  out.surface.triangles.resize(static_cast<Eigen::Index>(model.mesh.triangles.size()), 3);
  for (size_t t = 0; t < model.mesh.triangles.size(); ++t) {
    const glm::ivec3& c = model.mesh.triangles[t];
    out.surface.triangles.row(static_cast<Eigen::Index>(t)) << c.x, c.y, c.z;
  }
  return out;
}

}  // namespace

PictureViews::PictureViews(const Animation& animation, int k) {
  render::Picture picture;
  picture.size = animation.settings.size;
  picture.bounds = animation.bounds;
  fill_overlay(animation, picture_time(animation, k), picture);
  aim_camera(animation, k, animation.camera, picture);
  const render::Layout layout = render::make_layout(picture);
  if (picture.views.empty()) views_.push_back(render::make_view(picture.camera, layout.scene, animation.bounds));
  for (size_t v = 0; v < picture.views.size() && v < layout.views.size(); ++v)
    views_.push_back(render::make_view(picture.views[v].camera, layout.views[v], animation.bounds));
  // Insets show a part of the first view larger.
  for (size_t i = 0; i < picture.insets.size() && i < layout.magnified.size() && !views_.empty(); ++i) {
    const render::Camera& first = picture.views.empty() ? picture.camera : picture.views.front().camera;
    views_.push_back(render::make_view(render::inset_camera(first, views_.front(), picture.insets[i], layout.magnified[i]),
                                       layout.magnified[i], animation.bounds));
  }
}

namespace {

// Beside the view by so much of its size a point counts as seen where errors are told: a run that is a little off, or the way to the next
// point that is looked at, brings it in.
constexpr double nearly_seen = 0.05;

// Whether a point falls into the view's rectangle, or beside it by a share of its size.
bool seen(const render::ViewFrame& view, const glm::dvec3& world, glm::dvec2& pixel, double beside = 0.0) {
  if (!render::project(view, world, pixel)) return false;
  const render::PixelRect& a = view.area;
  const double x = beside * a.width, y = beside * a.height;
  return pixel.x >= a.x - x && pixel.y >= a.y - y && pixel.x <= a.x + a.width + x && pixel.y <= a.y + a.height + y;
}

}  // namespace

double PictureViews::pixels_per_metre(const glm::dvec3& world) const {
  double out = 0.0;
  for (const render::ViewFrame& view : views_) {
    glm::dvec2 pixel;
    if (!seen(view, world, pixel, nearly_seen)) continue;
    const double distance = view.orthographic ? 1.0 : std::max(-(view.view * glm::dvec4(world, 1.0)).z, view.near);
    out = std::max(out, 1.0 / (view.pixel * distance));
  }
  return out;
}

double PictureViews::moved(const glm::dvec3& world, const glm::dvec3& by) const {
  constexpr double step = 0.1;  // px, so short that perspective does not count
  double out = 0.0;
  for (const render::ViewFrame& view : views_) {
    glm::dvec2 here, there;
    if (!seen(view, world, here, nearly_seen)) continue;
    const double distance = view.orthographic ? 1.0 : std::max(-(view.view * glm::dvec4(world, 1.0)).z, view.near);
    const double h = step * view.pixel * distance;
    glm::dvec2 sum(0.0);
    for (int a = 0; a < 3; ++a) {
      glm::dvec3 beside = world;
      beside[a] += h;
      if (render::project(view, beside, there)) sum += glm::abs(there - here) * (std::abs(by[a]) / h);
    }
    out = std::max(out, glm::length(sum));
  }
  return out;
}

double PictureViews::apart(const glm::dvec3& a, const glm::dvec3& b) const {
  double out = 0.0;
  for (const render::ViewFrame& view : views_) {
    glm::dvec2 at, other;
    if (seen(view, a, at) && render::project(view, b, other)) out = std::max(out, glm::length(at - other));
  }
  return out;
}

glm::dvec2 PictureViews::pixel(const glm::dvec3& world) const {
  glm::dvec2 out(0.0);
  if (views_.empty()) return out;
  const render::PixelRect& a = views_.front().area;
  if (!render::project(views_.front(), world, out)) out = {a.x + 0.5 * a.width, a.y + 0.5 * a.height};
  return out;
}

std::vector<int> looked_at(const Animation& animation, int most) {
  std::vector<int> out;
  const int n = std::min(most, animation.count);
  out.reserve(static_cast<size_t>(std::max(n, 0)));
  for (int k = 0; k < n; ++k) out.push_back(n < 2 ? 0 : static_cast<int>(static_cast<long long>(k) * (animation.count - 1) / (n - 1)));
  return out;
}

VertexDistance vertices_apart(const Animation& animation, const sim::Results& other, const sim::Scene* scene, int most) {
  const sim::Results& results = *animation.results;
  if (!std::ranges::equal(other.bodies, results.bodies, {}, &sim::ResultBody::name, &sim::ResultBody::name))
    throw sim::InputError("runs with other bodies cannot be compared by their vertices");
  VertexDistance out;
  std::vector<int> pictures = looked_at(animation, most);
  // A run that ended earlier stays where it was in its last sample, which is no difference of the runs. Times are rounded in files.
  const double first = other.times[0], last = other.times[other.times.size() - 1], rounding = 1e-9 * (last - first);
  out.left_out = static_cast<int>(std::erase_if(pictures, [&](int k) {
    const double t = picture_time(animation, k);
    return t < first - rounding || t > last + rounding;
  }));
  if (pictures.empty()) throw sim::InputError("the runs have no picture's time in common");
  std::vector<PictureViews> views;
  views.reserve(pictures.size());
  for (const int k : pictures) views.emplace_back(animation, k);
  for (size_t b = 0; b < results.bodies.size(); ++b) {
    const BodyModel& model = animation.bodies[b];
    if (!model.visible || model.mesh.positions.empty()) continue;
    const sim::ResultBody moved = with_mesh_of(other.bodies[b], model);
    BodyModel there;
    // A body may stay as it is in one run and bend in the other.
    if (model.flexible || !moved.nodes.empty()) {
      BodyDrawing drawing;
      drawing.def = definition(scene, moved.name);
      there = make_body_model(moved, drawing, animation.settings, static_cast<int>(b));
      if ((model.flexible || there.flexible) && there.mesh.positions.size() != model.mesh.positions.size())
        throw sim::InputError("body '" + moved.name + "' has another mesh in the other run: vertices cannot be compared");
    }
    BodyMemory here_memory, there_memory;
    std::vector<glm::dvec3> here_at, there_at;
    for (size_t n = 0; n < pictures.size(); ++n) {
      const double t = picture_time(animation, pictures[n]);
      const SamplePlace place = find_sample(results.times, t), place_there = find_sample(other.times, t);
      if (model.flexible) update_displacement(model, results.bodies[b], place, here_memory);
      if (there.flexible) update_displacement(there, moved, place_there, there_memory);
      const glm::dmat4 pose = body_pose(results.bodies[b], place), pose_there = body_pose(other.bodies[b], place_there);
      for (const double scale : animation.scales) {
        scaled_vertices(animation, model, scale, here_memory, here_at);
        if (there.flexible) scaled_vertices(animation, there, scale, there_memory, there_at);
        const std::vector<glm::dvec3>& their = there.flexible ? there_at : model.mesh.positions;
        for (size_t i = 0; i < here_at.size(); ++i) {
          const glm::dvec3 p = placed(pose, here_at[i]), q = placed(pose_there, their[i]);
          out.widen(views[n].apart(p, q), glm::length(p - q), pictures[n], b, p);
        }
      }
    }
  }
  return out;
}

namespace {

// The nodes of a body, of a rigid one with a mesh its vertices, as they are drawn between two samples: poses turn evenly, displacements run
// straight.
class DrawnPoints {
 public:
  DrawnPoints(const Animation& animation, const BodyModel& model, const sim::ResultBody& body)
      : model_(model),
        body_(body),
        nodes_(!body.nodes.empty() && (model.flexible || model.mesh.positions.empty())),
        scale_(largest_scale(animation, model)) {}
  size_t count() const { return nodes_ ? body_.nodes.size() : model_.mesh.positions.size(); }
  // World, m; share (0 to 1) of the way from one sample to the other.
  glm::dvec3 between(size_t p, Eigen::Index from, Eigen::Index to, double share) const {
    if (!nodes_) return placed(pose_between(body_, from, to, share), model_.mesh.positions[p]);
    glm::dvec3 x(body_.nodes[p].origin.x(), body_.nodes[p].origin.y(), body_.nodes[p].origin.z());
    if (body_.displacement.cols() > 0)
      for (int a = 0; a < 3; ++a) {
        const Eigen::Index column = static_cast<Eigen::Index>(3 * p) + a;
        x[a] += scale_ * ((1.0 - share) * body_.displacement(from, column) + share * body_.displacement(to, column));
      }
    return placed(pose_between(body_, from, to, share), x);
  }

 private:
  const BodyModel& model_;
  const sim::ResultBody& body_;
  bool nodes_;
  double scale_;
};

// Bodies that are drawn: as a mesh, or by their nodes.
bool drawn(const BodyModel& model, const sim::ResultBody& body) {
  return model.visible && (!model.mesh.positions.empty() || !body.nodes.empty());
}

// The way of the body that the camera follows; no way without one.
glm::dvec3 followed_between(const Animation& animation, Eigen::Index from, Eigen::Index to, double share) {
  if (animation.follow < 0) return glm::dvec3(0.0);
  return glm::dvec3(pose_between(animation.results->bodies[static_cast<size_t>(animation.follow)], from, to, share)[3]);
}

// A picture that is looked at, between which samples it lies, and its views.
struct PicturePlace {
  int picture = 0;
  SamplePlace place;
  PictureViews views;
};

// The size of two vectors by the root of the mean square, along the larger one: what oscillates nearly as fast as the samples come has
// opposite signs at the two, so no mean of vectors.
glm::dvec3 either(const glm::dvec3& left, const glm::dvec3& right) {
  const double l = glm::dot(left, left), r = glm::dot(right, right);
  return l + r > 0.0 ? (l > r ? left : right) * std::sqrt(0.5 * (l + r) / std::max(l, r)) : left;
}

// Every so manyth time and the last.
sim::VecX thinned(const sim::VecX& times, int every) {
  const Eigen::Index last = times.size() - 1;
  sim::VecX out(last / every + 1 + (last % every > 0 ? 1 : 0));
  for (Eigen::Index i = 0; i < out.size(); ++i) out[i] = times[std::min(i * every, last)];
  return out;
}

}  // namespace

VertexDistance sample_errors(const Animation& animation, int most, int every) {
  const sim::Results& results = *animation.results;
  VertexDistance out;
  const Eigen::Index end = results.times.size() - 1, last = end / every;
  if (last < 3) return out;
  const sim::VecX times = thinned(results.times, every);
  std::vector<PicturePlace> places;
  for (const int k : looked_at(animation, most)) {
    const SamplePlace place = find_sample(times, picture_time(animation, k));
    if (place.share > 0.0) places.push_back({k, place, PictureViews(animation, k)});
  }
  for (size_t b = 0; b < results.bodies.size(); ++b) {
    const BodyModel& model = animation.bodies[b];
    const sim::ResultBody& body = results.bodies[b];
    if (!drawn(model, body)) continue;
    const BodyPoints seen_at(animation, b, points_seen);
    const DrawnPoints points(animation, model, body);
    const size_t step = std::max<size_t>(1, points.count() / 40);
    for (const auto& [k, place, views] : places) {
      const Eigen::Index i = std::clamp<Eigen::Index>(place.index, 1, last - 2);
      const double weight = place.share * (1.0 - place.share);
      const glm::dvec3 nearest = where_seen_largest(views, seen_at, {std::min(place.index * every, end), 0.0});
      // What the samples at both sides are missed by where they are left out, which is twice as much of the acceleration.
      const auto missed = [&](Eigen::Index s, const auto& between) {
        return weight * (between((s - 1) * every, (s + 1) * every, 0.5) - between(s * every, s * every, 0.0));
      };
      const auto camera = [&](Eigen::Index from, Eigen::Index to, double share) { return followed_between(animation, from, to, share); };
      const glm::dvec3 camera_left = missed(i, camera), camera_right = missed(i + 1, camera);
      for (size_t p = 0; p < points.count(); p += step) {
        const auto point = [&](Eigen::Index from, Eigen::Index to, double share) { return points.between(p, from, to, share); };
        const glm::dvec3 left = missed(i, point), right = missed(i + 1, point);
        out.widen(views.moved(nearest, either(left - camera_left, right - camera_right)), glm::length(either(left, right)), k, b);
      }
    }
  }
  return out;
}

VertexDistance thinned_errors(const Animation& animation, int every) {
  constexpr size_t points_of_body = 6;
  constexpr int most_pictures = 5000, views = 8;
  const sim::Results& results = *animation.results;
  VertexDistance out;
  const Eigen::Index last = results.times.size() - 1;
  if (last < every) return out;
  const sim::VecX coarse = thinned(results.times, every);
  const std::vector<int> pictures = looked_at(animation, most_pictures);
  for (size_t b = 0; b < results.bodies.size(); ++b) {
    const BodyModel& model = animation.bodies[b];
    const sim::ResultBody& body = results.bodies[b];
    if (!drawn(model, body)) continue;
    double per_metre = 0.0;
    const BodyPoints seen_at(animation, b, points_seen);
    for (const int k : looked_at(animation, views))
      per_metre = std::max(
          per_metre, body_pixels_per_metre(PictureViews(animation, k), seen_at, find_sample(results.times, picture_time(animation, k))));
    const DrawnPoints points(animation, model, body);
    const size_t step = std::max<size_t>(1, points.count() / points_of_body);
    for (const int k : pictures) {
      const double t = picture_time(animation, k);
      const SamplePlace fine = find_sample(results.times, t), place = find_sample(coarse, t);
      if (place.share <= 0.0) continue;
      const Eigen::Index from = std::min(place.index * every, last), to = std::min(from + every, last),
                         next = std::min(fine.index + 1, last);
      const glm::dvec3 camera =
          followed_between(animation, fine.index, next, fine.share) - followed_between(animation, from, to, place.share);
      for (size_t p = 0; p < points.count(); p += step) {
        const glm::dvec3 missed = points.between(p, fine.index, next, fine.share) - points.between(p, from, to, place.share);
        out.widen(glm::length(missed - camera) * per_metre, glm::length(missed), k, b);
      }
    }
  }
  return out;
}

namespace {

// Displacement of any point of a beam as its elements have it: places and tangents of the nodes joined by cubic Hermite curves, sections
// plane and square to the curve, or aslant to it by the element's shear (ResultBody::node_shear), their twist linear between the nodes.
// Elements of a curved beam are straight.
class BeamField {
 public:
  BeamField(const sim::ResultBody& body, const sim::BodyDef* def)
      : body_(body), beam_(def ? std::get_if<sim::BeamDef>(&def->kind) : nullptr), order_(body.nodes.size()) {
    std::iota(order_.begin(), order_.end(), size_t{0});
    std::vector<double> along;
    for (const sim::ResultNode& node : body.nodes)
      along.push_back(beam_ && beam_->axis ? nearest_on(*beam_, node.origin) : node.origin.x());
    std::stable_sort(order_.begin(), order_.end(), [&](size_t a, size_t b) { return along[a] < along[b]; });
  }
  static bool suits(const sim::ResultBody& body, const sim::BodyDef* def) {
    const auto* beam = def ? std::get_if<sim::BeamDef>(&def->kind) : nullptr;
    return body.kind == "beam" && body.nodes.size() > 1 && body.rotation.size() > 0 && beam;
  }
  sim::Vec3 displaced(const sim::Vec3& x, Eigen::Index sample) const {
    const size_t i = element_at(x);
    const sim::Vec3 from = axis(order_[i]), chord = axis(order_[i + 1]) - from;
    const double h = chord.norm();
    if (!(h > 0.0)) return motion(order_[i], sample);
    const sim::Vec3 e0 = chord / h;
    const double s = (x - from).dot(e0) / h;
    const sim::Mat3 r0 = turn(order_[i], sample), r1 = turn(order_[i + 1], sample);
    const sim::Vec3 p0 = from + motion(order_[i], sample), p1 = axis(order_[i + 1]) + motion(order_[i + 1], sample);
    // Tangents of the length that the element has now, an arc over its chord: stretching is linear.
    const double half = 0.5 * std::acos(std::clamp((r0 * e0).dot(r1 * e0), -1.0, 1.0));
    const double stretch = (p1 - p0).norm() / h * (half > 1e-4 ? half / std::sin(half) : 1.0);
    sim::Vec3 t0 = stretch * (r0 * chord), t1 = stretch * (r1 * chord);
    const sim::Vec3 lead = h * shear(i, (p1 - p0 - 0.5 * (t0 + t1)) / h, h, sim::Quat(r0).slerp(0.5, sim::Quat(r1)));
    t0 += lead;
    t1 += lead;
    const double s2 = s * s, s3 = s2 * s;
    const sim::Vec3 p = (2 * s3 - 3 * s2 + 1) * p0 + (s3 - 2 * s2 + s) * t0 + (3 * s2 - 2 * s3) * p1 + (s3 - s2) * t1;
    const sim::Vec3 along = (6 * s2 - 6 * s) * p0 + (3 * s2 - 4 * s + 1) * t0 + (6 * s - 6 * s2) * p1 + (3 * s2 - 2 * s) * t1;
    const sim::Quat q = sim::Quat(r0).slerp(s, sim::Quat(r1));
    const sim::Vec3 e = q * e0;
    const sim::Mat3 r = (sim::shortest_turn(e, along - lead) * q).toRotationMatrix();
    return p + r * (x - from - s * chord) - x;
  }
  // How far vertices of a curved beam are off where it shears, m: its sections are drawn square to the axis, through nodes
  // by their turns. Of a shear g they and the axis' tangents are turned wrongly by g at the nodes, and by 3/2 g between them. g by the
  // relation of Timoshenko's element, chord - mean turn = g (1 + 1/Phi), Phi = 12 EI/(k G A h^2). beside: how far what is drawn lies from
  // the axis, m.
  double sheared(const sim::BeamDef& beam, double beside, Eigen::Index sample) const {
    const sim::Section& of = body_.section;
    const double g = 24.0 * (1.0 + beam.material.poisson) / std::max(of.area, 1e-300);
    const double y = of.shear_y > 0.0 ? g * of.iz / of.shear_y : 0.0, z = of.shear_z > 0.0 ? g * of.iy / of.shear_z : 0.0;  // h^2 Phi
    double out = 0.0;
    for (size_t i = 0; i + 1 < order_.size(); ++i) {
      const sim::Vec3 from = axis(order_[i]), chord = axis(order_[i + 1]) - from;
      const double h = chord.norm();
      const sim::Vec3 now = chord + motion(order_[i + 1], sample) - motion(order_[i], sample);
      if (!(h > 0.0) || !(now.norm() > 0.0)) continue;
      const sim::Mat3 r0 = turn(order_[i], sample), r1 = turn(order_[i + 1], sample);
      const double apart = (now.normalized() - (0.5 / h) * (r0 * chord + r1 * chord)).norm();
      // Its sections' axes are elsewhere: all of it is across both.
      out = std::max(out, 1.5 * apart * beside * (y / (y + h * h) + z / (z + h * h)));
    }
    return out;
  }

 private:
  // x/L of the place of a curved axis that is nearest.
  static double nearest_on(const sim::BeamDef& beam, const sim::Vec3& x) {
    constexpr int places = 2000;
    double out = 0.0, nearest = 1e300;
    for (int k = 0; k <= places; ++k) {
      const double s = static_cast<double>(k) / places, apart = (sim::place_on_axis(beam, s) - x).squaredNorm();
      if (apart < nearest) nearest = apart, out = s;
    }
    return out;
  }
  // The element beside which a point lies: its chord is the nearest.
  size_t element_at(const sim::Vec3& x) const {
    size_t out = 0;
    double nearest = 1e300;
    for (size_t i = 0; i + 1 < order_.size(); ++i) {
      const sim::Vec3 from = axis(order_[i]), chord = axis(order_[i + 1]) - from;
      const double length2 = chord.squaredNorm();
      const double s = length2 > 0.0 ? std::clamp((x - from).dot(chord) / length2, 0.0, 1.0) : 0.0;
      const double apart = (x - from - s * chord).squaredNorm();
      if (apart < nearest) nearest = apart, out = i;
    }
    return out;
  }
  // By how much the axis leads the sections of element i, as a slope, by its section in the middle. apart: its chord less their mean turn.
  // turned: its middle.
  sim::Vec3 shear(size_t i, const sim::Vec3& apart, double h, const sim::Quat& turned) const {
    if (body_.node_shear.rows() == 0 || !beam_) return sim::Vec3::Zero();
    const double x = 0.5 * (axis(order_[i]) + axis(order_[i + 1])).x() / beam_->length;
    const Eigen::Vector4d of = sim::shear_length2(*beam_, std::clamp(x, 0.0, 1.0));
    const Eigen::Matrix2d phi = 12.0 / (h * h) * (Eigen::Matrix2d() << of[0], of[1], of[2], of[3]).finished();
    const sim::Vec3 in_body = turned.conjugate() * apart;
    sim::Vec3 out = sim::Vec3::Zero();
    out.tail<2>() = (Eigen::Matrix2d::Identity() + phi).partialPivLu().solve(phi * in_body.tail<2>());
    return turned * out;
  }
  sim::Vec3 axis(size_t node) const { return body_.nodes[node].origin; }
  sim::Vec3 motion(size_t node, Eigen::Index sample) const {
    return body_.displacement.row(sample).segment<3>(static_cast<Eigen::Index>(3 * node)).transpose();
  }
  sim::Mat3 turn(size_t node, Eigen::Index sample) const {
    return sim::rotation_exp(body_.rotation.row(sample).segment<3>(static_cast<Eigen::Index>(3 * node)).transpose());
  }
  const sim::ResultBody& body_;
  const sim::BeamDef* beam_;  // null: not of the scene
  std::vector<size_t> order_;
};

// Pictures at which the body is bent farthest, a few, and as many at which that is seen largest.
std::vector<int> most_bent(const Animation& animation, const sim::ResultBody& body, const BodyPoints& seen_at, int most, size_t few) {
  std::vector<std::pair<double, int>> bent, shown;
  for (const int k : looked_at(animation, most)) {
    const SamplePlace place = find_sample(animation.results->times, picture_time(animation, k));
    const double by = body.displacement.row(place.index).cwiseAbs().maxCoeff();
    bent.emplace_back(-by, k);
    shown.emplace_back(-by * body_pixels_per_metre(PictureViews(animation, k), seen_at, place), k);
  }
  std::set<int> out;
  for (auto* of : {&bent, &shown}) {
    std::sort(of->begin(), of->end());
    for (size_t k = 0; k < std::min(few, of->size()); ++k) out.insert((*of)[k].second);
  }
  return {out.begin(), out.end()};
}

constexpr size_t map_moments = 6;

}  // namespace

MapErrors map_errors(const Animation& animation, const sim::Scene* scene, int most) {
  const sim::Results& results = *animation.results;
  MapErrors out;
  for (size_t b = 0; b < results.bodies.size(); ++b) {
    const BodyModel& model = animation.bodies[b];
    const sim::ResultBody& body = results.bodies[b];
    if (!model.visible || !model.flexible || model.mesh.positions.empty() || !model.vertex_nodes.empty()) continue;
    if (body.displacement.size() == 0) continue;
    const sim::BodyDef* def = definition(scene, body.name);
    const bool beam = BeamField::suits(body, def);
    const BeamField field(body, def);
    BodyModel doubting;
    if (!beam) {
      RenderSettings settings = animation.settings;
      settings.color_by = ColorBy::map_error;
      BodyDrawing drawing;
      drawing.def = def;
      doubting = make_body_model(body, drawing, settings, static_cast<int>(b));
      if (!doubting.doubt && !(doubting.error_bar && doubting.error_bar->known())) {
        out.unknown.push_back(body.name);
        continue;
      }
      if (!doubting.doubt) out.estimated.push_back(body.name);
    }
    BodyMemory memory;
    std::vector<float> doubt;
    const double scale = largest_scale(animation, model);
    const BodyPoints seen_at(animation, b, points_seen);
    for (const int k : most_bent(animation, body, seen_at, most, map_moments)) {
      const PictureViews views(animation, k);
      const SamplePlace place{find_sample(results.times, picture_time(animation, k)).index, 0.0};
      const glm::dmat4 pose = body_pose(body, place);
      double aslant = 0.0;
      update_displacement(model, body, place, memory);
      if (!beam) map_error(doubting, body, place, memory, doubt);
      else if (const auto& of = std::get<sim::BeamDef>(def->kind); of.axis)
        aslant = field.sheared(of, std::sqrt(body.section.area / std::numbers::pi), place.index);
      for (size_t i = 0; i < model.mesh.positions.size(); ++i) {
        const glm::dvec3& x = model.mesh.positions[i];
        const sim::Vec3 drawn(memory.displacement[3 * i], memory.displacement[3 * i + 1], memory.displacement[3 * i + 2]);
        double off = aslant;
        if (beam) off += (field.displaced({x.x, x.y, x.z}, place.index) - drawn).norm();
        else if (i < doubt.size()) off += static_cast<double>(doubt[i]);
        const glm::dvec3 at = placed(pose, x + scale * glm::dvec3(drawn.x(), drawn.y(), drawn.z()));
        const double pixels = scale * off * views.pixels_per_metre(at);
        if (pixels > out.largest.pixels) out.by_shear = aslant > 0.5 * off;
        out.largest.widen(pixels, scale * off, k, b);
      }
    }
  }
  return out;
}

VertexDistance raster_errors(const Animation& animation, int most) {
  constexpr double places = 256.0;  // of a pixel
  constexpr double rounding = 6e-8;
  const sim::Results& results = *animation.results;
  VertexDistance out;
  for (const int k : looked_at(animation, most)) {
    const PictureViews views(animation, k);
    const SamplePlace place = find_sample(results.times, picture_time(animation, k));
    for (size_t b = 0; b < results.bodies.size(); ++b) {
      const BodyModel& model = animation.bodies[b];
      if (!model.visible || model.mesh.positions.empty()) continue;
      double farthest = 0.0;
      for (const glm::dvec3& p : model.mesh.positions) farthest = std::max(farthest, glm::length(p));
      const double metres = rounding * (farthest + glm::length(glm::dvec3(body_pose(results.bodies[b], place)[3])));
      const BodyPoints seen_at(animation, b, points_seen);
      out.widen(0.5 / places + metres * body_pixels_per_metre(views, seen_at, place), metres, k, b);
    }
  }
  return out;
}

}  // namespace flexframe::film
