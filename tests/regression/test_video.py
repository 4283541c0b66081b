"""Videos of `render` and `export`, read back by ffprobe and by the format's own rules: every picture, at the rate asked for."""
import fractions
import json
import os
import pathlib
import shutil
import struct
import subprocess

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
    expect(set(json.loads(tags.stdout)["streams"][0].values()) == {"bt709", "tv"}, f"the video's colours are not tagged: {tags.stdout}")

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
