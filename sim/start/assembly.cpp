#include "sim/start/assembly.h"

#include "sim/base/eigen_solvers.h"
#include "sim/dynamics/closure.h"
#include "sim/dynamics/dynamics.h"
#include "sim/dynamics/kinematics.h"
#include "sim/dynamics/loop_descent.h"
#include "sim/model/bodies.h"
#include "sim/model/joint_motion.h"
#include "sim/scene/joint_kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numbers>

namespace flexframe::sim {
namespace {

// Writes a scene's initial value of a joint into its coordinates. Lists: spherical a rotation vector, free position then rotation vector.
void set_joint_value(const TreeJoint& joint, const std::vector<double>& value, double* q) {
  const auto quaternion = [](const Vec3& a, double* out) {
    const Quat r(rotation_exp(a));
    out[0] = r.w(), out[1] = r.x(), out[2] = r.y(), out[3] = r.z();
  };
  const int at = traits(joint.kind).quaternion;
  for (int i = 0; i < (at < 0 ? joint.nq : at); ++i) q[i] = value[i];
  if (at < 0) return;
  const size_t turn = at;
  quaternion(value.size() > turn ? Vec3(value[turn], value[turn + 1], value[turn + 2]) : Vec3(Vec3::Zero()), q + at);
}

// Rates: angular velocities (spherical) and velocities (free) are given in the parent frame, kept in the child's axes.
void set_joint_rate(const TreeJoint& joint, const std::vector<double>& rate, const double* q, double* w) {
  if (has_orientation(joint.kind)) {
    const Mat3 R = orientation_of(joint.kind, q);
    for (size_t block = 0; block < rate.size() / 3; ++block) {
      const Vec3 v = R.transpose() * Vec3(rate[3 * block], rate[3 * block + 1], rate[3 * block + 2]);
      for (size_t i = 0; i < 3; ++i) w[3 * block + i] = v[i];
    }
  } else {
    for (int i = 0; i < joint.nv; ++i) w[i] = rate[i];
  }
}

void require_count(const Scene& scene, const JointDef& def, const char* key, size_t found, std::initializer_list<int> allowed) {
  if (std::find(allowed.begin(), allowed.end(), static_cast<int>(found)) != allowed.end()) return;
  throw InputError(fmt::format("{}:{}: joint '{}': key 'initial.{}' has {} numbers; allowed: {}", scene.file.string(), def.line, def.name,
                               key, found, fmt::join(allowed, " or ")));
}

struct Freedom {
  std::vector<int> value, rate;  // cluster rates that may be moved at the position and at the velocity level
  // Of these, those of joints, which go first: the links of lumped beams are deformations and stay at rest where joints close the loop.
  std::vector<int> joint_value, joint_rate;
  std::vector<int> unguessed;  // of joint_value, those of joints without a guess
};

Freedom freedom_of(const Model& model, const Scene& scene, int cluster) {
  const Cluster& c = model.clusters[cluster];
  Freedom out;
  for (int i : c.parts) {
    const Part& p = model.parts[i];
    const JointDef* def = p.joint.scene_joint >= 0 ? &scene.joints[p.joint.scene_joint] : nullptr;
    for (int k = 0; k < p.joint.nv; ++k) {
      const int column = p.v0 - c.v0 + k;
      if (!def || !def->initial.value) out.value.push_back(column);
      if (!def || !def->initial.rate) out.rate.push_back(column);
      if (p.joint.link >= 0) continue;
      if (!def || !def->initial.value) out.joint_value.push_back(column);
      if (!def || !def->initial.rate) out.joint_rate.push_back(column);
      if (!def || (!def->initial.value && !def->initial.guess)) out.unguessed.push_back(column);
    }
  }
  return out;
}

// Conditions on directions hold, too, where the child is turned over by half a turn: its axis against the parent's, or of a joint that
// lets nothing turn its y. The first loop that is closed so; null: none.
const LoopJoint* turned_over(const Model& model, int cluster, Work& work) {
  for (const int l : model.clusters[cluster].loops) {
    const LoopJoint& loop = model.loops[l];
    const std::string_view turns = traits(loop.kind).closure->turns;
    if (turns.size() < 4) continue;
    const Mat3 R = frame_in_base(model, work, cluster, loop.a).R.transpose() * frame_in_base(model, work, cluster, loop.b).R;
    const Vec3 y = axis_normals(loop.axis)[1];
    if (loop.axis.dot(R * loop.axis) < 0.0 || (turns.size() == 6 && y.dot(R * y) < 0.0)) return &loop;
  }
  return nullptr;
}

// The coordinates of a joint with which B is turned as R has it in A. Kinds whose turns are no coordinates of their own keep them.
void set_turn(const TreeJoint& joint, const Mat3& R, double* q) {
  const auto [x, y] = axis_normals(joint.axis);
  const auto about = [](const Vec3& u, const Vec3& v, const Vec3& turned) { return std::atan2(v.dot(turned), u.dot(turned)); };
  if (has_orientation(joint.kind)) {
    const Quat turn(R);
    double* out = q + traits(joint.kind).quaternion;
    out[0] = turn.w(), out[1] = turn.x(), out[2] = turn.y(), out[3] = turn.z();
  } else if (joint.kind == JointKind::universal) {
    q[0] = about(x, y, R * x);
    q[1] = about(y, joint.axis, rotation_exp(joint.axis * -q[0]) * (R * y));
  } else if (joint.kind == JointKind::constant_velocity) {
    const Vec3 bend = rotation_log(shortest_turn(joint.axis, R * joint.axis));
    q[0] = x.dot(bend), q[1] = y.dot(bend);
  } else if (const std::string_view rates = traits(joint.kind).rates;
             joint.pitch == 0.0 && std::count(rates.begin(), rates.end(), 'r') == 1) {
    q[rates.find('r')] = about(x, y, R * x);
  }
}

// Turns the massless links of loops that are turned over to where the bodies have them; these stay.
void turn_links(const Model& model, int cluster, const std::vector<int>& columns, Work& work) {
  const Cluster& c = model.clusters[cluster];
  for (const int l : c.loops) {
    const LoopJoint& loop = model.loops[l];
    const int at = model.frames[loop.a].part;
    if (at == ground || model.parts[at].scene_body >= 0 || model.parts[at].joint.nq == 0) continue;
    const Part& link = model.parts[at];
    const auto moves = [&](int k) { return std::find(columns.begin(), columns.end(), link.v0 - c.v0 + k) != columns.end(); };
    if (!moves(0)) continue;
    const Pose parent = frame_in_base(model, work, cluster, link.joint.inboard), child = frame_in_base(model, work, cluster, loop.b);
    set_turn(link.joint, parent.R.transpose() * child.R, work.q.data() + link.q0);
  }
}

// As descend; a loop that closes with a joint turned over counts as just open: only what is closed is better.
double descend_upright(const Model& model, int cluster, const std::vector<int>& columns, Work& work) {
  const double size = model.clusters[cluster].size;
  const double open = descend(model, cluster, columns, work);
  if (open > 1e-9 * size || !turned_over(model, cluster, work)) return open;
  const VecX closed = work.q;
  turn_links(model, cluster, columns, work);
  const double turned = descend(model, cluster, columns, work);
  if (turned <= 1e-9 * size && !turned_over(model, cluster, work)) return turned;
  work.q = closed;
  return std::max(open, 2e-9 * size);
}

// From the current coordinates; where that is a dead point (bars in line, from which no small motion brings the ends together), from
// places around it, nearest first, and of the ways to close the loops that are found at one distance the one with the least motion;
// of two mirror images the one with the larger distances along slides.
double assemble_positions(const Model& model, int cluster, const std::vector<int>& columns, Work& work) {
  const Cluster& c = model.clusters[cluster];
  const VecX start = work.q;
  const double closed = 1e-9 * c.size;
  double best = descend_upright(model, cluster, columns, work);
  if (best <= closed) return best;
  if (columns.empty()) return descend(model, cluster, columns, work);
  VecX best_q = work.q;
  const auto distance = [&](const VecX& q) {
    double d = 0.0;
    for (int i : c.parts) {
      const Part& p = model.parts[i];
      for (int k = 0; k < p.joint.nq; ++k) d += std::pow((q[p.q0 + k] - start[p.q0 + k]) * (is_length(p.joint.kind, k) ? 1.0 : c.size), 2);
    }
    return d;
  };
  const auto along_slides = [&](const VecX& q) {
    double sum = 0.0;
    for (int i : c.parts) {
      // A slide has one length among its coordinates.
      const std::string_view rates = traits(model.parts[i].joint.kind).rates;
      if (model.parts[i].joint.nq > 0 && std::count(rates.begin(), rates.end(), 'm') == 1)
        sum += q[model.parts[i].q0 + static_cast<int>(rates.find('m'))];
    }
    return sum;
  };
  // A reproducible sequence of directions (Weyl's: fractional parts of multiples of irrational numbers) in growing circles.
  unsigned sample = 0;
  for (const double radius : {0.1, 0.5, 1.2, 2.5}) {
    double least = std::numeric_limits<double>::infinity();
    for (int attempt = 0; attempt < 8; ++attempt) {
      work.q = start;
      VecX step(columns.size());
      for (size_t k = 0; k < columns.size(); ++k) {
        const double at = ++sample * std::numbers::phi + 0.5 * std::numbers::sqrt2 * static_cast<double>(k * k);
        step[static_cast<Eigen::Index>(k)] = radius * (2.0 * (at - std::floor(at)) - 1.0) * c.size / rate_scale(model, cluster, columns[k]);
      }
      move_rates(model, c, columns, step, work);
      const double open = descend_upright(model, cluster, columns, work);
      const double d = distance(work.q);
      // To a thousandth the two are mirror images that differ by rounding or by which turn they took.
      const bool nearer = d < (1.0 - 1e-3) * least || (d < (1.0 + 1e-3) * least && along_slides(work.q) > along_slides(best_q));
      if (open <= closed ? best > closed || nearer : best > closed && open < best) {
        best = open;
        best_q = work.q;
        if (open <= closed) least = d;
      }
    }
    if (best <= closed) break;
  }
  work.q = best_q;
  update_cluster_positions(model, cluster, work);
  update_closure_residual(model, cluster, work);
  return closure_row_scales(model, work, cluster).cwiseProduct(work.clusters[cluster].residual).cwiseAbs().maxCoeff();
}

// Angles that the scene leaves open are those within half a turn: the search may have gone round the other way. A coupling counts turns.
void take_least_turns(const Model& model, const Scene& scene, const Cluster& c, Work& work) {
  if (!c.couplings.empty()) return;
  for (const int i : c.parts) {
    const Part& p = model.parts[i];
    if (p.joint.scene_joint < 0 || p.joint.nq == 0 || p.joint.pitch != 0.0 || has_orientation(p.joint.kind)) continue;
    const JointDef& def = scene.joints[p.joint.scene_joint];
    if (def.initial.value || def.initial.guess || p.joint.kind == JointKind::constant_velocity || p.joint.curve) continue;
    for (int k = 0; k < p.joint.nq; ++k)
      if (!is_length(p.joint.kind, k)) work.q[p.q0 + k] -= 2.0 * std::numbers::pi * std::round(work.q[p.q0 + k] / (2.0 * std::numbers::pi));
  }
}

// "0.5236", or "[0.1, 0.2]" of several coordinates.
std::string values_text(const double* q, int count) {
  std::string text;
  for (int k = 0; k < count; ++k) text += fmt::format("{}{:.10g}", k > 0 ? ", " : "", q[k]);
  return count == 1 ? text : "[" + text + "]";
}

// "joint 'coupler' 1.249, joint 'rocker' 0.61": where the coordinates are that were moved to close the loop; the first six.
std::string branch_text(const Model& model, const Cluster& c, const VecX& before, const Work& work) {
  std::string text;
  int told = 0;
  for (int i : c.parts) {
    const Part& p = model.parts[i];
    if (p.joint.scene_joint < 0 || p.joint.nq == 0 || p.joint.nq != p.joint.nv) continue;
    if (((work.q - before).segment(p.q0, p.joint.nq).cwiseAbs().array() <= 1e-6).all()) continue;
    if (++told > 6) return text + ", ...";
    VecX rounded = work.q.segment(p.q0, p.joint.nq);
    for (double& x : rounded) x = std::round(x * 1e4) * 1e-4;
    text += fmt::format("{}joint '{}' {}", text.empty() ? "" : ", ", p.joint.name, values_text(rounded.data(), p.joint.nq));
  }
  return text;
}

// Which of the given initial values would close the loop, were it another: "'value' of joint 'crank' 0.5236 instead of 0.5". One joint at a
// time, from the positions that the scene gives; those that need the least change first, three at most. Joints of quaternions are left out.
// Empty: none alone can.
std::string closing_values(const Model& model, const Scene& scene, int cluster, const VecX& given, Work& work) {
  const Cluster& c = model.clusters[cluster];
  const std::vector<int> free = freedom_of(model, scene, cluster).value;
  std::vector<std::pair<double, std::string>> found;
  for (int i : c.parts) {
    const Part& p = model.parts[i];
    if (p.joint.scene_joint < 0 || p.joint.nq == 0 || p.joint.nq != p.joint.nv || !scene.joints[p.joint.scene_joint].initial.value)
      continue;
    std::vector<int> columns = free;
    for (int k = 0; k < p.joint.nv; ++k) columns.push_back(p.v0 - c.v0 + k);
    work.q = given;
    if (assemble_positions(model, cluster, columns, work) > 1e-9 * c.size) continue;
    double change = 0.0;
    for (int k = 0; k < p.joint.nv; ++k)
      change = std::max(change, std::abs(work.q[p.q0 + k] - given[p.q0 + k]) * rate_scale(model, cluster, p.v0 - c.v0 + k));
    found.emplace_back(change, fmt::format("'initial.value' {} of joint '{}' (given: {})", values_text(work.q.data() + p.q0, p.joint.nq),
                                           p.joint.name, values_text(given.data() + p.q0, p.joint.nq)));
  }
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::string text;
  for (size_t k = 0; k < std::min<size_t>(found.size(), 3); ++k) text += (k > 0 ? ", or " : "") + found[k].second;
  return text;
}

// Where no single value is to blame, several are rounded: with all but the first of them as guesses, else all, "'guess' instead of 'value'
// at joint 'B', it closes with joint 'B' -0.7199". Empty: not even so.
std::string closing_guesses(const Model& model, const Scene& scene, int cluster, const VecX& given, Work& work) {
  const Cluster& c = model.clusters[cluster];
  std::vector<int> valued;
  for (int i : c.parts)
    if (const TreeJoint& j = model.parts[i].joint; j.scene_joint >= 0 && j.nq > 0 && scene.joints[j.scene_joint].initial.value)
      valued.push_back(i);
  for (const size_t first : {size_t{1}, size_t{0}}) {
    if (first >= valued.size()) continue;
    std::vector<int> columns = freedom_of(model, scene, cluster).value;
    std::string names;
    for (size_t n = first; n < valued.size(); ++n) {
      const Part& p = model.parts[valued[n]];
      for (int k = 0; k < p.joint.nv; ++k) columns.push_back(p.v0 - c.v0 + k);
      names += fmt::format("{}'{}'", names.empty() ? "" : ", ", p.joint.name);
    }
    work.q = given;
    if (assemble_positions(model, cluster, columns, work) <= 1e-9 * c.size)
      return fmt::format("with initial.guess instead of initial.value at {}, which may be moved, it closes with {}", names,
                         branch_text(model, c, given, work));
  }
  return "";
}

// A body of the loops that could give way, if the joints did not have to close them.
std::string elastic_body(const Model& model, const Scene& scene, int cluster) {
  for (const int i : model.clusters[cluster].parts)
    if (model.parts[i].body.n > 0 && model.parts[i].scene_body >= 0)
      return scene.bodies[static_cast<size_t>(model.parts[i].scene_body)].name;
  return "";
}

// given: coordinates as the scene gives them.
[[noreturn]] void refuse_open(const Model& model, const Scene& scene, const VecX& given, Work& work, int cluster) {
  const Cluster& c = model.clusters[cluster];
  int row = 0;
  double worst = -1.0, gap = 0.0, turn = 0.0;
  // The first, should none be measurable: of what is no number nothing is the largest.
  const LoopJoint* open = c.loops.empty() ? nullptr : &model.loops[c.loops.front()];
  for (int l : c.loops) {
    double g = 0.0, a = 0.0;
    for (const ClosureRow& r : model.loops[l].rows) {
      const double e = work.clusters[cluster].residual[row++];
      (r.kind == ClosureRow::angle ? a : g) += e * e;
    }
    const double measure = std::sqrt(g) + c.size * std::sqrt(a);
    if (measure > worst) worst = measure, gap = std::sqrt(g), turn = std::sqrt(a), open = &model.loops[l];
  }
  std::string others;
  for (int i : c.parts)
    if (model.parts[i].joint.scene_joint >= 0) others += fmt::format("{}'{}'", others.empty() ? "" : ", ", model.parts[i].joint.name);
  // A coupling that is further open than every loop is to blame.
  const CouplingRow* apart = nullptr;
  double by = 0.0;
  for (int k : c.couplings) {
    const double e = std::abs(work.clusters[cluster].residual[row++]);
    if (const double size = model.couplings[k].length ? e : c.size * e; size > worst) worst = size, by = e, apart = &model.couplings[k];
  }
  int line = 0;
  for (const JointDef& def : scene.joints)
    if (open && def.name == open->name) line = def.line;
  const std::string values = closing_values(model, scene, cluster, given, work);
  std::string advice = "it closes with " + values;
  if (values.empty()) advice = closing_guesses(model, scene, cluster, given, work);
  if (advice.empty()) {
    advice = "no other initial values close it: check lengths and joint positions";
    if (const std::string elastic = elastic_body(model, scene, cluster); !elastic.empty())
      advice += fmt::format(
          "; bodies are not deformed while it is assembled: what '{}' is to give way by comes as the 'motion' of a joint "
          "that starts from 0 (a support that settles), or with a stiff [[force]] of kind \"bushing\" in place of the joint",
          elastic);
  }
  if (apart || !open)
    throw InputError(fmt::format(
        "{}:{}: the mechanism cannot be assembled: coupling '{}' stays off its value by {:.4g} {}, whatever the joints do ({}); {}",
        scene.file.string(), apart ? scene.couplings[apart->scene_coupling].line : 0, apart ? apart->name : "", by,
        apart && apart->length ? "m" : "rad", others, advice));
  throw InputError(
      fmt::format("{}:{}: the mechanism cannot be assembled: joint '{}' stays open by {:.4g} m and {:.4g} rad in every position of the "
                  "other joints of its loop ({}); {}",
                  scene.file.string(), line, open->name, gap, turn, others, advice));
}

// A start in a change point, where the loop has more ways to move than anywhere beside it: the rates say which way it goes. The cluster
// is moved a hundred-thousandth of its size along them, where its conditions are independent, and the rates follow the loop there.
// Returns false where the start is no change point. Throws where the rates fit no way out.
bool leave_change_point(const Model& model, const Scene& scene, int cluster, Work& work) {
  const Cluster& c = model.clusters[cluster];
  ClusterWork& cw = work.clusters[cluster];
  const Partition here = cw.partition;
  if (static_cast<int>(here.rows.size()) == closure_row_count(model, work, cluster)) return false;
  std::vector<int> columns;
  VecX rate;
  for (int k = 0; k < c.nv; ++k)
    if (rate_scale(model, cluster, k) > 0.0) columns.push_back(k);
  rate.resize(static_cast<Eigen::Index>(columns.size()));
  double speed = 0.0;
  for (size_t k = 0; k < columns.size(); ++k) {
    rate[static_cast<Eigen::Index>(k)] = work.w[c.v0 + columns[k]];
    speed = std::max(speed, std::abs(work.w[c.v0 + columns[k]]) * rate_scale(model, cluster, columns[k]));
  }
  if (speed == 0.0) return false;

  // A hundred-thousandth: far enough for Newton's method to close the loop to rounding (close_positions), too little to see.
  const double ahead = 1e-5 * c.size;
  const VecX before = work.q;
  move_rates(model, c, columns, rate * (ahead / speed), work);
  const VecX along = work.q;
  assemble_positions(model, cluster, columns, work);
  const Partition beside = choose_partition(model, cluster, work, true);
  if (beside.rows.size() <= here.rows.size()) {
    work.q = before;
    close_positions(model, cluster, work);
    return false;
  }
  // The rates lead along a way that exists if the closed position lies beside them by second order only.
  if ((work.q - along).segment(c.q0, c.nq).cwiseAbs().maxCoeff() > 1e-3 * (along - before).segment(c.q0, c.nq).cwiseAbs().maxCoeff()) {
    std::string joints;
    for (int i : c.parts)
      if (model.parts[i].joint.scene_joint >= 0 && model.parts[i].joint.nv > 0)
        joints += fmt::format("{}'{}'", joints.empty() ? "" : ", ", model.parts[i].joint.name);
    throw InputError(
        fmt::format("{}: the loop of joint '{}' starts in a change point, from which it can move in more than one way, and the initial "
                    "rates fit none of them: give rates of more of its joints ({}), or start away from that position",
                    scene.file.string(), closure_row_name(model, work.clusters[cluster], cluster, beside.rows.back()), joints));
  }
  cw.partition = beside;
  close_positions(model, cluster, work);
  // The nearest rates that the loop allows.
  update_closure_matrix(model, cluster, work);
  const MatX A = scaled_columns(model, work, cluster, columns, closure_row_scales(model, work, cluster));
  VecX scaled(rate.size());
  for (size_t k = 0; k < columns.size(); ++k)
    scaled[static_cast<Eigen::Index>(k)] = rate[static_cast<Eigen::Index>(k)] * rate_scale(model, cluster, columns[k]);
  scaled -= least_squares(A, A * scaled, 1e-9);
  for (size_t k = 0; k < columns.size(); ++k)
    work.w[c.v0 + columns[k]] = scaled[static_cast<Eigen::Index>(k)] / rate_scale(model, cluster, columns[k]);
  update_cluster_world(model, cluster, work);
  close_velocities(model, cluster, work);
  return true;
}

}  // namespace

std::string largest_moves(const Model& model, const VecX& from, const VecX& to, double least) {
  double length = 0.0, angle = 0.0;
  for (const Part& p : model.parts) {
    const int orientation = traits(p.joint.kind).quaternion;
    for (int k = 0; k < (orientation >= 0 ? orientation : p.joint.nq); ++k) {
      double& largest = is_length(p.joint.kind, k) ? length : angle;
      largest = std::max(largest, std::abs(to[p.q0 + k] - from[p.q0 + k]));
    }
    if (orientation >= 0) {
      const Mat3 a = orientation_of(p.joint.kind, from.data() + p.q0), b = orientation_of(p.joint.kind, to.data() + p.q0);
      angle = std::max(angle, Eigen::AngleAxisd(a.transpose() * b).angle());
    }
  }
  std::string text;
  if (length > least) text = fmt::format("{:.3g} m", length);
  if (angle > least) text += fmt::format("{}{:.3g} rad", text.empty() ? "" : " and ", angle);
  return text;
}

void assemble(Model& model, const Scene& scene, Work& work, Notes& notes) {
  update_expressions(model, 0.0, work);
  // What the scene gives.
  for (const Part& p : model.parts) {
    if (p.joint.scene_joint < 0 || p.joint.nq == 0) continue;
    const JointDef& def = scene.joints[p.joint.scene_joint];
    const int nv = p.joint.nv;
    if (def.initial.value) {
      require_count(scene, def, "value", def.initial.value->size(),
                    traits(p.joint.kind).quaternion > 0 ? std::initializer_list<int>{3, nv} : std::initializer_list<int>{nv});
      set_joint_value(p.joint, *def.initial.value, work.q.data() + p.q0);
    }
    if (def.initial.guess) set_joint_value(p.joint, *def.initial.guess, work.q.data() + p.q0);
    if (def.initial.rate) {
      require_count(scene, def, "rate", def.initial.rate->size(),
                    traits(p.joint.kind).quaternion > 0 ? std::initializer_list<int>{3, nv} : std::initializer_list<int>{nv});
      set_joint_rate(p.joint, *def.initial.rate, work.q.data() + p.q0, work.w.data() + p.v0);
    }
  }
  for (size_t b = 0; b < scene.bodies.size(); ++b) {
    const FlexibleInitial* initial = nullptr;
    if (const auto* beam = std::get_if<BeamDef>(&scene.bodies[b].kind)) initial = &beam->initial;
    if (const auto* modal = std::get_if<ModalDef>(&scene.bodies[b].kind)) initial = &modal->initial;
    if (const auto* space = std::get_if<StateSpaceDef>(&scene.bodies[b].kind)) initial = &space->initial;
    if (!initial) continue;
    const size_t total = coordinate_count(model, static_cast<int>(b));
    for (const auto* list : {&initial->q, &initial->qd}) {
      if (list->empty()) continue;
      if (list->size() != total)
        throw InputError(fmt::format("{}:{}: body '{}': key 'initial.{}' has {} numbers; the body has {} elastic coordinates",
                                     scene.file.string(), scene.bodies[b].line, scene.bodies[b].name, list == &initial->q ? "q" : "qd",
                                     list->size(), total));
      const bool rates = list == &initial->qd;
      set_body_coordinates(model, static_cast<int>(b), Eigen::Map<const VecX>(list->data(), static_cast<Eigen::Index>(total)),
                           rates ? work.w : work.q, rates);
    }
  }

  for (size_t k = 0; k < model.clusters.size(); ++k) {
    const int cluster = static_cast<int>(k);
    const Cluster& c = model.clusters[k];
    if (has_closure(c)) {
      const Freedom free = freedom_of(model, scene, cluster);
      const VecX before = work.q;
      // First what has no guess comes as near as it can to closing the loop, so that the guesses choose the way to close it.
      if (free.unguessed.size() < free.joint_value.size()) assemble_positions(model, cluster, free.unguessed, work);
      // 1e-9 of the size is far above rounding and far below what anybody calls closed by construction.
      const double closed = 1e-9 * c.size;
      const VecX unbent = work.q;
      if (descend_upright(model, cluster, free.joint_value, work) > closed) work.q = unbent;
      if (assemble_positions(model, cluster, free.value, work) > closed) refuse_open(model, scene, before, work, cluster);
      take_least_turns(model, scene, c, work);
      if (const LoopJoint* over = turned_over(model, cluster, work))
        notes.warn(fmt::format("joint '{}'", over->name),
                   "its loop was closed only with the joint turned over by half a turn: the axes of its child's frame against those of its "
                   "parent's; turn one of these frames, or give a joint of the loop an initial 'guess' near the position that is meant");
      if (const std::string moved = largest_moves(model, before, work.q, 1e-6); !moved.empty()) {
        const std::string branch = branch_text(model, c, before, work);
        notes.tell(closure_of(model, c),
                   fmt::format("initial positions were adjusted by up to {} to close the loop{}{}", moved,
                               branch.empty() ? "" : ": it starts with " + branch,
                               branch.empty() ? "" : "; initial = { guess = ... } near another position chooses another way to close it"));
      }
      work.clusters[k].partition = choose_partition(model, cluster, work, false);
      const int rows = closure_row_count(model, work, cluster), used = static_cast<int>(work.clusters[k].partition.rows.size());
      if (used < rows)
        notes.tell(closure_of(model, c),
                   fmt::format("{} of the {} closure conditions of its loop are redundant and left out", rows - used, rows));
    }
    close_positions(model, cluster, work);
    update_cluster_world(model, cluster, work);
  }
  assemble_rates(model, scene, work, notes);
  for (size_t i = 0; i < model.parts.size(); ++i) update_mass(model.parts[i].body, work.parts[i].q, work.parts[i].terms);
}

void assemble_rates(const Model& model, const Scene& scene, Work& work, Notes& notes) {
  for (size_t k = 0; k < model.clusters.size(); ++k) {
    const int cluster = static_cast<int>(k);
    const Cluster& c = model.clusters[k];
    if (!has_closure(c)) {
      close_velocities(model, cluster, work);
      continue;
    }
    // Rates: what is free takes up what the loops need, least motion first.
    const Freedom free = freedom_of(model, scene, cluster);
    update_closure_matrix(model, cluster, work);
    const VecX scale = closure_row_scales(model, work, cluster);
    const Partition chosen = work.clusters[k].partition;
    Partition all = chosen;
    all.rows.resize(closure_row_count(model, work, cluster));
    for (size_t r = 0; r < all.rows.size(); ++r) all.rows[r] = static_cast<int>(r);
    all.plan = 0;
    work.clusters[k].partition = all;
    update_cluster_velocities(model, cluster, work);
    update_closure_rates(model, cluster, work);
    work.clusters[k].partition = chosen;
    const VecX b = -scale.cwiseProduct(work.clusters[k].rate);
    VecX x, left;
    const auto close_with = [&](const std::vector<int>& columns) {
      const MatX A = scaled_columns(model, work, cluster, columns, scale);
      x = columns.empty() ? VecX() : least_squares(A, b);
      left = columns.empty() ? b : VecX(b - A * x);
    };
    // Against the speeds that meet in the loop, also what carries it along: where they fit, only rounding of them is left.
    const Vec6& carrier = work.bases[k].V;
    double speed = std::max({b.cwiseAbs().maxCoeff(), carrier.head<3>().norm(), carrier.tail<3>().norm() * c.size});
    for (int v = 0; v < c.nv; ++v) speed = std::max(speed, std::abs(work.w[c.v0 + v]) * rate_scale(model, cluster, v));
    for (int i : c.parts)
      if (const TreeJoint& j = model.parts[i].joint; j.motion >= 0)
        speed = std::max(speed, std::abs(work.motion[j.motion].rate) * (is_length(j.kind, 0) ? 1.0 : c.size));
    // Rates that are rounding themselves contradict nothing: what opens over the run by less than a rounding of the loop's size.
    constexpr double rounding = 1e-12;
    const auto opens = [&] {
      const double open = left.cwiseAbs().maxCoeff();
      return open > 1e-8 * speed && open * scene.simulation.duration > rounding * c.size;
    };
    const std::vector<int>* moved = &free.joint_rate;
    close_with(*moved);
    if (opens() && free.rate.size() > moved->size()) close_with(*(moved = &free.rate));
    if (opens()) {
      int row = 0;
      left.cwiseAbs().maxCoeff(&row);
      std::string motions, rates;
      for (int i : c.parts) {
        const TreeJoint& j = model.parts[i].joint;
        if (j.motion >= 0) motions += fmt::format("{}'{}'", motions.empty() ? "" : ", ", j.name);
        else if (j.scene_joint >= 0 && scene.joints[j.scene_joint].initial.rate)
          rates += fmt::format("{}'{}'", rates.empty() ? "" : ", ", j.name);
      }
      const std::string given = motions.empty() ? "initial rates" : rates.empty() ? "motions" : "motions and initial rates";
      // The rates that would close it, one joint's at a time.
      std::string closing;
      for (int i : c.parts) {
        const Part& p = model.parts[i];
        if (p.joint.scene_joint < 0 || p.joint.nv == 0 || p.joint.nq != p.joint.nv || !scene.joints[p.joint.scene_joint].initial.rate)
          continue;
        std::vector<int> columns = free.rate;
        for (int m = 0; m < p.joint.nv; ++m) columns.push_back(p.v0 - c.v0 + m);
        const MatX B = scaled_columns(model, work, cluster, columns, scale);
        const VecX y = least_squares(B, b);
        if ((b - B * y).cwiseAbs().maxCoeff() > 1e-8 * speed) continue;
        VecX fitting = work.w.segment(p.v0, p.joint.nv);
        for (int m = 0; m < p.joint.nv; ++m) fitting[m] += y[y.size() - p.joint.nv + m] / rate_scale(model, cluster, p.v0 - c.v0 + m);
        closing += fmt::format("{}'initial.rate' {} of joint '{}' (given: {})", closing.empty() ? ": it closes with " : ", or ",
                               values_text(fitting.data(), p.joint.nv), p.joint.name, values_text(work.w.data() + p.v0, p.joint.nv));
      }
      throw InputError(fmt::format(
          "{}: the given {} contradict the loop of joint '{}' ({}{}{}): it would open at {:.4g} m/s; remove one {} of the loop{}",
          scene.file.string(), given, closure_row_name(model, work.clusters[cluster], cluster, row), motions,
          motions.empty() || rates.empty() ? "" : "; ", rates, left[row], rates.empty() ? "motion" : "rate", closing));
    }
    for (size_t f = 0; f < moved->size(); ++f) work.w[c.v0 + (*moved)[f]] += x[f] / rate_scale(model, cluster, (*moved)[f]);
    close_velocities(model, cluster, work);
    if (leave_change_point(model, scene, cluster, work))
      notes.tell(closure_of(model, c), "its loop starts in a change point: moved by 1e-5 of its size along the initial rates");
  }
}

}  // namespace flexframe::sim
