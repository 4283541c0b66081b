#!/usr/bin/env python3
"""Size, time to load and frames a second of HTML pages in Chromium: what examples/README.md says of them.

    page_figures.py PAGE.html...

Each page is opened from disk in a headless Chromium that draws in software. Loading is from the start of navigation until the page is
ready to be turned; frames a second are those of the page while it plays and is turned, over five seconds and at least ten frames, from the
tenth on: by then shaders are compiled and the page knows how fast it is drawn. CPU is that of all of the browser's processes, which other
work on the machine changes less: until the page is ready, its start included, and for each frame. The figures come out of the page by a
picture that it asks of a port of this machine: the page's own text is not changed but for a script at its end, in a copy.
"""
import http.server
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import threading
import urllib.parse

SCRIPT = """<script>(() => {
  const root = document.documentElement, seconds = 5, canvas = document.querySelector('canvas');
  let loaded = 0, first = 0, frames = 0, early = 0;
  const tell = words => { new Image().src = `http://127.0.0.1:PORT/?${words}`; };
  const each = now => {
    if (!loaded && root.dataset.ready) { loaded = performance.now(); location.hash = 'play=1'; tell('ready=1'); }
    if (loaded && now > loaded + 1000) {
      if (!first && ++early > 10) { first = now; tell('first=1'); }
      if (first) ++frames;
      const put = (type, x) => canvas.dispatchEvent(new PointerEvent(type, {clientX: x, clientY: 200, pointerId: 1, buttons: 1}));
      try { put('pointerdown', 300); put('pointermove', 302); put('pointerup', 302); }
      catch { canvas.dispatchEvent(new WheelEvent('wheel')); }
      if (first && frames > 10 && now > first + 1000 * seconds) {
        tell(`loaded=${loaded}&count=${frames - 1}&frames=${(frames - 1) / (now - first) * 1000}`);
        return;
      }
    }
    requestAnimationFrame(each);
  };
  requestAnimationFrame(each);
})();</script>"""


def cpu_below(process):
    """CPU seconds of a process and all that it has started and that still run."""
    try:
        fields = pathlib.Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
        tasks = pathlib.Path(f"/proc/{process}/task").iterdir()
        below = [int(c) for task in tasks for c in (task / "children").read_text().split()]
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK") + sum(cpu_below(c) for c in below)


class Listener(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        told = {k: float(v[0]) for k, v in urllib.parse.parse_qs(urllib.parse.urlparse(self.path).query).items()}
        told.update({f"cpu_{k}": cpu_below(self.server.process) for k in told if k in ("ready", "first", "loaded")})
        self.server.figures.update(told)
        if "loaded" in told:
            self.server.arrived.set()
        self.send_response(204)
        self.end_headers()

    def log_message(self, *_):
        pass


def figures(browser, page, folder):
    server = http.server.HTTPServer(("127.0.0.1", 0), Listener)
    server.arrived, server.figures = threading.Event(), {}
    threading.Thread(target=server.serve_forever, daemon=True).start()
    copy = folder / page.name
    text = page.read_text(encoding="utf-8")
    end = text.rindex("</body>") if "</body>" in text else len(text)
    copy.write_text(text[:end] + SCRIPT.replace("PORT", str(server.server_port)) + text[end:], encoding="utf-8")
    words = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    words += ["--window-size=1120,700", f"--user-data-dir={folder}/profile", "--remote-debugging-port=0", f"file://{copy}"]
    process = subprocess.Popen([browser, *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    server.process = process.pid
    server.arrived.wait(180)
    process.terminate()
    process.wait()
    server.shutdown()
    return server.figures


def main():
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if len(sys.argv) < 2 or not browser:
        sys.exit(__doc__ if browser else "chromium is missing: install it (Debian package chromium)")
    print("| page | MB | ready after, s | CPU s until then | frames a second | CPU ms a frame |\n|---|---|---|---|---|---|")
    for name in sys.argv[1:]:
        page = pathlib.Path(name).resolve()
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            found = figures(browser, page, pathlib.Path(folder))
        row = "not ready in 3 min | | |"
        if "loaded" in found:
            frame = 1000 * (found["cpu_loaded"] - found["cpu_first"]) / max(1, found["count"])
            row = f"{found['loaded'] / 1000:.2f} | {found['cpu_ready']:.2f} | {found['frames']:.1f} | {frame:.0f}"
        print(f"| {page.stem} | {page.stat().st_size / 1e6:.2f} | {row} |", flush=True)


if __name__ == "__main__":
    main()
