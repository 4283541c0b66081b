#include "sim/bodies/beam_pieces.h"

#include "sim/base/spatial.h"
#include "sim/scene/curve.h"
#include "sim/scene/section.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace flexframe::sim {

int piece_count(const BeamDef& beam) {
  if (beam.model == BeamModel::lumped) return beam.elements + 1;
  return beam.model == BeamModel::mixed ? beam.volumes : 1;
}

namespace {

// x/L of the borders of a beam whose section changes: every station is one, and the stretches between them have as many pieces as brings
// their lengths nearest to one another.
std::vector<double> borders(const BeamDef& beam) {
  std::vector<double> marks{0.0};
  for (const SectionStation& station : beam.stations)
    if (station.at > marks.back()) marks.push_back(station.at);
  if (marks.back() < 1.0) marks.push_back(1.0);
  std::vector<int> count(marks.size() - 1, 1);
  const auto longest = [&]() {
    size_t best = 0;
    for (size_t i = 0; i < count.size(); ++i)
      if ((marks[i + 1] - marks[i]) / count[i] > (1.0 + 1e-12) * (marks[best + 1] - marks[best]) / count[best]) best = i;
    return best;
  };
  for (int k = static_cast<int>(count.size()); k < piece_count(beam); ++k) ++count[longest()];
  std::vector<double> out{0.0};
  for (size_t i = 0; i < count.size(); ++i)
    for (int k = 1; k <= count[i]; ++k) out.push_back(marks[i] + (marks[i + 1] - marks[i]) * k / count[i]);
  return out;
}

// Frames that are carried along a curve without twist, from the body's axes at its beginning.
class Carried {
 public:
  explicit Carried(const SpaceCurve& curve) : curve_(curve) {}
  // x along the tangent at s.
  Mat3 tangent(double s) { return turned_to(curve_.at(s).tangent.normalized(), s); }
  // x along a chord that begins at s.
  Mat3 chord(double s, const Vec3& direction) { return turned_to(direction.normalized(), s); }

 private:
  // By the shortest turn from the last frame, in steps along the curve that keep it from twisting.
  Mat3 turned_to(const Vec3& x, double s) {
    constexpr int steps_of_curve = 400;
    const double step = curve_.length() / steps_of_curve;
    while (at_ + step < s) {
      at_ += step;
      axes_ = shortest(curve_.at(at_).tangent.normalized());
    }
    return shortest(x);
  }
  Mat3 shortest(const Vec3& x) const { return shortest_turn(axes_.col(0), x).toRotationMatrix() * axes_; }

  const SpaceCurve& curve_;
  double at_ = 0.0;
  Mat3 axes_ = Mat3::Identity();
};

// Chords of an even bend are as long as one another to the digits of the curve's spline: rounded to these, so that their pieces are one
// body and made once (model/fe_body). What a piece begins and ends with is not moved.
double even_length(double chord, double length) {
  const double grid = 1e-10 * length;
  return grid * std::round(chord / grid);
}

double chord_length(const BeamDef& beam, int k) {
  const double from = piece_start(beam, k);
  return (beam.axis->at(from + piece_length(beam, k)).place - beam.axis->at(from).place).norm();
}

// carried: not beyond the middle of the piece.
Pose chord_pose(const BeamDef& beam, int k, Carried& carried) {
  const double from = piece_start(beam, k), length = piece_length(beam, k);
  const Vec3 a = beam.axis->at(from).place, b = beam.axis->at(from + length).place, along = (b - a).normalized();
  Vec3 beside = Vec3::Zero();
  for (const auto& [share, weight] : {std::pair{0.25, 1.0 / 3.0}, {0.5, 1.0 / 6.0}, {0.75, 1.0 / 3.0}})
    beside += weight * (beam.axis->at(from + share * length).place - a - share * (b - a));
  Pose out;
  out.R = carried.chord(from + 0.5 * length, b - a);
  out.p = a + beside - beside.dot(along) * along;
  return out;
}

}  // namespace

Pose chord_pose(const BeamDef& beam, int k) {
  Carried carried(*beam.axis);
  return chord_pose(beam, k, carried);
}

double piece_start(const BeamDef& beam, int k) {
  if (beam.model == BeamModel::lumped) return k == 0 ? 0.0 : (k - 0.5) * (beam.length / beam.elements);
  if (!beam.stations.empty()) return borders(beam)[k] * beam.length;
  return k * beam.length / piece_count(beam);
}

double piece_length(const BeamDef& beam, int k) {
  if (beam.stations.empty()) return beam.length / piece_count(beam);
  const std::vector<double> all = borders(beam);
  return (all[k + 1] - all[k]) * beam.length;
}

