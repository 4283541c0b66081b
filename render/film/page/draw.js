// WebGL 2. Bodies keep their undeformed vertices and the shapes of their deformation on the card; a picture sends poses and weights.

const shape_width = 2048;  // texels a row of the textures that hold shapes
const most_shapes = 64;

// Once for each time and colour: the displacement, its rate, the change of the normal and the value of every point, kept in a buffer that
// all passes read.
const deform_shader = `#version 300 es
precision highp float;
precision highp int;
precision highp isampler2D;
uniform isampler2D shapes, turns, values;
uniform int shape_count, value_count, points, parts;  // parts of the value: 0 a number, else so many vectors whose length it is
uniform vec4 weights[${most_shapes}];  // of displacement, of normals, of the value, of the displacement's rate
out vec3 moved, turn, rate;
out float number;
void main() {
  moved = turn = rate = vec3(0.0);
  for (int k = 0; k < shape_count; ++k) {
    int i = k * points + gl_VertexID;
    ivec2 texel = ivec2(i % ${shape_width}, i / ${shape_width});
    vec3 shape = vec3(texelFetch(shapes, texel, 0).xyz);
    moved += weights[k].x * shape;
    rate += weights[k].w * shape;
    turn += weights[k].y * vec3(texelFetch(turns, texel, 0).xyz);
  }
  vec3 first = vec3(0.0), second = vec3(0.0);
  for (int k = 0; k < value_count; ++k) {
    int i = (k * points + gl_VertexID) * max(parts, 1);
    first += weights[k].z * vec3(texelFetch(values, ivec2(i % ${shape_width}, i / ${shape_width}), 0).xyz);
    ++i;
    if (parts == 2) second += weights[k].z * vec3(texelFetch(values, ivec2(i % ${shape_width}, i / ${shape_width}), 0).xyz);
  }
  number = parts > 0 ? sqrt(dot(first, first) + dot(second, second)) : first.x;
  gl_Position = vec4(0.0);
}`;
const nothing_shader = `#version 300 es
precision highp float;
out vec4 result;
void main() { result = vec4(0.0); }`;

const vertex_shader = `#version 300 es
precision highp float;
precision highp int;
layout(location = 0) in vec3 point;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 color;
layout(location = 3) in vec3 moved;
layout(location = 4) in vec3 turn;
layout(location = 5) in float number;
layout(location = 6) in vec3 rate;
uniform mat4 world, eye, drift;  // drift: what the frame changes by in a second
uniform int shown;  // 0 own colour, 1 length of the displacement, 2 the value, 3 zero, 4 speed
uniform float scale;
uniform bool shadow;
uniform vec3 light, ground_point, ground_normal;
out vec3 at, turned, own;
out float value;
void main() {
  value = shown == 1 ? length(moved) : shown == 2 ? number : 0.0;
  if (shown == 4) value = length((drift * vec4(point + moved, 1.0)).xyz + mat3(world) * rate);
  vec4 p = world * vec4(point + scale * moved, 1.0);
  turned = mat3(world) * (normal + scale * turn);
  own = color;
  if (shadow) p.xyz -= light * dot(p.xyz - ground_point, ground_normal) / dot(light, ground_normal);
  at = p.xyz;
  gl_Position = eye * p;
}`;

const fragment_shader = `#version 300 es
precision highp float;
precision highp int;
in vec3 at, turned, own;
in float value;
uniform vec3 camera, light, up, color;
uniform vec4 cut;  // normal and place; normal 0: nothing is cut
uniform float opacity, metallic, lower, upper;
uniform int shown, levels;
uniform bool logarithmic, flat_color, orthographic;
uniform sampler2D map;
out vec4 result;
vec3 to_linear(vec3 c) { return pow(c, vec3(2.2)); }
void main() {
  if (dot(cut.xyz, at) > cut.w) discard;
  if (flat_color) { result = vec4(color, opacity); return; }
  vec3 own_color = own.x >= 0.0 ? own : color;
  if (shown > 0) {
    float share = logarithmic ? log(max(value, 1e-30) / lower) / log(upper / lower) : (value - lower) / max(upper - lower, 1e-30);
    share = clamp(share, 0.0, 1.0);
    if (levels > 1) share = (min(floor(share * float(levels)), float(levels) - 1.0) + 0.5) / float(levels);
    own_color = texture(map, vec2((share * 255.0 + 0.5) / 256.0, 0.5)).rgb;
  }
  vec3 n = normalize(turned), eye = orthographic ? normalize(camera) : normalize(camera - at);
  bool inside = dot(n, eye) < 0.0;
  if (inside) n = -n;
  if (inside && dot(cut.xyz, cut.xyz) > 0.0) { result = vec4(own_color * 0.72, opacity); return; }
  float key = max(dot(n, light), 0.0), sky = 0.5 + 0.5 * dot(n, up);
  vec3 half_way = normalize(light + eye);
  float shine = pow(max(dot(n, half_way), 0.0), metallic > 0.5 ? 24.0 : 48.0);
  vec3 albedo = to_linear(own_color);
  vec3 lit = albedo * (0.62 * key + mix(0.22, 0.52, sky)) + mix(vec3(0.10), albedo, metallic) * shine * (metallic > 0.5 ? 0.7 : 0.35);
  result = vec4(pow(min(lit, vec3(1.0)), vec3(1.0 / 2.2)), opacity);
}`;

