'use strict';
// The scene and its arrays, and the motion between two pictures. Arrays lie in one block, {o: byte offset, n: count, t: type}.
// The data are unpacked by the browser (gzip); orientations are unit quaternions x y z w, world from body.

async function read_data() {
  const scene = JSON.parse(document.getElementById('scene').textContent);
  const packed = Uint8Array.from(atob(document.getElementById('data').textContent), c => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
  const block = await new Response(stream).arrayBuffer();
  const types = { f4: Float32Array, i4: Int32Array, u4: Uint32Array, i2: Int16Array, u2: Uint16Array, i1: Int8Array, u1: Uint8Array };
  const array = d => new types[d.t](block, d.o, d.n);
  return { scene, array };
}

// Place of a time among the pictures: the one before and a share of the next.
function find_picture(times, t) {
  const at = Math.min(Math.max((t - times.first) / times.step, 0), times.count - 1);
  const k = Math.min(Math.floor(at + 1e-9), times.count - 1);
  const share = Math.max(at - k, 0);
  return { k, next: Math.min(k + 1, times.count - 1), share };
}

function blend(values, width, at) {
  const out = new Array(width);
  for (let i = 0; i < width; ++i)
    out[i] = values[width * at.k + i] * (1 - at.share) + values[width * at.next + i] * at.share;
  return out;
}

// The shortest turn between two orientations (slerp).
function blend_turn(values, at) {
  const a = values.subarray(4 * at.k, 4 * at.k + 4), b = values.subarray(4 * at.next, 4 * at.next + 4);
  let dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
  const sign = dot < 0 ? -1 : 1;
  dot = Math.min(Math.abs(dot), 1);
  const angle = Math.acos(dot), sine = Math.sin(angle);
  const wa = sine > 1e-6 ? Math.sin((1 - at.share) * angle) / sine : 1 - at.share;
  const wb = sign * (sine > 1e-6 ? Math.sin(at.share * angle) / sine : at.share);
  const q = [0, 1, 2, 3].map(i => wa * a[i] + wb * b[i]), size = Math.hypot(...q);
  return q.map(x => x / size);
}

// Column-major 4 x 4 of a position and an orientation.
function pose_matrix(p, q) {
  const [x, y, z, w] = q;
  return [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 0,
    2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w), 0,
    2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y), 0, p[0], p[1], p[2], 1];
}

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const times = (s, a) => [s * a[0], s * a[1], s * a[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = a => times(1 / (Math.hypot(...a) || 1), a);

function multiply(a, b) {
  const out = new Array(16).fill(0);
  for (let c = 0; c < 4; ++c)
    for (let r = 0; r < 4; ++r)
      for (let k = 0; k < 4; ++k) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
}

// World to the picture's cube, as the program's own camera: vertical angle in degrees, or a height in m. Where the window is narrower than
// the pictures (`shape`, width over height), their whole width stays in sight.
function camera_matrix(camera, aspect, shape, reach) {
  const narrow = Math.min(1, aspect / shape);
  const z = unit(subtract(camera.position, camera.target)), x = unit(cross(camera.up, z)), y = cross(z, x);
  const p = camera.position, distance = Math.hypot(...subtract(p, camera.target));
  const view = [x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -dot(x, p), -dot(y, p), -dot(z, p), 1];
  const far = distance + reach, near = camera.height ? distance - reach : Math.max(distance - reach, 2e-3 * distance);
  let projection;
  if (camera.height) {
    const h = 2 * narrow / camera.height;
    projection = [h / aspect, 0, 0, 0, 0, h, 0, 0, 0, 0, -2 / (far - near), 0, 0, 0, -(far + near) / (far - near), 1];
  } else {
    const f = narrow / Math.tan(camera.fov * Math.PI / 360);
    projection = [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, -(far + near) / (far - near), -1, 0, 0, -2 * far * near / (far - near), 0];
  }
  return multiply(projection, view);
}
