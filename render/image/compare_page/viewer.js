"use strict";
// Each pair has a viewer: baseline and new picture side by side, parted by a line that is dragged (swipe), in turn (blink), or what
// differs; all with the same zoom. Without scripts the pictures stand side by side.

const modes = [["side", "Side by side"], ["swipe", "Swipe"], ["blink", "Blink"], ["difference", "Difference"]];
const numbers = text => (text || "").split(",").filter(word => word !== "").map(Number);

class Viewer {
  constructor(section) {
    this.section = section;
    this.a = section.querySelector(".a img");
    this.b = section.querySelector(".b img");
    this.heat = section.querySelector(".heat img");
    const [x, y] = numbers(section.dataset.part), box = numbers(section.dataset.box), factor = Number(section.dataset.factor);
    this.origin = {x, y, factor};
    // In pixels of what the page holds.
    this.box = box.length === 4 && box[2] > 0
      ? {x: (box[0] - x) / factor, y: (box[1] - y) / factor, w: box[2] / factor, h: box[3] / factor} : null;
    this.width = Math.max(this.a.naturalWidth, this.b.naturalWidth);
    this.height = Math.max(this.a.naturalHeight, this.b.naturalHeight);
    this.mode = "side";
    this.split = 0.5;
    this.turned = false;  // blink: the new picture
    this.build();
    this.fit();
  }

  build() {
    const tools = document.createElement("div");
    tools.className = "tools";
    const button = (text, title, action) => {
      const b = tools.appendChild(document.createElement("button"));
      b.textContent = text;
      b.title = title;
      b.addEventListener("click", action);
      return b;
    };
    this.buttons = modes.map(([mode, text], k) => [mode, button(text, `key ${k + 1}`, () => this.set(mode))]);
    tools.appendChild(document.createElement("span")).className = "gap";
    if (this.box) button("To the difference", "key D", () => this.toBox());
    button("Whole", "key 0", () => this.fit());
    button("−", "key −", () => this.magnify(1 / 1.5));
    button("+", "key +, or the wheel", () => this.magnify(1.5));
    this.said = tools.appendChild(document.createElement("output"));
    this.canvas = document.createElement("canvas");
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("aria-label", "baseline and new picture");
    const figures = this.section.querySelector(".row");
    figures.hidden = true;
    figures.before(tools, this.canvas);
    this.listen();
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    window.addEventListener("resize", () => this.draw());  // its height counts too
  }

  listen() {
    const c = this.canvas;
    let from = null;
    c.addEventListener("pointerdown", e => {
      c.setPointerCapture(e.pointerId);
      from = {x: e.clientX, y: e.clientY};
    });
    c.addEventListener("pointerup", () => { from = null; });
    c.addEventListener("pointermove", e => {
      if (from && this.mode === "swipe" && !e.shiftKey) {
        const r = c.getBoundingClientRect();
        this.split = Math.min(1, Math.max(0, (e.clientX - r.left) / r.width));
      } else if (from) {
        this.x -= (e.clientX - from.x) / this.scale();
        this.y -= (e.clientY - from.y) / this.scale();
        from = {x: e.clientX, y: e.clientY};
      }
      if (from) this.draw();
      this.tell(e);
    });
    c.addEventListener("wheel", e => {
      e.preventDefault();
      this.magnify(Math.exp(-0.002 * e.deltaY), this.under(e));
    }, {passive: false});
    c.addEventListener("keydown", e => {
      const k = Number(e.key);
      if (k >= 1 && k <= 4) this.set(modes[k - 1][0]);
      else if (e.key === "0") this.fit();
      else if (e.key === "d" || e.key === "D") this.toBox();
      else if (e.key === "+" || e.key === "=") this.magnify(1.5);
      else if (e.key === "-") this.magnify(1 / 1.5);
      else if (e.key === " " && this.mode === "blink") this.turn();
      else return;
      e.preventDefault();
    });
  }

  set(mode) {
    this.mode = mode;
    clearInterval(this.timer);
    if (mode === "blink") this.timer = setInterval(() => this.turn(), 700);
    this.draw();
  }

  turn() {
    this.turned = !this.turned;
    this.draw();
  }

