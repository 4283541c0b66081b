// Shading is in linear light in the camera's frame; samples are stored as square roots of it, which cost a sixth of the way to sRGB.
// Microfacet highlight: Walter, Marschner, Li, Torrance, "Microfacet models for refraction through rough surfaces", 2007 (GGX);
// visibility term: Hammon, "PBR diffuse lighting for GGX+Smith microsurfaces", 2017 (height-correlated approximation);
// shadows: Lauritzen, McCool, "Layered variance shadow maps", 2008 (exponential warp).
#include "render/draw/shaders.h"

namespace flexframe::render {

const char* const surface_vertex = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in float scalar;
layout(location = 3) in vec3 color;
layout(location = 4) in vec3 corner;
#ifdef VECTORS
layout(location = 5) in vec3 vector;
out vec3 vector_at;
#ifdef SHEARS
layout(location = 6) in vec3 shear;
out vec3 shear_at;
#endif
#endif
uniform mat4 clip_from_surface;
invariant gl_Position;
#ifdef CUT
uniform vec4 cut_plane;  // in the surface's frame
#endif
#if defined(SHADOW) || !defined(NORMALS)
uniform mat4 view_from_surface;  // not worked out where only the clip position is wanted
#endif
#ifdef NORMALS
uniform mat3 view_normal;
out vec4 normal_scalar;  // one slot: setting up triangles costs by the slot
#else
out vec4 position_scalar;
#endif
#ifdef SCALARS
uniform vec2 scalar_scale;
#endif
#ifdef COLORS
out vec3 color_at;
#endif
#ifdef EDGES
noperspective out vec3 corner_at;
#endif
#ifdef SHADOW
uniform mat4 light_from_view;
out vec3 light_position;
#endif
void main() {
  gl_Position = clip_from_surface * vec4(position, 1.0);
#ifdef CUT
  gl_ClipDistance[0] = -(dot(cut_plane.xyz, position) + cut_plane.w);
#endif
#if defined(SHADOW) || !defined(NORMALS)
  vec4 v = view_from_surface * vec4(position, 1.0);
#endif
  float s = 0.0;
#ifdef SCALARS
  s = scalar * scalar_scale.x + scalar_scale.y;
#endif
#ifdef NORMALS
  normal_scalar = vec4(view_normal * normal, s);
#else
  position_scalar = vec4(v.xyz, s);
#endif
#ifdef VECTORS
  vector_at = vector;
#ifdef SHEARS
  shear_at = shear;
#endif
#endif
#ifdef COLORS
  color_at = color;
#endif
#ifdef EDGES
  corner_at = corner;
#endif
#ifdef SHADOW
  light_position = (light_from_view * v).xyz;
#endif
}
)";

