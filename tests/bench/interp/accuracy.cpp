// Makes examples/accuracy-interp: error against number of nodes for each scheme on the con rod (table, diagram, pictures of the error on
// the body) and a plate moved by its corners.
//   interp_accuracy CONROD.txt OUTPUT_FOLDER
//   interp_accuracy OUTPUT_FOLDER                      only the plate
#include "interp/map.h"
#include "interp/surface.h"
#include "render/draw/renderer.h"
#include "render/frame/camera.h"
#include "render/image/png.h"
#include "render/picture/mesh.h"
#include "tests/bench/cpu.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>

namespace {

using namespace flexframe;
using interp::Points;
using interp::Scheme;

interp::MeshView view_of(const render::Mesh& mesh) {
  return {Eigen::Map<const Points>(&mesh.positions[0].x, static_cast<Eigen::Index>(mesh.positions.size()), 3),
          Eigen::Map<const interp::Triangles>(&mesh.triangles[0].x, static_cast<Eigen::Index>(mesh.triangles.size()), 3)};
}

struct Case {
  double error = std::numeric_limits<double>::quiet_NaN(), worst = 0.0, lebesgue = 0.0, seconds = 0.0, leave_one_out = 0.0;
  Points found;  // of mode 2
};

struct ConRod {
  render::Mesh mesh;
  std::vector<Points> mode;
  std::vector<int> order;
};

// tests/unit/data/kernel_map/conrod.txt: counts, then a vertex a line (x y z and three modes), then triangles. The nodes are the first of a
// farthest-point order.
ConRod read_conrod(const std::filesystem::path& file) {
  ConRod rod;
  std::ifstream in(file);
  Eigen::Index vertices = 0, triangles = 0;
  in >> vertices >> triangles;
  std::vector<glm::dvec3> positions(static_cast<size_t>(vertices));
  std::vector<glm::ivec3> faces(static_cast<size_t>(triangles));
  rod.mode.assign(3, Points(vertices, 3));
  for (Eigen::Index v = 0; v < vertices; ++v) {
    glm::dvec3& x = positions[static_cast<size_t>(v)];
    in >> x.x >> x.y >> x.z;
    for (Points& m : rod.mode) in >> m(v, 0) >> m(v, 1) >> m(v, 2);
  }
  for (glm::ivec3& t : faces) in >> t.x >> t.y >> t.z;
  if (!in || vertices == 0) throw std::runtime_error(file.string() + " is missing or incomplete");
  rod.mesh = render::make_mesh(positions, faces, file.string());
  const auto view = view_of(rod.mesh);
  Eigen::VectorXd distance = Eigen::VectorXd::Constant(vertices, std::numeric_limits<double>::infinity());
  for (Eigen::Index next = 0; rod.order.size() < 1000; distance.maxCoeff(&next)) {
    rod.order.push_back(static_cast<int>(next));
    distance = distance.cwiseMin((view.vertices.rowwise() - view.vertices.row(next)).rowwise().norm());
  }
  return rod;
}

Case measure(const ConRod& rod, Scheme scheme, int count) {
  interp::Nodes nodes;
  nodes.positions.resize(count, 3);
  const auto view = view_of(rod.mesh);
  for (int i = 0; i < count; ++i) nodes.positions.row(i) = view.vertices.row(rod.order[static_cast<size_t>(i)]);
  interp::Options options;
  options.scheme = scheme;
  options.precise = true;
  options.threads = 1;
  options.lebesgue_error = std::numeric_limits<double>::infinity();
  Case c;
  const double start = test::process_seconds();
  const interp::Map map = interp::make_map(nodes, view, options);
  c.seconds = test::process_seconds() - start;
  c.lebesgue = map.report.lebesgue;
  std::vector<char> is_node(rod.mesh.positions.size(), 0);
  for (int i = 0; i < count; ++i) is_node[static_cast<size_t>(rod.order[static_cast<size_t>(i)])] = 1;
  double error2 = 0.0, truth2 = 0.0;
  for (size_t m = 0; m < 3; ++m) {
    Points u(count, 3);
    for (int i = 0; i < count; ++i) u.row(i) = rod.mode[m].row(rod.order[static_cast<size_t>(i)]);
    const Points found = interp::apply_linear(map, u, Points(0, 3));
    c.leave_one_out = std::max(c.leave_one_out, interp::leave_one_out(map, u, Points(0, 3)).relative);
    const double largest = rod.mode[m].rowwise().norm().maxCoeff();
    for (Eigen::Index v = 0; v < found.rows(); ++v) {
      if (is_node[static_cast<size_t>(v)]) continue;
      const double e = (found.row(v) - rod.mode[m].row(v)).norm();
      error2 += e * e;
      truth2 += rod.mode[m].row(v).squaredNorm();
      c.worst = std::max(c.worst, e / largest);
    }
    if (m == 1) c.found = found;
  }
  c.error = std::sqrt(error2 / truth2);
  return c;
}

// Positions, normals and triangles of a mesh as the renderer takes them, by shading points.
struct Drawn {
  std::vector<glm::vec3> positions, normals;
  std::vector<glm::uvec3> triangles;
  std::vector<float> scalars;
};
Drawn prepare(const render::Mesh& mesh, const Points& displacement, const std::vector<float>& scalars) {
  std::vector<float> moved;
  for (size_t v = 0; v < mesh.positions.size(); ++v)
    for (int c = 0; c < 3; ++c) moved.push_back(static_cast<float>(mesh.positions[v][c] + displacement(static_cast<Eigen::Index>(v), c)));
  std::vector<int> position, group;
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      position.push_back(mesh.triangles[t][k]);
      group.push_back(mesh.point_group[static_cast<size_t>(mesh.triangle_points[t][k])]);
    }
  interp::PointsF normals;
  interp::compute_normals(interp::make_normal_layout(position, group, mesh.normal_groups), moved, normals);
  Drawn d;
  for (size_t p = 0; p < mesh.point_position.size(); ++p) {
    const auto v = static_cast<size_t>(mesh.point_position[p]);
    const auto g = static_cast<Eigen::Index>(mesh.point_group[p]);
    d.positions.emplace_back(moved[3 * v], moved[3 * v + 1], moved[3 * v + 2]);
    d.normals.emplace_back(normals(g, 0), normals(g, 1), normals(g, 2));
    if (!scalars.empty()) d.scalars.push_back(scalars[v]);
  }
  for (const glm::ivec3& t : mesh.triangle_points) d.triangles.emplace_back(t);
  return d;
}

