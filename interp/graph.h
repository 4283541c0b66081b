// The mesh as a graph: vertices welded by position, edges of its triangles, parts, bridges, distances along the surface.
// Distances follow edges and, across a triangle, the straight line of the unfolded front (Kimmel and Sethian, Computing geodesic
// paths on manifolds, 1998), so that they do not depend on how the edges happen to run.
#pragma once

#include "interp/types.h"

#include <span>
#include <vector>

namespace flexframe::interp {

// Vertices within `distance` of each other become one. row: welded vertex of each vertex; positions of the first of each.
struct Weld {
  std::vector<int> row;  // M -> welded
  Points positions;      // welded x 3
  Triangles triangles;   // of welded vertices, those that collapse left out
  double size = 0.0;     // m, diagonal of the box round all but stray faces; 0: not known
};
Weld weld_vertices(const MeshView& mesh, double distance);

// Faces that are no part of the surface, such as files of CAD programs hold: leaves out those that hang on one edge or none while other
// faces have all their corners. Returns how many.
int drop_fins(Weld& weld);

// Positions of the vertices but those of single faces that float about a mesh of many (n x 3, m). All of them where there are no faces.
Points points_without_strays(const Weld& weld);

// Part of each welded vertex, 0..count-1: vertices that triangles join are of one part.
std::vector<int> part_of_vertices(const Weld& weld, int& count);

// Place of a cell in an array over a grid of `size` cells, x running fastest.
inline Eigen::Index grid_slot(const Eigen::Array3i& cell, const Eigen::Array3i& size) {
  return cell[0] + size[0] * (cell[1] + Eigen::Index{size[1]} * cell[2]);
}

// Nearest points in a uniform grid.
class PointGrid {
 public:
  // Points: the array must outlive the grid.
  explicit PointGrid(const Points& points);
  // Nearest point; -1 if there is none.
  int nearest(const Vec3& x) const;
  // Indices of all points within radius, increasing.
  void within(const Vec3& x, double radius, std::vector<int>& out) const;

 private:
  const Points& points_;
  Vec3 lower_ = Vec3::Zero();
  double cell_ = 1.0;
  Eigen::Array3i size_ = Eigen::Array3i::Ones();
  std::vector<int> begin_, item_;
  Eigen::Array3i cell_of(const Vec3& x) const;
  Eigen::Index slot(const Eigen::Array3i& c) const;
};

struct Graph {
  int vertices = 0;  // welded vertices first, then nodes
  int nodes = 0;
  std::vector<int> begin, neighbour;  // compressed adjacency of the mesh edges and bridges, without the nodes
  std::vector<float> length;
  std::vector<int> corner_begin, corner;  // triangles of each vertex, as pairs of their other two vertices
  // Attachment of node i: vertices at node_begin[i]..node_begin[i+1] with straight distances.
  std::vector<int> node_begin, node_vertex;
  std::vector<double> node_length;
  std::vector<int> vertex_begin, vertex_node;  // the same from the vertices' side
  std::vector<double> vertex_length;
  std::vector<double> off_mesh;  // distance of each node from the surface
  // Of a wall far thinner than the nodes' spacing: from its middle to each vertex and node, m; zero where it is no wall. No rows: no wall.
  Points beside, node_beside, node_normal;  // node_normal: unit vector across the wall
  int parts = 0;                            // connected parts of the mesh
  int pieces = 0;                           // parts and groups of bridged parts that hold nodes
  // Parts that had to be bridged, the largest first: vertices, their middle (m), nodes held.
  struct Bridged {
    int vertices = 0, nodes = 0;
    Vec3 middle = Vec3::Zero();
  };
  std::vector<Bridged> bridged;
};

// Connects parts that hold too few nodes with their nearest neighbour part. Enough are `enough` nodes; for a part that lies apart from all
// others three that are not on a line, or with rotations one.
Graph make_graph(const Weld& weld, const Points& nodes, int enough, bool rotations);

// Reusable memory of one search; one a thread.
struct Search {
  std::vector<double> distance;
  std::vector<int> stamp, reached;  // reached vertices in order of distance
  std::vector<int> node;            // reached nodes in order of distance
  std::vector<double> node_distance;
  int now = 0;
  std::vector<char> state;
};

// From a vertex outward until `count` nodes are reached, then on to every vertex nearer than the last of them. Returns that distance; if
// fewer nodes can be reached: infinity, with all that can be reached.
double grow(const Graph& graph, const Points& positions, int start, int count, Search& search);

}  // namespace flexframe::interp
