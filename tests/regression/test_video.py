"""Videos of `render` and `export`, read back by ffprobe and by the format's own rules: every picture, at the rate asked for."""
import fractions
import base64
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys

from program import examples, expect, finish, run, temporary_folder

count, rate = 12, 60


def probe(path):
    """Size, rate and number of pictures, all decoded."""
    words = [
        "ffprobe",
        "-v",
        "error",
        "-count_frames",
        "-select_streams",
        "v:0",
        "-show_entries",
        "stream=width,height,avg_frame_rate,nb_read_frames",
        "-of",
        "json",
        str(path),
    ]
    stream = json.loads(subprocess.run(words, capture_output=True, text=True, check=True).stdout)["streams"][0]
    return stream["width"], stream["height"], fractions.Fraction(stream["avg_frame_rate"]), int(stream["nb_read_frames"])


def animated_png(path):
    """Pictures and the delays of an animated PNG."""
    data, at, frames, delays = path.read_bytes(), 8, 0, []
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        if kind == b"acTL":
            (frames,) = struct.unpack_from(">I", data, at + 8)
        if kind == b"fcTL":
            delays.append(fractions.Fraction(*struct.unpack_from(">HH", data, at + 8 + 20)))
        at += 12 + size
    return frames, delays


PAGE = """<video id="v" muted src="data:video/mp4;base64,%s"></video><img id="i" src="data:image/png;base64,%s"><pre id="out">none</pre>
<script>
const video = document.getElementById("v"), still = document.getElementById("i");
function pixels(what, w, h) {
  const c = document.createElement("canvas");
  c.width = w, c.height = h;
  const g = c.getContext("2d");
  g.drawImage(what, 0, 0);
  return g.getImageData(0, 0, w, h).data;
}
function judge() {
  const w = still.naturalWidth, h = still.naturalHeight, a = pixels(still, w, h), b = pixels(video, w, h);
  const shades = new Map();
  for (let y = 6; y < h - 6; y += 3)
    for (let x = 6; x < w - 6; x += 3) {
      // Only where the picture is even: edges are the codec's to blur.
      let even = true;
      for (let v = -6; v <= 6 && even; v += 2)
        for (let u = -6; u <= 6 && even; u += 2)
          for (let k = 0; k < 3; ++k) even = even && Math.abs(a[4 * ((y + v) * w + x + u) + k] - a[4 * (y * w + x) + k]) <= 3;
      if (!even) continue;
      // The mean over all places of a shade: what is off at single ones is the codec's noise.
      const p = 4 * (y * w + x), name = [a[p] >> 3, a[p + 1] >> 3, a[p + 2] >> 3].join();
      const shade = shades.get(name) || { count: 0, off: [0, 0, 0], vivid: false };
      shades.set(name, shade);
      ++shade.count;
      shade.vivid = Math.max(a[p], a[p + 1], a[p + 2]) - Math.min(a[p], a[p + 1], a[p + 2]) > 60;
      for (let k = 0; k < 3; ++k) shade.off[k] += b[p + k] - a[p + k];
    }
  const most = [0, 0, 0];
  let vivid = 0, all = 0;
  for (const shade of shades.values())
    if (shade.count >= 50) {
      ++all;
      vivid += shade.vivid;
      shade.off.forEach((off, k) => { most[k] = Math.max(most[k], Math.abs(off / shade.count)); });
    }
  document.getElementById("out").textContent =
      `shades ${all} vivid ${vivid} most ${most.map(x => x.toFixed(2)).join(" ")} of ${video.videoWidth} x ${video.videoHeight}`;
}
video.onloadeddata = () => { video.onseeked = judge; video.currentTime = 0.001; };
</script>"""


def browser(folder):
    """Chromium shows the colours of the pictures: every even shade at most 3 levels off, in a film of 720 lines."""
    if "--browser" not in sys.argv:
        return
    program = shutil.which("chromium") or shutil.which("google-chrome")
    expect(program, "Chromium is missing: install the section [nightly] of tests/packages.txt")
    (folder / "vivid.toml").write_text(
        '[render]\nsize = [1280, 720]\ncolor_by = "displacement"\nbands = 6\nlook = "print"\nedges = false\n'
    )
    results = folder / "vivid.h5"
    run("simulate", examples / "pendulum.toml", "-o", results, "--no-error-estimate", "--no-effect-check")
    run("render", results, "--scene", folder / "vivid.toml", "-o", folder / "vivid", "--frames", "40:43")
    video, still = (
        base64.b64encode(p.read_bytes()).decode() for p in (folder / "vivid/vivid.mp4", folder / "vivid/frames/frame_00040.png")
    )
    (folder / "vivid.html").write_text(PAGE % (video, still))
    flags = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--autoplay-policy=no-user-gesture-required"]
    words = [program, *flags, "--virtual-time-budget=20000", "--dump-dom", f"file://{folder}/vivid.html"]
    # On a busy machine its clock may run out before the film is decoded.
    for _ in range(5):
        page = subprocess.run(words, capture_output=True, text=True, timeout=180).stdout
        found = re.search(r"shades (\d+) vivid (\d+) most ([\d.]+) ([\d.]+) ([\d.]+) of 1280 x 720", page)
        if found:
            break
    expect(found, f"the browser did not play the film: {page[-300:]}")
    if found:
        shades, vivid, red, green, blue = int(found[1]), int(found[2]), *map(float, found.groups()[2:])
        print(f"Chromium: {shades} shades, {vivid} of them vivid, at most {red}, {green}, {blue} levels off")
        # Of a film of 220 levels Chromium without a graphics card shows blue up to 10 levels off; of one of the wrong matrix green 15.
        right = max(red, green, blue) <= 3
        expect(shades >= 3 and vivid >= 2 and right, f"Chromium shows other colours: {found[0]}")