render::Surface surface(const Drawn& d) {
  render::Surface s;
  s.positions = d.positions;
  s.normals = d.normals;
  s.triangles = d.triangles;
  s.scalars = d.scalars;
  return s;
}

void draw_errors(const ConRod& rod, const std::map<std::pair<Scheme, int>, Case>& cases, const std::filesystem::path& folder,
                 render::Renderer& renderer) {
  const double largest = rod.mode[1].rowwise().norm().maxCoeff();
  const double amplitude = 0.03 * 2.0 * compute_bounds(rod.mesh).radius() / largest;
  for (const auto& [scheme, count] :
       {std::pair(Scheme::r3, 20), std::pair(Scheme::kernel, 97), std::pair(Scheme::elastic, 20), std::pair(Scheme::elastic, 97)}) {
    const Case& c = cases.at({scheme, count});
    std::vector<float> error;
    for (Eigen::Index v = 0; v < c.found.rows(); ++v)
      error.push_back(static_cast<float>(100.0 * (c.found.row(v) - rod.mode[1].row(v)).norm() / largest));
    const Drawn drawn = prepare(rod.mesh, amplitude * c.found, error);
    render::Picture picture;
    picture.size = {960, 420};
    picture.surfaces.push_back(surface(drawn));
    picture.scalar_map.upper = 5.0;
    picture.overlay.title = fmt::format("con rod, mode 2, {} nodes, {}", count, interp::scheme_name(scheme));
    picture.overlay.scalar_bar = render::ScalarBar{"error", "% of max", 1.0};
    render::Markers nodes;
    for (int i = 0; i < count; ++i)
      nodes.points.push_back(
          drawn.positions.empty() ? glm::vec3(0) : glm::vec3(rod.mesh.positions[static_cast<size_t>(rod.order[static_cast<size_t>(i)])]));
    for (int i = 0; i < count; ++i)
      for (int k = 0; k < 3; ++k)
        nodes.points[static_cast<size_t>(i)][k] += static_cast<float>(amplitude * c.found(rod.order[static_cast<size_t>(i)], k));
    nodes.diameter = 8.0f;
    picture.markers.push_back(nodes);
    std::vector<glm::dvec3> corners;
    render::append_corners(corners, compute_bounds(rod.mesh));
    render::FitOptions fit;
    fit.direction = {0.25, 0.45, -0.9};
    picture.camera = render::fit_camera(picture, corners, fit);
    render::write_png(folder / fmt::format("error_{}_{}.png", interp::scheme_name(scheme), count), renderer.draw(picture));
  }
}