const char* const surface_fragment = R"(
#if defined(STORED)
uniform usampler2D geometry;
#elif defined(NORMALS)
in vec4 normal_scalar;
#else
in vec4 position_scalar;
#endif
#ifdef SCALARS
uniform uint colors[COLOR_STEPS + 1];  // 10 bits a channel, square roots of linear light: one look-up, not three; last: no number
#ifdef LEVELS
uniform float levels;
#endif
#ifdef ISOLINES
uniform float isolines;
uniform float line_half;
#endif
#if defined(VECTORS) || defined(LOGARITHM)
uniform vec2 value_scale;
#endif
#ifdef VECTORS
in vec3 vector_at;
#ifdef SHEARS
in vec3 shear_at;
#endif
#endif
#endif
#ifdef COLORS
in vec3 color_at;
#endif
#ifdef EDGES
noperspective in vec3 corner_at;
uniform vec3 edge_color;
uniform float edge_width;
#endif
#ifdef SHADOW
#ifdef STORED
uniform sampler2D depths;
uniform mat4 light_from_view;
uniform vec4 planes;   // distance of a depth z: (x + y * z) / (z * z' + w), z' the third
uniform vec4 place;    // orthographic: position across the view by gl_FragCoord: scale, offset
uniform float orthographic;
#else
in vec3 light_position;
#endif
uniform sampler2D shadow;
uniform float shadow_warp;
uniform vec4 shadow_part;
uniform mat3 light_turn;
uniform float shadow_reach;
#endif
#ifdef CUT
uniform vec3 cut_normal;  // camera frame
uniform vec3 cap_color;
uniform float hatch;      // a sample's share of a stripe
#endif
uniform vec3 base_color;
uniform vec3 to_light;
uniform vec3 up;
#ifdef STUDIO
uniform vec3 side;
uniform vec4 boxes;  // where the reflected soft box begins and how steeply, the same of the strip
uniform float box_strength;
uniform vec3 falloff;  // of light across the view: a lamp is not infinitely far away, so plain faces are not of one shade
#endif
// What is the same for all fragments is worked out once outside: software OpenGL would do it for each.
uniform vec4 diffuse_terms;  // constant, by the height of the normal, by facing the viewer, by the key light
uniform vec4 gloss;          // alpha = roughness^2; alpha^2 / 2 pi; strength of highlight; of the reflected surroundings
uniform vec3 mirror_terms;   // steepness of the reflected horizon, reflection seen along the surface, metallic
uniform vec4 ray;  // direction to the viewer: (scale.xy * gl_FragCoord.xy + offset.xy, 1)
uniform vec2 mark;
#ifdef STORE
// Normal in two times 16 bits (octahedron: Cigolle et al., "A survey of efficient representations for independent unit vectors",
// 2014); square roots of linear colour and the mark in a byte each.
uniform uint mark_bits;
out uvec2 result;
#else
out vec4 result;
#endif
#ifdef MEMBERS
uniform uint members[8];  // a bit a mark: surfaces with this material
#endif

vec3 to_linear(vec3 s) { return s * (s * (s * 0.305306011 + 0.682171111) + 0.012522878); }

