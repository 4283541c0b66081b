"""Image regression as a user has it: the CMake function in a project of its own, baselines made, kept, missed and changed, and `compare`
itself."""
import json
import os
import pathlib
import shutil
import subprocess

from program import expect, finish, flexframe, run, source, temporary_folder

scene_text = """[simulation]
duration = 0.3
gravity = [0, -9.81, 0]
[[body]]
name = "rod"
kind = "beam"
length = 0.4
section = { shape = "rectangle", width = 0.05, height = 0.009 }
material = { density = 5540.0, youngs_modulus = 1e9 }
elements = 4
effects = ["bending_xy", "stiffening"]
[[joint]]
name = "pin"
kind = "revolute"
parent = "ground"
child = "rod.root"
[render]
size = [160, 90]
frame_rate = 10
color_range = [0, 0.004]
"""
project_text = """cmake_minimum_required(VERSION 3.20)
project(user LANGUAGES NONE)
enable_testing()
include("%s/tests/image/FlexframeImageTest.cmake")
flexframe_add_image_test(NAME swing SCENE swing.toml BASELINE baselines/swing FRAMES 0:3 LABELS pictures)
"""


def ctest(folder, good, reason=None):
    environment = dict(os.environ)
    environment.pop("FLEXFRAME_UPDATE", None)
    if reason:
        environment["FLEXFRAME_UPDATE"] = reason
    done = subprocess.run(
        ["ctest", "--test-dir", str(folder / "build"), "--output-on-failure", "-L", "pictures"],
        capture_output=True,
        text=True,
        env=environment,
    )
    expect((done.returncode == 0) == good, f"ctest ended with {done.returncode}: {done.stdout[-1500:]}{done.stderr[-500:]}")
    return done.stdout


with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    scene, out, baseline = folder / "swing.toml", folder / "build/image-tests/swing", folder / "baselines/swing"
    scene.write_text(scene_text)
    (folder / "CMakeLists.txt").write_text(project_text % source.resolve())
    done = subprocess.run(
        [
            "cmake",
            "-G",
            "Ninja",
            "-S",
            str(folder),
            "-B",
            str(folder / "build"),
            f"-DFLEXFRAME_PROGRAM={pathlib.Path(flexframe).resolve()}",
        ],
        capture_output=True,
        text=True,
    )
    expect(done.returncode == 0, f"the user's project cannot be configured: {done.stderr}")

    # No baseline: fails, the pictures are kept; with a reason they become the baseline; then it passes.
    told = ctest(folder, good=False)
    expect("there is no baseline" in told and len(list((out / "frames").glob("*.png"))) == 3, f"missing baseline: {told[-800:]}")
    ctest(folder, good=True, reason="first pictures")
    expect(
        len(list(baseline.glob("*.png"))) == 3 and "first pictures" in (baseline / "CHANGES.md").read_text(), "the baseline was not made"
    )
    ctest(folder, good=True)

    expect("<testsuite " in (out / "junit.xml").read_text() and "all 3 pictures agree" in (out / "summary.md").read_text(), "no reports")
    shutil.copytree(baseline, folder / "baselines/old")

    # One picture of the baseline gone, or one too many: fails.
    (baseline / "frame_00001.png").rename(folder / "aside.png")
    told = ctest(folder, good=False)
    expect("missing baseline" in told, told[-800:])
    (folder / "aside.png").rename(baseline / "frame_00001.png")
    shutil.copy(baseline / "frame_00001.png", baseline / "frame_00009.png")
    expect("missing picture" in ctest(folder, good=False), "a picture that is not drawn any more passes")
    (baseline / "frame_00009.png").unlink()

    # Softer by 1 %, or another colour range by 1.25 %: fails, with numbers, a page and a heat map.
    for change, word in [(("1e9", "9.9e8"), "frame_0000"), (("0.004]", "0.00405]"), "colour range")]:
        scene.write_text(scene_text.replace(*change))
        told = ctest(folder, good=False)
        expect(word in told, f"{change}: {told[-1200:]}")
        page = (out / "report.html").read_text()
        expect("<img" in page and page.count("data:image/png") >= 2, f"{change}: the page shows no pictures")
    ctest(folder, good=True, reason="wider colours")
    expect((baseline / "CHANGES.md").read_text().count("\n- ") >= 2, "the second reason is not noted")
    ctest(folder, good=True)

    # Both states of the scene agree where the project names both baselines.
    scene.write_text(scene_text)
    ctest(folder, good=False)
    swing = "FRAMES 0:3 LABELS pictures"
    for words, good in [("ALSO baselines/old", True), ('IGNORE "frame_*.png:0,0,160x20" "0,0,4x4"', False), ("MASK none.png", False)]:
        (folder / "CMakeLists.txt").write_text(project_text.replace(swing, f"{swing} {words}") % source.resolve())
        subprocess.run(["cmake", str(folder / "build")], capture_output=True, check=True)
        told = ctest(folder, good=good)
        expect(words != "MASK none.png" or f"{folder}/none.png" in told, f"{words}: {told[-600:]}")
    (folder / "CMakeLists.txt").write_text(project_text % source.resolve())

    # compare: exit codes, measures, files and folders.
    a, b = baseline / "frame_00000.png", baseline / "frame_00002.png"
    report = json.loads(run("compare", a, b, "--json", code=1).stdout)["pictures"][0]
    expect(
        report["result"] == "differs"
        and report["largest"] > 2
        and 0 < report["ssim"] < 1
        and report["flip"] > 0
        and report["share_over"] > 5e-5,
        f"measures: {report}",
    )
    report = json.loads(run("compare", a, a, "--json").stdout)["pictures"][0]
    expect(report["result"] == "equal" and report["ssim"] == 1 and report["flip"] == 0, f"equal pictures: {report}")
    (folder / "text.png").write_text("no picture")
    for words in [
        (a, folder / "text.png"),
        (folder / "text.png", a),
        (a, baseline),
        (a, folder / "none.png"),
        (a,),
        (a, b, "--update", "  "),
    ]:
        run("compare", *words, code=2)
    (folder / "empty").mkdir()
    run("compare", folder / "empty", folder / "empty", code=2)
finish()
