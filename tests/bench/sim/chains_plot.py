"""Draws the rows of bench_chains as an SVG:  chains_plot.py ROWS.csv OUT.svg

CPU seconds of one evaluation against the number of links, both logarithmic, with the exponent of each kind (least squares).
"""
import csv
import math
import sys

colours = {
    "rigid links": "#2a6f97",
    "flexible links": "#c1121f",
    "volumes of a beam in the plane": "#588157",
    "volumes of a beam in space": "#9a6324",
}
width, height, left, right, top, bottom = 640, 400, 64, 16, 40, 48

rows = {}
with open(sys.argv[1], newline="") as file:
    for row in csv.DictReader(file):
        if row["kind"] in colours:
            rows.setdefault(row["kind"], []).append((int(row["links"]), 1e6 * float(row["seconds"])))

x_range = (10, 1000)
values = [t for points in rows.values() for _, t in points]
y_range = (10 ** math.floor(math.log10(min(values))), 10 ** math.ceil(math.log10(max(values))))


def place(n, t):
    x = left + (width - left - right) * math.log(n / x_range[0]) / math.log(x_range[1] / x_range[0])
    y = height - bottom - (height - top - bottom) * math.log(t / y_range[0]) / math.log(y_range[1] / y_range[0])
    return x, y


def number(v):
    return f"{v:.10g}"


out = [
    (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" font-family="sans-serif"'
        ' font-size="12">'
    ),
    f'<rect width="{width}" height="{height}" fill="white"/>',
    f'<text x="{left}" y="22" font-size="14">CPU of one evaluation of the equations of motion of a chain</text>',
]
for n in (10, 20, 50, 100, 200, 500, 1000):
    x, _ = place(n, y_range[0])
    out.append(
        f'<path d="M{x:.1f} {top}V{height - bottom}" stroke="#ddd"/><text x="{x:.1f}" y="{height - bottom + 16}"'
        f' text-anchor="middle">{n}</text>'
    )
t = y_range[0]
while t <= y_range[1] * 1.001:
    _, y = place(x_range[0], t)
    out.append(
        f'<path d="M{left} {y:.1f}H{width - right}" stroke="#ddd"/><text x="{left - 6}" y="{y + 4:.1f}"'
        f' text-anchor="end">{number(t)}</text>'
    )
    t *= 10
out.append(f'<text x="{(left + width - right) / 2}" y="{height - 10}" text-anchor="middle">links</text>')
out.append(f'<text transform="translate(14 {(top + height - bottom) / 2}) rotate(-90)" text-anchor="middle">microseconds</text>')
for line, (kind, points) in enumerate(rows.items()):
    x, y = [math.log(n) for n, _ in points], [math.log(t) for _, t in points]
    mx, my = sum(x) / len(x), sum(y) / len(y)
    exponent = sum((a - mx) * (b - my) for a, b in zip(x, y)) / sum((a - mx) ** 2 for a in x)
    places = [place(n, t) for n, t in points]
    out.append(f'<path d="M{" L".join(f"{a:.1f} {b:.1f}" for a, b in places)}" fill="none" stroke="{colours[kind]}" stroke-width="2"/>')
    out += [f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3" fill="{colours[kind]}"/>' for a, b in places]
    at = top + 18 + 18 * line
    out.append(
        f'<path d="M{left + 14} {at - 4}h22" stroke="{colours[kind]}" stroke-width="2"/><text x="{left + 42}" y="{at}">{kind}: exponent'
        f" {exponent:.2f}</text>"
    )
out.append("</svg>")
with open(sys.argv[2], "w") as file:
    file.write("\n".join(out) + "\n")