// Heckmann, Otter, Dietz, Diaz Lopez 2006, figures 8 and 9: 165 vertices moved by the four corners; rest, up, down, and one picture with
// four past positions.
void draw_plate(const std::filesystem::path& folder, render::Renderer& renderer) {
  std::vector<glm::dvec3> positions;
  std::vector<glm::ivec3> triangles;
  for (int j = 0; j < 15; ++j)
    for (int i = 0; i < 11; ++i) positions.emplace_back(i / 10.0, 1.3 * j / 14.0, 0.0);
  for (int j = 0; j < 14; ++j)
    for (int i = 0; i < 10; ++i) {
      const int a = i + 11 * j;
      triangles.emplace_back(a, a + 1, a + 12);
      triangles.emplace_back(a, a + 12, a + 11);
    }
  const render::Mesh mesh = render::make_mesh(positions, triangles, "plate");
  interp::Nodes nodes;
  nodes.positions.resize(4, 3);
  nodes.positions << 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.3, 0.0, 1.0, 1.3, 0.0;
  interp::Options options;
  options.precise = true;
  const interp::Map map = interp::make_map(nodes, view_of(mesh), options);
  auto shape = [&](double amplitude) {
    Points u = Points::Zero(4, 3);
    u(3, 2) = amplitude;
    return prepare(mesh, interp::apply_precise(map, u, Points(0, 3)), {});
  };
  for (const auto& [name, now, past] :
       {std::tuple("plate_rest", 0.0, std::vector<double>{}), std::tuple("plate_up", 1.0, std::vector<double>{}),
        std::tuple("plate_down", -1.0, std::vector<double>{}), std::tuple("plate_past", 1.0, std::vector<double>{0.6, 0.2, -0.2, -0.6})}) {
    std::vector<Drawn> drawn{shape(now)};
    for (const double a : past) drawn.push_back(shape(a));
    render::Picture picture;
    picture.size = {640, 400};
    // The grid of the animation vertices: of each cell's two triangles all edges but the diagonal.
    std::vector<std::uint8_t> grid;
    for (size_t k = 0; k < triangles.size(); ++k) grid.push_back(k % 2 == 0 ? 0b011 : 0b110);
    render::Markers corner;
    corner.diameter = 9.0f;
    for (int k = 0; k < 4; ++k) corner.points.emplace_back(nodes.positions(k, 0), nodes.positions(k, 1), k == 3 ? now : 0.0);
    picture.markers.push_back(corner);
    picture.ground =
        render::Ground{.point = {0.0, 0.0, -1.1}, .normal = {0.0, 0.0, 1.0}, .spacing = 0.0, .line_color = glm::vec3(0.55f, 0.60f, 0.66f)};
    picture.bounds = {{0.0, 0.0, -1.0}, {1.0, 1.3, 1.0}};
    for (size_t k = 0; k < drawn.size(); ++k) {
      render::Surface s = surface(drawn[k]);
      s.edges = true;
      s.edge_flags = grid;
      s.material.color = {0.35f, 0.55f, 0.80f};
      if (k > 0) {
        s.opacity = 0.35f - 0.06f * static_cast<float>(k);
        s.casts_shadow = false;
      }
      picture.surfaces.push_back(s);
    }
    picture.overlay.triad = true;
    picture.overlay.title =
        fmt::format("Plate, corner at {}{:g} m{}", now < 0.0 ? "−" : "", std::abs(now), past.empty() ? "" : " and before");
    std::vector<glm::dvec3> corners;
    render::append_corners(corners, render::Bounds{{0.0, 0.0, -1.0}, {1.0, 1.3, 1.0}});
    render::FitOptions fit;
    fit.direction = {-0.62, 0.62, -0.48};
    fit.up = {0.0, 0.0, 1.0};
    picture.camera = render::fit_camera(picture, corners, fit);
    render::write_png(folder / fmt::format("{}.png", name), renderer.draw(picture), {.level = 12, .text = {}});
  }
}