void main() {
#ifdef SCALARS
#ifdef NORMALS
  float scalar_at = normal_scalar.w;
#else
  float scalar_at = position_scalar.w;
#endif
#ifdef SHEARS
  // Von Mises of the interpolated components; divided first, so that pascals squared stay in range.
  vec3 apart = vector_at - vector_at.yzx;
  scalar_at = sqrt(0.5 * dot(apart, apart) + 3.0 * dot(shear_at, shear_at));
#elif defined(VECTORS)
  scalar_at = length(vector_at);
#endif
#ifdef LOGARITHM
  scalar_at = scalar_at == scalar_at ? log2(max(scalar_at, 1e-37)) * value_scale.x + value_scale.y : scalar_at;
#elif defined(VECTORS)
  scalar_at = scalar_at * value_scale.x + value_scale.y;
#endif
#endif
#ifdef SCALAR_OUTPUT
#ifdef SCALARS
  result = vec4(clamp(scalar_at, 0.0, 1.0), 0.0, 0.0, 1.0);
#else
  result = vec4(2.0, 0.0, 0.0, 1.0);
#endif
#else
  vec3 to_viewer = vec3(ray.xy * gl_FragCoord.xy + ray.zw, 1.0);
  vec3 v = normalize(to_viewer);
#if defined(STORED)
  uvec2 stored = texelFetch(geometry, ivec2(gl_FragCoord.xy), 0).rg;
#ifdef MEMBERS
  if ((members[stored.y >> 29] >> (stored.y >> 24 & 31u) & 1u) == 0u) discard;
#endif
  vec3 n = vec3(vec2(int(stored.x & 65535u) - 32768, int(stored.x >> 16) - 32768) / 32767.0, 0.0);
  n.z = 1.0 - abs(n.x) - abs(n.y);
  vec2 folded = vec2(max(-n.z, 0.0));
  n.xy -= vec2(n.x < 0.0 ? -folded.x : folded.x, n.y < 0.0 ? -folded.y : folded.y);
  n = normalize(n);
  vec3 root = vec3(stored.y & 255u, stored.y >> 8 & 255u, stored.y >> 16 & 255u) * (1.0 / 255.0);
  vec3 albedo = root * root;
  float mark_at = float(stored.y >> 24) * (1.0 / 255.0);
#ifdef SHADOW
  float depth = texelFetch(depths, ivec2(gl_FragCoord.xy), 0).r;
  float distance_at = (planes.x + planes.y * depth) / (planes.z * depth + planes.w);
  vec3 position_at = orthographic > 0.5 ? vec3(place.xy * gl_FragCoord.xy + place.zw, -distance_at) : -distance_at * to_viewer;
  vec3 light_position = (light_from_view * vec4(position_at, 1.0)).xyz;
#endif
#else
  float mark_at = mark.x;
#ifdef NORMALS
  vec3 n = normal_scalar.xyz;
#else
  vec3 n = cross(dFdx(position_scalar.xyz), dFdy(position_scalar.xyz));
#endif
#ifndef STORE
  n = normalize(n);
#endif
#ifdef TWO_SIDED
  // The side that is seen, by the normal itself: it needs no winding.
  if (dot(n, to_viewer) < 0.0) n = -n;
#endif
#ifdef CUT
  // The inside of a wall behind the cut stands for the cap before it.
  if (!gl_FrontFacing) n = cut_normal;
#endif
#ifdef SCALARS
  float s = clamp(scalar_at, 0.0, 1.0);
#ifdef LEVELS
  s = (min(floor(s * levels), levels - 1.0) + 0.5) / levels;
#endif
  uint packed_color = colors[scalar_at == scalar_at ? int(s * float(COLOR_STEPS - 1) + 0.5) : COLOR_STEPS];
#ifndef STORE
  vec3 root = vec3(packed_color & 1023u, packed_color >> 10 & 1023u, packed_color >> 20) * (1.0 / 1023.0);
  vec3 albedo = root * root;
#endif
#elif defined(COLORS)
  vec3 albedo = to_linear(color_at);
#else
  vec3 albedo = base_color;
#endif
#ifdef CUT
  if (!gl_FrontFacing) albedo = cap_color * (fract((gl_FragCoord.x + gl_FragCoord.y) * hatch) < 0.22 ? 0.5 : 1.0);
#endif
#endif
#ifdef STORE
  float share = 1.0 / max(abs(n.x) + abs(n.y) + abs(n.z), 1e-30);
  vec2 flat_n = n.xy * share;
  vec2 folded = 1.0 - abs(flat_n.yx);
  if (n.z < 0.0) flat_n = vec2(flat_n.x < 0.0 ? -folded.x : folded.x, flat_n.y < 0.0 ? -folded.y : folded.y);
  ivec2 code = ivec2(flat_n * 32767.0 + 32768.5);
#ifndef SCALARS
  ivec3 root = ivec3(sqrt(clamp(albedo, 0.0, 1.0)) * 255.0 + 0.5);
  uint packed_color = uint(root.x | root.y << 8 | root.z << 16);
#endif
  result = uvec2(uint(code.x | code.y << 16), packed_color | mark_bits);
#else
  float n_v = dot(n, v), n_l = dot(n, to_light), v_l = dot(v, to_light), n_up = dot(n, up);
  float nv = max(n_v, 1e-3), nl = max(n_l, 0.0);
  float light = nl;
#ifdef SHADOW
  // Looked up off the surface by the filter's reach, the more the more the light grazes: no surface shadows itself.
  vec3 seen = light_position + light_turn * (n * (shadow_reach * sqrt(max(1.0 - n_l * n_l, 0.0))));
  vec2 moments = texture(shadow, seen.xy * shadow_part.xy + shadow_part.zw).rg;
  float warped = exp(shadow_warp * (clamp(seen.z, 0.0, 1.0) - 0.5));
  float variance = max(moments.y - moments.x * moments.x, 1e-5 * warped * warped);
  float off = warped - moments.x;
  float lit = off <= 0.0 ? 1.0 : variance / (variance + off * off);
#ifdef CUT
  if (gl_FrontFacing)
#endif
  light *= clamp((lit - 0.25) / 0.75, 0.0, 1.0);
#endif
  // Surroundings: sky above, warm floor below, and a faint light from the viewer so that no side is black; then the key light.
  float diffuse = diffuse_terms.x + diffuse_terms.y * n_up + diffuse_terms.z * nv + diffuse_terms.w * light;

#ifdef STUDIO
  float nearness = dot(falloff, vec3(gl_FragCoord.xy, 1.0));
  diffuse *= nearness;
#endif
#ifndef MATT
  // Highlight; h is the direction half way between light and viewer.
  float inverse = inversesqrt(max(2.0 + 2.0 * v_l, 1e-6));
  float nh = max((n_l + n_v) * inverse, 0.0), vh = (1.0 + v_l) * inverse;
  float d = nh * nh * (gloss.x * gloss.x - 1.0) + 1.0;
  float lobe = min(gloss.y / (d * d * max(mix(2.0 * nl * nv, nl + nv, gloss.x), 1e-3)), 4.0) * light * gloss.z;
  float grazing = max(1.0 - vh, 0.0), g2 = grazing * grazing, g5 = g2 * g2 * grazing;

#ifdef STUDIO
  lobe *= nearness;
#endif
  // Reflected surroundings: sharper horizon for smooth surfaces.
  float horizon = clamp(0.5 + (2.0 * n_v * n_up - dot(v, up)) * mirror_terms.x, 0.0, 1.0);
#ifdef STUDIO
  float box = clamp((2.0 * n_v * n_l - v_l - boxes.x) * boxes.y, 0.0, 1.0);
  float across = 2.0 * n_v * dot(n, side) - dot(v, side);
  float strip = clamp((max(across, -0.9 * across) - boxes.z) * boxes.w, 0.0, 1.0);  // one on each side, the farther one smaller
  float sky = 0.30 + 0.45 * horizon * horizon * (3.0 - 2.0 * horizon);  // the floor is lit too, as in the picture
  float mirrored = (sky + box_strength * (box * box * (3.0 - 2.0 * box) + 0.45 * strip * strip * (3.0 - 2.0 * strip))) * gloss.w * nearness;
#else
  float mirrored = (0.42 + 0.58 * horizon * horizon * (3.0 - 2.0 * horizon)) * gloss.w;
#endif
#endif
  float rim = 1.0 - nv, r2 = rim * rim;
#ifdef MATT
  vec3 lit_color = albedo * diffuse;
#else
  float r5 = r2 * r2 * rim;
#ifdef METAL
  vec3 f0 = mix(vec3(0.04), albedo, mirror_terms.z);
  vec3 lit_color = albedo * diffuse + (f0 + (1.0 - f0) * g5) * lobe + (f0 + (max(vec3(mirror_terms.y), f0) - f0) * r5) * mirrored;
#else
  vec3 lit_color = albedo * diffuse + (0.04 + 0.96 * g5) * lobe + (0.04 + (mirror_terms.y - 0.04) * r5) * mirrored;
#endif
#endif
#if defined(SCALARS) && defined(ISOLINES)
  // Lines where bands would meet, a pixel and a half wide; where they are closer than that they fade.
  float band = scalar_at * isolines, per_sample = max(fwidth(band), 1e-9);
  float line_at = clamp(line_half + 0.5 - abs(band - floor(band + 0.5)) / per_sample, 0.0, 1.0);
  if (band > 0.5 && band < isolines - 0.5) lit_color *= 1.0 - 0.75 * line_at * clamp(1.0 / (4.0 * per_sample * line_half) - 0.5, 0.0, 1.0);
#endif
  // Soft shoulder above 0.8 only.
  vec3 over = clamp(lit_color - 0.8, 0.0, 0.4);
  lit_color = min(lit_color, 0.8) + over * (1.0 - 1.25 * over);
#ifdef EDGES
  vec3 slope = max(vec3(length(vec2(dFdx(corner_at.x), dFdy(corner_at.x))), length(vec2(dFdx(corner_at.y), dFdy(corner_at.y))),
                        length(vec2(dFdx(corner_at.z), dFdy(corner_at.z)))), vec3(1e-6));
  vec3 away = corner_at / slope;
  // Small triangles get thinner lines, an eighth of their height on each side: wires thin out with the distance like drawn ones.
#ifdef WIRES
  // Without a body behind them they must not vanish.
  vec3 thin = min(vec3(edge_width), 0.16 / slope);
  vec3 lines = clamp(thin + 0.5 - away, 0.0, 1.0) * min(0.1 + 2.0 * thin, 1.0);
#else
  vec3 thin = min(vec3(edge_width), 0.125 / slope);
  vec3 lines = clamp(thin + 0.5 - away, 0.0, 1.0) * min(2.0 * thin, 1.0);
#endif
  float line = max(max(lines.x, lines.y), lines.z);
  lit_color = mix(lit_color, edge_color, line * 0.85);
#endif
#if defined(WIRES)
  result = vec4(sqrt(edge_color), line * mark.y);
#elif defined(GHOST)
  // A shell of glass: denser and darker where it is seen edge on.
  float edge_on = r2 * (3.0 - 2.0 * rim);
  result = vec4(sqrt(mix(lit_color, albedo * 0.55, 0.6 * edge_on)), clamp(mark.y * mix(0.9, 2.2, edge_on), 0.0, 1.0));
#else
  result = vec4(sqrt(lit_color), mark_at);
#endif
#endif
#endif
}
)";

