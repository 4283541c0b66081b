"""`flexframe export --to html`: the page's own data against the results, read here by h5py; with --browser its picture in Chromium.

    test_page.py FLEXFRAME SOURCE_DIR [--browser]
"""
import base64
import gzip
import html.parser
import json
import re
import subprocess
import sys

import h5py
import numpy as np
import scipy.spatial

from browser import Browser, chromium
from page_controls import Page, changed, check_controls
from program import examples, expect, finish, near, run, temporary_folder

TYPES = {"f4": "<f4", "u4": "<u4", "i2": "<i2", "u2": "<u2", "i1": "i1", "u1": "u1"}


class Reader(html.parser.HTMLParser):
    """Scripts by id, headings and classes of a page; void elements need no end."""

    def __init__(self, text):
        super().__init__()
        self.scripts, self.open, self.inside, self.headings = {}, [], None, []
        self.feed(text)
        self.close()
        expect(not self.open, f"elements without an end: {self.open}")

    def handle_starttag(self, tag, attributes):
        if tag not in ("meta", "input", "img"):
            self.open.append(tag)
        if tag == "script":
            self.inside = dict(attributes).get("id", "code")
        for name, value in attributes:
            outside = name in ("src", "href") and not value.startswith("data:")
            expect(not outside, f"the page loads {value}")

    def handle_endtag(self, tag):
        expect(self.open and self.open[-1] == tag, f"</{tag}> closes {self.open[-1:]}")
        self.open.pop()
        self.inside = None

    def handle_data(self, data):
        if self.inside:
            self.scripts[self.inside] = self.scripts.get(self.inside, "") + data
        elif self.open and self.open[-1] == "h1":
            self.headings.append(data)


def read_page(path):
    page = Reader(path.read_text(encoding="utf-8"))
    scene = json.loads(page.scripts["scene"])
    block = gzip.decompress(base64.b64decode(page.scripts["data"], validate=True))
    for word in ("fetch(", "XMLHttpRequest", "import(", "WebSocket"):
        expect(word not in page.scripts["code"], f"the page uses {word}")
    return page, scene, lambda d: np.frombuffer(block, TYPES[d["t"]], d["n"], d["o"])


def between(times, values, t):
    """Rows of `values` at the times t, linear between samples."""
    return np.stack([np.interp(t, times, column) for column in np.asarray(values).T], axis=1)


def deformed(array, body, k):
    """Displacement of every point of a body at picture k, m."""
    n, shapes = body["points"], body["shapes"]
    weights = array(body["weights"]).reshape(-1, shapes)[k] * np.array(body["shape_step"])
    return np.tensordot(weights, array(body["shape_data"]).reshape(shapes, n, 3), axes=1)


def check_motion(scene, array, results):
    """Frames and elastic displacement of every body at every picture."""
    t = scene["times"]["first"] + scene["times"]["step"] * np.arange(scene["times"]["count"])
    times = results["times"][:]
    worst = 0.0
    for body in scene["bodies"]:
        if body["kind"] != "body":
            continue
        group = results["bodies"][body["name"]]
        place = between(times, group["position"][:], t)
        worst = max(worst, np.abs(array(body["position"]).reshape(-1, 3) - place).max())
        q = array(body["rotation"]).reshape(-1, 4)
        expect(np.abs(np.linalg.norm(q, axis=1) - 1).max() < 1e-6, f"{body['name']}: orientations are unit quaternions")
        wanted = between(times, np.asarray(group["orientation"][:]), t)
        wanted = (wanted / np.linalg.norm(wanted, axis=1)[:, None])[:, [1, 2, 3, 0]]
        worst = max(worst, (1 - np.abs((q * wanted).sum(axis=1))).max())
    near(worst, 0, 2e-6, "frames of the page against the results")