std::string diagram(const std::vector<Scheme>& schemes, const std::vector<int>& counts,
                    const std::map<std::pair<Scheme, int>, Case>& cases) {
  constexpr double left = 70, top = 20, width = 560, height = 360;
  auto x = [&](double n) { return left + width * (std::log10(n) - std::log10(7.0)) / (std::log10(1100.0) - std::log10(7.0)); };
  auto y = [&](double e) { return top + height * (std::log10(1.0) - std::log10(e)) / 3.0; };
  const std::vector<std::string> color{"#1f5fa8", "#c8501e", "#2f8f4e", "#777777", "#8a5fb0", "#b09020"};
  std::string s =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"760\" height=\"440\" font-family=\"DejaVu Sans, sans-serif\" "
      "font-size=\"13\">\n<rect width=\"760\" height=\"440\" fill=\"white\"/>\n";
  for (const double e : {1.0, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001})
    s += fmt::format(
        "<line x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\" stroke=\"#ddd\"/><text x=\"{3}\" y=\"{4:.1f}\" "
        "text-anchor=\"end\">{5:g} %</text>\n",
        left, left + width, y(e), left - 8, y(e) + 4, 100 * e);
  for (const int n : counts)
    s += fmt::format(
        "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" stroke=\"#eee\"/><text x=\"{0:.1f}\" y=\"{3}\" "
        "text-anchor=\"middle\">{4}</text>\n",
        x(n), top, top + height, top + height + 18, n);
  s += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">simulation nodes</text>\n", left + width / 2, top + height + 42);
  for (size_t k = 0; k < schemes.size(); ++k) {
    std::string points;
    for (const int n : counts)
      if (const auto it = cases.find({schemes[k], n}); it != cases.end()) {
        points += fmt::format("{:.1f},{:.1f} ", x(n), y(it->second.error));
        s += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\" fill=\"{}\"/>\n", x(n), y(it->second.error), color[k]);
      }
    s += fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>\n", points, color[k]);
    s += fmt::format("<text x=\"{}\" y=\"{}\" fill=\"{}\">{}</text>\n", left + width + 14, top + 20 + 20 * static_cast<double>(k), color[k],
                     interp::scheme_name(schemes[k]));
  }
  return s + "</svg>\n";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2) {
    render::Renderer renderer;
    draw_plate(argv[1], renderer);
    return 0;
  }
  if (argc != 3) {
    fmt::print(stderr, "interp_accuracy CONROD.txt OUTPUT_FOLDER\n");
    return 2;
  }
  const std::filesystem::path folder = argv[2];
  std::filesystem::create_directories(folder);
  const ConRod rod = read_conrod(argv[1]);
  const std::vector<Scheme> schemes{Scheme::kernel, Scheme::elastic, Scheme::lattice, Scheme::r3, Scheme::r, Scheme::tps};
  const std::vector<int> counts{8, 20, 50, 97, 200, 1000};
  std::map<std::pair<Scheme, int>, Case> cases;
  std::string table = "| nodes |";
  for (const Scheme s : schemes) table += fmt::format(" {} |", interp::scheme_name(s));
  table += "\n|---|---|---|---|---|---|---|\n";
  std::string csv = "scheme,nodes,relative_l2,largest,lebesgue,leave_one_out,setup_cpu_s\n";
  for (const int n : counts) {
    table += fmt::format("| {} |", n);
    for (const Scheme s : schemes) {
      // Green's functions are for sparse nodes; their cost grows with the square of the number.
      if ((s == Scheme::elastic || s == Scheme::lattice) && n > 200) {
        table += " |";
        continue;
      }
      Case& c = cases[{s, n}] = measure(rod, s, n);
      table += fmt::format(" {:.2f} |", 100.0 * c.error);
      csv += fmt::format("{},{},{:.6g},{:.6g},{:.4g},{:.4g},{:.4g}\n", interp::scheme_name(s), n, c.error, c.worst, c.lebesgue,
                         c.leave_one_out, c.seconds);
      fmt::print("{:8} {:5}  error {:.4f}  largest {:.3f}  Lebesgue {:.2f}  leave-one-out {:.3f}  set-up {:.3f} s\n",
                 interp::scheme_name(s), n, c.error, c.worst, c.lebesgue, c.leave_one_out, c.seconds);
      std::fflush(stdout);
    }
    table += "\n";
  }
  std::ofstream(folder / "table.md") << table;
  std::ofstream(folder / "error.csv") << csv;
  std::ofstream(folder / "error.svg") << diagram(schemes, counts, cases);
  render::Renderer renderer;
  draw_errors(rod, cases, folder, renderer);
  draw_plate(folder, renderer);
  return 0;
}
