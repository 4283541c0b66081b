"""Pictures for print: vector files beside the pictures, sizes in millimetres, dots an inch; with --browser the vector file in Chromium.

    test_vector.py FLEXFRAME SOURCE_DIR [--browser]
"""
import base64
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import xml.etree.ElementTree
import zlib

import numpy as np

from program import expect, finish, history, near, run, temporary_folder

SCENE = """title = "Swing & <sway>, ü"
[simulation]
duration = 1.0
gravity = [0, -9.81, 0]
[[body]]
name = "rod"
kind = "rigid"
density = 500.0
shapes = [{ shape = "box", size = [0.4, 0.05, 0.05], position = [0.2, 0, 0] }]
frames = { tip = [0.4, 0, 0] }
[[joint]]
name = "pin"
kind = "revolute"
parent = "ground"
child = "rod"
[[output]]
name = "speed"
quantity = "velocity"
of = "rod.tip"
[render]
size = [640, 360]
frame_rate = 4
speed = 1.0
channels = ["vector"]
color_by = "velocity"
overlay = { plot = ["speed.y"] }
"""
NAME = "{http://www.w3.org/2000/svg}"
WIDTH, HEIGHT = 640, 360


def pixels(data, width=WIDTH, height=HEIGHT):
    words = ["ffmpeg", "-v", "error", "-i", "-", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    out = subprocess.run(words, input=data, capture_output=True, check=True).stdout
    return np.frombuffer(out, np.uint8).reshape(height, width, 3).astype(int)


def dots(path):
    """pHYs of a PNG file: dots a metre, or None."""
    data = path.read_bytes()
    at = data.find(b"pHYs")
    return struct.unpack(">IIB", data[at + 4 : at + 13]) if at > 0 else None


def elements(svg, what):
    return list(svg.iter(NAME + what))


def vector(folder):
    """Words, bar and plot are where the picture has them, and the plot's line holds the values of the history."""
    root = xml.etree.ElementTree.fromstring((folder / "out/vector/frame_00002.svg").read_text(encoding="utf-8"))
    expect(root.get("width") == str(WIDTH) and root.get("viewBox") == f"0 0 {WIDTH} {HEIGHT}", f"size: {root.attrib}")
    words = {t.text: t for t in elements(root, "text")}
    expect("Swing & <sway>, ü" in words and any(w.startswith("t = 0.5") for w in words), f"words: {list(words)}")
    image = elements(root, "image")
    data = [v for k, v in image[0].attrib.items() if k.endswith("href")][0]
    below = pixels(base64.b64decode(data.split(",")[1]))
    whole = pixels((folder / "out/frames/frame_00002.png").read_bytes())
    off = np.abs(below - whole).max(axis=2) > 0
    # What the vector elements cover, and no more, is missing in the pixels.
    covered = np.zeros((HEIGHT, WIDTH), bool)

    def cover(x, y, w, h):
        covered[max(0, int(y) - 2) : int(np.ceil(y + h)) + 2, max(0, int(x) - 2) : int(np.ceil(x + w)) + 2] = True

    for r in elements(root, "rect"):
        cover(*(float(r.get(k)) for k in ("x", "y", "width", "height")))
    for t in words.values():
        if t.get("x"):
            size, wide = float(t.get("font-size")), float(t.get("textLength"))
            cover(float(t.get("x")), float(t.get("y")) - size, wide, 1.3 * size)
    for p in elements(root, "path") + elements(root, "polygon"):
        numbers = np.array(re.findall(r"-?[\d.]+", p.get("d") or p.get("points")), float).reshape(-1, 2)
        cover(*numbers.min(axis=0), *np.ptp(numbers, axis=0))
    for c in elements(root, "circle"):
        x, y, r = (float(c.get(k)) for k in ("cx", "cy", "r"))
        cover(x - r, y - r, 2 * r, 2 * r)
    expect(off.sum() > 5000 and not (off & ~covered).any(), f"{(off & ~covered).sum()} of {off.sum()} pixels differ without an element")

    # Axes by their own ticks: numbers below the plot and left of it.
    def scale(along, other, pick):
        ticks = []
        for text, t in words.items():
            if not re.fullmatch(r"[−-]?[\d.]+", text) or not t.get("x") or not pick(t):
                continue
            middle = (
                float(t.get("x")) + 0.5 * float(t.get("textLength"))
                if along == "x"
                else float(t.get("y")) - 0.36 * float(t.get("font-size"))
            )
            ticks.append((middle, float(text.replace("−", "-"))))
        return np.polyfit(*np.array(ticks).T, 1)

    line = max(elements(root, "path"), key=lambda p: len(p.get("d")))
    points = np.array(re.findall(r"-?[\d.]+", line.get("d")), float).reshape(-1, 2)
    left, low = points[:, 0].min(), points[:, 1].max()
    x = scale("x", "y", lambda t: float(t.get("y")) > low + 2)
    y = scale("y", "x", lambda t: float(t.get("x")) < left and float(t.get("y")) > 0.6 * HEIGHT)
    h = history(folder / "out/histories.csv")
    shown = np.polyval(y, points[:, 1])
    truth = np.interp(np.polyval(x, points[:, 0]), h["t"], h["speed.y"])
    near(np.abs(shown - truth).max() / np.ptp(truth), 0, 0.02, "the plot's line against the history / its range")


def again(folder):
    """The same bytes by any number of workers; --resume keeps what is whole and draws what is not."""
    first = {p.name: p.read_bytes() for p in (folder / "out/vector").iterdir()}
    expect(len(first) == 5, f"files: {sorted(first)}")
    run("render", folder / "out/results.h5", "-o", folder / "two", "--no-video", "--workers", 2)
    expect({p.name: p.read_bytes() for p in (folder / "two/vector").iterdir()} == first, "two workers draw other files")
    half = folder / "two/vector/frame_00001.svg"
    half.write_bytes(half.read_bytes()[:5000])
    (folder / "two/vector/frame_00003.svg").unlink()
    done = run("render", folder / "out/results.h5", "-o", folder / "two", "--no-video", "--resume", "--json")
    expect('"kept": 3' in done.stdout, f"kept: {done.stdout[:400]}")
    expect({p.name: p.read_bytes() for p in (folder / "two/vector").iterdir()} == first, "resumed files differ")
    # Pixels are the same with the vector file and without.
    run("render", folder / "out/results.h5", "-o", folder / "plain", "--no-video", "--scene", folder / "plain.toml", "--frames", "2:3")
    run("compare", folder / "plain/frames/frame_00002.png", folder / "out/frames/frame_00002.png", "--exact")
    expect(not (folder / "plain/vector").exists(), "a vector file that nobody asked for")


def others(folder):
    """PDF and linear light beside the pictures: the PDF's pixels are the SVG's, light becomes the picture's bytes, --resume keeps both."""

    words = SCENE[SCENE.index("[render]") :].replace('channels = ["vector"]', 'channels = ["vector", "linear"]')
    (folder / "others.toml").write_text(words, encoding="utf-8")
    command = ["render", folder / "out/results.h5", "-o", folder / "others", "--no-video", "--scene", folder / "others.toml", "--pdf"]
    run(*command, "--frames", "1:3")
    pdf = (folder / "others/pdf/frame_00002.pdf").read_bytes()
    expect(pdf.startswith(b"%PDF-1.4\n% flexframe-inputs ") and pdf.endswith(b"%%EOF\n"), f"head and end: {pdf[:60]}")
    # The first stream is the page's content, the second the pixels.
    streams = [zlib.decompress(s) for s in re.findall(rb"/Length \d+ >>\nstream\n(.*?)\nendstream", pdf, re.S)]
    expect(b" re\n" in streams[0] and b" c\n" in streams[0], "no rectangles and letters on the page")
    root = xml.etree.ElementTree.fromstring((folder / "others/vector/frame_00002.svg").read_text(encoding="utf-8"))
    data = [v for k, v in elements(root, "image")[0].attrib.items() if k.endswith("href")][0]
    expect((np.frombuffer(streams[1], np.uint8).reshape(HEIGHT, WIDTH, 3) == pixels(base64.b64decode(data.split(",")[1]))).all(), "pixels")
    near(float(re.search(rb"MediaBox \[0 0 ([\d.]+)", pdf)[1]), WIDTH * 72 / 96, 0.01, "width of the page, points")

    # Where the body covers the whole pixel: light to sRGB by its definition (IEC 61966-2-1).
    file = folder / "others/linear/frame_00002.png"
    words = ["ffmpeg", "-v", "error", "-i", str(file), "-f", "rawvideo", "-pix_fmt", "rgba64le", "-"]
    raw = subprocess.run(words, capture_output=True, check=True).stdout
    light = np.frombuffer(raw, "<u2").reshape(HEIGHT, WIDTH, 4) / 65535
    expect(b"gAMA\x00\x01\x86\xa0" in file.read_bytes(), "the file does not say that it is linear")
    srgb = np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055)[..., :3]
    picture = np.frombuffer(streams[1], np.uint8).reshape(HEIGHT, WIDTH, 3)
    body = light[..., 3] == 1
    expect(body.sum() > 300, f"the body covers {body.sum()} pixels")
    near(np.abs(255 * srgb - picture)[body].max(), 0, 2.5, "light against the picture, levels")
    done = run(*command, "--frames", "1:3", "--resume", "--json")
    expect('"kept": 2' in done.stdout, f"kept: {done.stdout[:400]}")
    (folder / "others/pdf/frame_00001.pdf").write_bytes(pdf[:-3])
    done = run(*command, "--frames", "1:3", "--resume", "--json")
    expect('"kept": 1' in done.stdout, f"a cut PDF passes for whole: {done.stdout[:400]}")


