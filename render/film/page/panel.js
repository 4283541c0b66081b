// Controls, plots, link and keys around the picture.

const $ = id => document.getElementById(id);
const root = document.documentElement;
window.addEventListener('error', e => { root.dataset.error = e.message; });
window.addEventListener('unhandledrejection', e => {
  root.dataset.error = String(e.reason);
  $('message').textContent = 'The scene cannot be unpacked: ' + e.reason;
});

// Exaggeration by a slider: its first tenth from 0 to 1, the rest by equal factors up to the largest.
const from_slider = (s, most) => s <= 0.1 ? 10 * s : Math.pow(most, (s - 0.1) / 0.9);
const to_slider = (scale, most) => scale <= 1 ? scale / 10 : Math.min(1, 0.1 + 0.9 * Math.log(scale) / Math.log(most));
const three_digits = x => x === 0 ? '0' : Math.abs(x) >= 1e5 || Math.abs(x) < 1e-3 ? x.toExponential(2) : String(+x.toPrecision(3));

function element(parent, name, attributes = {}, text) {
  const svg = ['svg', 'path', 'line', 'text', 'g'].includes(name);
  const e = svg ? document.createElementNS('http://www.w3.org/2000/svg', name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) e.setAttribute(key, value);
  if (text !== undefined) e.textContent = text;
  parent.appendChild(e);
  return e;
}