const char* const cover_vertex = R"(
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }
)";

const char* const line_vertex = R"(
layout(location = 0) in vec3 first;
layout(location = 1) in vec3 second;
layout(location = 2) in vec4 first_color;
layout(location = 3) in vec4 second_color;
uniform mat4 view_from_surface;
uniform mat4 clip_from_view;
uniform vec2 viewport;
uniform float half_width;
uniform float near;
uniform float pull;
uniform float orthographic;
flat out vec4 ends;
out vec4 color_at;
#ifdef CUT
uniform vec4 cut_plane;
out float cut_at;
#endif
void main() {
  vec3 a = (view_from_surface * vec4(first, 1.0)).xyz, b = (view_from_surface * vec4(second, 1.0)).xyz;
  vec4 ca = first_color, cb = second_color;
  // Cut at the near plane, where there is no screen position.
  if (a.z > -near && b.z < -near) { float t = (a.z + near) / (a.z - b.z); a = mix(a, b, t); ca = mix(ca, cb, t); }
  else if (b.z > -near && a.z < -near) { float t = (b.z + near) / (b.z - a.z); b = mix(b, a, t); cb = mix(cb, ca, t); }
  // Pulled a little towards the viewer: lines on a surface lie on top of it.
  if (orthographic > 0.5) { a.z += pull; b.z += pull; } else { a *= 1.0 - pull; b *= 1.0 - pull; }
  vec4 pa = clip_from_view * vec4(a, 1.0), pb = clip_from_view * vec4(b, 1.0);
  vec2 sa = (pa.xy / pa.w * 0.5 + 0.5) * viewport, sb = (pb.xy / pb.w * 0.5 + 0.5) * viewport;
  vec2 along = sb - sa;
  float length_px = length(along);
  along = length_px > 1e-6 ? along / length_px : vec2(1.0, 0.0);
  vec2 across = vec2(-along.y, along.x);
  bool far_end = gl_VertexID == 1 || gl_VertexID == 2 || gl_VertexID == 4;
  float side = gl_VertexID == 0 || gl_VertexID == 1 || gl_VertexID == 3 ? -1.0 : 1.0;
  vec2 corner = (far_end ? sb + along * (half_width + 1.0) : sa - along * (half_width + 1.0)) + across * side * (half_width + 1.0);
  vec4 p = far_end ? pb : pa;
  gl_Position = vec4((corner / viewport * 2.0 - 1.0) * p.w, p.z, p.w);
  if (a.z > -near * 0.999 && b.z > -near * 0.999 && orthographic < 0.5) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  ends = vec4(sa, sb);
  color_at = far_end ? cb : ca;
#ifdef CUT
  cut_at = dot(cut_plane, vec4(far_end ? second : first, 1.0));
#endif
}
)";

