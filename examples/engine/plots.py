"""The plots of Heckmann et al. 2006 fig. 22 from the history of examples/engine.toml: python3 plots.py HISTORY.csv PLOTS.svg"""
import csv
import math
import sys

with open(sys.argv[1], newline="") as file:
    rows = list(csv.reader(file))
columns = {name: [float(row[i]) for row in rows[1:]] for i, name in enumerate(rows[0])}
t = columns["t"]
# The scene's own expression; positive towards the crank.
columns["gas"] = [600 * max(0.0, math.sin(2.4 + 50 * s * s)) for s in t]
panels = [
    ("gas force, N", ["gas"], 1),
    ("crank speed, rad/s", ["crank_speed"], 1),
    ("modal amplitude 1, 1337 Hz, 1e-9", ["amplitude.1"], 1e9),
    ("modal amplitude 2, 1734 Hz, 1e-9", ["amplitude.2"], 1e9),
    ("modal amplitude 3, 2164 Hz, 1e-9", ["amplitude.3"], 1e9),
]
width, height, left, right, top, gap = 860, 130, 70, 15, 24, 44
s = [
    (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {len(panels) * (height + gap) + 10}" font-family="sans-serif"'
        ' font-size="12">'
    ),
    f'<rect width="{width}" height="{len(panels) * (height + gap) + 10}" fill="white"/>',
]


def ticks(low, high):
    step = 10 ** math.floor(math.log10((high - low) / 3))
    while (high - low) / step > 5:
        step *= 2 if (high - low) / step <= 10 else 5
    return [k * step for k in range(math.ceil(low / step), math.floor(high / step) + 1)]


for n, (label, names, factor) in enumerate(panels):
    y0 = top + n * (height + gap)
    values = [[factor * v for v in columns[name]] for name in names]
    low, high = min(map(min, values)), max(map(max, values))
    if not high > low:
        low, high = low - 1.0, high + 1.0
    margin = 0.05 * (high - low)
    low, high = low - margin, high + margin
    px = lambda v: left + (v - t[0]) / (t[-1] - t[0]) * (width - left - right)
    py = lambda v: y0 + (high - v) / (high - low) * height
    s.append(
        f'<text x="{left}" y="{y0 - 6}" font-weight="bold">{label}</text><rect x="{left}" y="{y0}" width="{width - left - right}"'
        f' height="{height}" fill="none" stroke="#999"/>'
    )
    for v in ticks(low, high):
        s.append(
            f'<line x1="{left}" x2="{width - right}" y1="{py(v):.1f}" y2="{py(v):.1f}" stroke="#ddd"/><text x="{left - 6}"'
            f' y="{py(v) + 4:.1f}" text-anchor="end">{v:g}</text>'
        )
    for k in range(5):
        v = t[0] + k / 4 * (t[-1] - t[0])
        s.append(f'<text x="{px(v):.1f}" y="{y0 + height + 15}" text-anchor="middle">{v:g}{" s" if k == 4 else ""}</text>')
    for v in values:
        s.append(
            '<polyline fill="none" stroke="#2255aa" stroke-width="1" points="'
            + " ".join(f"{px(a):.1f},{py(b):.1f}" for a, b in zip(t, v))
            + '"/>'
        )
s.append("</svg>")
with open(sys.argv[2], "w") as out:
    out.write("\n".join(s) + "\n")