def paper(folder):
    """Millimetres and dots an inch become pixels, which the files say; words keep seven points."""
    run("render", folder / "out/results.h5", "-o", folder / "print", "--no-video", "--frames", "2:3", "--print-size", "80x50", "--dpi", 200)
    file = folder / "print/frames/frame_00002.png"
    expect(struct.unpack(">II", file.read_bytes()[16:24]) == (630, 394), "80 x 50 mm at 200 dpi are 630 x 394 pixels")
    expect(dots(file) == (7874, 7874, 1), f"dots a metre: {dots(file)}")
    root = xml.etree.ElementTree.fromstring((folder / "print/vector/frame_00002.svg").read_text(encoding="utf-8"))
    near(float(root.get("width").removesuffix("mm")), 80, 0.07, "width on paper, mm")
    sizes = {t.text: float(t.get("font-size")) * 72 / 200 for t in elements(root, "text")}
    near(next(v for k, v in sizes.items() if k.startswith("grid")), 7, 0.1, "size of the words on paper, points")
    expect(dots(folder / "out/frames/frame_00002.png") is None, "a picture for the screen says nothing of paper")
    run("render", folder / "out/results.h5", "-o", folder / "print", "--no-video", "--frames", "2:3", "--dpi", 150)
    expect(dots(file) == (5906, 5906, 1), f"dots a metre: {dots(file)}")
    for words, told in [
        (("--print-size", "80"), "print_size"),
        (("--print-size", "80x50", "--size", "100x100"), "--size"),
        (("--print-size", "3000x50"), "16384"),
        (("--print-size", "0x50"), "print_size"),
        (("--dpi", "0"), "dpi"),
        (("--dpi", "many"), "dpi"),
    ]:
        error = run("render", folder / "out/results.h5", "-o", folder / "wrong", "--no-video", *words, code=2).stderr
        expect(told in error, f"{words}: {error}")
    expect(not (folder / "wrong").exists(), "files of wrong words")


