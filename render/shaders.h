// Private to the drawing: GLSL sources. Variants are made by #define lines put behind the #version line.
#pragma once

namespace flexframe::render {

// Lit surfaces. Switches: NORMALS SCALARS COLORS EDGES SHADOW GHOST TWO_SIDED DEPTH_ONLY SCALAR_OUTPUT
extern const char* const surface_vertex;
extern const char* const surface_fragment;

// Segments as rectangles facing the viewer, one instance a segment.
extern const char* const line_vertex;
extern const char* const line_fragment;

// Symbols of constant size, one instance a point.
extern const char* const marker_vertex;
extern const char* const marker_fragment;

}  // namespace flexframe::render
