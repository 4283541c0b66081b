"""The page of a run, used as a person would in a real Chromium: every control by mouse, keys and fingers. For test_page.py --browser."""

import math
import subprocess
import time

import numpy as np

from browser import Browser
from program import expect, near

SIZE = (1000, 700)


class Page:
    """What a person sees of the page and what its link says of time and view."""

    def __init__(self, browser, folder):
        self.browser, self.folder = browser, folder

    def open(self, address):
        self.browser.open(address)
        self.browser.wait("document.documentElement.dataset.ready === '1'")
        box = self.browser.ask("(b => [b.x, b.y, b.width, b.height])(document.querySelector('#view').getBoundingClientRect())")
        self.box = [int(v) for v in box]

    def at(self, x, y):
        """A place in the scene by shares of its width and height."""
        return [self.box[0] + x * self.box[2], self.box[1] + y * self.box[3]]

    def state(self):
        """The words of the link to this time and view."""
        self.browser.key("l")
        words = dict(w.split("=", 1) for w in self.browser.ask("location.hash").lstrip("#").split("&"))
        numbers = [float(v) for v in words["view"].split(",")]
        view = {"position": np.array(numbers[:3]), "target": np.array(numbers[3:6])}
        return words | {"t": float(words["t"]), "scale": float(words["scale"])} | view

    def pixels(self):
        """The scene as it is seen, height x width x 3."""
        time.sleep(0.6)  # what rests is drawn whole
        self.browser.settle()
        png = self.browser.picture(self.folder / "seen.png")
        words = ["ffmpeg", "-v", "error", "-i", png, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
        raw = np.frombuffer(subprocess.run(words, capture_output=True, check=True).stdout, np.uint8)
        wide = self.browser.ask("innerWidth")
        x, y, w, h = self.box
        return raw.reshape(-1, wide, 3)[y : y + h, x : x + w].astype(int)


def changed(before, after):
    return (np.abs(before - after).max(axis=2) > 8).sum()


def distance(state):
    return np.linalg.norm(state["position"] - state["target"])


def camera(page):
    """Orbit, move, zoom by the mouse; views by keys; the distance that a view keeps."""
    b, first = page.browser, page.state()
    b.drag(page.at(0.4, 0.5), page.at(0.5, 0.55))
    turned = page.state()
    near(distance(turned) / distance(first), 1.0, 1e-4, "a drag turns about the target: distance")
    expect(np.linalg.norm(turned["position"] - first["position"]) > 0.1 * distance(first), "a drag turns the scene")
    expect(np.allclose(turned["target"], first["target"], atol=1e-6), "the target of a turn stays")
    b.drag(page.at(0.4, 0.5), page.at(0.5, 0.5), button="right")
    moved = page.state()
    way = moved["target"] - turned["target"]
    expect(np.allclose(moved["position"] - turned["position"], way, atol=1e-5) and np.linalg.norm(way) > 0, "a right drag moves the scene")
    b.wheel(page.at(0.4, 0.5), 100)
    near(distance(page.state()) / distance(moved), math.exp(0.1), 1e-3, "the wheel zooms")
    views = {}
    for key in "1234":
        b.key(key)
        views[key] = page.state()["position"]
    expect(len({tuple(v) for v in views.values()}) == 4, "four views by keys")
    b.key("f")
    b.key("0")
    expect(np.allclose(page.state()["position"], first["position"], atol=1e-5), "0 leads back to the view of the pictures")


def clock(page, step, last):
    """Play and stop, one picture on and back, scrub, speed."""
    b = page.browser
    begin = page.state()["t"]
    b.key(" ")
    time.sleep(1.5)
    b.key(" ")
    stopped = page.state()["t"]
    expect(begin < stopped < last, f"it plays from {begin} to {stopped} s")
    time.sleep(0.3)
    near(page.state()["t"], stopped, 0.0, "what is stopped stays")
    b.key("ArrowRight")
    near(page.state()["t"], stopped + step, 2e-7, "one picture on")
    b.key("ArrowLeft")
    near(page.state()["t"], stopped, 2e-7, "one picture back")
    speed = float(b.ask("document.querySelector('#speed').value"))
    b.key("ArrowUp")
    expect(float(b.ask("document.querySelector('#speed').value")) > speed, "faster")
    b.key("ArrowDown")
    near(float(b.ask("document.querySelector('#speed').value")), speed, 0.0, "slower")
    # A click in the middle of the time's slider.
    b.click(b.middle("#scrub"))
    near(page.state()["t"], last / 2, 0.02 * last, "time by its slider")
    seen = b.ask("document.querySelector('#time').textContent")
    near(float(seen.split("=")[1].split()[0]), page.state()["t"], 1e-4, "the time that is shown")


def deformation(page):
    """Exaggeration by the slider, its number and keys; as a ghost or alone; colours."""
    b = page.browser
    before = page.pixels()
    b.click(b.middle("#scale", 0.9))
    more = page.state()["scale"]
    expect(more > 1 and changed(before, page.pixels()) > 200, f"the slider exaggerates: {more}")
    b.click(b.middle("#scale", 0.3))
    less = page.state()["scale"]
    expect(0 < less < more, f"and less: {less}")
    b.key("+")
    near(page.state()["scale"] / less, 1.25, 1e-2, "+ exaggerates")
    b.choose("#scale-number", 12.5)
    near(page.state()["scale"], 12.5, 0.0, "exaggeration as a number")
    ghost, seen = page.state()["ghost"], page.pixels()
    b.key("g")
    expect(page.state()["ghost"] != ghost and changed(seen, page.pixels()) > 200, "a ghost or alone")
    b.key("g")
    colour, seen = page.state()["colour"], page.pixels()
    b.key("c")
    expect(page.state()["colour"] != colour and changed(seen, page.pixels()) > 200, "the next colours")
    b.choose("#colours", 0)
    expect(page.state()["colour"] == "displacement", "colours from the list")


def shown(page, last):
    """A cut, bodies hidden, following a body, plots and what a click on them does."""
    b = page.browser
    whole = page.pixels()
    b.choose("#cut", "x")
    cut = page.pixels()
    expect(page.state()["cut"].startswith("x,0.5") and changed(whole, cut) > 500, "a cut across x")
    b.click(b.middle("#cut-at", 0.8))
    expect(changed(cut, page.pixels()) > 100, "the cut moves")
    b.choose("#cut", "")
    b.choose("#bodies li:nth-child(2) input", True)
    expect(page.state()["hide"] == "1" and changed(whole, page.pixels()) > 500, "a body hides")
    b.choose("#bodies li:nth-child(2) input", True)
    expect(page.state()["hide"] == "", "and is there again")
    # The slider alone, by its dark pixels on the bright sky: followed it stays where it is.
    places = {}
    names = b.ask("[...document.querySelectorAll('#bodies li')].map(l => l.textContent)")
    block = names.index("block")
    b.choose("#ground", False)
    for k in range(len(names)):
        if k != block:
            b.choose(f"#bodies li:nth-child({k + 1}) input", False)
    for follow in (-1, block):
        b.choose("#follow", follow)
        for share in (0.1, 0.5):
            b.click(b.middle("#scrub", share))
            scene = page.pixels()
            # The legend stands on the right.
            scene = scene[:, : int(0.78 * scene.shape[1])]
            dark = (scene.max(axis=2) - np.median(scene.max(axis=2), axis=1, keepdims=True)) < -40
            places[follow, share] = np.argwhere(dark).mean(axis=0)
    free, kept = (np.linalg.norm(places[f, 0.5] - places[f, 0.1]) for f in (-1, block))
    expect(free > 50 and kept < 0.1 * free, f"a body that is followed stays where it is: {kept:.1f} of {free:.1f} pixels")
    for k in range(len(names)):
        if k != block:
            b.choose(f"#bodies li:nth-child({k + 1}) input", True)
    b.choose("#follow", -1)
    b.choose("#ground", True)
    count = b.ask("document.querySelectorAll('#plots figure').length")
    b.choose("#add", 2)
    expect(b.ask("document.querySelectorAll('#plots figure').length") == count + 1, "a plot more")
    mark = "document.querySelector('#plots .mark').getAttribute('x1')"
    before = float(b.ask(mark))
    b.click(b.middle("#plots figure", 0.75))
    time_there = page.state()["t"]
    expect(0.6 * last < time_there < 0.95 * last, f"a click on a plot sets the time: {time_there} of {last}")
    expect(float(b.ask(mark)) > before, "the mark goes along")
    b.click(b.middle("#plots figure:last-child button"))
    expect(b.ask("document.querySelectorAll('#plots figure').length") == count, "the plot is removed")


def surroundings(page, address):
    """Light and dark as the system says and by key, the list of keys, a link that leads back, fingers."""
    b = page.browser
    dark = "document.documentElement.dataset.theme"
    b.emulate(prefers_color_scheme="dark")
    expect(b.ask(dark) == "dark" and page.pixels().mean() < 90, "dark where the system is")
    b.key("t")
    expect(b.ask(dark) == "light" and page.pixels().mean() > 160, "light by a key")
    b.key("h")
    expect(b.ask("!document.querySelector('#help').hidden"), "the keys are listed")
    b.key("h")
    said = page.state()
    linked = b.ask("location.hash")
    page.open(address + linked)
    expect(page.state()["view"] == said["view"] and b.ask("location.hash") == linked, "a link leads to the same time and view")
    b.call("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=5)
    before = page.state()
    b.fingers((page.at(0.4, 0.5), page.at(0.5, 0.55)))
    turned = page.state()
    near(distance(turned) / distance(before), 1.0, 1e-4, "one finger turns: distance")
    expect(np.linalg.norm(turned["position"] - before["position"]) > 0.1 * distance(before), "one finger turns the scene")
    b.fingers((page.at(0.4, 0.5), page.at(0.3, 0.5)), (page.at(0.6, 0.5), page.at(0.7, 0.5)))
    near(distance(page.state()) / distance(turned), 0.5, 0.02, "two fingers twice as far apart zoom")


def check_controls(folder, page_file, step, last):
    """All of it; nothing is complained of, nothing is loaded from elsewhere."""
    address = f"file://{page_file}"
    with Browser(SIZE) as browser:
        page = Page(browser, folder)
        page.open(address + "#t=0.1")
        camera(page)
        clock(page, step, last)
        deformation(page)
        shown(page, last)
        surroundings(page, address)
        expect(browser.complaints == [], f"the console says {browser.complaints[:3]}")
        elsewhere = [a for a in browser.asked if not a.startswith(("file:", "data:", "about:"))]
        expect(elsewhere == [], f"the page loads {elsewhere}")
        # Without scripts: the picture, with its plots, and the summary.
        browser.call("Emulation.setScriptExecutionDisabled", value=True)
        browser.call("Page.navigate", url=address)
        time.sleep(2)
        seen = {}
        for what, selector in {"picture": "#stage img", "summary": "#run dt", "controls": "#bar", "views": "aside .row"}.items():
            document = browser.call("DOM.getDocument")["root"]["nodeId"]
            node = browser.call("DOM.querySelector", nodeId=document, selector=selector)["nodeId"]
            try:
                seen[what] = browser.call("DOM.getBoxModel", nodeId=node)["model"]["height"] > 0
            except RuntimeError:  # it has no box
                seen[what] = False
        expect(seen == {"picture": True, "summary": True, "controls": False, "views": False}, f"without scripts: {seen}")
    with Browser(SIZE, ["--disable-3d-apis"]) as browser:
        page = Page(browser, folder)
        page.open(address)
        expect("WebGL" in browser.ask("document.querySelector('#message').textContent"), "without WebGL it says so")
        expect(browser.ask("document.querySelector('#stage img').clientWidth") > 300, "without WebGL a picture")
        expect(browser.ask("document.querySelectorAll('#plots svg path').length") > 0, "without WebGL plots")
        expect(browser.ask("document.querySelector('#run-part').open"), "without WebGL the summary is open")
        before = browser.ask("document.querySelector('#time').textContent")
        browser.click(browser.middle("#scrub"))
        expect(browser.ask("document.querySelector('#time').textContent") != before, "without WebGL time runs in the plots")