def hidden(folder):
    return [p.name for p in folder.rglob(".*")]


with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    results = folder / "r.h5"
    run("simulate", examples / "pendulum.toml", "-o", results, "--no-error-estimate", "--no-effect-check")
    # Odd sides, and a folder whose name ffmpeg would take for a pattern.
    out = folder / "50 %d pictures ä"
    words = [
        "render",
        results,
        "-o",
        out,
        "--size",
        "97x55",
        "--samples",
        "1",
        "--no-shadows",
        "--workers",
        "1",
        "--frames",
        f"3:{3 + count}",
    ]

    report = json.loads(run(*words, "--json").stdout)
    expect(report["video"] == str(out / "r.mp4") and report["cpu_seconds"]["video"] > 0, f"{report['video']}")
    expect(probe(out / "r.mp4") == (98, 56, rate, count), f"mp4: {probe(out / 'r.mp4')}")
    run(*words, "--resume", "--video", folder / "new/a.APNG")
    expect(
        animated_png(folder / "new/a.APNG") == (count, [fractions.Fraction(1, rate)] * count),
        f"apng: {animated_png(folder / 'new/a.APNG')}",
    )
    expect(probe(folder / "new/a.APNG")[3] == count, "apng: not every picture can be decoded")
    # Hundredths of a second are all that a GIF knows, and less than two of them no player keeps.
    run(*words, "--resume", "--video", out / "a.gif")
    width, height, found, pictures = probe(out / "a.gif")
    expect(
        (width, height, found) == (97, 55, 50) and pictures in (count * 50 // rate, count * 50 // rate + 1), f"gif: {probe(out / 'a.gif')}"
    )
    expect(hidden(folder) == [], f"left behind: {hidden(folder)}")

    # The stream names the matrix, primaries and range of its colours (their values: tests/unit/film_video.cpp).
    tags = subprocess.run(
        [
            "ffprobe",
            "-v",
            "error",
            "-select_streams",
            "v:0",
            "-show_entries",
            "stream=color_space,color_primaries,color_transfer,color_range",
            "-of",
            "json",
            str(out / "r.mp4"),
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    expect(set(json.loads(tags.stdout)["streams"][0].values()) == {"bt709", "pc"}, f"the video's colours are not tagged: {tags.stdout}")

    # Other endings are refused before anything is drawn, with those that are allowed.
    for refused in (
        run(*words[:3], folder / "none", *words[4:], "--video", folder / "a.avi", code=2),
        run("export", results, "--to", "mp4", "-o", folder / "a.mkv", code=2),
    ):
        expect(".mp4, .gif, .apng" in refused.stderr and "Traceback" not in refused.stderr, refused.stderr)
    expect(not (folder / "none").exists() and not (folder / "a.avi").exists(), "a refused video left something")

    # Without ffmpeg, and with one that fails: pictures, and a sentence.
    empty = folder / "empty"
    empty.mkdir()
    bare = run(*words[:3], folder / "bare", *words[4:-1], "0:2", env={**os.environ, "PATH": str(empty)})
    expect(
        "no video: the program ffmpeg is not installed" in bare.stdout and len(list((folder / "bare/frames").iterdir())) == 2, bare.stdout
    )
    fake = empty / "ffmpeg"
    fake.write_text("#!/bin/sh\necho 'it is broken' >&2\nexit 3\n")
    fake.chmod(0o755)
    failing = run(*words[:-1], "3:5", "--resume", "--video", folder / "c.mp4", env={**os.environ, "PATH": f"{empty}:{os.environ['PATH']}"})
    expect("no video: ffmpeg failed: it is broken" in failing.stdout, failing.stdout)
    expect(not (folder / "c.mp4").exists() and hidden(folder) == [], "a failed video left something")
    browser(folder)

    # A transparent picture lies on white in an mp4, and stays transparent in an animated PNG.
    scene = folder / "clear.toml"
    scene.write_text((examples / "pendulum.toml").read_text().replace("[render]\n", '[render]\nbackground = "transparent"\n'))
    for ending in ("mp4", "apng"):
        run(
            "render",
            results,
            "--scene",
            scene,
            "-o",
            folder / "clear",
            "--size",
            "64x36",
            "--frames",
            "0:1",
            "--workers",
            "1",
            "--resume",
            "--no-overlay",
            "--video",
            folder / f"clear.{ending}",
        )
        corner = subprocess.run(
            ["ffmpeg", "-v", "error", "-i", folder / f"clear.{ending}", "-vf", "crop=2:2:0:0", "-pix_fmt", "rgba", "-f", "rawvideo", "-"],
            capture_output=True,
            check=True,
        ).stdout[:4]
        expect(
            (min(corner[:3]) > 250 and corner[3] == 255) if ending == "mp4" else corner[3] == 0, f"{ending}: the corner is {tuple(corner)}"
        )
    shutil.rmtree(out)
finish()
