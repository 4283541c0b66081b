// Shading is in linear light in the camera's frame; the framebuffer encodes to sRGB.
// Microfacet highlight: Walter, Marschner, Li, Torrance, "Microfacet models for refraction through rough surfaces", 2007 (GGX);
// visibility term: Hammon, "PBR diffuse lighting for GGX+Smith microsurfaces", 2017 (height-correlated approximation);
// shadows: Lauritzen, McCool, "Layered variance shadow maps", 2008 (exponential warp).
#include "render/shaders.h"

namespace flexframe::render {

const char* const surface_vertex = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in float scalar;
layout(location = 3) in vec3 color;
layout(location = 4) in vec3 corner;
uniform mat4 view_from_surface;
uniform mat4 clip_from_view;
invariant gl_Position;
#ifndef DEPTH_ONLY
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
#endif
void main() {
  vec4 v = view_from_surface * vec4(position, 1.0);
  gl_Position = clip_from_view * v;
#ifndef DEPTH_ONLY
  float s = 0.0;
#ifdef SCALARS
  s = scalar * scalar_scale.x + scalar_scale.y;
#endif
#ifdef NORMALS
  normal_scalar = vec4(view_normal * normal, s);
#else
  position_scalar = vec4(v.xyz, s);
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
#endif
}
)";

const char* const surface_fragment = R"(
#ifdef DEPTH_ONLY
void main() {}
#else
#ifdef NORMALS
in vec4 normal_scalar;
#else
in vec4 position_scalar;
#endif
#ifdef SCALARS
uniform sampler2D colors;
uniform float levels;
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
in vec3 light_position;
uniform sampler2D shadow;
uniform float shadow_warp;
uniform mat3 light_turn;
uniform float shadow_reach;
#endif
uniform vec3 base_color;
uniform vec3 to_light;
uniform vec3 up;
uniform vec3 strength;
uniform vec3 surface;
uniform vec4 ray;  // direction to the viewer: (scale.xy * gl_FragCoord.xy + offset.xy, 1)
uniform vec2 mark;
out vec4 result;

vec3 to_linear(vec3 s) { return s * (s * (s * 0.305306011 + 0.682171111) + 0.012522878); }

