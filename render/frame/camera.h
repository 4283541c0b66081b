// Where to look from: fits, orbits, follows, paths. All functions are pure.
#pragma once

#include "render/picture/picture.h"

#include <span>
#include <vector>

namespace flexframe::render {

// The scene fills the scene area: the picture less its plot panels (Overlay::plots). A camera sees the scene area.
//
// Part of the scene area that other overlays take, in fractions of its width (left, right) and height (top, bottom).
struct Insets {
  double left = 0.0, right = 0.0, top = 0.0, bottom = 0.0;
};

// The camera that sees all points as large as possible within the insets and `margin` (fraction of the free part on each
// side), looking along `direction` (from camera to scene, world) with `up` upwards. Exact for both projections: some
// points touch the free rectangle. points: world; for a sequence, corners of the bounds of every body at every picture.
// A set of one point or none gives a view of 1 m around it.
struct FitOptions {
  glm::dvec3 direction{-0.45, -0.40, -0.80};
  glm::dvec3 up{0.0, 1.0, 0.0};
  double fov = 30.0;  // degrees, vertical
  Projection projection = Projection::perspective;
  double margin = 0.04;
  Insets insets;
};
// size: of the picture, pixels.
Camera fit_camera(std::span<const glm::dvec3> points, Size size, const FitOptions& options);

// The same for the scene area and insets of a picture: set size and overlay first; options.insets is replaced.
Camera fit_camera(const Picture& picture, std::span<const glm::dvec3> points, FitOptions options);

// The eight corners of a box, appended.
void append_corners(std::vector<glm::dvec3>& points, const Bounds& bounds);

// Direction and up for a motion: planar motions (one extent far below the others) are seen nearly square on to their
// plane, with a slight three-quarter turn; spatial ones from a classic three-quarter view. Up is against gravity if there
// is some, else y for motions in xy, z otherwise. points as for fit_camera. Sets direction and up of the options.
FitOptions default_view(std::span<const glm::dvec3> points, const glm::dvec3& gravity);

// A ground for default_view: below all points perpendicular to up, a little off so that nothing touches it.
Ground default_ground(std::span<const glm::dvec3> points, const glm::dvec3& up);

// Turned by `degrees` about the axis `up` through the target.
Camera orbit_camera(const Camera& camera, double degrees);

// Position and target moved by `displacement` (follow a body: displacement of its origin since the fit).
Camera shift_camera(const Camera& camera, const glm::dvec3& displacement);

struct CameraKey {
  double t = 0.0;
  Camera camera;
};

// Smooth path through keys (sorted by t): monotone-free Catmull-Rom (cubic Hermite, non-uniform) of position, target, up,
// fov and height; held at the ends. Throws ArgumentError for no keys or times that do not rise.
Camera camera_on_path(std::span<const CameraKey> keys, double t);

enum class ViewKind { front, side, top, iso };

// One to four views of the points, each fitted to its part of the picture: front (looking along -z for up y, +y for up z), side, top,
// three-quarter. Square views have one scale. Two stand side by side, three and four two by two. Set size and overlay of the picture first.
std::vector<View> make_views(const Picture& picture, std::span<const glm::dvec3> points, const glm::dvec3& up,
                             std::span<const ViewKind> kinds);

// View matrix in double (camera from world).
glm::dmat4 view_matrix(const Camera& camera);

// Direction towards the key light where a picture names none: from above, left of the camera and a little behind it.
// up: of the ground or the camera. A film keeps that of its first picture: light that turned with the camera would make all shadows run.
glm::dvec3 default_light(const Camera& camera, const glm::dvec3& up);

}  // namespace flexframe::render
