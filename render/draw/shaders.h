// Private to the drawing: GLSL sources. Variants are made by #define lines put behind the #version line.
#pragma once

namespace flexframe::render {

// Lit surfaces. Switches: NORMALS SCALARS LEVELS COLORS METAL EDGES SHADOW GHOST TWO_SIDED SCALAR_OUTPUT;
// STORE keeps normal, colour and mark of a sample instead of lighting it, STORED (with cover_vertex) lights what was kept,
// MEMBERS only that of some surfaces.
// Entries of the colour map that scalars are looked up in: below one level of a byte apart.
constexpr int color_steps = 1024;
extern const char* const surface_vertex;
extern const char* const surface_fragment;
extern const char* const cover_vertex;  // one triangle over everything, at the depth of nothing

// Segments as rectangles facing the viewer, one instance a segment.
extern const char* const line_vertex;
extern const char* const line_fragment;

// Symbols of constant size, one instance a point.
extern const char* const marker_vertex;
extern const char* const marker_fragment;

}  // namespace flexframe::render
