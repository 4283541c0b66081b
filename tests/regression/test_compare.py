"""`flexframe compare` on pictures made here: measures against numpy, several baselines, what is ignored, reports; with --browser the page.

    test_compare.py FLEXFRAME SOURCE_DIR [--browser]
"""
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import urllib.parse
import xml.etree.ElementTree
import zlib

import numpy as np

from program import expect, finish, near, run, temporary_folder

WIDTH, HEIGHT = 320, 180


def png(pixels, depth=8, text=(), clear=None):
    """The bytes of a PNG file; pixels: height x width x channels, or height x width; clear: the colour that counts as transparent."""
    pixels = np.asarray(pixels, ">u2" if depth == 16 else np.uint8)
    pixels = pixels.reshape(pixels.shape[0], pixels.shape[1], -1)
    height, width, channels = pixels.shape
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, depth, {1: 0, 2: 4, 3: 2, 4: 6}[channels], 0, 0, 0)
    words = b"".join(chunk(b"tEXt", f"{key}\0{value}".encode("latin-1")) for key, value in text)
    if clear is not None:
        words += chunk(b"tRNS", struct.pack(f">{len(clear)}H", *clear))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + words + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def scene(seed):
    """A picture with structure: gradients, a disc, noise that does not pack."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    out = np.stack([40 + x / 2, 60 + y / 2, 120 + (x + y) / 4], axis=2)
    out[(x - 100 - 5 * seed) ** 2 + (y - 90) ** 2 < 900] = (200, 60, 40)
    out[:, 200:] += random.integers(0, 30, (HEIGHT, WIDTH - 200, 3))
    return out.clip(0, 255).astype(np.uint8)


def write(path, pixels, **more):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(png(pixels, **more))


def compare(*words, code=0):
    done = run("compare", *words, "--json", code=code)
    try:
        return {row["name"]: row for row in json.loads(done.stdout)["pictures"]}
    except ValueError:
        return {}


def measures(folder):
    """Numbers and box of a pair are those that numpy finds."""
    random = np.random.default_rng(7)
    before = scene(0)
    after = before.copy()
    after[40:52, 110:131] = (255, 0, 255)
    spots = random.integers(0, [HEIGHT, WIDTH], (30, 2))
    after[spots[:, 0], spots[:, 1]] ^= 4
    write(folder / "m/a.png", before)
    write(folder / "m/b.png", after)
    row = compare(folder / "m/a.png", folder / "m/b.png", code=1)["b.png"]
    off = np.abs(after.astype(int) - before).max(axis=2)
    ys, xs = np.nonzero(off > 2)
    expect(row["largest"] == off.max() and row["pixels_over"] == (off > 2).sum(), f"largest and number of pixels: {row}")
    near(row["mean"], np.abs(after.astype(int) - before).mean(), 1e-12, "mean difference")
    box = [xs.min(), ys.min(), xs.max() - xs.min() + 1, ys.max() - ys.min() + 1]
    expect(row["box"] == [int(v) for v in box], f"box {row['box']}, wanted {box}")
    # What is ignored counts nowhere, in shares and means neither.
    row = compare(folder / "m/a.png", folder / "m/b.png", "--ignore", "110,40,21x12", code=1)["b.png"]
    kept = np.ones((HEIGHT, WIDTH), bool)
    kept[40:52, 110:131] = False
    expect(row["ignored"] == 21 * 12 and row["pixels_over"] == (off[kept] > 2).sum(), f"ignored: {row}")
    near(row["mean"], np.abs(after.astype(int) - before)[kept].mean(), 1e-12, "mean of what is looked at")
    near(row["share_over"], (off[kept] > 2).mean(), 1e-12, "share of what is looked at")


def ignoring(folder):
    """Regions and masks: what they cover passes, what lies one pixel beyond does not, and nothing can be ignored by mistake."""
    a, b = folder / "i/a", folder / "i/b"
    for k in range(3):
        pixels = scene(k)
        write(a / f"shot_{k}.png", pixels)
        pixels[20:40, 30:70] = 255 - pixels[20:40, 30:70]
        write(b / f"shot_{k}.png", pixels)
    compare(a, b, code=1)
    compare(a, b, "--ignore", "30,20,40x20")
    for narrow in ("31,20,40x20", "30,21,40x20", "30,20,39x20", "30,20,40x19"):
        compare(a, b, "--ignore", narrow, code=1)
    rows = compare(a, b, "--ignore", "shot_[01].png:30,20,40x20", code=1)
    expect([rows[f"shot_{k}.png"]["result"] for k in range(3)] == ["equal", "equal", "differs"], f"regions by name: {rows}")
    compare(a, b, "--ignore", "30,20,40x10", "--ignore", "30,30,40x10")
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    mask[20:40, 30:70] = 255
    write(folder / "i/mask.png", mask)
    compare(a, b, "--mask", folder / "i/mask.png")
    painted = np.zeros((HEIGHT, WIDTH, 4), np.uint8)
    painted[20:40, 30:70] = 255
    for k in range(2):
        write(folder / f"i/masks/shot_{k}.png", painted)
    write(folder / "i/masks/gone.png", painted)
    rows = compare(a, b, "--mask", folder / "i/masks", code=1)
    expect([rows[f"shot_{k}.png"]["result"] for k in range(3)] == ["equal", "equal", "differs"], f"masks by name: {rows}")
    told = run("compare", a, b, "--mask", folder / "i/masks", code=1).stderr
    expect("gone.png" in told and "without a picture" in told, f"a mask of no picture is told: {told}")
    write(folder / "i/small.png", mask[:90])
    write(folder / "i/all.png", np.full((HEIGHT, WIDTH), 255))
    for words, what in [
        (("--mask", folder / "i/small.png"), "90"),
        (("--mask", folder / "i/all.png"), "nothing is compared"),
        (("--mask", folder / "i/none.png"), "none.png"),
        (("--ignore", "400,20,40x20"), "outside"),
        (("--ignore", "other*:30,20,40x20"), "no picture has such a name"),
        (("--ignore", "0,0,320x180"), "nothing is compared"),
        (("--ignore", "30,20,40"), "X,Y,WxH"),
        (("--ignore", "30,20,0x5"), "X,Y,WxH"),
        (("--ignore", "a,b,cxd"), "X,Y,WxH"),
        (("--ignore", "99999999999,20,4x4"), "X,Y,WxH"),
    ]:
        told = run("compare", a, b, *words, code=2).stderr
        expect(what in told, f"{words}: {told}")


def baselines(folder):
    """A picture agrees if it agrees with any; which it was is told; 16 bits likewise; --update writes the first."""
    for k, name in enumerate("abc"):
        write(folder / f"s/{name}/x.png", scene(k))
        write(folder / f"s/{name}/depth.png", np.arange(WIDTH * HEIGHT).reshape(HEIGHT, WIDTH) % 60000 + 500 * k, depth=16)
    new = folder / "s/new"
    shutil.copytree(folder / "s/b", new)
    compare(folder / "s/a", new, code=1)
    rows = compare(folder / "s/a", new, "--also", folder / "s/c", "--also", folder / "s/b")
    expect(all(row["result"] == "equal" and "/s/b/" in row["baseline"] for row in rows.values()), f"the one that agrees: {rows}")
    write(new / "x.png", np.where(np.arange(WIDTH)[None, :, None] < 4, 0, scene(2)))
    rows = compare(folder / "s/a", new, "--also", folder / "s/b", "--also", folder / "s/c", code=1)
    expect("/s/c/" in rows["x.png"]["baseline"], f"the nearest is shown: {rows['x.png']}")
    # A picture that only one of several baselines has is missing; one that only the new folder has, too.
    write(folder / "s/c/only.png", scene(3))
    write(new / "more.png", scene(4))
    rows = compare(folder / "s/b", new, "--also", folder / "s/c", code=1)
    expect(rows["only.png"]["result"] == "missing picture" and rows["more.png"]["result"] == "missing baseline", f"missing: {rows}")
    run("compare", folder / "s/b", new, "--also", folder / "s/c", "--update", "new colours")
    compare(folder / "s/b", new, "--also", folder / "s/c")
    expect((folder / "s/c/x.png").read_bytes() == png(scene(2)), "another baseline was changed")
    expect(not (folder / "s/c/only.png").exists(), "a picture that nobody draws is kept")
    run("compare", folder / "s/a", new, "--also", folder / "s/none", code=2)
    run("compare", folder / "s/a", new, "--also", folder / "s/b/x.png", code=2)
    rows = compare(folder / "s/a/x.png", new / "more.png", "--also", folder / "s/b/x.png", "--also", folder / "s/c/x.png", code=1)
    expect(len(rows) == 1, f"files: {rows}")


def reports(folder):
    """JUnit, Markdown and page of names that mean something to each of them; the same whatever the number of threads."""
    a, b = folder / "r/a", folder / "r/b"
    names = [
        "plain.png",
        "sub/deep.png",
        'a&b <i>"q".png',
        "bar|tick`_x.png",
        "grün 曲柄.png",
        os.fsdecode(b"latin\xe9 half\xed\xa0\x80.png"),
        "ok.png",
    ]
    for k, name in enumerate(names):
        write(a / name, scene(k), text=[("flexframe-environment", "llvmpipe, this one")])
        pixels = scene(k)
        if name != "ok.png":
            pixels[10 : 20 + k, 10:40] //= 2
        write(b / name, pixels, text=[("flexframe-environment", "llvmpipe, other" if k == 0 else "llvmpipe, this one")])
    write(a / "size.png", scene(0))
    write(b / "size.png", scene(0)[:100])
    made = []
    for jobs in (1, 5):
        words = ["--junit", folder / "j.xml", "--markdown", folder / "m.md", "--report", folder / "page.html", "--jobs", jobs]
        run("compare", a, b, *words, code=1, errors="surrogateescape")
        made.append([(folder / name).read_bytes() for name in ("j.xml", "m.md", "page.html")])
    expect(made[0] == made[1], "reports depend on the number of threads")
    try:
        suite = xml.etree.ElementTree.fromstring(made[0][0].decode("utf-8")).find("testsuite")
    except (UnicodeDecodeError, xml.etree.ElementTree.ParseError) as error:
        expect(False, f"JUnit's file cannot be read: {error}")
        return
    cases = {case.get("name"): case.find("failure") for case in suite.findall("testcase")}
    expect(len(cases) == 8 and suite.get("tests") == "8" and suite.get("failures") == "7", f"JUnit counts: {suite.attrib}")
    expect(cases["ok.png"] is None and cases[names[2]] is not None and cases["size.png"].get("type") == "other size", f"cases: {cases}")
    facts = {p.get("name"): p.get("value") for p in suite.find("properties")}
    expect(os.uname().release in facts["machine"] and "llvmpipe" in facts["renderer"], f"machine and renderer: {facts}")
    text = made[0][1].decode("utf-8")
    rows = [line for line in text.splitlines() if line.startswith("|")][2:]
    expect(len(rows) == 7 and all(len(re.findall(r"(?<!\\)\|", row)) == 4 for row in rows), f"rows of the table: {rows}")
    expect("7 of 8 pictures do not agree" in text and facts["renderer"].split(",")[0] in text, f"summary: {text[:400]}")
    page = made[0][2].decode("utf-8")
    expect("<i>" not in page and page.count('class="pair"') == 7 and "llvmpipe, other" in page, "names on the page")
    # Links lead to the files.
    links = re.findall(r'<a href="([^"#]+)">(?:baseline|new picture)', page)
    there = [(folder / urllib.parse.unquote(link, errors="surrogateescape")).is_file() for link in links]
    expect(len(links) == 14 and all(there), f"links: {links}")
    # The page keeps to its size and says what it leaves out.
    for size in (0.1, 0.3):
        run("compare", a, b, "--report", folder / "small.html", "--page-size", size, code=1, errors="replace")
        small = (folder / "small.html").read_text()
        expect(len(small.encode()) <= 1e6 * size, f"a page of {size} MB has {len(small)} bytes")
        expect("cut to" in (folder / "small.html").read_text(), "what is cut is said")
    expect(
        not (folder / "none").exists() and run("compare", a, b, "--junit", folder / "none/j.xml", code=1).stderr,
        "a folder that is not there",
    )


def unreadable(folder):
    """A damaged picture of a folder is told as bad input, and the others are compared and reported all the same."""
    a, b = folder / "u/a", folder / "u/b"
    for k in range(4):
        write(a / f"{k}.png", scene(k))
        write(b / f"{k}.png", scene(k))
    (b / "1.png").write_bytes((b / "1.png").read_bytes()[:3000])
    os.symlink("nowhere", a / "link.png")
    write(b / "link.png", scene(1))
    pixels = scene(2)
    pixels[10:40, 10:40] //= 2
    write(b / "2.png", pixels)
    reports = ["--junit", folder / "u.xml", "--report", folder / "u.html", "--markdown", folder / "u.md"]
    done = run("compare", a, b, "--json", *reports, code=2)
    rows = {row["name"]: row for row in json.loads(done.stdout)["pictures"]}
    results = [rows[name]["result"] for name in ("0.png", "1.png", "2.png", "3.png", "link.png")]
    expect(results == ["equal", "unreadable", "differs", "equal", "unreadable"], f"results: {results}")
    expect("b/1.png: damaged" in rows["1.png"]["reason"] and "a/link.png" in rows["link.png"]["reason"], f"reasons: {rows}")
    expect("b/1.png: damaged" in done.stderr and "1 more picture" in done.stderr, f"told: {done.stderr}")
    cases = xml.etree.ElementTree.parse(folder / "u.xml").findall(".//failure")
    expect([c.get("type") for c in cases] == ["unreadable", "differs", "unreadable"], f"JUnit: {[c.attrib for c in cases]}")
    for name in ("u.html", "u.md"):
        expect((folder / name).read_text().count("damaged PNG file") >= 1, f"{name} tells of the damaged picture")
    # No damaged picture becomes a baseline; a damaged baseline is replaced.
    kept = (a / "2.png").read_bytes()
    run("compare", a, b, "--update", "all", code=2)
    expect((a / "2.png").read_bytes() == kept, "a baseline was changed beside a picture that cannot be read")
    write(b / "1.png", scene(1))
    (a / "0.png").write_bytes(b"no picture")
    run("compare", a, b, "--update", "all")
    compare(a, b)
    # Nor does one that only the new folder has.
    (b / "new.png").write_bytes(b"no picture")
    run("compare", a, b, "--update", "more", code=2)
    expect(not (a / "new.png").exists(), "a damaged picture became a baseline")
    run("compare", a, b, "--report", folder / "u.html", code=1)
    # Shards: what is left is told by the comparison of all.
    (b / "1.png").write_bytes(b"no picture")
    for shard in ("1/2", "2/2"):
        run("compare", a, b, "--shard", shard, "--parts", folder / "u/parts")
    done = run("compare", a, b, "--parts", folder / "u/parts", code=2)
    expect("b/1.png: not a PNG file" in done.stderr, f"after shards: {done.stderr}")


def names(folder):
    """Endings in capitals, linked folders and a link to the folder itself, names of two lines."""
    a, b = folder / "l/a", folder / "l/b"
    for side in (a, b):
        for k, name in enumerate(("UP.PNG", "two\nlines.Png")):
            write(side / name, scene(k))
        write(folder / "l/elsewhere" / side.name / "deep.png", scene(3 if side == a else 4))
        os.symlink(folder / "l/elsewhere" / side.name, side / "linked")
        os.symlink(side, side / "loop")
    rows = compare(a, b, code=1)
    expect(sorted(rows) == ["UP.PNG", "linked/deep.png", "two\nlines.Png"], f"names: {sorted(rows)}")
    expect(rows["linked/deep.png"]["result"] == "differs" and rows["UP.PNG"]["result"] == "equal", f"rows: {rows}")
    write(b / "two\nlines.Png", scene(5))
    run("compare", a, b, "--update", "why")
    lines = (a / "CHANGES.md").read_text().splitlines()
    expect([line for line in lines if line] == ["# Why baselines changed", "- why: linked/deep.png two lines.Png"], f"notes: {lines}")


def formats(folder):
    """The same pixels in other forms of PNG are equal; what is asked of a number is a number."""
    pixels, grey = scene(0), scene(0)[..., 0]
    write(folder / "f/clear.png", pixels, clear=[int(v) for v in pixels[0, 0]])
    opaque = np.where((pixels == pixels[0, 0]).all(axis=2), 0, 255)
    write(folder / "f/alpha.png", np.dstack([pixels, opaque]))
    compare(folder / "f/clear.png", folder / "f/alpha.png", "--exact")
    write(folder / "f/plain.png", pixels)
    compare(folder / "f/clear.png", folder / "f/plain.png", code=1)
    write(folder / "f/grey.png", grey, clear=[int(grey[0, 0])])
    write(folder / "f/grey_alpha.png", np.dstack([grey, np.where(grey == grey[0, 0], 0, 255)]))
    compare(folder / "f/grey.png", folder / "f/grey_alpha.png", "--exact")
    deep = 257 * grey.astype(int)
    write(folder / "f/deep.png", deep, depth=16)
    write(folder / "f/deep_alpha.png", np.dstack([deep, np.full_like(deep, 65535)]), depth=16)
    write(folder / "f/deep_rgb.png", np.dstack([deep, deep, deep + 300 * (grey < 200)]), depth=16)
    compare(folder / "f/deep.png", folder / "f/deep_alpha.png", "--exact")
    compare(folder / "f/deep.png", folder / "f/deep_rgb.png", code=1)
    done = run("compare", folder / "f/plain.png", folder / "i/a/shot_0.png", "--mean", "nan", code=2)
    expect("--mean: must be 0 to 255, found 'nan'" in done.stderr, f"NaN: {done.stderr}")
    for words, told in (
        (("--pixels", 0.5), "--pixels is for two results files"),
        (("--levels", 1, "--levels", 2), "--levels is given 2 times"),
        (("--levels",), "--levels needs N behind it"),
    ):
        error = run("compare", folder / "f/plain.png", folder / "f/plain.png", *words, code=2).stderr
        expect(told in error, f"{words}: {error}")
    write(folder / "f/low.png", pixels[:100])
    done = run("compare", folder / "f/plain.png", folder / "f/low.png", code=1)
    expect("320 x 100 pixels, the baseline has 320 x 180" in done.stdout, f"sizes: {done.stdout}")


def worst(folder):
    """SSIM and FLIP of the worst pairs only; the others have none rather than a wrong one."""
    for k in range(6):
        pixels = scene(k)
        write(folder / f"w/a/{k}.png", pixels)
        pixels[50 : 60 + 10 * k, 20:60] ^= 64
        write(folder / f"w/b/{k}.png", pixels)
    rows = compare(folder / "w/a", folder / "w/b", "--measure", 2, code=1)
    expect([k for k in range(6) if rows[f"{k}.png"]["ssim"] is not None] == [4, 5], f"measured: {rows}")
    every = compare(folder / "w/a", folder / "w/b", code=1)
    expect(all(0 < row["ssim"] < 1 and row["flip"] > 0 for row in every.values()), f"all measured: {every}")
    expect(rows["5.png"] == every["5.png"], "the same measures")


def many(folder):
    """300 pairs that differ: one page below 5 MB, worst first."""
    pixels = scene(0)
    for k in range(300):
        write(folder / f"n/a/{k:03d}.png", pixels)
        changed = pixels.copy()
        changed[20 : 21 + k // 3, 220:300] ^= 32
        write(folder / f"n/b/{k:03d}.png", changed)
    run("compare", folder / "n/a", folder / "n/b", "--report", folder / "many.html", "--measure", 2, code=1)
    page = (folder / "many.html").read_text()
    expect(len(page.encode()) <= 5e6, f"the page has {len(page)} bytes")
    shown = re.findall(r'data-name="(\d+)\.png"', page)
    expect(len(shown) >= 20 and set(shown[:3]) == {"297", "298", "299"}, f"shown: {shown}")
    expect(len(re.findall("<tr><td>", page)) == 300 and f"worst {len(shown)} of 300" in page, "the table has them all")


def pixels_of(path):
    out = subprocess.run(["ffmpeg", "-v", "error", "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"], capture_output=True, check=True)
    return np.frombuffer(out.stdout, np.uint8).reshape(900, 1200, 3)


def browser(folder):
    """The page in Chromium: every mode shows what it says, at the place of the difference."""
    if "--browser" not in sys.argv:
        return
    program = shutil.which("chromium") or shutil.which("google-chrome")
    expect(program, "Chromium is missing: install the section [nightly] of tests/packages.txt")
    before = np.full((HEIGHT, WIDTH, 3), 90)
    after = before.copy()
    after[60:100, 200:240] = (0, 200, 0)
    write(folder / "p/a/x.png", before)
    write(folder / "p/b/x.png", after)
    run("compare", folder / "p/a", folder / "p/b", "--report", folder / "p/page.html", code=1)

    def shot(words):
        url = f"file://{folder}/p/page.html#pair=x.png&only=1&{words}"
        flags = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader", "--hide-scrollbars"]
        flags += ["--enable-unsafe-swiftshader", "--window-size=1200,900", "--virtual-time-budget=3000", "--enable-logging=stderr"]
        done = subprocess.run([program, *flags, f"--screenshot={folder}/shot.png", url], capture_output=True, text=True, timeout=180)
        expect("CONSOLE" not in done.stderr, f"the browser says {[line for line in done.stderr.splitlines() if 'CONSOLE' in line][:3]}")
        return pixels_of(folder / "shot.png")

    def count(image, color):
        return int((np.abs(image.astype(int) - color).max(axis=2) < 8).sum())

    grey, green, red = (90, 90, 90), (0, 200, 0), (214, 0, 40)
    whole = shot("mode=blink&turned=1")
    place = np.nonzero((np.abs(whole.astype(int) - green).max(axis=2) < 8))
    zoom = (np.ptp(place[1]) + 1) / 40
    near((np.ptp(place[0]) + 1) / 40, zoom, 0.02 * zoom, "the new picture keeps its shape")
    near(count(whole, green), 1600 * zoom**2, 0.03 * 1600 * zoom**2, "the new picture's square")
    expect(count(shot("mode=blink&turned=0"), green) == 0, "the baseline has no square")
    close = shot("mode=blink&turned=1&at=difference")
    expect(count(close, green) > 3 * count(whole, green), "the zoom goes to the difference")
    # The line goes through the square: a half of it is the baseline's.
    near(
        count(shot("mode=swipe&split=0.5&at=difference"), green),
        0.5 * count(close, green),
        0.03 * count(close, green),
        "half of the square",
    )
    expect(count(shot("mode=swipe&split=1&at=difference"), green) == 0, "the baseline alone")
    near(count(shot("mode=difference"), red), count(whole, green), 0.03 * count(whole, green), "what differs is red")
    both = shot("mode=side")
    expect(0 < count(both, green) < count(whole, green) / 3 and count(both, grey) > 0, "side by side, smaller")


with temporary_folder() as name:
    for part in (measures, ignoring, baselines, reports, unreadable, names, formats, worst, many, browser):
        print(f"== {part.__name__}", flush=True)
        part(pathlib.Path(name))
finish()