Section section_at(const BeamDef& beam, double s) {
  if (beam.stations.empty()) return beam.section;
  size_t next = 0;
  while (next < beam.stations.size() && beam.stations[next].at < s) ++next;
  if (next == 0) return beam.stations.front().section;
  if (next == beam.stations.size()) return beam.stations.back().section;
  const SectionStation &a = beam.stations[next - 1], &b = beam.stations[next];
  std::map<std::string, double> size = a.section.size;
  for (auto& [name, value] : size) value += (s - a.at) / (b.at - a.at) * (b.section.size.at(name) - value);
  return make_section(a.section.shape, size);
}

Eigen::Vector4d shear_length2(const BeamDef& beam, double s) {
  const Section at = section_at(beam, s);
  const double stiffnesses = 2.0 * (1.0 + beam.material.poisson);  // E/G
  const double y = at.shear_y > 0.0 ? stiffnesses / (at.shear_y * at.area) : 0.0;
  const double z = at.shear_z > 0.0 ? stiffnesses / (at.shear_z * at.area) : 0.0, yz = stiffnesses / at.area * at.shear_yz;
  return {y * at.iz + yz * at.iyz, y * at.iyz + yz * at.iy, yz * at.iz + z * at.iyz, yz * at.iyz + z * at.iy};
}

Section piece_section(const BeamDef& beam, int k) {
  if (beam.stations.empty()) return beam.section;
  return section_at(beam, (piece_start(beam, k) + 0.5 * piece_length(beam, k)) / beam.length);
}

Pose piece_pose(const BeamDef& beam, int k) {
  if (beam.axis) return chord_pose(beam, k);
  Pose out;
  out.p.x() = piece_start(beam, k);
  return out;
}

std::vector<Pose> piece_poses(const BeamDef& beam) {
  std::vector<Pose> out(piece_count(beam));
  std::optional<Carried> carried;
  if (beam.axis) carried.emplace(*beam.axis);
  for (int k = 0; k < piece_count(beam); ++k)
    if (carried) out[k] = chord_pose(beam, k, *carried);
    else out[k].p.x() = piece_start(beam, k);
  return out;
}

Mat3 tangent_in_piece(const BeamDef& beam, int k, double s) {
  if (!beam.axis) return Mat3::Identity();
  // The root has the body's own axes, as the curve is drawn in them.
  if (s == 0.0) return chord_pose(beam, k).R.transpose();
  return chord_pose(beam, k).R.transpose() * Carried(*beam.axis).tangent(s * beam.length);
}

Vec3 place_on_axis(const BeamDef& beam, double s) {
  return beam.axis ? beam.axis->at(s * beam.length).place : Vec3(s * beam.length, 0.0, 0.0);
}

Vec3 beside_piece(const BeamDef& beam, int k, double s) {
  if (!beam.axis) return Vec3::Zero();
  const Pose pose = chord_pose(beam, k);
  const double share = (s * beam.length - piece_start(beam, k)) / piece_length(beam, k);
  return pose.R.transpose() * (beam.axis->at(s * beam.length).place - pose.p) - Vec3(share * chord_length(beam, k), 0.0, 0.0);
}

std::pair<int, double> locate_piece(const BeamDef& beam, double s) {
  const int pieces = piece_count(beam);
  if (beam.model == BeamModel::lumped) {
    int k = 0;
    while (k + 1 < pieces && s * beam.length >= piece_start(beam, k + 1)) ++k;
    return {k, 0.0};
  }
  if (!beam.stations.empty()) {
    const std::vector<double> all = borders(beam);
    int k = 0;
    while (k + 1 < pieces && s > all[k + 1] * (1.0 + 1e-12)) ++k;
    const double from = all[k], to = all[k + 1];
    return {k, std::clamp((s - from) / (to - from), 0.0, 1.0)};
  }
  const double at = s * pieces;
  const int k = std::clamp(static_cast<int>(std::ceil(at)) - 1, 0, pieces - 1);
  return {k, at - k};
}

BeamDef piece_of(const BeamDef& beam, int k, double time_constant) {
  BeamDef out = beam;
  const int pieces = piece_count(beam);
  out.length = beam.stations.empty() ? beam.length / pieces : piece_length(beam, k);
  if (beam.axis) {
    // Along its chord, with the mass and the flexibility of the curve, which is longer.
    const double chord = even_length(chord_length(beam, k), out.length);
    out.material.density *= out.length / chord;
    out.material.youngs_modulus *= chord / out.length;
    out.length = chord;
  }
  out.section = piece_section(beam, k);
  out.stations.clear();
  out.axis = nullptr;
  out.model = beam.model == BeamModel::mixed ? (beam.modes.empty() ? BeamModel::finite_element : BeamModel::modal) : beam.model;
  if (beam.model == BeamModel::mixed) {
    out.damping = {};
    out.damping.stiffness = time_constant;
  }
  out.frames.clear();
  for (const auto& [name, s] : beam.frames) {
    const auto [piece, local] = locate_piece(beam, s);
    if (piece == k) out.frames[name] = local;
  }
  return out;
}

}  // namespace flexframe::sim