const ground_vertex = `#version 300 es
precision highp float;
uniform mat4 eye;
uniform vec3 ground_point, across, along;
uniform float reach;
out vec2 place;
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  place = corner * reach;
  gl_Position = eye * vec4(ground_point + place.x * across + place.y * along, 1.0);
}`;
const ground_fragment = `#version 300 es
precision highp float;
in vec2 place;
uniform float spacing, reach;
uniform vec3 color;
out vec4 result;
void main() {
  vec2 g = place / spacing, w = fwidth(g), d = abs(fract(g - 0.5) - 0.5) / w;
  float line = (1.0 - min(min(d.x, d.y), 1.0)) * clamp(0.5 / max(w.x, w.y), 0.0, 1.0);
  float fade = max(1.0 - length(place) / reach, 0.0);
  result = vec4(color, 0.7 * line * fade * fade);
}`;

// kept: outputs of the vertex shader that go to a buffer.
function make_program(gl, vertex, fragment, kept) {
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  if (kept) gl.transformFeedbackVaryings(program, kept, gl.INTERLEAVED_ATTRIBS);
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  const at = {};
  for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); ++i) {
    const name = gl.getActiveUniform(program, i).name.replace('[0]', '');
    at[name] = gl.getUniformLocation(program, name);
  }
  return { program, at };
}

// Whole numbers of three (or one) a texel, as a texture of fixed width.
function make_texture(gl, values, width) {
  const texels = values.length / width, rows = Math.max(1, Math.ceil(texels / shape_width));
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  const [inner, outer] = width === 1 ? [gl.R16I, gl.RED_INTEGER] : [gl.RGBA16I, gl.RGBA_INTEGER], channels = width === 1 ? 1 : 4;
  const all = new Int16Array(rows * shape_width * channels);
  for (let i = 0; i < texels; ++i)
    for (let c = 0; c < width; ++c) all[channels * i + c] = values[width * i + c];
  gl.texImage2D(gl.TEXTURE_2D, 0, inner, shape_width, rows, 0, outer, gl.SHORT, all);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  return texture;
}

function make_buffer(gl, kind, values) {
  const buffer = gl.createBuffer();
  gl.bindBuffer(kind, buffer);
  gl.bufferData(kind, values, gl.STATIC_DRAW);
  return buffer;
}

function attribute(gl, place, values) {
  make_buffer(gl, gl.ARRAY_BUFFER, values);
  gl.enableVertexAttribArray(place);
  gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
}

// What the card keeps of a body.
function load_body(gl, array, body) {
  const n = body.points, points = new Float32Array(3 * n), normals = new Float32Array(3 * n);
  const rest = array(body.rest), directions = array(body.normals);
  for (let i = 0; i < 3 * n; ++i) {
    points[i] = body.rest_low[i % 3] + rest[i] * body.rest_step[i % 3];
    normals[i] = directions[i] / 32767;
  }
  const model = {
    body, vertices: gl.createVertexArray(), visible: body.visible, moving: array(body.position), turning: array(body.rotation),
  };
  gl.bindVertexArray(model.vertices);
  attribute(gl, 0, points);
  attribute(gl, 1, normals);
  if (body.colors) attribute(gl, 2, Float32Array.from(array(body.colors), x => x / 255));
  model.triangles = make_buffer(gl, gl.ELEMENT_ARRAY_BUFFER, array(body.triangles));
  gl.bindVertexArray(null);
  if (body.creases) model.creases = make_buffer(gl, gl.ELEMENT_ARRAY_BUFFER, array(body.creases));
  if (body.shapes) {
    model.weights = array(body.weights);
    model.shapes = make_texture(gl, array(body.shape_data), 3);
    model.turns = make_texture(gl, array(body.turn_data), 3);
  }
  if (body.drift) model.drift = array(body.drift);
  if (body.rates) model.rates = array(body.rates);
  // What each colour makes of it; the joints' solids have none.
  model.looks = (body.looks || []).map(look => look.values
    ? { ...look, weights: array(look.value_weights), texture: make_texture(gl, array(look.value_data), look.parts ? 3 : 1) } : look);
  if (body.shapes || model.looks.some(look => look.values)) {
    gl.bindVertexArray(model.vertices);
    model.deformed = make_buffer(gl, gl.ARRAY_BUFFER, new Float32Array(10 * n));
    for (const [place, width, from] of [[3, 3, 0], [4, 3, 12], [6, 3, 24], [5, 1, 36]]) {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, width, gl.FLOAT, false, 40, from);
    }
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ARRAY_BUFFER, null);
  }
  return model;
}