// Round numbers between two ends, about so many.
function round_marks(low, high, count) {
  const raw = (high - low) / count || 1, power = Math.pow(10, Math.floor(Math.log10(raw)));
  const step = [1, 2, 5, 10].map(s => s * power).find(s => s >= raw);
  const marks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) marks.push(k * step);
  return { marks, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

// One history over time with a running mark; a click sets the time. Returns what moves the mark.
function make_plot(output, span, x, y, go, remove) {
  const figure = element($('plots'), 'figure');
  const draw = () => {
    figure.replaceChildren();
    const width = Math.max(figure.clientWidth, 120), height = 110, left = 56, right = width - 16, top = 16, bottom = 90;
    const svg = element(figure, 'svg', { viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': output.label });
    let low = Infinity, high = -Infinity;
    for (const v of y) { low = Math.min(low, v); high = Math.max(high, v); }
    if (!(high > low)) { low -= 1; high += 1; }
    const px = t => left + (right - left) * (t - span.first) / (span.last - span.first || 1);
    const py = v => bottom - (bottom - top) * (v - low) / (high - low);
    const across = round_marks(low * output.factor, high * output.factor, 4), along = round_marks(span.first, span.last, width / 90);
    for (const m of across.marks) {
      const v = py(m / output.factor);
      element(svg, 'line', { x1: left, x2: right, y1: v, y2: v, class: 'grid' });
      element(svg, 'text', { x: left - 4, y: v + 3, 'text-anchor': 'end' },
        m === 0 ? '0' : across.digits > 4 || Math.abs(m) >= 1e5 ? m.toExponential(1) : m.toFixed(across.digits));
    }
    along.marks.forEach((m, i) => element(svg, 'text', { x: px(m), y: height - 6, 'text-anchor': 'middle' },
      m.toFixed(along.digits) + (i + 1 === along.marks.length ? ' s' : '')));
    element(svg, 'text', { x: left, y: 11, class: 'name' }, output.unit ? `${output.label} [${output.unit}]` : output.label);
    let path = '';
    for (let i = 0; i < x.length; ++i) path += (i ? 'L' : 'M') + px(x[i]).toFixed(1) + ' ' + py(y[i]).toFixed(1);
    element(svg, 'path', { d: path, fill: 'none', stroke: 'var(--accent)', 'stroke-width': 1.5 });
    const mark = element(svg, 'line', { y1: top, y2: bottom, class: 'mark' });
    svg.addEventListener('pointerdown', e => {
      const box = svg.getBoundingClientRect(), at = (e.clientX - box.left) / box.width * width;
      go(span.first + (span.last - span.first) * (at - left) / (right - left));
    });
    element(figure, 'button', { title: 'Remove this plot' }, '×').addEventListener('click', () => { figure.remove(); remove(); });
    return t => { mark.setAttribute('x1', px(t)); mark.setAttribute('x2', px(t)); };
  };
  return { draw, move: draw() };
}

// The bar of a colour; none for bodies in their own.
function make_legend(c, array) {
  const box = $('legend');
  box.replaceChildren();
  if (!c) return;
  const canvas = document.createElement('canvas'), map = array(c.map);
  element(box, 'div', {}, `${c.label} [${c.unit}]`);
  const row = element(box, 'div', { class: 'scale' }), marks = element(row, 'div', { class: 'marks' });
  canvas.width = 14;
  canvas.height = 256;
  const pen = canvas.getContext('2d');
  for (let i = 0; i < 256; ++i) {
    const band = Math.min(Math.floor(i / 256 * c.levels), c.levels - 1);
    const share = c.levels > 1 ? (band + 0.5) / c.levels : i / 255, k = 3 * Math.round(255 * share);
    pen.fillStyle = `rgb(${map[k]},${map[k + 1]},${map[k + 2]})`;
    pen.fillRect(0, 255 - i, 14, 1);
  }
  row.appendChild(canvas);
  for (let i = 0; i <= 4; ++i) {
    const s = i / 4, value = c.logarithmic ? c.lower * Math.pow(c.upper / c.lower, s) : c.lower + s * (c.upper - c.lower);
    const beyond = i === 0 && c.beyond[0] ? '≤ ' : i === 4 && c.beyond[1] ? '≥ ' : '';
    element(marks, 'span', { style: `top:${100 * (1 - s)}%` }, beyond + three_digits(value * c.factor));
  }
}

(async () => {
  const { scene, array } = await read_data();
  const canvas = $('view'), span = scene.times.step * (scene.times.count - 1), last = scene.times.first + span;
  const picture = document.querySelector('#stage img');
  const state = {
    t: scene.times.first, playing: false, speed: scene.speed, scale: scene.scale, ghost: scene.ghost, colour: scene.coloured, ground: true,
    camera: { ...scene.camera }, follow: scene.follow, axis: '', cut_at: 0.5, cut_side: false, plain: false, reach: scene.reach, dark: false
  };
  let painter = null;
  try {
    painter = make_painter(canvas, scene, array);
  } catch (error) {
    root.dataset.error = error.message;
  }
  if (painter && picture) picture.remove();
  if (!painter) {
    canvas.hidden = true;
    $('message').textContent = 'This browser cannot draw the scene (WebGL 2): a still picture stands for it.';
    for (const part of document.querySelectorAll('aside details')) part.hidden = part.id !== 'run-part';
  }

  // The camera goes along with a body.
  const place_of = (b, t) => {
    const at = find_picture(scene.times, t);
    return blend(painter.models[b].moving, 3, at);
  };
  function camera_now() {
    if (!painter || state.follow < 0) return state.camera;
    const way = subtract(place_of(state.follow, state.t), place_of(state.follow, scene.times.first));
    return { ...state.camera, position: add(state.camera.position, way), target: add(state.camera.target, way) };
  }
  function cut_now() {
    const i = ['x', 'y', 'z'].indexOf(state.axis);
    if (i < 0) return null;
    const sign = state.cut_side ? -1 : 1, normal = [0, 0, 0];
    normal[i] = sign;
    return [...normal, sign * (scene.low[i] + state.cut_at * (scene.high[i] - scene.low[i]))];
  }

  const plots = new Map();
  let asked = false;
  function redraw() {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => { asked = false; draw(); });
  }
  // Where a picture takes long (100 ms: no graphics card), those of a motion are drawn at half the resolution, without shadows and
  // with ghosts that show both shells; as soon as it rests the picture is whole again.
  let drawn = 0, mean = 0, slow = false, rest = 0;
  function is_rough() {
    const now = performance.now(), gap = now - drawn;
    const moving = state.playing || gap < 400;
    if (moving && drawn) mean = mean ? 0.8 * mean + 0.2 * Math.min(gap, 400) : Math.min(gap, 400);
    drawn = now;
    if (mean > 100) slow = true;
    if (mean < 20) slow = false;
    clearTimeout(rest);
    const rough = slow && moving && !state.plain;
    if (rough && !state.playing) rest = setTimeout(redraw, 450);
    return rough;
  }
  function draw() {
    state.rough = is_rough();
    const ratio = (state.plain ? 1 : Math.min(window.devicePixelRatio || 1, 2)) * (state.rough ? 0.5 : 1);
    const wide = Math.max(1, Math.round(canvas.clientWidth * ratio)), high = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== wide || canvas.height !== high) { canvas.width = wide; canvas.height = high; }
    state.at = find_picture(scene.times, state.t);
    if (painter) {
      const camera = camera_now(), away = Math.hypot(...subtract(camera.target, scene.centre));
      painter.draw({ ...state, camera, cut: cut_now(), reach: state.reach + away });
    }
    $('time').textContent = `t = ${state.t.toFixed(scene.times.digits)} s`;
    $('scrub').value = span > 0 ? (state.t - scene.times.first) / span : 0;
    for (const plot of plots.values()) plot.move(state.t);
    root.dataset.frames = +(root.dataset.frames || 0) + 1;
  }
  function go(t) {
    state.t = Math.min(Math.max(t, scene.times.first), last);
    redraw();
  }

  // Playing: time goes on by the clock, at the speed of the pictures or as chosen.
  let before = 0;
  function step(now) {
    if (!state.playing) return;
    const dt = before ? Math.min((now - before) / 1000, 0.25) : 0;
    before = now;
    state.t += dt * state.speed;
    if (state.t > last) state.t = scene.times.first + (span > 0 ? (state.t - scene.times.first) % span : 0);
    draw();
    requestAnimationFrame(step);
  }
  function play(on) {
    state.playing = on && span > 0;
    before = drawn = 0;
    $('play').innerHTML = state.playing ? '&#10073;&#10073;' : '&#9654;';
    if (state.playing) requestAnimationFrame(step);
    else redraw();
  }
  $('play').addEventListener('click', () => play(!state.playing));
  $('scrub').addEventListener('input', e => { play(false); go(scene.times.first + span * e.target.value); });
  const speeds = [...new Set([...[0.01, 0.02, 0.05, 0.1, 0.2, 0.25, 0.5, 1, 2, 5, 10], scene.speed])].sort((a, b) => a - b);
  for (const s of speeds) element($('speed'), 'option', { value: s }, `${three_digits(s)} ×`);
  $('speed').value = scene.speed;
  $('speed').addEventListener('change', e => { state.speed = +e.target.value; });

  // Deformation.
  const most = Math.max(100, 10 * scene.scale);
  function set_scale(scale) {
    if (!(scale >= 0)) return;
    state.scale = scale;
    $('scale').value = to_slider(scale, most);
    $('scale-number').value = +scale.toPrecision(3);
    redraw();
  }
  $('scale').addEventListener('input', e => set_scale(from_slider(+e.target.value, most)));
  $('scale-number').addEventListener('change', e => set_scale(+e.target.value));
  const bind_flag = (id, key) => {
    $(id).checked = state[key];
    $(id).addEventListener('change', e => { state[key] = e.target.checked; redraw(); });
  };
  bind_flag('ghost', 'ghost');
  bind_flag('ground', 'ground');
  bind_flag('cut-side', 'cut_side');
  if (!scene.bodies.some(b => b.shapes)) $('scale').closest('details').hidden = true;
  // Colours: any of the scene's, or the bodies' own (-1).
  element($('colours'), 'option', { value: -1 }, 'their own');
  scene.colours.forEach((c, i) => element($('colours'), 'option', { value: i }, c.label));
  $('colours-label').hidden = !scene.colours.length;
  function set_colour(i) {
    $('colours').value = state.colour = i;
    if (painter) make_legend(scene.colours[i], array);
    redraw();
  }
  $('colours').addEventListener('change', e => set_colour(+e.target.value));
  const next_colour = () => set_colour((state.colour + 2) % (scene.colours.length + 1) - 1);
  set_colour(state.colour);
  $('add-label').hidden = scene.outputs.length === 0;

  // What the run warns of is told where it is seen.
  const warnings = document.querySelectorAll('#run .warning').length;
  $('run-part').open = warnings > 0 || !painter;
  if (warnings) {
    $('warned').hidden = false;
    $('warned').textContent = warnings === 1 ? '1 warning' : `${warnings} warnings`;
    $('warned').addEventListener('click', () => {
      $('run-part').open = true;
      document.querySelector('#run .warning').scrollIntoView({ block: 'center' });
    });
  }

  // Views.
  const up = unit(scene.camera.up), start = unit(subtract(scene.camera.position, scene.camera.target));
  const flat = unit(subtract(start, times(dot(start, up), up))), side = cross(up, flat);
  function look_from(direction, above) {
    const camera = { ...scene.camera, up: above };
    camera.target = scene.centre;
    const distance = camera.height ? 3 * scene.radius : 1.05 * scene.radius / Math.sin(camera.fov * Math.PI / 360);
    if (camera.height) camera.height = 2.1 * scene.radius;
    camera.position = add(scene.centre, times(distance, unit(direction)));
    state.camera = camera;
    redraw();
  }
  const views = [() => { state.camera = { ...scene.camera }; redraw(); }, () => look_from(flat, up), () => look_from(side, up),
    () => look_from(up, times(-1, flat)), () => look_from(add(add(flat, times(0.8, side)), times(0.7, up)), up)];
  for (const button of document.querySelectorAll('[data-view]')) button.addEventListener('click', () => views[+button.dataset.view]());
  const fit = () => look_from(subtract(state.camera.position, state.camera.target), state.camera.up);
  $('fit').addEventListener('click', fit);
  element($('follow'), 'option', { value: -1 }, 'nothing');
  scene.bodies.forEach((b, i) => { if (b.kind === 'body') element($('follow'), 'option', { value: i }, b.name); });
  $('follow').value = state.follow;
  $('follow').addEventListener('change', e => { state.follow = +e.target.value; redraw(); });
  function set_cut(axis, at, other_side) {
    $('cut').value = state.axis = axis;
    $('cut-at').value = state.cut_at = at;
    $('cut-side').checked = state.cut_side = other_side;
    $('cut-at').hidden = $('cut-side-label').hidden = !axis;
    redraw();
  }
  $('cut').addEventListener('change', e => set_cut(e.target.value, state.cut_at, state.cut_side));
  $('cut-at').addEventListener('input', e => { state.cut_at = +e.target.value; redraw(); });

  // Bodies.
  scene.bodies.forEach((b, i) => {
    const label = element(element($('bodies'), 'li'), 'label'), box = element(label, 'input', { type: 'checkbox' });
    element(label, 'i', { style: `background: rgb(${b.color.map(c => Math.round(255 * c)).join(',')})` });
    label.append(b.kind === 'joint' ? `joint ${b.name}` : b.name);
    box.checked = b.visible;
    box.addEventListener('change', e => { if (painter) painter.models[i].visible = e.target.checked; redraw(); });
  });

  // Plots.
  function add_plot(i) {
    if (plots.has(i)) return;
    const output = scene.outputs[i];
    plots.set(i, make_plot(output, { first: scene.times.first, last }, array(output.x), array(output.y), t => { play(false); go(t); },
      () => { plots.delete(i); draw_plots(); }));
    draw_plots();
  }
  // Their width changes with their number and the window.
  function draw_plots() {
    for (const plot of plots.values()) plot.move = plot.draw();
    redraw();
  }
  element($('add'), 'option', { value: -1 }, 'add ...');
  scene.outputs.forEach((o, i) => element($('add'), 'option', { value: i }, o.unit ? `${o.label} [${o.unit}]` : o.label));
  $('add').addEventListener('change', e => { if (+e.target.value >= 0) add_plot(+e.target.value); e.target.value = -1; });
  scene.plots.forEach(add_plot);

  // Theme: the system's unless chosen.
  const dark = window.matchMedia('(prefers-color-scheme: dark)');
  function set_theme(on) {
    state.dark = on;
    root.dataset.theme = on ? 'dark' : 'light';
    redraw();
  }
  set_theme(dark.matches);
  dark.addEventListener('change', e => set_theme(e.matches));
  $('theme').addEventListener('click', () => set_theme(!state.dark));

  // Link to this time and view; the same words are read when the page opens.
  function make_link() {
    const c = state.camera, round = v => v.map(x => +x.toPrecision(6)).join(',');
    const hidden = painter ? painter.models.flatMap((m, i) => m.visible ? [] : [i]).join(',') : '';
    const words = { t: +state.t.toPrecision(8), scale: +state.scale.toPrecision(4), ghost: +state.ghost,
      view: round([...c.position, ...c.target, ...c.up, c.height || 0]), follow: state.follow, hide: hidden,
      colour: scene.colours[state.colour]?.word || 'own' };
    if (state.axis) words.cut = `${state.axis},${state.cut_at},${+state.cut_side}`;
    return '#' + Object.entries(words).map(([k, v]) => `${k}=${v}`).join('&');
  }
  function read_link() {
    const words = new URLSearchParams(location.hash.slice(1));
    const numbers = key => (words.get(key) || '').split(',').filter(x => x !== '').map(Number);
    if (words.has('clean')) { document.body.classList.add('clean'); state.plain = true; state.ground = false; }
    if (words.has('ghost')) $('ghost').checked = state.ghost = words.get('ghost') === '1';
    const colour = scene.colours.findIndex(c => c.word === words.get('colour'));
    if (colour >= 0 || words.get('colour') === 'own') set_colour(colour);
    const followed = Number(words.get('follow') || -1);
    if (words.has('follow') && (followed === -1 || scene.bodies[followed]?.kind === 'body')) $('follow').value = state.follow = followed;
    const [axis, at, side] = (words.get('cut') || '').split(',');
    if (['x', 'y', 'z'].includes(axis) && Number.isFinite(+at)) set_cut(axis, +at, side === '1');
    const v = numbers('view');
    if (v.length === 10 && v.every(Number.isFinite)) {
      state.camera = { ...scene.camera, position: v.slice(0, 3), target: v.slice(3, 6), up: v.slice(6, 9) };
      if (v[9] > 0) state.camera.height = v[9];
    }
    if (painter) for (const i of numbers('hide')) if (painter.models[i]) painter.models[i].visible = false;
    for (const [i, box] of [...document.querySelectorAll('#bodies input')].entries()) if (painter) box.checked = painter.models[i].visible;
    set_scale(words.has('scale') && Number.isFinite(+words.get('scale')) ? Number(words.get('scale')) : state.scale);
    if (words.has('t') && Number.isFinite(+words.get('t'))) go(Number(words.get('t')));
    if (words.has('play')) play(true);
  }
  $('link').addEventListener('click', () => {
    history.replaceState(null, '', make_link());
    const tell = text => {
      $('link').textContent = text;
      setTimeout(() => { $('link').textContent = 'Link'; }, 1500);
    };
    const copied = navigator.clipboard ? navigator.clipboard.writeText(location.href) : Promise.reject();
    copied.then(() => tell('Copied'), () => tell('In the address'));
  });
  window.addEventListener('hashchange', read_link);
  const help = () => { $('help').hidden = !$('help').hidden; };
  $('help-button').addEventListener('click', help);

  // Mouse and fingers.
  function turn(dx, dy) {
    const c = state.camera, above = unit(c.up);
    let way = subtract(c.position, c.target);
    const distance = Math.hypot(...way);
    const spin = (v, axis, angle) => {
      const cosine = Math.cos(angle), sine = Math.sin(angle);
      return add(add(times(cosine, v), times(sine, cross(axis, v))), times((1 - cosine) * dot(axis, v), axis));
    };
    way = spin(way, above, -dx);
    const height = Math.asin(Math.min(1, Math.max(-1, dot(unit(way), above)))), wanted = Math.min(1.553, Math.max(-1.553, height + dy));
    way = spin(way, unit(cross(above, way)), height - wanted);
    state.camera = { ...c, position: add(c.target, times(distance, unit(way))) };
    redraw();
  }
  function move(dx, dy) {
    const c = state.camera, z = unit(subtract(c.position, c.target)), x = unit(cross(c.up, z)), y = cross(z, x);
    const high = c.height || 2 * Math.hypot(...subtract(c.position, c.target)) * Math.tan(c.fov * Math.PI / 360);
    const s = high / canvas.clientHeight;
    const way = add(times(-dx * s, x), times(dy * s, y));
    state.camera = { ...c, position: add(c.position, way), target: add(c.target, way) };
    redraw();
  }
  function zoom(factor) {
    const c = state.camera;
    state.camera = { ...c, position: add(c.target, times(factor, subtract(c.position, c.target))) };
    if (c.height) state.camera.height = c.height * factor;
    redraw();
  }
  const fingers = new Map();
  canvas.addEventListener('contextmenu', e => e.preventDefault());
  canvas.addEventListener('pointerdown', e => {
    canvas.setPointerCapture(e.pointerId);
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
  });
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, e => fingers.delete(e.pointerId));
  canvas.addEventListener('pointermove', e => {
    const old = fingers.get(e.pointerId);
    if (!old) return;
    const now = [e.clientX, e.clientY], dx = now[0] - old[0], dy = now[1] - old[1];
    if (fingers.size === 2) {
      const other = [...fingers.entries()].find(([id]) => id !== e.pointerId)[1];
      zoom(Math.hypot(old[0] - other[0], old[1] - other[1]) / Math.max(1, Math.hypot(now[0] - other[0], now[1] - other[1])));
      move(dx / 2, dy / 2);
    } else if (e.buttons & 2 || e.shiftKey) {
      move(dx, dy);
    } else {
      turn(0.008 * dx, 0.008 * dy);
    }
    fingers.set(e.pointerId, now);
  });
  canvas.addEventListener('wheel', e => { e.preventDefault(); zoom(Math.exp(0.001 * e.deltaY)); }, { passive: false });

  const faster = d => {
    const i = Math.min(Math.max(speeds.indexOf(state.speed) + d, 0), speeds.length - 1);
    $('speed').value = state.speed = speeds[i];
  };
  const keys = {
    ' ': () => play(!state.playing), ArrowLeft: () => { play(false); go(state.t - scene.times.step); },
    ArrowRight: () => { play(false); go(state.t + scene.times.step); }, ArrowUp: () => faster(1), ArrowDown: () => faster(-1),
    '+': () => set_scale(state.scale * 1.25 || 1), '-': () => set_scale(state.scale / 1.25), f: fit,
    g: () => $('ghost').click(), c: next_colour,
    t: () => set_theme(!state.dark), l: () => $('link').click(), h: help
  };
  window.addEventListener('keydown', e => {
    if (e.ctrlKey || e.metaKey || e.altKey || (e.target.matches('input, select') && e.target.type !== 'range')) return;
    const action = keys[e.key] || keys[e.key.toLowerCase()] || (/^[0-4]$/.test(e.key) && views[+e.key]);
    if (action) { e.preventDefault(); action(); }
  });
  window.addEventListener('resize', draw_plots);

  read_link();
  draw();
  root.dataset.ready = '1';
})();