const char* const line_fragment = R"(
flat in vec4 ends;
in vec4 color_at;
uniform float half_width;
uniform vec2 origin;
uniform vec2 mark;
#ifdef CUT
in float cut_at;
#endif
out vec4 result;
vec3 to_linear(vec3 s) { return s * (s * (s * 0.305306011 + 0.682171111) + 0.012522878); }
void main() {
  // Distance from the segment: round ends join a polyline without gaps.
  vec2 p = gl_FragCoord.xy - origin - ends.xy, d = ends.zw - ends.xy;
  float along = dot(p, d) / max(dot(d, d), 1e-6), t = clamp(along, 0.0, 1.0);
  if (length(p - d * t) > half_width) discard;
#ifdef CUT
  if (cut_at > 0.0) discard;
#endif
#ifdef BUTT
  if (along != t) discard;  // round ends would be blended twice
#endif
#ifdef GHOST
  result = vec4(sqrt(to_linear(color_at.rgb)), color_at.a);
#else
  result = vec4(sqrt(to_linear(color_at.rgb)), mark.x);
#endif
}
)";

const char* const marker_vertex = R"(
layout(location = 0) in vec3 point;
uniform mat4 view_from_surface;
uniform mat4 clip_from_view;
uniform vec2 viewport;
uniform float half_width;
uniform float near;
uniform float pixel;
uniform float orthographic;
out vec2 at;
void main() {
  vec3 v = (view_from_surface * vec4(point, 1.0)).xyz;
  // Towards the viewer by its own radius, as a ball around the point would reach.
  float radius = half_width * pixel * (orthographic > 0.5 ? 1.0 : -v.z);
  bool behind = orthographic < 0.5 && v.z > -near;
  if (orthographic > 0.5) v.z += radius; else v *= max(0.0, 1.0 + radius / min(v.z, -1e-20));
  vec4 p = clip_from_view * vec4(v, 1.0);
  vec2 corner = vec2(gl_VertexID == 1 || gl_VertexID == 2 || gl_VertexID == 4 ? 1.0 : -1.0,
                     gl_VertexID == 0 || gl_VertexID == 1 || gl_VertexID == 3 ? -1.0 : 1.0);
  at = corner * (half_width + 1.0) / half_width;
  gl_Position = behind ? vec4(2.0, 2.0, 2.0, 1.0) : vec4(p.xy + corner * (half_width + 1.0) * 2.0 / viewport * p.w, p.z, p.w);
}
)";

