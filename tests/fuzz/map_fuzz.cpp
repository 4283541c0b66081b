// libFuzzer entry: nodes and a mesh on a coarse grid, so that points meet, lie on lines and in planes and triangles are flat; the map must
// answer in a sentence or keep rigid motion (interp/map.h). Build and run: tests/fuzz/fuzz.sh map
#include "interp/map.h"
#include "tests/fuzz/scratch.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace {

using namespace flexframe::interp;

struct Bytes {
  const std::uint8_t* at;
  const std::uint8_t* end;
  int next() { return at < end ? *at++ : 0; }
  // A coordinate: 33 places between -1 and 1.
  double place() { return (next() % 33 - 16) / 16.0; }
};

void check(const Map& map, const Nodes& nodes, const MeshView& mesh, double size) {
  // A turn of 100 degrees and a shift, both well beyond what is small.
  const Vec3 axis = Vec3(1, -2, 2) / 3.0, shift = size * Vec3(0.3, -0.7, 0.5);
  const double angle = 100.0 * std::numbers::pi / 180.0;
  Mat3 R = Mat3::Identity();
  const Points& x = nodes.positions;
  // Nodes on a line without rotations do not say how the body turns about it; where the map warns (nodes in a corner of the body, patches
  // simplified), it may turn another way, but goes along with a shift.
  const Points centred = x.rowwise() - x.colwise().mean();
  const Eigen::SelfAdjointEigenSolver<Mat3> spread(Mat3(centred.transpose() * centred));  // squares, the largest last
  if (map.report.warnings.empty() && (nodes.rotations || (x.rows() > 2 && spread.eigenvalues()(1) > 0.0025 * size * size)))
    R = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  const bool turned = !R.isIdentity(0.0);
  const Points u = (x * R.transpose() - x).rowwise() + shift.transpose();
  Points theta(nodes.rotations ? x.rows() : 0, 3);
  for (Eigen::Index i = 0; i < theta.rows(); ++i) theta.row(i) = (turned ? angle : 0.0) * axis.transpose();
  PointsF out;
  apply(map, u, theta, out);
  const Points wanted = (mesh.vertices * R.transpose() - mesh.vertices).rowwise() + shift.transpose();
  const double off = (out.cast<double>() - wanted).rowwise().norm().maxCoeff();
  // Weights are single precision, their sum at most 100.
  if (!(off < 1e-3 * size)) {
    std::fprintf(stderr, "rigid motion is off by %g of %g (%s, %s)\n", off, size, std::string(scheme_name(map.report.scheme)).c_str(),
                 map.report.layout.c_str());
    std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes bytes{data, data + size};
  const int kind = bytes.next();
  const double scale = std::pow(10.0, bytes.next() % 13 - 6);
  Nodes nodes;
  nodes.rotations = kind & 1;
  Points vertices(1 + bytes.next() % 64, 3);
  Triangles triangles(kind & 2 ? 0 : 1 + bytes.next() % 96, 3);
  nodes.positions.resize(1 + bytes.next() % 24, 3);
  for (double& v : vertices.reshaped()) v = scale * bytes.place();
  for (int& v : triangles.reshaped()) v = bytes.next() % static_cast<int>(vertices.rows());
  for (double& v : nodes.positions.reshaped()) v = scale * bytes.place();
  Options options;
  constexpr Scheme schemes[] = {Scheme::automatic, Scheme::automatic, Scheme::kernel, Scheme::elastic, Scheme::r3, Scheme::lattice};
  options.scheme = schemes[(kind >> 2) % 6];
  options.threads = 1;
  const MeshView mesh{Eigen::Map<const Points>(vertices.data(), vertices.rows(), 3),
                      Eigen::Map<const Triangles>(triangles.data(), triangles.rows(), 3)};
  try {
    check(make_map(nodes, mesh, options), nodes, mesh, scale);
  } catch (const InputError& e) {
    fuzz::require_answer(e.what(), "");
  } catch (const MapError& e) {
    fuzz::require_answer(e.what(), "");
  }
  return 0;
}