def check_deformation(scene, array, results, name, node):
    """The mean displacement of the ring of points around a node is that of the node: sections stay plane."""
    body = next(b for b in scene["bodies"] if b["name"] == name)
    group = results["bodies"][name]
    origin = group["node_origin"][node]
    rest = np.array(body["rest_low"]) + array(body["rest"]).reshape(-1, 3) * np.array(body["rest_step"])
    near_by = np.abs(rest[:, 0] - origin[0])
    ring = near_by < near_by.min() + 1e-4
    expect(ring.sum() >= 4, f"{name}: a ring of points lies at the node")
    t = scene["times"]["first"] + scene["times"]["step"] * np.arange(scene["times"]["count"])
    truth = between(results["times"][:], group["displacement"][:, node, :], t)
    found = np.array([deformed(array, body, k)[ring].mean(axis=0) for k in range(len(t))])
    size = np.abs(truth).max()
    near(np.abs(found - truth).max() / size, 0, 5e-3, f"displacement of {name} at node {node} / its largest")


def matrix(q):
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def value_of(array, body, look, k, rest, moved):
    """What a body's points are coloured by at picture k, as the page's shaders make it."""
    shown = look["shown"]
    if shown == 1:
        return np.linalg.norm(moved, axis=1)
    if shown == 2:
        n, count = body["points"], look["values"]
        width = 3 * look.get("parts", 0) or 1
        weights = array(look["value_weights"]).reshape(-1, count)[k] * np.array(look["value_step"])
        return np.linalg.norm(np.tensordot(weights, array(look["value_data"]).reshape(count, n, width), axes=1), axis=1)
    if shown == 4:
        drift = array(body["drift"]).reshape(-1, 4, 3)[k]
        v = (rest + moved) @ drift[:3] + drift[3]
        if "rates" in body:
            weights = array(body["rates"]).reshape(-1, body["shapes"])[k] * np.array(body["shape_step"])
            rate = np.tensordot(weights, array(body["shape_data"]).reshape(body["shapes"], -1, 3), axes=1)
            v = v + rate @ matrix(array(body["rotation"]).reshape(-1, 4)[k]).T
        return np.linalg.norm(v, axis=1)
    return np.zeros(len(rest))