void main() {
#ifdef SCALARS
#ifdef NORMALS
  float scalar_at = normal_scalar.w;
#else
  float scalar_at = position_scalar.w;
#endif
#endif
#ifdef SCALAR_OUTPUT
#ifdef SCALARS
  result = vec4(clamp(scalar_at, 0.0, 1.0), 0.0, 0.0, 1.0);
#else
  result = vec4(2.0, 0.0, 0.0, 1.0);
#endif
#else
  vec3 v = normalize(vec3(ray.xy * gl_FragCoord.xy + ray.zw, 1.0));
#ifdef NORMALS
  vec3 n = normalize(normal_scalar.xyz);
#else
  vec3 n = normalize(cross(dFdx(position_scalar.xyz), dFdy(position_scalar.xyz)));
#endif
#ifdef TWO_SIDED
  // The side that is seen, by the normal itself: it needs no winding.
  if (dot(n, v) < 0.0) n = -n;
#endif
#ifdef SCALARS
  float s = clamp(scalar_at, 0.0, 1.0);
  if (levels > 1.5) s = (min(floor(s * levels), levels - 1.0) + 0.5) / levels;
  vec3 albedo = scalar_at == scalar_at ? texture(colors, vec2((s * 255.0 + 0.5) / 256.0, 0.5)).rgb : vec3(0.21);
#elif defined(COLORS)
  vec3 albedo = to_linear(color_at);
#else
  vec3 albedo = base_color;
#endif
  float roughness = surface.x, metallic = surface.y, modulation = surface.z;
  float nv = max(dot(n, v), 1e-3);
  float nl = dot(n, to_light);
  float light = clamp(nl, 0.0, 1.0);
#ifdef SHADOW
  // Looked up off the surface by the filter's reach, the more the more the light grazes: no surface shadows itself.
  vec3 seen = light_position + light_turn * (n * (shadow_reach * sqrt(max(1.0 - nl * nl, 0.0))));
  vec2 moments = texture(shadow, seen.xy).rg;
  float warped = exp(shadow_warp * (clamp(seen.z, 0.0, 1.0) - 0.5));
  float variance = max(moments.y - moments.x * moments.x, 1e-5 * warped * warped);
  float off = warped - moments.x;
  float lit = off <= 0.0 ? 1.0 : variance / (variance + off * off);
  lit = clamp((lit - 0.25) / 0.75, 0.0, 1.0);
  if (any(lessThan(seen.xy, vec2(0.0))) || any(greaterThan(seen.xy, vec2(1.0)))) lit = 1.0;
  light *= lit;
#endif
  // Surroundings: sky above, warm floor below, and a faint light from the viewer so that no side is black.
  float sky = 0.5 + 0.5 * dot(n, up);
  float ambient = mix(0.30, 0.62, sky) * strength.y;
  float fill = 0.16 * strength.y * nv;
  float diffuse = ambient + fill + 0.62 * strength.x * light;

  // Highlight.
  vec3 h = normalize(to_light + v);
  float nh = max(dot(n, h), 0.0), vh = max(dot(v, h), 0.0);
  float a = roughness * roughness, a2 = a * a;
  float d = nh * nh * (a2 - 1.0) + 1.0;
  float visibility = 0.5 / max(mix(2.0 * max(nl, 0.0) * nv, max(nl, 0.0) + nv, a), 1e-3);
  vec3 f0 = mix(vec3(0.04), albedo, metallic);
  float grazing = 1.0 - vh; float g2 = grazing * grazing;
  vec3 fresnel = f0 + (1.0 - f0) * g2 * g2 * grazing;
  float lobe = min(a2 / (3.14159265 * d * d) * visibility, 4.0) * light * strength.x * 0.9;

  // Reflected surroundings: sharper horizon for smooth surfaces.
  vec3 r = reflect(-v, n);
  float edge = mix(0.08, 1.0, roughness);
  float horizon = clamp(0.5 + dot(r, up) / (2.0 * edge), 0.0, 1.0);
  float mirrored = mix(0.42, 1.0, horizon * horizon * (3.0 - 2.0 * horizon)) * strength.y;
  float rim = 1.0 - nv; float r2 = rim * rim;
  vec3 mirror = f0 + (max(vec3(1.0 - roughness), f0) - f0) * r2 * r2 * rim;

  // Light only modulates colour-mapped surfaces: the colours stay those of the scalar bar.
  diffuse = mix(1.0, diffuse, modulation);
  vec3 lit_color = albedo * (1.0 - metallic) * diffuse + (fresnel * lobe + mirror * mirrored) * mix(0.35, 1.0, step(0.99, modulation));
  // Soft shoulder above 0.8 only.
  vec3 over = max(lit_color - 0.8, 0.0);
  lit_color = min(lit_color, 0.8) + over / (1.0 + over * 5.0);
#ifdef EDGES
  vec3 slope = max(vec3(length(vec2(dFdx(corner_at.x), dFdy(corner_at.x))), length(vec2(dFdx(corner_at.y), dFdy(corner_at.y))),
                        length(vec2(dFdx(corner_at.z), dFdy(corner_at.z)))), vec3(1e-6));
  vec3 away = corner_at / slope;
  // Lines of triangles only a few lines high fade: they would darken the whole surface.
  vec3 room = clamp((1.0 / slope - 3.0 * edge_width) / (6.0 * edge_width), 0.15, 1.0);
  vec3 lines = clamp(edge_width + 0.5 - away, 0.0, 1.0) * room;
  lit_color = mix(lit_color, edge_color, max(max(lines.x, lines.y), lines.z) * 0.85);
#endif
#ifdef GHOST
  // A shell of glass: denser and darker where it is seen edge on.
  float edge_on = r2 * (3.0 - 2.0 * rim);
  result = vec4(mix(lit_color, albedo * 0.55, 0.6 * edge_on), clamp(mark.y * mix(0.9, 2.2, edge_on), 0.0, 1.0));
#else
  result = vec4(lit_color, mark.x);
#endif
#endif
}
#endif
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
}
)";

const char* const line_fragment = R"(
flat in vec4 ends;
in vec4 color_at;
uniform float half_width;
uniform vec2 origin;
uniform vec2 mark;
out vec4 result;
vec3 to_linear(vec3 s) { return s * (s * (s * 0.305306011 + 0.682171111) + 0.012522878); }
void main() {
  // Distance from the segment: round ends join a polyline without gaps.
  vec2 p = gl_FragCoord.xy - origin - ends.xy, d = ends.zw - ends.xy;
  float t = clamp(dot(p, d) / max(dot(d, d), 1e-6), 0.0, 1.0);
  if (length(p - d * t) > half_width) discard;
#ifdef GHOST
  result = vec4(to_linear(color_at.rgb), color_at.a);
#else
  result = vec4(to_linear(color_at.rgb), mark.x);
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
  result = vec4(c, color.a);
#else
  result = vec4(c, mark.x);
#endif
}
)";

}  // namespace flexframe::render