  panels() {
    if (this.mode !== "side") return 1;
    return this.heat ? 3 : 2;
  }

  // CSS pixels of one panel.
  room() {
    const width = this.canvas.clientWidth || 800;
    const tall = this.mode === "side" ? width / this.panels() : width;
    const height = Math.min(Math.max(160, tall * this.height / this.width), 0.72 * window.innerHeight);
    return {width: width / this.panels(), height};
  }

  fit() {
    this.zoom = 0;  // as large as there is room
    this.x = this.width / 2;
    this.y = this.height / 2;
    this.draw();
  }

  toBox() {
    if (!this.box) return;
    this.zoom = -1;  // the difference as large as there is room
    this.x = this.box.x + this.box.w / 2;
    this.y = this.box.y + this.box.h / 2;
    this.draw();
  }

  scale() {
    if (this.zoom > 0) return this.zoom;
    const room = this.room(), border = 12;
    if (this.zoom < 0) return Math.min(room.width / (this.box.w + border), room.height / (this.box.h + border), 24);
    return Math.min(room.width / this.width, room.height / this.height);
  }

  magnify(factor, about) {
    const before = this.scale(), after = Math.min(64, Math.max(0.05, before * factor));
    if (about) {
      this.x = about.x - (about.x - this.x) * before / after;
      this.y = about.y - (about.y - this.y) * before / after;
    }
    this.zoom = after;
    this.draw();
  }

  // The pixel of what the page holds that lies under the pointer.
  under(e) {
    const r = this.canvas.getBoundingClientRect(), room = this.room(), z = this.scale();
    const u = (e.clientX - r.left) % room.width, v = e.clientY - r.top;
    return {x: this.x + (u - room.width / 2) / z, y: this.y + (v - room.height / 2) / z};
  }

  tell(e) {
    const at = this.under(e), x = Math.floor(at.x), y = Math.floor(at.y);
    const value = image => {
      const p = pixelsOf(image), i = 4 * (y * p.width + x);
      return x >= 0 && y >= 0 && x < p.width && y < p.height ? Array.from(p.data.slice(i, i + 3)).join(" ") : "none";
    };
    const o = this.origin;
    this.said.textContent = x < 0 || y < 0 || x >= this.width || y >= this.height ? ""
      : `pixel ${Math.floor(o.x + o.factor * (x + 0.5))}, ${Math.floor(o.y + o.factor * (y + 0.5))}: ` +
        `baseline ${value(this.a)}, new ${value(this.b)}`;
  }

  draw() {
    const room = this.room(), ratio = window.devicePixelRatio || 1, count = this.panels(), c = this.canvas;
    c.style.height = `${room.height}px`;
    c.width = Math.round(room.width * count * ratio);
    c.height = Math.round(room.height * ratio);
    const g = c.getContext("2d"), z = this.scale();
    const panel = (k, image, name, from = 0, to = 1) => {
      g.save();
      g.beginPath();
      g.rect((k + from) * room.width * ratio, 0, (to - from) * room.width * ratio, c.height);
      g.clip();
      g.setTransform(z * ratio, 0, 0, z * ratio, ((k + 0.5) * room.width - this.x * z) * ratio, (room.height / 2 - this.y * z) * ratio);
      g.imageSmoothingEnabled = z * ratio < 1;
      g.drawImage(image, 0, 0);
      if (this.box) {
        const edge = 2 / z;
        g.strokeStyle = "#e0007a";
        g.lineWidth = edge;
        g.strokeRect(this.box.x - edge, this.box.y - edge, this.box.w + 2 * edge, this.box.h + 2 * edge);
      }
      g.setTransform(ratio, 0, 0, ratio, 0, 0);
      g.font = "13px system-ui, sans-serif";
      const wide = g.measureText(name).width + 12, left = from > 0 ? (k + 1) * room.width - wide : k * room.width;
      g.fillStyle = "rgba(20, 26, 34, 0.75)";
      g.fillRect(left, room.height - 20, wide, 20);
      g.fillStyle = "#fff";
      g.fillText(name, left + 6, room.height - 6);
      g.restore();
    };
    if (this.mode === "side") {
      panel(0, this.a, "baseline");
      panel(1, this.b, "new");
      if (this.heat) panel(2, this.heat, this.heat.alt);
    } else if (this.mode === "swipe") {
      panel(0, this.a, "baseline", 0, this.split);
      panel(0, this.b, "new", this.split, 1);
      g.fillStyle = "#e0007a";
      g.fillRect((this.split * room.width - 1) * ratio, 0, 2 * ratio, c.height);
    } else if (this.mode === "blink") {
      panel(0, this.turned ? this.b : this.a, this.turned ? "new" : "baseline");
    } else {
      panel(0, this.difference(), "red: differs, pale: the baseline");
    }
    for (const [mode, button] of this.buttons) button.setAttribute("aria-pressed", String(mode === this.mode));
  }

