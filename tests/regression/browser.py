"""A headless Chromium that is driven as a person would: keys, mouse, fingers, pictures of what is seen. Drawn in software.

Chromium's own protocol (DevTools) through a pipe: commands and events are JSON texts, each with a zero behind it.
"""

import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
import time

KEYS = {" ": ("Space", 32)} | {f"Arrow{way}": (f"Arrow{way}", 37 + k) for k, way in enumerate(("Left", "Up", "Right", "Down"))}


def chromium():
    return shutil.which("chromium") or shutil.which("google-chrome")


class Browser:
    """One page of `size` pixels. `complaints`: what its console says; `asked`: addresses that it has loaded."""

    def __init__(self, size=(800, 450), more=()):
        self.folder = tempfile.TemporaryDirectory(prefix="flexframe_browser_", ignore_cleanup_errors=True)
        words = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        words += ["--hide-scrollbars", f"--window-size={size[0]},{size[1]}", f"--user-data-dir={self.folder.name}", *more]
        to_browser, self.to = os.pipe()
        self.back, from_browser = os.pipe()

        def connect():  # the browser reads from 3 and writes to 4
            ends = os.dup(to_browser), os.dup(from_browser)
            os.dup2(ends[0], 3)
            os.dup2(ends[1], 4)

        quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        words = [chromium(), *words, "--remote-debugging-pipe", "about:blank"]
        self.process = subprocess.Popen(words, preexec_fn=connect, close_fds=False, **quiet)
        os.close(to_browser)
        os.close(from_browser)
        self.number, self.session, self.rest = 0, None, b""
        self.complaints, self.asked = [], []
        pages = [t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page"]
        self.session = self.call("Target.attachToTarget", targetId=pages[0]["targetId"], flatten=True)["sessionId"]
        for room in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{room}.enable")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(30)
        self.folder.cleanup()

    def message(self, seconds):
        end = time.time() + seconds
        while b"\0" not in self.rest:
            ready = select.select([self.back], [], [], max(0, end - time.time()))[0]
            part = os.read(self.back, 1 << 20) if ready else b""
            if not part:
                raise TimeoutError(f"the browser says nothing for {seconds} s")
            self.rest += part
        text, self.rest = self.rest.split(b"\0", 1)
        return json.loads(text)

    def call(self, method, seconds=120, **words):
        """A command's answer; what happens meanwhile is noted."""
        self.number += 1
        command = {"id": self.number, "method": method, "params": words} | ({"sessionId": self.session} if self.session else {})
        os.write(self.to, json.dumps(command).encode() + b"\0")
        while True:
            message = self.message(seconds)
            kind, told = message.get("method", ""), message.get("params", {})
            if kind == "Runtime.exceptionThrown":
                self.complaints.append(json.dumps(told["exceptionDetails"])[:300])
            elif kind == "Runtime.consoleAPICalled" or (kind == "Log.entryAdded" and told["entry"]["level"] in ("error", "warning")):
                self.complaints.append(json.dumps(told)[:300])
            elif kind == "Network.requestWillBeSent":
                self.asked.append(told["request"]["url"][:200])
            if message.get("id") == self.number:
                if "error" in message:
                    raise RuntimeError(f"{method}: {message['error']}")
                return message["result"]

    def ask(self, script):
        """The value of a JavaScript expression, which may be a promise."""
        out = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in out:
            raise RuntimeError(f"{script}: {out['exceptionDetails']}")
        return out["result"].get("value")

    def wait(self, script, seconds=60):
        end = time.time() + seconds
        while not self.ask(script):
            if time.time() > end:
                raise TimeoutError(f"not in {seconds} s: {script}")
            time.sleep(0.05)

    def open(self, address):
        self.call("Page.navigate", url="about:blank")
        self.call("Page.navigate", url=address)
        self.wait("document.readyState === 'complete'")

    def settle(self):
        """Two pictures later."""
        self.ask("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def key(self, key):
        code, number = KEYS[key] if key in KEYS else (f"Key{key.upper()}", ord(key.upper()))
        text = {"text": key} if len(key) == 1 else {}
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=code, windowsVirtualKeyCode=number, **text)
        self.settle()

    def mouse(self, kind, at, **more):
        self.call("Input.dispatchMouseEvent", type=kind, x=at[0], y=at[1], **more)

    def click(self, at):
        self.mouse("mousePressed", at, button="left", buttons=1, clickCount=1)
        self.mouse("mouseReleased", at, button="left", clickCount=1)
        self.settle()

    def drag(self, at, to, button="left"):
        held = {"left": 1, "right": 2}[button]
        self.mouse("mousePressed", at, button=button, buttons=held, clickCount=1)
        for share in (0.5, 1):
            self.mouse("mouseMoved", [a + share * (b - a) for a, b in zip(at, to)], button=button, buttons=held)
        self.mouse("mouseReleased", to, button=button, clickCount=1)
        self.settle()

    def wheel(self, at, by):
        self.mouse("mouseWheel", at, deltaX=0, deltaY=by)
        self.settle()

    def fingers(self, *paths):
        """Fingers that go down at the starts of their paths, move to their ends and go up."""
        places = lambda share: [
            {"x": a[0] + share * (b[0] - a[0]), "y": a[1] + share * (b[1] - a[1]), "id": k} for k, (a, b) in enumerate(paths)
        ]
        self.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=places(0))
        for share in (0.5, 1):
            self.call("Input.dispatchTouchEvent", type="touchMove", touchPoints=places(share))
        self.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
        self.settle()

    def middle(self, selector, share=0.5):
        """Where an element is: its middle, or a share of its width from its left."""
        box = self.ask(
            f"(e => {{ const b = e.getBoundingClientRect(); return [b.x, b.y, b.width, b.height]; }})"
            f"(document.querySelector({json.dumps(selector)}))"
        )
        return [box[0] + share * box[2], box[1] + 0.5 * box[3]]

    def choose(self, selector, value):
        """A value of a list or a tick of a box, as if chosen by hand."""
        self.ask(
            f"(e => {{ if (e.type === 'checkbox') e.click(); else {{ e.value = {json.dumps(value)};"
            f" e.dispatchEvent(new Event('input')); e.dispatchEvent(new Event('change')); }} }})"
            f"(document.querySelector({json.dumps(selector)}))"
        )
        self.settle()

    def emulate(self, **features):
        """What the page is told of its reader: prefers_color_scheme="dark"."""
        self.call("Emulation.setEmulatedMedia", features=[{"name": k.replace("_", "-"), "value": v} for k, v in features.items()])
        self.settle()

    def picture(self, path):
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))
        return path
