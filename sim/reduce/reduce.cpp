// The reducer. See reduce.h and REDUCE.md.
#include "sim/reduce/reduce.h"

#include "sim/base/cpu_clock.h"
#include "sim/base/eigen_solvers.h"
#include "sim/base/spatial.h"
#include "sim/reduce/dense_products.h"
#include "sim/reduce/fe_attachment.h"
#include "sim/reduce/fe_elements.h"
#include "sim/reduce/fe_facets.h"
#include "sim/reduce/fe_further.h"
#include "sim/reduce/fe_integrals.h"
#include "sim/reduce/fe_layer_error.h"
#include "sim/reduce/fe_mesh_error.h"
#include "sim/reduce/fe_nodal_stress.h"
#include "sim/reduce/fe_refine.h"
#include "sim/reduce/fe_solver.h"
#include "sim/reduce/fe_surface.h"

#include <cblas.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <set>
#include <unordered_map>
#include <utility>

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace flexframe::sim {
namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;
double hertz(double eigenvalue) { return std::sqrt(std::max(0.0, eigenvalue)) / two_pi; }
double eigenvalue_of(double frequency) { return (two_pi * frequency) * (two_pi * frequency); }

// Bytes the machine has free, by Linux' own account.
double available_memory() {
  std::ifstream in("/proc/meminfo");
  std::string word;
  double kilobytes = 0.0;
  while (in >> word)
    if (word == "MemAvailable:" && in >> kilobytes) return 1024.0 * kilobytes;
  return 0.0;
}

// What many small pieces (faces, sets, graphs) have left in the heap goes back to the system: with a million degrees of freedom more than a
// gigabyte.
void give_back_memory() {
#ifdef __GLIBC__
  ::malloc_trim(0);
#endif
}

// M-orthonormal combinations of the fields, orthogonal to the rigid motions, that diagonalise K; sorted. Fields that add nothing are
// dropped.
FeModes orthonormal_basis(const FeReduced& system, const MatX& rigid, MatX fields, std::vector<std::string>& notes) {
  for (int pass = 0; pass < 2; ++pass) add_product(fields, -1.0, rigid, product_tn(symmetric_product(system.M(), rigid), fields));
  MatX MF = symmetric_product(system.M(), fields);
  const VecX norm = fields.cwiseProduct(MF).colwise().sum().cwiseSqrt();
  for (int k = 0; k < fields.cols(); ++k) {
    const double scale = norm(k) > 0.0 ? 1.0 / norm(k) : 0.0;
    fields.col(k) *= scale;
    MF.col(k) *= scale;
  }
  const MatX M = product_tn(fields, MF), K = product_tn(fields, symmetric_product(system.K(), fields));
  SymmetricEigen gram(0.5 * (M + M.transpose()));
  // Directions whose share of the normalised fields is rounding of the solutions (1e-11) squared.
  int keep = 0;
  for (int k = 0; k < gram.eigenvalues().size(); ++k) keep += gram.eigenvalues()(k) > 1e-12 * gram.eigenvalues().maxCoeff();
  if (keep < fields.cols())
    notes.push_back(
        fmt::format("{} of {} shapes are dropped: they are rigid motions or depend on the others", fields.cols() - keep, fields.cols()));
  const MatX S = gram.eigenvectors().rightCols(keep) * gram.eigenvalues().tail(keep).cwiseSqrt().cwiseInverse().asDiagonal();
  SymmetricEigen ritz(S.transpose() * (0.5 * (K + K.transpose())) * S);
  FeModes out;
  out.eigenvalues = ritz.eigenvalues();
  out.vectors = MatX::Zero(fields.rows(), keep);
  add_product(out.vectors, 1.0, fields, S * ritz.eigenvectors());
  return out;
}

class Reducer {
 public:
  Reducer(const FeModel& m, const ReduceOptions& o, const FeProgress& p, const std::function<void()>& a)
      : model(m), options(o), method(o.method), progress(p), ask(a), clock(process_cpu_seconds()) {
    if (method == ReduceMethod::automatic) method = options.interfaces.empty() ? ReduceMethod::eigenmodes : ReduceMethod::craig_bampton;
  }

  Reduction run() {
    check();
    openblas().set_threads(options.threads);
    say("assembling");
    system = assemble(model);
    report().degrees_of_freedom = system.size;
    report().elements = static_cast<int>(model.elements.size());
    report().nodes = static_cast<int>(std::count_if(system.dof.begin(), system.dof.end(), [](const auto& d) { return d[0] >= 0; }));
    if (const auto parts = unconnected_parts(model, system); parts.size() > 1) {
      constexpr size_t most = 5;
      std::vector<std::string> named;
      for (size_t k = 0; k < std::min(most, parts.size()); ++k)
        named.push_back(fmt::format("{} nodes with node {}", parts[k].first, model.node_ids[parts[k].second]));
      throw InputError(fmt::format(
          "{}: the model consists of {} unconnected parts ({}{}); a body must be one piece (tie them by spiders, or remove parts)",
          model.file, parts.size(), fmt::join(named, ", "), parts.size() > most ? ", ..." : ""));
    }
    reduced = eliminate(model, system, options.held);
    if (!reduced.idle.empty())
      note(fmt::format("{} motions of nodes have neither stiffness nor mass and are held (the first at node {})", reduced.idle.size(),
                       model.node_ids[reduced.idle[0]]));
    choose_nodes();
    lap("assembly");
    try {
      factorise();
      find_fields();
    } catch (const InputError& error) {
      throw InputError(error.what() + membranes(error.what()));
    } catch (const SimulationError& error) {
      throw SimulationError(error.what() + membranes(error.what()));
    }
    make_body();
    return std::move(out);
  }

 private:
  const FeModel& model;
  const ReduceOptions& options;
  ReduceMethod method;
  FeProgress progress;
  std::function<void()> ask;
  double clock;  // CPU time at the end of the last stage, s
  Reduction out;
  FeSystem system;
  FeReduced reduced;
  std::unique_ptr<FeSolver> solver;
  std::vector<FeAttachment> attachments;  // interfaces first
  std::vector<int> attachment_nodes;      // node index or -1
  std::vector<std::string> names;
  std::vector<bool> turning;  // interfaces that nothing holds against turns; the matrix that tells goes before the factor is made
  FeModes basis;
  MatX static_fields;  // elastic responses to unit loads at the interfaces, of which the further shapes are made

  ReduceReport& report() { return out.report; }
  void say(const std::string& text) {
    if (ask) ask();
    if (progress) progress(text);
  }
  void note(std::string text) { report().notes.push_back(std::move(text)); }
  void lap(const char* name) {
    const double now = process_cpu_seconds();
    report().stages.push_back({name, now - clock});
    clock = now;
  }

  // Where a mechanism is refused: the shells that may be its cause.
  std::string membranes(const std::string& refusal) const {
    if (refusal.find("mechanism") == std::string::npos) return {};
    const auto found = std::find_if(model.elements.begin(), model.elements.end(), [&](const FeElement& e) {
      return fe_is_shell(e.shape) && e.section >= 0 && model.layups[e.section].bending == 0.0;
    });
    if (found == model.elements.end()) return {};
    return fmt::format(
        ". {}: element {} and those like it are membranes (PSHELL without MID2), which resist nothing across their surface where it is "
        "flat: give the PSHELL MID2 = MID1",
        place_of(model, *found), found->id);
  }

  void check() {
    check_model(model);
    report().notes = model.notes;
    report().warnings = model.warnings;
    for (std::string& text : shells_in_doubt(model)) report().warnings.push_back(std::move(text));
    if (options.modes < 0) throw InputError("modes: a number >= 0 is expected");
    if ((method == ReduceMethod::guyan || method == ReduceMethod::craig_bampton || method == ReduceMethod::response) &&
        options.interfaces.empty())
      throw InputError("guyan, craig-bampton and response reductions need interfaces");
    if (method == ReduceMethod::response && !(options.highest > 0.0))
      throw InputError("a response reduction needs the highest frequency of interest");
    if (method == ReduceMethod::eigenmodes && options.modes == 0 && !(options.highest > 0.0))
      throw InputError("no modes are requested: give their number or the highest frequency");
    if (options.threads < 1) throw InputError("threads: a number >= 1 is expected");
    if (std::error_code none; !options.scratch.empty() && !std::filesystem::is_directory(options.scratch, none))
      throw InputError(fmt::format("scratch: {} is no folder", options.scratch.string()));
    if (!(options.damping >= 0.0)) throw InputError("damping: a ratio >= 0 is expected");
  }

  // Interfaces, then the nodes of the user, then well spread ones of the surface.
  void choose_nodes() {
    std::vector<int> chosen;
    std::set<int> taken;
    std::vector<Vec3> places;
    for (const ReduceInterface& i : options.interfaces) {
      if (i.spider >= 0) {
        attachments.push_back(spider_attachment(model, system, model.spiders[i.spider]));
        attachment_nodes.push_back(-1);
        taken.insert(model.spiders[i.spider].node);
      } else {
        attachments.push_back(node_attachment(model, system, node_neighbours(model, {i.node}), i.node));
        attachment_nodes.push_back(i.node);
        taken.insert(i.node);
      }
      turning.push_back(turns_freely(i));
      names.push_back(!i.name.empty() ? i.name : i.spider >= 0 ? attachments.back().id : fmt::format("node[{}]", attachments.back().id));
      places.push_back(attachments.back().position);
    }
    if (!options.nodes.empty()) {
      for (int n : options.nodes)
        if (taken.insert(n).second) chosen.push_back(n);
    } else {
      std::set<int> surface;
      for (const auto& face : outer_faces(model))
        for (int n : face)
          if (moves(system.dof[n])) surface.insert(n);
      if (model.matrices || surface.empty())
        for (size_t i = 0; i < model.nodes.size(); ++i)
          if (moves(system.dof[i])) surface.insert(static_cast<int>(i));
      for (int n : taken) surface.erase(n);
      chosen = spread_nodes(model, {surface.begin(), surface.end()}, places, options.node_count - static_cast<int>(attachments.size()));
      std::sort(chosen.begin(), chosen.end());
    }
    const auto neighbours = node_neighbours(model, chosen);
    for (size_t k = 0; k < chosen.size(); ++k) {
      attachments.push_back(node_attachment(model, system, {neighbours[k]}, chosen[k]));
      attachment_nodes.push_back(chosen[k]);
      names.push_back(fmt::format("node[{}]", attachments.back().id));
    }
    std::set<std::string> unique(names.begin(), names.end());
    if (unique.size() != names.size()) throw InputError("two interfaces or nodes of the body have the same name");
  }

  void factorise() {
    say("ordering");
    give_back_memory();
    const MatX rigid = free_rigid_motions(model, system, reduced, options.held);
    solver = std::make_unique<FeSolver>(reduced, rigid, estimate_modes(model, system), options.threads, ask, options.scratch.string());
    report().rigid_motions = solver->rigid();
    if (solver->rigid() > 0 && has_ground_springs(model, system))
      report().warnings.push_back(fmt::format(
          "{}: springs to the ground act between the body and its own frame, which moves with it in a scene: take them out of the "
          "model and put them into the scene (spring-damper, bushing)",
          model.file));
    report().factor_entries = solver->factor_entries();
    // The factor with both matrices beside it, and either the matrix it is made from or the vectors of modes and fields: Lanczos keeps some
    // four times the modes asked for.
    const double vectors =
        8.0 * system.size * (5.0 * std::max(options.modes, 10) + 100.0 + 6.0 * static_cast<double>(options.interfaces.size()));
    report().estimated_bytes = solver->estimated_bytes() + 16.0 * static_cast<double>(system.K.nonZeros()) +
                               std::max(vectors, 16.0 * static_cast<double>(system.K.nonZeros()));
    const double limit = options.memory_limit > 0.0 ? options.memory_limit : available_memory();
    say(fmt::format("{} degrees of freedom, {:.1f} million entries in the factorised matrix, about {:.2f} GB", system.size,
                    report().factor_entries / 1e6, report().estimated_bytes / 1e9));
    if (limit > 0.0 && report().estimated_bytes > limit)
      throw SimulationError(fmt::format(
          "the reduction needs about {:.1f} GB, but {:.1f} GB are available: take a coarser mesh{} or a larger machine",
          report().estimated_bytes / 1e9, limit / 1e9, options.scratch.empty() ? ", keep the factor in a folder (--scratch)" : ""));
    if (!reduced.identity) SparseMatrix().swap(system.K);  // the reduced system has its own; the factor needs the room
    lap("ordering");
    give_back_memory();
    say("factorising");
    solver->factorise();
    lap("factorisation");
  }

  // Unit loads at the interfaces, on the reduced system: forces, and moments where the interface has rotations of its own.
  // Unit loads at the interfaces; `owners`, where wanted: interface and component (0 .. 5) of each.
  MatX interface_loads(std::vector<std::pair<size_t, int>>* owners = nullptr) const {
    std::vector<VecX> loads;
    for (size_t i = 0; i < options.interfaces.size(); ++i)
      for (int d = 0; d < (attachments[i].own_rotation ? 6 : 3); ++d) {
        const VecX p = reduced.restrict(VecX(attachments[i].motion.row(d).transpose()));
        if (!(p.squaredNorm() > 0.0)) continue;
        loads.push_back(p);
        if (owners) owners->emplace_back(i, d);
      }
    MatX P(reduced.size(), loads.size());
    for (size_t k = 0; k < loads.size(); ++k) P.col(k) = loads[k];
    return P;
  }

  void find_fields() {
    say("modes");
    const FeProgress talk = [this](const std::string& text) { say(text); };
    const double limit = options.highest > 0.0 ? eigenvalue_of(options.highest) : 0.0;
    MatX loads, fields;
    const bool wants_modes = method == ReduceMethod::eigenmodes || method == ReduceMethod::response;
    FeModes modes;
    if (wants_modes) {
      modes = solver->modes(limit > 0.0 ? 0 : options.modes, limit, MatX(reduced.size(), 0), talk);
      // The one beyond the limit only proves that there are no more below.
      int keep = static_cast<int>(modes.eigenvalues.size());
      if (limit > 0.0)
        while (keep > 0 && modes.eigenvalues(keep - 1) > limit) --keep;
      if (keep > 0) refuse_massless(modes.eigenvalues.head(keep));
      if (keep == 0 && method == ReduceMethod::eigenmodes)
        throw InputError(
            fmt::format("no elastic mode up to {:g} Hz; the first is at {:.1f} Hz", options.highest, hertz(modes.eigenvalues(0))));
      report().full_frequencies = modes.eigenvalues.head(keep).unaryExpr(&hertz);
      if (method == ReduceMethod::eigenmodes) {
        basis.eigenvalues = modes.eigenvalues.head(keep);
        basis.vectors = modes.vectors.leftCols(keep);
        lap("modes");
        report_compliance();
        return;
      }
      fields = modes.vectors.leftCols(keep);
    }
    loads = interface_loads();
    if (method == ReduceMethod::response) {
      const double first = modes.eigenvalues(0);
      const double omega2 = options.lowest > 0.0 ? 0.25 * eigenvalue_of(options.lowest) : 0.25 * first;
      if (omega2 >= 0.98 * first)
        throw InputError(
            fmt::format("the lowest frequency of interest, {:g} Hz, must be below twice the first elastic one, {:.1f} Hz (Heckmann et al. "
                        "2006 eq. 11 at half of it would be in resonance)",
                        options.lowest, hertz(first)));
      const MatX u = solver->respond(loads, omega2);
      MatX all(fields.rows(), fields.cols() + u.cols());
      all << fields, u;
      fields = std::move(all);
    } else {
      // Constraint modes span the same space as the responses to interface loads; with rigid motions free, the elastic part of both.
      fields = solver->respond(loads);
      if (method == ReduceMethod::craig_bampton && (options.modes > 0 || limit > 0.0)) {
        // With all interfaces held: motions that depend on each other (interfaces that share nodes) are held once.
        modes = solver->modes(limit > 0.0 ? 0 : options.modes, limit, independent_columns(loads, 1e-8), talk);
        MatX all(fields.rows(), fields.cols() + modes.vectors.cols());
        all << fields, modes.vectors;
        fields = std::move(all);
      }
    }
    lap("modes");
    basis = orthonormal_basis(reduced, solver->rigid_basis(), std::move(fields), report().notes);
    if (options.cut_off > 0.0 && options.highest > 0.0) cut_off(loads);
    if (basis.eigenvalues.size() == 0) throw InputError("no elastic coordinate is left: raise the highest frequency or the cut-off");
    lap("basis");
    report_compliance();
  }

  // Motions with stiffness and without mass (rounding of one) have no frequency: ten decades of it are in no body, and 1e50 Hz is none.
  static void refuse_massless(const VecX& eigenvalues) {
    const double highest = std::min(1e20 * eigenvalues.minCoeff(), 1e100);
    const Eigen::Index count = (eigenvalues.array() <= highest).count();
    if (count < eigenvalues.size()) throw InputError(fmt::format("{} modes are requested, the model has {}", eigenvalues.size(), count));
  }

  // Drops modes of the reduced model above the cut-off, but keeps those that carry the static deflection at the interfaces: seldom many,
  // since each load is carried by the few local modes at its own interface. The greatest share of the load that is worst off is taken in
  // until all are exact enough.
  void cut_off(const MatX& loads) {
    const double limit = options.cut_off * options.highest;
    const int all = static_cast<int>(basis.eigenvalues.size());
    int below = 0;
    while (below < all && hertz(basis.eigenvalues(below)) <= limit) ++below;
    if (below == all) return;
    // Shares of the modes in the deflection of each load in its own direction.
    const MatX shares = basis.eigenvalues.cwiseInverse().asDiagonal() * product_tn(basis.vectors, loads).cwiseAbs2();
    const VecX whole = shares.colwise().sum();
    std::vector<int> kept(below);
    for (int k = 0; k < below; ++k) kept[k] = k;
    std::vector<bool> taken(all, false);
    VecX missing = shares.bottomRows(all - below).colwise().sum().transpose();
    while (options.static_error > 0.0 && static_cast<int>(kept.size()) < all) {
      Eigen::Index worst = 0;
      if (missing.cwiseQuotient(whole).maxCoeff(&worst) <= options.static_error) break;
      int best = -1;
      for (int k = below; k < all; ++k)
        if (!taken[k] && (best < 0 || shares(k, worst) > shares(best, worst))) best = k;
      taken[best] = true;
      kept.push_back(best);
      missing -= shares.row(best).transpose();
    }
    std::sort(kept.begin(), kept.end());
    note(fmt::format("{} modes of the reduced model above {:g} Hz are dropped{}", all - kept.size(), limit,
                     static_cast<int>(kept.size()) > below
                         ? fmt::format(", {} kept for the static deflection at the interfaces, the highest at {:.0f} Hz",
                                       kept.size() - below, hertz(basis.eigenvalues(kept.back())))
                         : ""));
    basis.eigenvalues = VecX(basis.eigenvalues(kept));
    basis.vectors = MatX(basis.vectors(Eigen::all, kept));
  }

  // Static deflection at the interfaces under unit loads there, reduced against full (inertia relief for a free body).
  void report_compliance() {
    report().frequencies = basis.eigenvalues.unaryExpr(&hertz);
    report().compliance_error = -1.0;
    if (options.interfaces.empty()) return;
    std::vector<std::pair<size_t, int>> owners;
    const MatX loads = interface_loads(&owners);
    static_fields = solver->respond(loads, 0.0, &basis, 1e-8);
    const MatX full = product_tn(loads, static_fields);
    const MatX seen = product_tn(basis.vectors, loads);
    const MatX small = seen.transpose() * basis.eigenvalues.cwiseInverse().asDiagonal() * seen;
    double worst = 0.0;
    for (int k = 0; k < full.cols(); ++k) worst = std::max(worst, std::abs(small(k, k) - full(k, k)) / std::abs(full(k, k)));
    report().compliance_error = worst;
    report_lacks(owners, full, small);
    if (worst > 0.01)
      note(fmt::format("static deflection at the interfaces is off by up to {:.2g} %: {}", 100 * worst,
                       method == ReduceMethod::eigenmodes
                           ? "add response modes or constraint modes (--method response, craig-bampton, guyan)"
                           : "raise the cut-off, or keep all (--no-cut-off)"));
    lap("static check");
  }

  // A rigid body tied to solid nodes needs three that span a triangle to take up moments, unless a beam or shell ends at its own node: that
  // has stiffness against turns before the nodes that it carries are eliminated.
  bool turns_freely(const ReduceInterface& interface) const {
    if (interface.spider < 0) return false;
    const FeSpider& spider = model.spiders[interface.spider];
    const std::array<int, 6>& own = system.dof[spider.node];
    if (std::all_of(own.begin() + 3, own.end(), [&](int d) { return d >= 0 && system.K.coeff(d, d) > 0.0; })) return false;
    Vec3 middle = Vec3::Zero();
    for (const int n : spider.slaves) {
      if (system.dof[n][3] >= 0 || system.dof[n][4] >= 0 || system.dof[n][5] >= 0) return false;
      middle += model.nodes[n] / static_cast<double>(spider.slaves.size());
    }
    Mat3 spread = Mat3::Zero();
    for (const int n : spider.slaves) spread += (model.nodes[n] - middle) * (model.nodes[n] - middle).transpose();
    const Vec3 sizes = Eigen::SelfAdjointEigenSolver<Mat3>(spread, Eigen::EigenvaluesOnly).eigenvalues();
    // Squares: nodes within a hundred thousandth of their distance from a line are on it.
    return sizes(1) <= 1e-10 * sizes(2) || sizes(2) == 0.0;
  }

  // Of each interface: the norm of what its deflection under forces lacks, and of its turn under moments, relative to the whole. Stiff
  // directions beside soft ones count little, and so do interfaces that the model holds.
  void report_lacks(const std::vector<std::pair<size_t, int>>& owners, const MatX& full, const MatX& seen) {
    constexpr double held = 1e-6;  // of the softest interface
    std::array<VecX, 2> lacking{VecX::Zero(options.interfaces.size()), VecX::Zero(options.interfaces.size())}, whole = lacking;
    for (Eigen::Index a = 0; a < full.rows(); ++a)
      for (Eigen::Index b = 0; b < full.cols(); ++b) {
        const auto [i, d] = owners[a];
        const auto [j, e] = owners[b];
        if (i != j || d / 3 != e / 3) continue;
        lacking[d / 3](i) += std::pow(full(a, b) - seen(a, b), 2);
        whole[d / 3](i) += std::pow(full(a, b), 2);
      }
    for (size_t i = 0; i < options.interfaces.size(); ++i) {
      InterfaceLack lack{names[i], 0.0, turning[i]};
      if (lack.turns)
        report().warnings.push_back(fmt::format(
            "the nodes of interface '{}' lie on a line or at one point and have no rotations: the model resists no turn about it, "
            "and what is welded there holds the body all the same; take nodes that span a plane",
            names[i]));
      for (int part = 0; part < 2; ++part)
        if (whole[part](i) > held * held * whole[part].maxCoeff())
          lack.share = std::max(lack.share, std::sqrt(lacking[part](i) / whole[part](i)));
      report().lacks.push_back(std::move(lack));
    }
  }

  void make_body() {
    say("body");
    FlexibleBody& body = out.body;
    const int n = body.n = static_cast<int>(basis.eigenvalues.size());
    const MatX U = reduced.expand(basis.vectors);
    const RigidMass rigid = rigid_mass(model, system);
    body.mass = rigid.mass;
    if (const Vec3& m = rigid.directions; m.maxCoeff() - m.minCoeff() > 1e-3 * rigid.mass)
      report().warnings.push_back(fmt::format(
          "{}: the mass is {:.5g} kg along x, {:.5g} along y, {:.5g} along z: no body that moves freely has that (masses in some "
          "directions only, such as CMASS or CONM1); as a whole it moves with {:.5g} kg, its modes have the model's",
          model.file, m.x(), m.y(), m.z(), rigid.mass));
    body.md0 = rigid.md;
    body.J0 = rigid.J;
    judge_inertia(rigid);
    judge_offsets();
    const LinearMass linear = linear_mass_of(U);
    body.md1 = linear.md;
    body.J1 = linear.J;
    body.Cr0 = linear.Cr;
    QuadraticMass quadratic = quadratic_mass(model, system, U);
    body.md2 = std::move(quadratic.md2);
    body.J2 = std::move(quadratic.J2);
    body.Cr1 = std::move(quadratic.Cr1);
    body.Me = MatX::Identity(n, n);
    body.Ke = basis.eigenvalues.asDiagonal();
    if (options.damping > 0.0) body.De = (2.0 * options.damping * basis.eigenvalues.cwiseSqrt()).asDiagonal();
    for (int k = 0; k < n; ++k) body.labels.push_back(fmt::format("Eigen Mode {:4} : {:12.3f} Hz", k + 1, hertz(basis.eigenvalues(k))));
    lap("integrals");
    add_further_shapes();
    judge_mesh(U);

    for (size_t i = 0; i < attachments.size(); ++i) {
      FlexibleNode node;
      node.name = names[i];
      node.origin = attachments[i].position;
      const MatX motion = attachments[i].motion * U;
      node.phi = motion.topRows(3);
      node.psi = motion.bottomRows(3);
      body.nodes.push_back(std::move(node));
    }
    judge_damping();
    judge_hourglass_at_interfaces(U);
    if (options.stiffening && model.matrices) note("geometric stiffening needs the elements: left out for a model given as matrices");
    else if (options.stiffening) add_stiffening(U);
    if (options.stress) add_stress(U);
    if (options.surface) add_surface(U);
  }

  LinearMass linear_mass_of(const MatX& U) {
    LinearMass mass = linear_mass(model, system, U);
    // Of a free body shapes are orthogonal to all rigid motions by construction; what is left is rounding.
    if (solver->rigid() == 6) mass.md.setZero(), mass.Cr.setZero();
    return mass;
  }

  // What the coordinates leave out, for scenes to judge by. Eigenmodes are the model's, and what they lack is told of the interfaces.
  void add_further_shapes() {
    if (method == ReduceMethod::eigenmodes || static_fields.cols() == 0) return;
    const FeFurther found = further_fields(*solver, basis, std::exchange(static_fields, MatX()));
    if (found.shapes.eigenvalues.size() == 0) return;
    const MatX U = reduced.expand(found.shapes.vectors);
    FurtherShapes& further = out.further;
    further.stiffness = found.shapes.eigenvalues;
    further.coupling = found.coupling;
    const LinearMass linear = linear_mass_of(U);
    further.md = linear.md;
    further.J = linear.J;
    further.Cr = linear.Cr;
    further.motion.resize(6 * std::ssize(attachments), U.cols());
    for (size_t i = 0; i < attachments.size(); ++i)
      further.motion.middleRows(6 * static_cast<Eigen::Index>(i), 6) = attachments[i].motion * U;
    report().right_up_to = hertz(found.right_up_to);
    lap("further shapes");
  }

  // Shells beside their nodes have the area of the nodes' surface: bent, their own is another one.
  void judge_offsets() {
    if (model.matrices) return;
    constexpr double smooth = 0.866, told = 0.02;  // 30 degrees: plates that meet at an angle keep their own normals
    std::unordered_map<int, std::vector<Vec3>> normals;
    struct Shell {
      Mat3X X, normals;
      double mass = 0.0, height = 0.0;  // kg/m^2; m, of its middle above the nodes
      const FeElement* element = nullptr;
    };
    std::vector<Shell> shells;
    double mass = 0.0;
    for (const FeElement& e : model.elements) {
      if (!fe_is_shell(e.shape)) continue;
      Shell s{Mat3X(3, e.count), {}, 0.0, 0.0, &e};
      for (int i = 0; i < e.count; ++i) s.X.col(i) = model.nodes[model.connectivity[e.first + i]];
      double area = 0.0;
      const Mat3 Q = shell_axes(e.shape, s.X, e.id, area);
      const FeShellLaw law = shell_law(model, e, Q);
      mass += law.m0 * area;
      s.mass = law.m0;
      s.height = law.m0 > 0.0 ? law.m1 / law.m0 : 0.0;
      const bool curved = e.shape == FeShape::triangle6 || e.shape == FeShape::quadrangle8;
      s.normals = curved ? curved_shell_normals(e.shape, s.X, e.id) : Mat3X(Q.col(2).replicate(1, e.count));
      for (int i = 0; i < e.count; ++i) normals[model.connectivity[e.first + i]].push_back(s.normals.col(i));
      if (s.height != 0.0) shells.push_back(std::move(s));
    }
    double off = 0.0;
    const auto area_of = [](const Shell& s, const Mat3X& X) {
      double sum = 0.0;
      for (const FeShellPoint& p : shell_points(s.element->shape, X, s.element->id)) sum += p.area;
      return sum;
    };
    for (const Shell& s : shells) {
      Mat3X moved = s.X;
      for (int i = 0; i < s.element->count; ++i) {
        Vec3 mean = Vec3::Zero();
        for (const Vec3& n : normals[model.connectivity[s.element->first + i]])
          if (const double along = n.dot(s.normals.col(i)); std::abs(along) > smooth) mean += along > 0.0 ? n : Vec3(-n);
        moved.col(i) += s.height * mean.normalized();
      }
      off += s.mass * std::abs(area_of(s, moved) - area_of(s, s.X));
    }
    if (off > told * mass)
      report().warnings.push_back(fmt::format(
          "shells beside their nodes (OFFSET, ZOFFS, Z0) have the area of their nodes' surface, which is {:.2g} % off where they are "
          "curved. Mass and stiffness are off by as much: put the nodes into the middle of the wall",
          100.0 * off / mass));
  }

  // Facets leave out what the surface rises between their corners, and have their mass at these: about an axis along a strip of one
  // element it is three times too far out.
  void judge_inertia(const RigidMass& rigid) {
    if (model.matrices) return;
    const Vec3 c = rigid.md / rigid.mass;
    const FacetMoments moments = facet_moments(model, c);
    judge_mass(moments, rigid);
    Mat3 more = -moments.smooth_second;  // int r r^T dm, as it is less as it should be
    bool flat = false;
    for (const FeElement& e : model.elements) {
      if (!fe_is_shell(e.shape)) continue;
      Mat3X X(3, e.count);
      for (int i = 0; i < e.count; ++i) X.col(i) = model.nodes[model.connectivity[e.first + i]] - c;
      double area = 0.0;
      const double mass = shell_law(model, e, shell_axes(e.shape, X, e.id, area)).m0;
      if (e.shape == FeShape::triangle3 || e.shape == FeShape::quadrangle4) {
        more += mass * area / e.count * X * X.transpose();
        flat = true;
      } else {
        for (const FeShellPoint& p : shell_points(e.shape, X, e.id)) more += mass * p.area * (X * p.N) * (X * p.N).transpose();
      }
    }
    Mat3 J;
    J << rigid.J(0), rigid.J(3), rigid.J(4), rigid.J(3), rigid.J(1), rigid.J(5), rigid.J(4), rigid.J(5), rigid.J(2);
    J += rigid.mass * skew(c) * skew(c);
    const Eigen::SelfAdjointEigenSolver<Mat3> principal(J);
    if (!(principal.eigenvalues()(0) > 0.0)) return;
    double worst = 0.0;
    Vec3 axis = Vec3::Zero();
    for (int k = 0; k < 3; ++k) {
      const Vec3 a = principal.eigenvectors().col(k);
      const double off = more.trace() - a.dot(more * a), share = off / (principal.eigenvalues()(k) - off);
      if (std::abs(share) > std::abs(worst)) {
        worst = share;
        axis = a;
      }
    }
    axis = (axis.array().abs() < 1e-3).select(0.0, axis);
    if (std::abs(worst) > 0.01)
      report().warnings.push_back(
          fmt::format("the mesh is coarse: its flat shells {}, which makes the moment of inertia about the axis "
                      "({:.2g}, {:.2g}, {:.2g}) through the centre of mass {:.2g} % too {}; refine it across that axis",
                      worst > 0.0 && flat ? "have their mass at their nodes" : "lie beside the curved surface through their corners",
                      axis.x(), axis.y(), axis.z(), 100.0 * std::abs(worst), worst > 0.0 ? "large" : "small"));
  }

  // Mass of the facets beside that of the surface.
  void judge_mass(const FacetMoments& moments, const RigidMass& rigid) {
    constexpr double told = 0.01;
    const double more = moments.mass - moments.smooth_mass;
    if (!(std::abs(more) > told * (rigid.mass - more))) return;
    report().warnings.push_back(fmt::format(
        "the mesh is coarse: its shells are flat between their corners, and the curved surface through them is {}: the mass is {:.2g} % "
        "too {} beside that of the surface, weight and inertia with it. Refine it, or take shells with middle nodes on the surface (S8R, "
        "S6); plates that are meant to meet at an angle there have the mass that they should",
        more < 0.0 ? "larger" : "smaller", 100.0 * std::abs(more) / (rigid.mass - more), more < 0.0 ? "small" : "large"));
  }

  // The damping that a free body's ratio leaves its lowest mode where the first interface is welded, told where it is another one.
  void judge_damping() {
    const FlexibleBody& b = out.body;
    if (b.De.size() == 0 || solver->rigid() < 6 || options.interfaces.empty() || !attachments[0].own_rotation) return;
    // The frame follows so that the interface stands still.
    const FlexibleNode& node = b.nodes[0];
    MatX follow(6, b.n), M(6, 6);
    follow << -node.phi + skew(node.origin) * -node.psi, -node.psi;
    M << b.mass * Mat3::Identity(), -skew(b.md0), skew(b.md0), Mat3::Zero();
    M.bottomRightCorner<3, 3>() << b.J0(0), b.J0(3), b.J0(4), b.J0(3), b.J0(1), b.J0(5), b.J0(4), b.J0(5), b.J0(2);
    const GeneralizedEigen held(b.Ke, b.Me + follow.transpose() * M * follow);
    if (held.info() != Eigen::Success || !(held.eigenvalues()(0) > 0.0)) return;
    const VecX mode = held.eigenvectors().col(0);
    const double omega = std::sqrt(held.eigenvalues()(0)), ratio = mode.dot(b.De * mode) / (2.0 * omega);
    constexpr double told = 0.1;  // ratios are seldom known better
    if (std::abs(ratio / options.damping - 1.0) > told)
      report().warnings.push_back(fmt::format(
          "damping: the ratio {:g} is that of the free body's modes; welded at '{}' its lowest one, {:.4g} Hz, has {:.2g}: instead of "
          "--damping give the body damping = {{ ratio = {:g} }} in the scene, which is that of its modes as they are mounted",
          options.damping, node.name, omega / two_pi, ratio, options.damping));
  }

  // Of the lowest frequencies those that are the hold's of hourglass motions.
  void judge_hourglass(const MatX& U) {
    constexpr double told = 0.02;  // twenty times what sound modes have
    const VecX shares = hourglass_shares(model, system, U, basis.eigenvalues.head(U.cols()));
    std::string held;
    for (Eigen::Index k = 0; k < U.cols(); ++k)
      if (shares(k) > told) held += fmt::format("{}{:.4g} Hz", held.empty() ? "" : ", ", hertz(basis.eigenvalues(k)));
    if (!held.empty())
      report().warnings.push_back(fmt::format(
          "hourglass motions, which the points of reduced integration (C3D20R, C3D6) do not see, make some of the lowest {} frequencies "
          "too "
          "low: {} (up to {:.2g} % of a mode's energy is in the small stiffness that the program adds against them); take C3D20 (C3D15) or "
          "two layers of elements, or attach masses, springs and supports to faces instead of single nodes",
          U.cols(), held, 100.0 * shares.maxCoeff()));
  }

  // Of the lowest frequencies those that are lower than layers that shear one by one have them.
  void judge_layers(const MatX& U) {
    if (model.matrices) return;
    constexpr double told = 0.02;
    const VecX errors = layer_error(model, system, U, basis.eigenvalues.head(U.cols()));
    std::string low;
    for (Eigen::Index k = 0; k < U.cols(); ++k)
      if (errors(k) > told)
        low += fmt::format("{}{:.4g} Hz by {:.2g} %", low.empty() ? "" : ", ", hertz(basis.eigenvalues(k)), 100.0 * errors(k));
    if (!low.empty())
      report().warnings.push_back(fmt::format(
          "layered shells: their layers shear one by one, which no shell with one normal has: of the lowest {} frequencies these are too "
          "low "
          "by an estimated share: {}; deflections are too large likewise. Make soft cores and thick layers of solids and compare",
          U.cols(), low));
  }

  // Of deflections under forces at interfaces those that are the hold's: a single node of a single layer gives way in such motions.
  void judge_hourglass_at_interfaces(const MatX& U) {
    constexpr double told = 0.02;
    const auto count = static_cast<Eigen::Index>(options.interfaces.size());
    const bool held = std::any_of(model.elements.begin(), model.elements.end(),
                                  [](const FeElement& e) { return fe_is_held_by_share(e.shape, e.formulation); });
    if (count == 0 || model.matrices || !held) return;
    MatX forces(U.cols(), 3 * count);  // generalised, of unit forces along the axes
    for (Eigen::Index i = 0; i < count; ++i) forces.middleCols(3 * i, 3) = out.body.nodes[i].phi.transpose();
    const MatX answers = basis.eigenvalues.cwiseInverse().asDiagonal() * forces;
    const VecX work = answers.cwiseProduct(forces).colwise().sum().transpose().cwiseMax(1e-300);
    const VecX shares = hourglass_shares(model, system, U * answers, work);
    std::string names_of;
    for (Eigen::Index i = 0; i < count; ++i)
      if (shares.segment(3 * i, 3).maxCoeff() > told) names_of += fmt::format("{}'{}'", names_of.empty() ? "" : ", ", names[i]);
    if (!names_of.empty())
      report().warnings.push_back(fmt::format(
          "hourglass motions, which the points of reduced integration (C3D20R, C3D6) do not see, make the deflection under forces at the "
          "interfaces {} that of the small stiffness that the program adds against them (up to {:.2g} % of the energy); take C3D20 (C3D15) "
          "or two layers of elements, or interfaces on faces instead of single nodes",
          names_of, 100.0 * shares.maxCoeff()));
  }

  // Whether the memory that is left holds a finer mesh's matrices and the vectors of its iteration.
  bool room_for_division() const {
    const double growth = refined_growth(model, FeFiner::quadratic), columns = growth * system.size;
    // Bricks that become quadratic have three times as many neighbours. Bytes of an entry; M has a third of them; once more what is held.
    const double neighbours = growth < refined_growth(model) ? 3.0 : 1.0, entry = reduced.identity ? 16.0 : 32.0;
    constexpr double vectors = 8.0 * 130.0;
    const double per_column = neighbours * entry * static_cast<double>(reduced.K().nonZeros()) / reduced.size() + vectors;
    const double room = options.memory_limit > 0.0 ? options.memory_limit - out.report.estimated_bytes : available_memory();
    return columns * per_column < room;
  }

  // The error of the mesh by a finer one: by its own factor where that costs a second or less, else by iteration from this one's. nullopt:
  // it needs more memory than there is, or cannot be done.
  std::optional<VecX> by_division(const MatX& U) {
    constexpr double dear = 1.2e7;  // entries of a factor: about a second with the modes
    constexpr int most_times = 2;   // then the error of the finer mesh no longer counts
    FeDivision division{options.held, 0, FeFiner::divided, nullptr, options.threads, ask};
    const double growth = std::pow(refined_growth(model), 4.0 / 3.0);
    for (double entries = solver->factor_entries() * growth; entries <= dear && division.times < most_times; entries *= growth)
      ++division.times;
    if (division.times == 0) {
      division.times = 1;
      division.finer = FeFiner::quadratic;
      division.coarse = solver.get();
      if (!room_for_division()) return std::nullopt;
    }
    say(division.coarse ? "a finer mesh, by iteration" : "the mesh divided");
    // The body's coordinates are the model's modes only where those were asked for; one may be a mixture of several.
    const auto count = static_cast<int>(U.cols());
    const int most = reduced.size() - solver->rigid();
    FeModes modes;
    std::optional<VecX> errors;
    try {
      // Some more: modes that this mesh has above others may be below them. Eight vectors cost the iteration as much as one.
      const int asked = std::min(count + (division.coarse ? 2 : 4), most);
      if (method == ReduceMethod::eigenmodes && basis.eigenvalues.size() >= asked)
        modes = {basis.eigenvalues.head(asked), basis.vectors.leftCols(asked)};
      else modes = solver->modes(asked, 0.0, MatX(reduced.size(), 0), {});
      errors = divided_mesh_error(model, system, reduced, modes, count, division);
    } catch (const SimulationError&) {
      return std::nullopt;  // hardly any mode but those of the interfaces
    } catch (const InputError&) {
      return std::nullopt;  // elements so distorted that their parts are inside out
    }
    if (!errors) return std::nullopt;
    const MatX share = product_tn(reduced.expand(modes.vectors), symmetric_product(system.M, U)).cwiseAbs2();
    return VecX((share.transpose() * *errors).cwiseQuotient(share.colwise().sum().transpose()));
  }

  // The lowest frequencies against those of a fine mesh.
  void judge_mesh(const MatX& U) {
    constexpr Eigen::Index looked_at = 6;
    constexpr double told = 0.01;  // what frequencies of finite elements are commonly taken to be good for
    const Eigen::Index count = std::min(looked_at, U.cols());
    judge_hourglass(U.leftCols(count));
    judge_layers(U.leftCols(count));
    const std::optional<VecX> divided = by_division(U.leftCols(count));
    const std::optional<VecX> errors = divided ? divided : mesh_error(model, system, U.leftCols(count), basis.eigenvalues.head(count));
    lap("mesh error");
    if (!errors) return;
    if (!std::isfinite(errors->maxCoeff()))
      return report().warnings.push_back(
          "the mesh is coarse: its elements have too few neighbours to tell by how much its frequencies are off; refine it and compare");
    report().mesh_errors = *errors;
    std::string coarse;
    for (Eigen::Index k = 0; k < count; ++k)
      if ((*errors)(k) > told)
        coarse += fmt::format("{}{:.4g} Hz by {:.2g} %", coarse.empty() ? "" : ", ", hertz(basis.eigenvalues(k)), 100.0 * (*errors)(k));
    const bool jumps = !divided && std::any_of(model.elements.begin(), model.elements.end(),
                                               [](const FeElement& e) { return fe_is_solid(e.shape) || fe_is_shell(e.shape); });
    if (!coarse.empty())
      report().warnings.push_back(
          fmt::format("the mesh is coarse: of the lowest {} frequencies these are off by an estimated share{}: {}; refine it and compare",
                      count, jumps ? " (from jumps of the stress: the true ones may be several times as large)" : "", coarse));
    else if (jumps)
      note(
          "the error of the mesh is estimated from jumps of the stress, below 1 %: they hardly show twist and what a single layer of "
          "elements misses, and not what flat shells leave out of a curved surface; refine the mesh and compare where that may matter");
  }

  // theta_j x (theta_k x r), symmetric in j and k: second derivatives of the end of an arm that keeps its length.
  static Vec3 turned_arm(const Vec3& a, const Vec3& b, const Vec3& r) { return 0.5 * (a.cross(b.cross(r)) + b.cross(a.cross(r))); }

  // Of all nodes of rigid spiders, 3 rows each, for `count` pairs from the pair `first` on.
  MatX arm_fields(const MatX& U, int first, int count) const {
    MatX fields = MatX::Zero(3 * static_cast<Eigen::Index>(reduced.arms.size()), reduced.arms.empty() ? 0 : count);
    for (size_t i = 0; i < reduced.arms.size(); ++i) {
      const FeArm& arm = reduced.arms[i];
      MatX theta(3, U.cols());
      for (int d = 0; d < 3; ++d) theta.row(d) = U.row(system.dof[arm.reference][3 + d]);
      fill_arm(theta, arm.arm, first, fields.middleRows(3 * static_cast<Eigen::Index>(i), 3));
    }
    return fields;
  }

  static void fill_arm(const MatX& theta, const Vec3& arm, int first, Eigen::Ref<MatX> into) {
    int at = 0;
    for (Eigen::Index k = 0; k < theta.cols(); ++k)
      for (Eigen::Index j = 0; j <= k; ++j, ++at)
        if (at >= first && at < first + into.cols()) into.col(at - first) += turned_arm(theta.col(j), theta.col(k), arm);
  }

  // An averaging spider's point beside its middle.
  static void add_own_arm(const FeAttachment& attachment, const MatX& U, int first, const Eigen::Ref<MatX>& into) {
    if (!attachment.arm.isZero(0.0)) fill_arm((attachment.motion * U).bottomRows(3), attachment.arm, first, into);
  }

  // Nodes that turn about their middle by theta move by theta x (theta x r) / 2 in second order, of which the fit of their displacements
  // makes a turn where they are spread unevenly; there is none.
  static void take_out_fit(const FeAttachment& attachment, const MatX& U, Eigen::Ref<MatX> from) {
    if (attachment.spread.isZero(0.0)) return;
    const MatX theta = (attachment.motion * U).bottomRows(3), spread = attachment.spread * theta;
    int at = 0;
    for (Eigen::Index k = 0; k < theta.cols(); ++k)
      for (Eigen::Index j = 0; j <= k; ++j, ++at)
        from.col(at) +=
            0.5 * attachment.fitted * (Vec3(theta.col(j)).cross(Vec3(spread.col(k))) + Vec3(theta.col(k)).cross(Vec3(spread.col(j))));
  }

  // Second-order terms of all kinds come from K u2_jk = -g_jk. Either each u2_jk is found, or, by reciprocity, the displacement of each
  // load that acts on it.
  void add_stiffening(const MatX& U) {
    const int n = out.body.n, pairs = n * (n + 1) / 2;
    const bool everywhere = pairs <= options.stiffening_limit || options.stiffening_forced;
    say("second-order displacements");
    // Rows: md (3), Cr (3), J (6), then three translations a node, then three rotations of each interface.
    const int interfaces = static_cast<int>(options.interfaces.size());
    const int nodes = everywhere ? static_cast<int>(attachments.size()) : interfaces, turns = 12 + 3 * nodes;
    MatX second(turns + 3 * interfaces, pairs);
    // Seen at a node, a hundred thousandth is far below what the second order itself leaves out.
    constexpr double tolerance = 1e-6;
    if (everywhere) {
      // In groups that bound the memory.
      constexpr int group = 32;
      for (int first = 0; first < pairs; first += group) {
        const int count = std::min(group, pairs - first);
        MatX g = second_order_loads(model, system, U, first, count);
        const MatX turned = arm_fields(U, first, count);
        if (turned.size() > 0) g += reduced.arm_K * turned;
        MatX U2 = reduced.expand(-solver->respond(reduced.restrict(g), 0.0, &basis, tolerance));
        for (size_t i = 0; i < reduced.arms.size(); ++i)
          for (int d = 0; d < 3; ++d) U2.row(system.dof[reduced.arms[i].node][d]) += turned.row(3 * static_cast<Eigen::Index>(i) + d);
        const LinearMass mass = linear_mass(model, system, U2);
        second.block(0, first, 3, count) = mass.md;
        second.block(3, first, 3, count) = mass.Cr;
        second.block(6, first, 6, count) = mass.J;
        for (Eigen::Index i = 0; i < nodes; ++i) {
          second.block(12 + 3 * i, first, 3, count) = (attachments[i].motion * U2).topRows(3);
          add_own_arm(attachments[i], U, first, second.block(12 + 3 * i, first, 3, count));
          if (i < interfaces) second.block(turns + 3 * i, first, 3, count) = (attachments[i].motion * U2).bottomRows(3);
        }
      }
    } else {
      MatX loads(system.size, second.rows());
      loads.leftCols(12) = linear_mass_loads(model, system);
      for (Eigen::Index i = 0; i < nodes; ++i) {
        loads.middleCols(12 + 3 * i, 3) = MatX(attachments[i].motion.topRows(3).transpose());
        loads.middleCols(turns + 3 * i, 3) = MatX(attachments[i].motion.bottomRows(3).transpose());
      }
      const MatX W = reduced.expand(solver->respond(reduced.restrict(loads), 0.0, &basis, tolerance));
      second = -second_order_work(model, system, U, W).transpose();
      // The arms' ends are moved against the forces that hold them: load less K W.
      if (!reduced.arms.empty()) {
        MatX hold = -(reduced.arm_K.transpose() * W);
        for (size_t i = 0; i < reduced.arms.size(); ++i)
          for (int d = 0; d < 3; ++d) hold.row(3 * static_cast<Eigen::Index>(i) + d) += loads.row(system.dof[reduced.arms[i].node][d]);
        second += hold.transpose() * arm_fields(U, 0, pairs);
      }
      for (Eigen::Index i = 0; i < nodes; ++i) add_own_arm(attachments[i], U, 0, second.middleRows(12 + 3 * i, 3));
      note(fmt::format("geometric stiffening of {}inertia; forces at other nodes have none ({} coordinates)",
                       options.interfaces.empty() ? "" : "forces and moments at the interfaces and of ", n));
    }
    FlexibleBody& body = out.body;
    const bool mean_axes = solver->rigid() == 6;
    const auto row = [&](int r) {
      MatX square(n, n);
      for (int j = 0; j < n; ++j)
        for (int k = 0; k < n; ++k) square(j, k) = second(r, j <= k ? k * (k + 1) / 2 + j : j * (j + 1) / 2 + k);
      return square;
    };
    // Mean axes keep the first moment and the angular momentum free of elastic coordinates, in second order too; but for ends of arms,
    // which move beside the solutions.
    for (int a = 0; a < 3 && !(mean_axes && reduced.arms.empty()); ++a) {
      body.md2[a] = body.md2[a].size() > 0 ? MatX(body.md2[a] + row(a)) : row(a);
      body.Cr1[a] += row(3 + a);
    }
    for (int r = 0; r < 6; ++r) body.J2[r] += row(6 + r);
    for (int i = 0; i < interfaces; ++i) take_out_fit(attachments[i], U, second.middleRows(turns + 3 * i, 3));
    for (int i = 0; i < nodes; ++i)
      for (int a = 0; a < 3; ++a) {
        body.nodes[i].phi2[a] = row(12 + 3 * i + a);
        if (i < interfaces && attachments[i].own_rotation) body.nodes[i].psi2[a] = row(turns + 3 * i + a);
      }
    lap("stiffening");
  }

  // What stress modes do not hold.
  void tell_of_stress() {
    bool shells = false, layers = false;
    int beams = 0;
    for (const FeElement& e : model.elements) {
      beams += e.shape == FeShape::beam2 ? 1 : 0;
      if (!fe_is_shell(e.shape)) continue;
      shells = true;
      layers = layers || (e.section >= 0 && model.layups[e.section].layers.size() > 1);
    }
    if (beams > 0) report().warnings.push_back(fmt::format("stress: {} beams and rods have none: what they carry is not shown", beams));
    if (layers) report().warnings.push_back("stress: of layered shells that of the outer faces alone: layers between them may carry more");
    if (shells && !options.surface)
      report().warnings.push_back(
          "stress: of shells that of the face to which their normals point, at folds of one of the plates: the other face may carry more; "
          "-o BODY.h5 has all of them");
  }

  void add_stress(const MatX& U) {
    if (model.matrices) return note("stresses need the elements: left out for a model given as matrices");
    tell_of_stress();
    std::vector<int> nodes;
    for (int n : attachment_nodes)
      if (n >= 0) nodes.push_back(n);
    const std::vector<MatX> stress = nodal_stress(model, system, U, nodes);
    size_t k = 0;
    for (size_t i = 0; i < attachments.size(); ++i)
      if (attachment_nodes[i] >= 0) {
        if (stress[k].cols() > 0) out.body.nodes[i].sigma = stress[k];
        ++k;
      }
    lap("stress");
  }

  // Static displacements under inertia and weight less what the coordinates have of them: bending modes do not stretch a body that spins.
  MatX left_out_of_inertia() const {
    const MatX loads = reduced.restrict(linear_mass_loads(model, system));
    constexpr double tolerance = 1e-6;
    MatX left = solver->respond(loads, 0.0, &basis, tolerance);
    add_product(left, -1.0, basis.vectors, basis.eigenvalues.cwiseInverse().asDiagonal() * product_tn(basis.vectors, loads));
    return reduced.expand(left);
  }

  // Stress at the surface's nodes: what is first at each, then what else is there.
  void add_surface_stress(const MatX& U, const std::vector<int>& nodes) {
    BodySurface& surface = out.surface;
    const Eigen::Index m = std::ssize(nodes);
    const auto stress = stresses_at_nodes(model, system, U, nodes),
               left_out = stresses_at_nodes(model, system, left_out_of_inertia(), nodes);
    for (size_t i = 0; i < nodes.size(); ++i)
      for (size_t part = 1; part < stress[i].size(); ++part) surface.other_points.push_back(static_cast<int>(i));
    const Eigen::Index others = std::ssize(surface.other_points);
    const auto fill = [&](const std::vector<std::vector<MatX>>& of, Eigen::Index columns, MatX& first, MatX& other) {
      first = MatX::Zero(6 * m, columns);
      other = MatX::Zero(6 * others, columns);
      Eigen::Index next = 0;
      for (Eigen::Index i = 0; i < m; ++i)
        for (size_t part = 0; part < of[i].size(); ++part)
          (part == 0 ? first : other).middleRows(part == 0 ? 6 * i : 6 * next++, 6) = of[i][part];
    };
    fill(stress, U.cols(), surface.stress, surface.other_stress);
    fill(left_out, 12, surface.load_stress, surface.other_load_stress);
  }

  // What the elements know of all nodes of the outer surface.
  void add_surface(const MatX& U) {
    if (model.matrices) return note("the surface needs the elements: left out for a model given as matrices");
    BodySurface& surface = out.surface;
    const std::vector<std::vector<int>> faces = whole_outer_faces(model);
    std::vector<int> number(model.nodes.size(), -1), nodes;
    for (const auto& face : faces)
      for (const int node : face) number[node] = 0;
    for (size_t i = 0; i < number.size(); ++i)
      if (number[i] == 0) {
        number[i] = static_cast<int>(nodes.size());
        nodes.push_back(static_cast<int>(i));
      }
    const Eigen::Index m = std::ssize(nodes), n = U.cols();
    surface.points.resize(m, 3);
    surface.phi = MatX::Zero(3 * m, n);
    for (Eigen::Index i = 0; i < m; ++i) {
      const int node = nodes[i];
      surface.ids.push_back(model.node_ids[node]);
      surface.points.row(i) = model.nodes[node].transpose();
      for (int d = 0; d < 3; ++d)
        if (const int motion = system.dof[node][d]; motion >= 0) surface.phi.row(3 * i + d) = U.row(motion);
    }
    surface.faces = Eigen::MatrixXi::Constant(std::ssize(faces), 8, -1);
    for (Eigen::Index f = 0; f < surface.faces.rows(); ++f)
      for (size_t k = 0; k < faces[f].size(); ++k) surface.faces(f, static_cast<Eigen::Index>(k)) = number[faces[f][k]];
    if (options.stress) add_surface_stress(U, nodes);
    lap("surface");
  }
};

}  // namespace