function make_painter(canvas, scene, array) {
  const gl = canvas.getContext('webgl2', { antialias: true, alpha: true, stencil: true, preserveDrawingBuffer: true });
  if (!gl) return null;
  const paint = make_program(gl, vertex_shader, fragment_shader), floor = make_program(gl, ground_vertex, ground_fragment);
  const deform = make_program(gl, deform_shader, nothing_shader, ['moved', 'turn', 'rate', 'number']);
  gl.vertexAttrib3f(2, -1, 0, 0);  // of what has no colours of its own
  gl.vertexAttrib3f(3, 0, 0, 0);  // and of what does not deform
  gl.vertexAttrib3f(4, 0, 0, 0);
  gl.vertexAttrib1f(5, 0);
  gl.vertexAttrib3f(6, 0, 0, 0);
  const models = scene.bodies.map(body => load_body(gl, array, body));
  const none = make_texture(gl, new Int16Array(4), 1), none3 = make_texture(gl, new Int16Array(3), 3);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  const make_map = colours => {
    const map = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, map);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, 256, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, colours);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    return map;
  };
  const maps = scene.colours.map(colour => make_map(array(colour.map))), no_map = make_map(new Uint8Array(3 * 256));
  const traces = scene.traces.map(t => ({ ...t, points: array(t.points) }));
  const springs = scene.springs.map(s => ({ ...s, ends: array(s.ends) }));
  const line_vertices = gl.createVertexArray(), line_buffer = gl.createBuffer();
  gl.bindVertexArray(line_vertices);
  gl.bindBuffer(gl.ARRAY_BUFFER, line_buffer);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
  gl.bindVertexArray(null);
  const up = unit(scene.camera.up);

  function bind_texture(program, place, name, texture) {
    gl.activeTexture(gl.TEXTURE0 + place);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.uniform1i(program.at[name], place);
  }

  // Bodies whose deformation in their buffer is that of another time or colour.
  function deform_bodies(shown, at, colour) {
    const late = shown.filter(({ model }) =>
      model.deformed && (model.k !== at.k || model.share !== at.share || model.colour !== colour));
    if (!late.length) return;
    gl.useProgram(deform.program);
    gl.bindVertexArray(null);
    gl.enable(gl.RASTERIZER_DISCARD);
    for (const { model } of late) {
      const body = model.body, look = model.looks[colour] || {}, all = new Float32Array(4 * most_shapes);
      if (body.shapes) blend(model.weights, body.shapes, at).forEach((w, k) => {
        all[4 * k] = w * body.shape_step[k];
        all[4 * k + 1] = w * body.turn_step[k];
      });
      if (look.values) blend(look.weights, look.values, at).forEach((w, k) => { all[4 * k + 2] = w * look.value_step[k]; });
      if (look.shown === 4 && model.rates)
        blend(model.rates, body.shapes, at).forEach((w, k) => { all[4 * k + 3] = w * body.shape_step[k]; });
      gl.uniform4fv(deform.at.weights, all);
      gl.uniform1i(deform.at.shape_count, body.shapes || 0);
      gl.uniform1i(deform.at.value_count, look.values || 0);
      gl.uniform1i(deform.at.parts, look.parts || 0);
      gl.uniform1i(deform.at.points, body.points);
      bind_texture(deform, 1, 'shapes', model.shapes || none3);
      bind_texture(deform, 2, 'turns', model.turns || none3);
      bind_texture(deform, 3, 'values', look.texture || none);
      gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, model.deformed);
      gl.beginTransformFeedback(gl.POINTS);
      gl.drawArrays(gl.POINTS, 0, body.points);
      gl.endTransformFeedback();
      gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, null);
      model.k = at.k;
      model.share = at.share;
      model.colour = colour;
    }
    gl.disable(gl.RASTERIZER_DISCARD);
  }

  // look.colour: an index among the scene's colours, -1: its own.
  function draw_body(model, world, look) {
    const body = model.body, shown = look.color ? 0 : model.looks[look.colour]?.shown || 0;
    gl.uniformMatrix4fv(paint.at.world, false, world);
    gl.uniform1f(paint.at.scale, look.scale);
    gl.uniform3fv(paint.at.color, look.color || body.color);
    gl.uniform1f(paint.at.opacity, look.opacity);
    gl.uniform1f(paint.at.metallic, body.metallic || 0);
    gl.uniform1i(paint.at.shown, shown);
    if (shown === 4) {
      const d = blend(model.drift, 12, look.at);
      gl.uniformMatrix4fv(paint.at.drift, false, [...d.slice(0, 3), 0, ...d.slice(3, 6), 0, ...d.slice(6, 9), 0, ...d.slice(9, 12), 0]);
    }
    gl.uniform1i(paint.at.flat_color, look.color ? 1 : 0);
    gl.bindVertexArray(model.vertices);
    if (look.lines) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, model.creases);
      gl.drawElements(gl.LINES, body.creases.n, gl.UNSIGNED_INT, 0);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, model.triangles);
    } else {
      gl.drawElements(gl.TRIANGLES, body.triangles.n, gl.UNSIGNED_INT, 0);
    }
  }

  function draw_lines(points, color, strip) {
    gl.bindVertexArray(line_vertices);
    gl.vertexAttrib3f(1, 0, 0, 1);
    gl.bindBuffer(gl.ARRAY_BUFFER, line_buffer);
    gl.bufferData(gl.ARRAY_BUFFER, points, gl.STREAM_DRAW);
    gl.uniformMatrix4fv(paint.at.world, false, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
    gl.uniform1i(paint.at.shown, 0);
    gl.uniform1i(paint.at.flat_color, 1);
    gl.uniform1f(paint.at.opacity, 1);
    gl.uniform3fv(paint.at.color, color);
    gl.drawArrays(strip ? gl.LINE_STRIP : gl.LINES, 0, points.length / 3);
  }

  // A helix between two points, as many turns as suit its rest.
  function coil(spring, at) {
    const [a, b] = [0, 3].map(i => blend(spring.ends, 6, at).slice(i, i + 3));
    const way = subtract(b, a), axis = unit(way), side = unit(cross(axis, Math.abs(axis[0]) < 0.8 ? [1, 0, 0] : [0, 1, 0]));
    const other = cross(axis, side), steps = 160, points = new Float32Array(3 * (steps + 1));
    for (let i = 0; i <= steps; ++i) {
      const s = i / steps, end = Math.min(s, 1 - s) < 0.08, angle = 2 * Math.PI * 8 * s, r = end ? 0 : spring.radius;
      points.set(add(add(a, times(s, way)), add(times(r * Math.cos(angle), side), times(r * Math.sin(angle), other))), 3 * i);
    }
    return points;
  }

  function set_common(state, eye) {
    gl.useProgram(paint.program);
    gl.uniformMatrix4fv(paint.at.eye, false, eye);
    const camera = state.camera.height ? unit(subtract(state.camera.position, state.camera.target)) : state.camera.position;
    gl.uniform3fv(paint.at.camera, camera);
    gl.uniform1i(paint.at.orthographic, state.camera.height ? 1 : 0);
    gl.uniform3fv(paint.at.light, scene.light);
    gl.uniform3fv(paint.at.up, up);
    gl.uniform4fv(paint.at.cut, state.cut || [0, 0, 0, 0]);
    gl.uniform1i(paint.at.shadow, 0);
    if (scene.ground) {
      gl.uniform3fv(paint.at.ground_point, scene.ground.point);
      gl.uniform3fv(paint.at.ground_normal, scene.ground.normal);
    }
    const colour = scene.colours[state.colour];
    if (colour) {
      gl.uniform1f(paint.at.lower, colour.lower);
      gl.uniform1f(paint.at.upper, colour.upper);
      gl.uniform1i(paint.at.levels, colour.levels);
      gl.uniform1i(paint.at.logarithmic, colour.logarithmic ? 1 : 0);
    }
    bind_texture(paint, 0, 'map', maps[state.colour] || no_map);
  }

  function draw_ground(state, eye) {
    const normal = unit(scene.ground.normal);
    const across = unit(cross(normal, Math.abs(normal[0]) < 0.8 ? [1, 0, 0] : [0, 0, 1])), along = cross(normal, across);
    gl.useProgram(floor.program);
    gl.uniformMatrix4fv(floor.at.eye, false, eye);
    gl.uniform3fv(floor.at.ground_point, scene.ground.point);
    gl.uniform3fv(floor.at.across, across);
    gl.uniform3fv(floor.at.along, along);
    gl.uniform1f(floor.at.reach, scene.ground.reach);
    gl.uniform1f(floor.at.spacing, scene.ground.spacing);
    gl.uniform3fv(floor.at.color, state.dark ? [0.45, 0.5, 0.58] : [0.52, 0.57, 0.64]);
    gl.bindVertexArray(null);
    gl.depthMask(false);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.depthMask(true);
  }

  // Each spot of the ground is darkened once.
  function draw_shadows(state, shown) {
    if (dot(scene.light, scene.ground.normal) < 0.15) return;
    gl.uniform1i(paint.at.shadow, 1);
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.depthMask(false);
    const shade = state.dark ? { color: [0, 0, 0], opacity: 0.5 } : { color: [0.12, 0.15, 0.2], opacity: 0.22 };
    for (const { model, world } of shown) draw_body(model, world, { scale: state.ghost ? 1 : state.scale, ...shade });
    gl.depthMask(true);
    gl.disable(gl.STENCIL_TEST);
    gl.uniform1i(paint.at.shadow, 0);
  }

  // Only the shell that faces the viewer: depth first, then colour.
  function draw_ghost(model, world, look, rough) {
    if (!rough) draw_depth(model, world, look);
    draw_body(model, world, look);
  }
  function draw_depth(model, world, look) {
    gl.colorMask(false, false, false, false);
    draw_body(model, world, { ...look, color: [0, 0, 0] });  // nothing to light
    gl.colorMask(true, true, true, true);
  }

  return {
    models,
    body_pose: (b, at) => pose_matrix(blend(models[b].moving, 3, at), blend_turn(models[b].turning, at)),
    draw(state) {
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
      gl.enable(gl.DEPTH_TEST);
      gl.depthFunc(gl.LEQUAL);
      gl.enable(gl.BLEND);
      gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      const eye = camera_matrix(state.camera, canvas.width / canvas.height, scene.shape, state.reach);
      const shown = models.filter(m => m.visible).map(model => ({ model, world: this.body_pose(models.indexOf(model), state.at) }));
      deform_bodies(shown, state.at, state.colour);
      if (state.ground && scene.ground) draw_ground(state, eye);
      set_common(state, eye);
      if (state.ground && scene.ground && !state.rough) draw_shadows(state, shown);
      gl.enable(gl.POLYGON_OFFSET_FILL);
      gl.polygonOffset(1, 1);
      const solid_scale = state.ghost ? 1 : state.scale;
      for (const opaque of [true, false])
        for (const { model, world } of shown) {
          if ((model.body.opacity >= 1) !== opaque) continue;
          const look = { scale: solid_scale, opacity: model.body.opacity, colour: state.colour, at: state.at };
          if (opaque) draw_body(model, world, look);
          else draw_ghost(model, world, look, state.rough);
          if (opaque && model.creases && !state.plain)
            draw_body(model, world, { ...look, lines: true, color: [0.13, 0.15, 0.19], opacity: 0.75 });
        }
      gl.disable(gl.POLYGON_OFFSET_FILL);
      for (const spring of springs) draw_lines(coil(spring, state.at), [0.25, 0.28, 0.33], true);
      for (const trace of traces) {
        const last = Math.max(2, Math.round((state.t - scene.times.first) / trace.step) + 1);
        draw_lines(trace.points.subarray(0, 3 * Math.min(last, trace.points.length / 3)), trace.color, true);
      }
      if (state.ghost && state.scale !== 1)
        for (const { model, world } of shown) {
          if (!model.body.shapes) continue;
          const look = { scale: state.scale, opacity: 0.38 * model.body.opacity, colour: state.colour, at: state.at };
          draw_ghost(model, world, look, state.rough);
        }
      gl.bindVertexArray(null);
    }
  };
}
