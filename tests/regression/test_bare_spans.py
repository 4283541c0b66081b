"""Beams of few elements under their weight: pictures lack what loads bend between the ends of elements, and as much is told. The truth:
between two hinges the middle sinks by 5 q L^4 / 384 EI, of which ends that turn by q L^3 / 24 EI make q L^4 / 96 EI; between two clamps
by q L^4 / 384 EI, of which they make nothing; the tip of a cantilever by q L^4 / 8 EI."""
import pathlib
import re

from program import expect, finish, near, run, temporary_folder
from scene_text import body, joint, output, simulation


def told(folder, ends, elements, outputs=""):
    text = simulation(0.01, output_rate=1000, gravity=[0, -9.81, 0], start="static")
    material = dict(density=7800.0, youngs_modulus=2.1e11)
    section = dict(shape="rectangle", width=0.02, height=0.01)
    text += body("b", "beam", 'effects = ["bending_xy"]', length=2.0, section=section, material=material, elements=elements)
    text += joint("a", "revolute" if ends == "hinges" else "weld", "ground", "b.root")
    if ends == "hinges":
        text += joint("c", "point-on-line", "ground", "b.tip", axis=[1, 0, 0], position=[2, 0, 0])
    if ends == "clamps":
        text += joint("c", "weld", "ground", "b.tip", position=[2, 0, 0])
    (folder / "s.toml").write_text(text + outputs)
    done = run("simulate", folder / "s.toml", "-o", folder / "r.h5")
    found = re.search(r"(WARNING|note) +body 'b': between the ends .* up to ([\d.e-]+) of its largest", done.stdout + done.stderr)
    return (found.group(1), float(found.group(2))) if found else ("", 0.0)


with temporary_folder() as name:
    folder = pathlib.Path(name)
    for ends, elements, missing in (("hinges", 1, 0.2), ("clamps", 1, 1.0), ("one clamp", 1, 1 / 48), ("hinges", 4, 0.0)):
        how, share = told(folder, ends, elements)
        near(share, missing, 0.1 * missing, f"{ends}, {elements} element(s)")
        expect((how == "WARNING") == (missing > 0.0), f"{ends}, {elements} element(s): {how or 'nothing'} is said")
    # What the ends do is right.
    how, share = told(folder, "hinges", 1, output("r", "a", "reaction"))
    expect(how == "note", f"with outputs: {how or 'nothing'} is said")

finish()
