"""SID files written here from point masses, whose motion has a closed form."""
import json
import math

from program import *

MASSES = [(1.0, 0.2), (2.0, 0.5)]  # kg at x m; each moves by x^2 along z, a unit of the one elastic coordinate
FREQUENCY = 10.0


def sid(node="", moment=True):
    """The body, its frame in the hinge; node: the blocks of orientation of its only node; moment: mdCM says how the modes move it."""
    first = sum(m * x for m, x in MASSES)
    second = sum(m * x * x for m, x in MASSES)
    across = sum(m * x * x * x for m, x in MASSES)  # of the place and of the shape
    push = second
    shape = sum(m * x**4 for m, x in MASSES)
    stiffness = shape * (2 * math.pi * FREQUENCY) ** 2

    def block(name, order, rows, columns, entries, structure=3):
        lines = "".join(f"{at} = {value:.15E}\n" for at, value in entries.items())
        head = f"order = {order}\nnrow = {rows}\nncol = {columns}\nnq = 1\nnqn = 0\nstructure = {structure if entries else 0}\n"
        return f"{name}\n{head}{lines}end {name}\n"

    text = "1 1 : two masses\npart\nnew modal = body\nrefmod\nmass = 3.0\nnelastq = 1\nielastq (1) = Eigen Mode 1 : 10.0 Hz\nend refmod\n"
    text += "frame\nnew node = 7\nrframe = body ref\n"
    text += block("origin", 1, 3, 1, {"m0(1,1)": 0.5, "m1(3,1,1)": 0.25}) + block("phi", 0, 3, 1, {"m0(3,1)": 0.25})
    text += block("psi", 0, 3, 1, {"m0(2,1)": -1.0}) + node + "end node\nend frame\n"
    text += block("mdCM", 1, 3, 1, {"m0(1,1)": first, "m1(3,1,1)": push}) if moment else block("mdCM", 0, 3, 1, {"m0(1,1)": first})
    text += block("J", 1, 6, 1, {"m0(2,1)": second, "m0(3,1)": second, "m1(5,1,1)": -across})
    text += block("Ct", 0, 1, 3, {"m0(1,3)": push}) + block("Cr", 1, 1, 3, {"m0(1,2)": -across})
    text += block("Me", 0, 1, 1, {"m0(1,1)": shape}) + block("Ke", 0, 1, 1, {"m0(1,1)": stiffness}) + block("De", 0, 1, 1, {})
    text += block("Oe", 1, 1, 6, {"m0(1,6)": across, "m1(1,1,1)": -shape, "m1(1,1,2)": -shape}) + block("ksigma", 0, 1, 1, {})
    return text + "end modal\nend part\n", push / stiffness


def weight_along_the_hinge(folder):
    """A hinge's axis along gravity: the arm is let go, sinks and swings as it does welded to the wall."""
    for kind, moment in (("revolute", True), ("weld", True), ("revolute", False)):
        text, soft = sid(moment=moment)
        (folder / "arm.sid").write_text(text)
        (folder / "arm.toml").write_text(
            '[simulation]\nduration = 0.3\noutput_rate = 200\ngravity = [0, 0, -9.81]\ntolerance = 1e-9\n[[body]]\nname = "arm"\n'
            f'kind = "modal"\nfile = "arm.sid"\n[[joint]]\nname = "hinge"\nkind = "{kind}"\nparent = "ground"\nchild = "arm"\n'
            '[[output]]\nname = "q"\nof = "arm"\nquantity = "q"\n'
        )
        run("simulate", folder / "arm.toml", "-o", folder / "arm.h5", "--csv", folder / "arm.csv", "--quiet")
        rows = history(folder / "arm.csv")
        wanted = [-9.81 * soft * (1 - math.cos(2 * math.pi * FREQUENCY * t)) for t in rows["t"]]
        worst = max(abs(q - w) for q, w in zip(rows["q.1"], wanted))
        near(worst, 0.0, 1e-5 * 9.81 * soft, f"{kind}: the arm under its weight")


def unit_axes_that_turn(folder):
    """AP of unit structure whose first order stands beside it: the node's axes are the body's and turn as psi says."""
    head = "AP\norder = 1\nnrow = 3\nncol = 3\nnq = 1\nnqn = 0\nstructure = 4\n"
    text, _ = sid(head + "m1(3,1,1) = 1.0D+00\nm1(1,1,3) =-1.0D+00\nend AP\n")
    (folder / "turns.sid").write_text(text)
    told = json.loads(run("info", folder / "turns.sid", "--json").stdout)
    expect(not told["faults"] and not told["notes"], f"unit axes: {told['faults']} {told['notes']}")


def one_of_two(folder):
    """Ct says what a first order of mdCM would: its absence contradicts nothing."""
    text, _ = sid(moment=False)
    (folder / "one.sid").write_text(text)
    told = json.loads(run("info", folder / "one.sid", "--json").stdout)
    expect(not told["faults"], f"mdCM without first order: {told['faults']}")


run_parts(weight_along_the_hinge, unit_axes_that_turn, one_of_two)