  // What differs in red, the more the stronger, over a pale baseline.
  difference() {
    if (this.red) return this.red;
    const p = pixelsOf(this.a), q = pixelsOf(this.b);
    this.red = new OffscreenCanvas(this.width, this.height);
    const g = this.red.getContext("2d"), out = g.createImageData(this.width, this.height);
    const off = new Float32Array(this.width * this.height);
    let largest = 1;
    for (let y = 0; y < this.height; ++y)
      for (let x = 0; x < this.width; ++x) {
        const inside = x < p.width && x < q.width && y < p.height && y < q.height;
        const i = 4 * (y * p.width + x), j = 4 * (y * q.width + x);
        const d = !inside ? 255 : Math.max(...[0, 1, 2, 3].map(k => Math.abs(p.data[i + k] - q.data[j + k])));
        off[y * this.width + x] = d;
        largest = Math.max(largest, d);
      }
    for (let n = 0; n < off.length; ++n) {
      const x = n % this.width, y = Math.floor(n / this.width), i = 4 * (y * p.width + x);
      const there = x < p.width && y < p.height;
      const grey = there ? 165 + 0.3 * (0.3 * p.data[i] + 0.59 * p.data[i + 1] + 0.11 * p.data[i + 2]) : 240;
      const share = off[n] > 0 ? 0.4 + 0.6 * off[n] / largest : 0;
      out.data.set([grey + (214 - grey) * share, grey * (1 - share), grey + (40 - grey) * share, 255], 4 * n);
    }
    g.putImageData(out, 0, 0);
    return this.red;
  }
}

const pixelMemory = new Map();
function pixelsOf(image) {
  if (!pixelMemory.has(image)) {
    const g = new OffscreenCanvas(image.naturalWidth, image.naturalHeight).getContext("2d", {willReadFrequently: true});
    g.drawImage(image, 0, 0);
    pixelMemory.set(image, g.getImageData(0, 0, image.naturalWidth, image.naturalHeight));
  }
  return pixelMemory.get(image);
}

// #pair=NAME&mode=swipe&split=0.3&at=difference opens a pair so; turned=1: blink stands still at the new picture; only=1: without the rest.
function open(viewers) {
  const words = new URLSearchParams(location.hash.slice(1)), viewer = viewers.get(words.get("pair"));
  if (!viewer) return;
  if (words.has("split")) viewer.split = Number(words.get("split"));
  if (words.has("mode")) viewer.set(words.get("mode"));
  if (words.has("turned")) {
    clearInterval(viewer.timer);
    viewer.turned = words.get("turned") === "1";
  }
  if (words.get("only") === "1")
    for (const part of document.body.children) part.hidden = part !== viewer.section;
  if (words.get("at") === "difference") viewer.toBox();
  viewer.draw();
  viewer.section.scrollIntoView();
}

async function start() {
  const viewers = new Map();
  for (const section of document.querySelectorAll(".pair")) {
    const images = [...section.querySelectorAll("img")];
    await Promise.all(images.map(image => image.decode()));
    if (section.querySelector(".a img") && section.querySelector(".b img")) viewers.set(section.dataset.name, new Viewer(section));
  }
  open(viewers);
  window.addEventListener("hashchange", () => open(viewers));
  document.documentElement.dataset.ready = "1";
}
window.addEventListener("load", start);
