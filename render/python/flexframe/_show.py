"""How results show themselves in Jupyter: a summary, the histories, the last picture."""

import base64
import html

import numpy as np

_COLORS = ("#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf")


def _polyline(t, y, color, width, height):
    keep = np.linspace(0, len(t) - 1, min(len(t), 400)).astype(int)
    low, high = float(np.min(y)), float(np.max(y))
    span = high - low if high > low else 1.0
    x = (t[keep] - t[0]) / ((t[-1] - t[0]) or 1.0) * width
    v = height - (y[keep] - low) / span * height
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, v))
    return f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="1.5"/>', low, high


def plots_svg(results, most=6):
    """The first histories, one diagram below the other, as SVG."""
    columns = results.columns[:most]
    width, height, gap = 520, 70, 26
    size = f'width="{width + 190}" height="{len(columns) * (height + gap) + 18}"'
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif" font-size="11">']
    t = results.t
    for k, column in enumerate(columns):
        line, low, high = _polyline(t, results[column], _COLORS[k % len(_COLORS)], width, height)
        top = k * (height + gap) + 4
        name = html.escape(f"{column} [{results.units[column]}]")
        out.append(f'<g transform="translate(70,{top})"><rect width="{width}" height="{height}" fill="none" stroke="#bbb"/>{line}')
        out.append(f'<text x="{width + 8}" y="{height / 2 + 4}">{name}</text><text x="-4" y="9" text-anchor="end">{high:.3g}</text>')
        out.append(f'<text x="-4" y="{height}" text-anchor="end">{low:.3g}</text></g>')
    out.append(f'<text x="70" y="{len(columns) * (height + gap) + 4}">t: {t[0]:g} to {t[-1]:g} s</text></svg>')
    return "".join(out)


def _summary(results):
    s = results.statistics
    words = [f"{len(results.t)} times to {results.t[-1]:g} s" if len(results.t) else "no times"]
    words.append(f"{len(results.bodies)} bodies")
    if s.get("method"):
        words.append(f"{s['method']}, tolerance {s['tolerance']:g}, {s['cpu_seconds']:.3f} CPU s")
    if "error_estimate" in s:
        words.append(f"estimated error {s['error_estimate']:.1e} of the range of {s['error_column']}")
    return ", ".join(words)


def _repr(results):
    return f"<flexframe.Results of {results.title!r}: {_summary(results)}>"


def _repr_png(results):
    from . import draw, png

    return png(draw(results, size=(640, 360)))


def _repr_html(results):
    parts = [f"<b>{html.escape(results.title)}</b><br>{html.escape(_summary(results))}"]
    parts += [f'<br><span style="color:#b00">{html.escape(w)}</span>' for w in results.warnings]
    try:
        picture = base64.b64encode(_repr_png(results)).decode()
        parts.append(f'<br><img alt="last picture" src="data:image/png;base64,{picture}">')
    except Exception as error:  # a missing drawing library must not hide the numbers
        parts.append(f"<br>no picture: {html.escape(str(error))}")
    if results.columns:
        parts.append("<br>" + plots_svg(results))
    return "".join(parts)


def sweep_html(sweep):
    """Counts, the range of each response and the diagrams of a sweep."""
    parts = [f"<b>Sweep of {len(sweep)} points</b>: {html.escape(sweep._counts())}"]
    for name, values in sweep.responses.items():
        there = values[np.isfinite(values)]
        told = f"{there.min():.6g} to {there.max():.6g}" if len(there) else "no value"
        parts.append(f"<br>{html.escape(name)}: {told}")
    if sweep.found:
        settings = ", ".join(f"{html.escape(key)} = {value:.6g}" for key, value in sweep.found.get("settings", {}).items())
        told = f"{sweep.found['value']:.6g} at {settings}" if settings else "none"
        parts.append(f"<br>best: {told}")
        parts += [f'<br><span style="color:#b00">{html.escape(w)}</span>' for w in sweep.found["warnings"]]
    for file in sorted(sweep.folder.glob("*.svg")):
        parts.append("<br>" + file.read_text(encoding="utf-8"))
    return "".join(parts)


def attach(results):
    """Gives the class its ways to show itself."""
    results.__repr__ = _repr
    results._repr_png_ = _repr_png
    results._repr_html_ = _repr_html