def check_colours(scene, array, vtk):
    """Every colour at five pictures against the point data of the export for ParaView, point by point."""
    words = [c["word"] for c in scene["colours"]]
    expect(words == ["displacement", "stress", "velocity"] and scene["coloured"] == 0, f"colours to choose from: {words}")
    flexible = {b["name"] for b in scene["bodies"] if "shapes" in b}
    bodies = [b for b in scene["bodies"] if b["kind"] == "body"]
    worst = dict.fromkeys(words, 0.0)
    with h5py.File(vtk) as file:
        root = file["VTKHDF"]
        n, count = root["NumberOfPoints"][0], scene["times"]["count"]
        expect(root["Steps"].attrs["NSteps"] == count, "as many steps as pictures")
        for k in range(0, count, count // 4):
            points = root["Points"][k * n : (k + 1) * n]
            data = {word: root["PointData"][word][k * n : (k + 1) * n] for word in words}
            data = {word: np.linalg.norm(d.reshape(n, -1), axis=1) for word, d in data.items()}
            for body in bodies:
                rest = np.array(body["rest_low"]) + array(body["rest"]).reshape(-1, 3) * np.array(body["rest_step"])
                moved = deformed(array, body, k) if "shapes" in body else np.zeros_like(rest)
                place = array(body["position"]).reshape(-1, 3)[k]
                world = (rest + moved) @ matrix(array(body["rotation"]).reshape(-1, 4)[k]).T + place
                away, at = scipy.spatial.cKDTree(points).query(world)
                near(away.max(), 0, 1e-5, f"{body['name']}, picture {k}: points of the page and of the export")
                for word, look in zip(words, body["looks"]):
                    expect(
                        (look["shown"] > 0) == (word == "velocity" or body["name"] in flexible),
                        f"{body['name']} by {word}: {look['shown']}",
                    )
                    if look["shown"]:
                        # Bodies touch: of points at one place any may be the other's.
                        other = np.array([data[word][i] for i in scipy.spatial.cKDTree(points).query(world, 8)[1].T])
                        close = np.linalg.norm(points[scipy.spatial.cKDTree(points).query(world, 8)[1].T] - world, axis=2) < 1e-4
                        off = np.where(close, np.abs(other - value_of(array, body, look, k, rest, moved)), np.inf).min(axis=0)
                        worst[word] = max(worst[word], off.max())
    for word, c in zip(words, scene["colours"]):
        near(worst[word] / c["upper"], 0, 0.01, f"{word}: colours of the page against the export / range")


def silhouette(png):
    """True where a picture on white or nothing shows something."""
    pixels = subprocess.run(
        ["ffmpeg", "-v", "error", "-i", png, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"], capture_output=True, check=True
    ).stdout
    return np.frombuffer(pixels, np.uint8).reshape(450, 800, 3).min(axis=2) < 250


def grown(mask):
    out = mask.copy()
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            out |= np.roll(np.roll(mask, dy, 0), dx, 1)
    return out


def in_browser(browser, url, png, more=()):
    words = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    words += ["--hide-scrollbars", "--window-size=800,450", "--virtual-time-budget=6000", "--enable-logging=stderr", *more]
    done = subprocess.run([browser, *words, f"--screenshot={png}", url], capture_output=True, text=True, timeout=180)
    said = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    expect(not said, f"{url}: the browser's console says {said[:3]}")
    dom = subprocess.run([browser, *words, "--dump-dom", url], capture_output=True, text=True, timeout=180).stdout
    root = re.search(r"<html[^>]*>", dom)
    expect(root and 'data-ready="1"' in root.group(0), f"{url}: the page is not ready: {root and root.group(0)}")
    expect(root and "data-error" not in root.group(0), f"{url}: {root and root.group(0)}")
    return dom


def check_browser(folder, scene_file):
    browser = chromium()
    expect(browser, "Chromium is missing: install the section [nightly] of tests/packages.txt")
    if not browser:
        return
    look = folder / "plain.toml"
    bare = "overlay = { title = false, time = false, scalar_bar = false, triad = false, legend = false, note = false }"
    text, count = re.subn(r"(?m)^overlay = .*$", "ground = false\n" + bare, scene_file.read_text())
    expect(count == 1, "the example's overlay is one line")
    look.write_text(text)
    words = ["--size", "800x450", "--background", "white", "--no-shadows", "--scales", "1"]
    run("render", folder / "r.h5", "-o", folder / "plain", "--no-video", "--scene", look, *words)
    run("export", folder / "r.h5", "--to", "html", "-o", folder / "plain.html", "--scene", look, "--size", "800x450", "--scales", "1")
    _, scene, _ = read_page(folder / "plain.html")
    for k in (0, scene["times"]["count"] // 3, 3 * scene["times"]["count"] // 4):
        t = scene["times"]["first"] + k * scene["times"]["step"]
        png = folder / f"browser_{k}.png"
        in_browser(browser, f"file://{folder}/plain.html#clean=1&t={t!r}&scale=1&ghost=0", png)
        ours, theirs = silhouette(folder / "plain" / "frames" / f"frame_{k:05d}.png"), silhouette(png)
        expect(ours.sum() > 3000, f"picture {k} shows something")
        missed = (ours & ~grown(theirs)).sum() + (theirs & ~grown(ours)).sum()
        near(missed, 0, 0, f"picture {k}: pixels of a silhouette that lie more than one pixel from the other")
    # The slider: what it is set to moves the picture.
    dom = in_browser(browser, f"file://{folder}/page.html#scale=40&ghost=0&t=0.4", folder / "scaled.png")
    expect(re.search(r"<figure><svg", dom), "plots are drawn")
    # What the run warns of stands in the head; a link that is damaged moves nothing.
    warned = folder / "warned.html"
    text = (folder / "page.html").read_text(encoding="utf-8")
    expect(text.count("</dl>") == 1, "one summary")
    warned.write_text(text.replace("</dl>", '<dt>warning</dt><dd class="warning">one</dd></dl>'), encoding="utf-8")
    dom = in_browser(browser, f"file://{warned}#t=none&scale=x&follow=99&cut=q,1&view=1,2", folder / "warned.png")
    # Where no font has the title's letters the page says so too.
    count = text.count('class="warning"') + 1
    words = "1 warning" if count == 1 else f"{count} warnings"
    expect(re.search(rf'<button id="warned"[^>]*>{words}</button>', dom), f"the head counts the warnings: {words}")
    expect('<button id="warned" title="What the run warns of">' in dom, "and shows the count")
    # Colours: each draws something else, with its own bar; a word that is none leaves the scene's.
    shots = {}
    bars = {"own": "", "displacement": "elastic displacement", "stress": "stress", "velocity": "speed", "none": "elastic"}
    with Browser((800, 450)) as driven:
        seen = Page(driven, folder)
        for word, bar in bars.items():
            seen.open(f"file://{folder}/page.html#colour={word}&ghost=0&t=0.4")
            shots[word] = seen.pixels()
            legend = driven.ask("document.querySelector('#legend').textContent")
            expect(bar in legend and (word == "own") == (legend == ""), f"bar of the colour '{word}': {legend}")
        words = list(bars)[:4]
        alike = [(a, b) for i, a in enumerate(words) for b in words[:i] if changed(shots[a], shots[b]) < 200]
        expect(alike == [] and changed(shots["none"], shots["displacement"]) == 0, f"each colour draws another picture: {alike}")
        for scale in (40, 0):
            seen.open(f"file://{folder}/page.html#scale={scale}&ghost=0&t=0.4")
            shots[scale] = seen.pixels()
        expect(changed(shots[40], shots[0]) > 200, "exaggeration changes the picture")


with temporary_folder() as name:
    import pathlib

    folder = pathlib.Path(name)
    text = (examples / "slider_crank.toml").read_text()
    # A title that would end a script or an element, and a mark of the page's own text.
    title = re.search(r'^title = "(.*)"$', text, re.M).group(0)
    scene_file = folder / "slider crank.toml"
    scene_file.write_text(text.replace(title, "title = '</script><b>&\"@DATA@ <!-- ü 曲柄'"))
    run("simulate", scene_file, "-o", folder / "r.h5", "--no-effect-check", "--no-error-estimate")
    done = json.loads(run("export", folder / "r.h5", "--to", "html", "-o", folder / "page.html", "--json").stdout)
    page, scene, array = read_page(folder / "page.html")
    expect(page.headings == ['</script><b>&"@DATA@ <!-- ü 曲柄'], f"the title stands as it is: {page.headings}")
    expect(done["bytes"] == (folder / "page.html").stat().st_size < 2e6, f"the page is small: {done['bytes']} bytes")
    with h5py.File(folder / "r.h5") as results:
        check_motion(scene, array, results)
        check_deformation(scene, array, results, "rod", 2)  # its middle
        expect(len(scene["outputs"]) == results["outputs"]["columns"].shape[0], "every output can be plotted")
    expect(done["error"] < 5e-3 * done["largest_displacement"], f"vertices within {done['error']} m")
    run("export", folder / "r.h5", "--to", "vtkhdf", "-o", folder / "r.vtkhdf")
    check_colours(scene, array, folder / "r.vtkhdf")
    expect(done["colors"] == ["displacement", "stress", "velocity"] and done["value_error"] < 0.05, f"colours as told: {done}")
    speed = json.loads(run("export", folder / "r.h5", "--to", "html", "-o", folder / "v.html", "--color-by", "velocity", "--json").stdout)
    expect(speed["colors"] == ["velocity", "displacement", "stress"], f"the scene's own colour comes first: {speed['colors']}")
    _, other, _ = read_page(folder / "v.html")
    for c in scene["colours"]:
        twin = next(d for d in other["colours"] if d["word"] == c["word"])
        expect([twin[k] for k in ("lower", "upper", "unit")] == [c[k] for k in ("lower", "upper", "unit")], f"one range of {c['word']}")
    run("export", folder / "r.h5", "--to", "html", "-o", folder / "again.html")
    expect((folder / "page.html").read_bytes() == (folder / "again.html").read_bytes(), "the same page again")

    run("run", scene_file, "-o", folder / "out", "--html", "--frames", "0:2", "--size", "160x90", "--no-video", "--no-effect-check")
    expect((folder / "out" / "slider crank.html").is_file(), "run --html writes the page")
    refused = run("export", folder / "r.h5", "--to", "htm", code=2)
    expect("html" in refused.stderr, "a wrong word names what there is")
    if "--browser" in sys.argv:
        check_browser(folder, scene_file)
        check_controls(folder, folder / "page.html", scene["times"]["step"], scene["times"]["step"] * (scene["times"]["count"] - 1))
finish()