def captions(folder):
    """A long caption of an inset is cut and still says how much larger it is."""
    (folder / "inset.toml").write_text(
        '[render]\nsize = [640, 360]\nframe_rate = 4\nspeed = 1.0\nchannels = ["vector"]\ncolor_by = "velocity"\nprobes = ["rod.tip"]\n'
        'insets = [{ at = "rod.tip", zoom = 3, size = 0.25, label = "the tip of the rod that swings about its pin" }]\n'
    )
    run("render", folder / "out/results.h5", "-o", folder / "inset", "--no-video", "--scene", folder / "inset.toml")
    for file in sorted((folder / "inset/vector").glob("*.svg")):
        words = elements(xml.etree.ElementTree.fromstring(file.read_text(encoding="utf-8")), "text")
        caption = next(t for t in words if t.text.startswith("the tip"))
        expect(caption.text.endswith("\u2026, \u00d7 3"), f"caption: {caption.text}")


def browser(folder):
    """Chromium shows what the picture shows, but for the edges of letters."""
    if "--browser" not in sys.argv:
        return
    program = shutil.which("chromium") or shutil.which("google-chrome")
    expect(program, "Chromium is missing: install the section [nightly] of tests/packages.txt")
    flags = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars", f"--window-size={WIDTH},{HEIGHT}"]
    shot = folder / "shot.png"
    subprocess.run(
        [program, *flags, f"--screenshot={shot}", f"file://{folder}/out/vector/frame_00002.svg"], capture_output=True, timeout=180
    )
    a, b = pixels(shot.read_bytes()), pixels((folder / "out/frames/frame_00002.png").read_bytes())
    near(np.abs(a - b).mean(), 0, 1.0, "mean difference from the picture, levels")
    # Blocks of 16 x 8 hold as much ink: no word is missing or stands elsewhere.
    blocks = [m.mean(axis=2)[: HEIGHT // 8 * 8].reshape(HEIGHT // 8, 8, WIDTH // 16, 16).mean(axis=(1, 3)) for m in (a, b)]
    near(np.abs(blocks[0] - blocks[1]).max(), 0, 16, "ink of any block")


with temporary_folder() as name:
    folder = pathlib.Path(name)
    (folder / "swing.toml").write_text(SCENE)
    (folder / "plain.toml").write_text(SCENE[SCENE.index("[render]") :].replace('channels = ["vector"]\n', ""))
    run("run", folder / "swing.toml", "-o", folder / "out", "--no-video", "--no-error-estimate", "--no-effect-check")
    for part in (vector, again, others, paper, captions, browser):
        print(f"== {part.__name__}", flush=True)
        part(folder)
finish()