Reduction reduce(const FeModel& model, const ReduceOptions& options, const std::function<void(const std::string&)>& progress,
                 const std::function<void()>& ask) {
  return Reducer(model, options, progress, ask).run();
}

std::string surface_obj(const FeModel& model) {
  // Triangles and quadrangles of node indices; a quadratic face is divided.
  std::vector<std::vector<int>> pieces;
  for (const std::vector<int>& face : whole_outer_faces(model)) {
    if (face.size() < 6) {
      pieces.push_back(face);
      continue;
    }
    const size_t n = face.size() / 2;
    for (size_t i = 0; i < n; ++i) pieces.push_back({face[i], face[n + i], face[n + (i + n - 1) % n]});
    pieces.emplace_back(face.begin() + static_cast<std::ptrdiff_t>(n), face.end());
  }
  std::vector<int> number(model.nodes.size(), 0);
  std::string text = "# undeformed outer surface, metres\n";
  int count = 0;
  for (const auto& f : pieces)
    for (int node : f) number[node] = 1;
  for (size_t i = 0; i < number.size(); ++i)
    if (number[i] > 0) {
      number[i] = ++count;
      const Vec3& x = model.nodes[i];
      text += fmt::format("v {:.9g} {:.9g} {:.9g}\n", x.x(), x.y(), x.z());
    }
  for (const auto& f : pieces) {
    text += "f";
    for (int node : f) text += fmt::format(" {}", number[node]);
    text += "\n";
  }
  return text;
}

}  // namespace flexframe::sim