const char* const marker_fragment = R"(
in vec2 at;
uniform vec4 color;
uniform int shape;
uniform vec2 mark;
out vec4 result;
void main() {
  float r = length(at);
  vec3 c = color.rgb;
  if (shape == 0) {
    if (r > 1.0) discard;
    vec3 n = vec3(at, sqrt(1.0 - r * r));
    float light = 0.55 + 0.6 * max(dot(n, normalize(vec3(-0.5, 0.7, 0.6))), 0.0);
    vec3 h = normalize(vec3(-0.5, 0.7, 1.6));
    c = min(c * light + 0.35 * pow(max(dot(n, h), 0.0), 40.0), 1.0);
  } else if (shape == 1) {
    if (r > 1.0) discard;
  } else if (shape == 2) {
    if (r > 1.0 || r < 0.58) discard;
  } else if (shape == 3) {
    if (max(abs(at.x), abs(at.y)) > 0.86) discard;
  } else {
    if (max(abs(at.x), abs(at.y)) > 1.0 || min(abs(at.x + at.y), abs(at.x - at.y)) > 0.42) discard;
  }
#ifdef GHOST
  result = vec4(sqrt(c), color.a);
#else
  result = vec4(sqrt(c), mark.x);
#endif
}
)";

}  // namespace flexframe::render
