"""Wrong mechanisms: each is answered by a sentence that names the culprit and says what to do; the right ones beside them run."""
import pathlib

from program import expect, finish, history, near, run, temporary_folder
from scene_text import joint

HEAD = """[simulation]
duration = 0.2
output_rate = 100
gravity = [0, -9.81, 0]
"""
ROD = """[[body]]
name = "{name}"
kind = "rigid"
mass = 1
inertia = [0.001, 0.0833, 0.0833]
centre_of_mass = [0.5, 0, 0]
frames = {{ tip = [1, 0, 0] }}
"""


def body(*names):
    return "".join(ROD.format(name=name) for name in names)


def force(text):
    return f"[[force]]\n{text}\n"


FOUR_BAR = (
    body("a", "b", "c")
    + joint("ja", "revolute", "ground", "a", "rotation = [0, 0, 1]")
    + joint("jb", "revolute", "a.tip", "b", "rotation = [0, 0, -1]")
    + joint("jc", "revolute", "ground", "c", "position = [1, 0, 0]\nrotation = [0, 0, 1]")
)
PIVOT = body("a") + joint("pivot", "revolute", "ground", "a")

right = {
    "pendulum": PIVOT,
    "four-bar": FOUR_BAR + joint("jd", "revolute", "b.tip", "c.tip"),
    "motion by table": body("a")
    + joint("pivot", "revolute", "ground", "a", "motion = { table = [[0, 0], [0.1, 0.2], [0.2, 0.8], [0.3, 1]] }"),
    "force by table of a coordinate": PIVOT
    + force('kind = "torque"\non = "a"\nvalue = { table = [[-1, 3], [0, 1], [1, -2]], of = "pivot" }\ndirection = [0, 0, 1]'),
    "reaction in the child's axes": PIVOT + '[[output]]\nname = "r"\nof = "pivot"\nquantity = "reaction"\nframe = "child"\n',
    "a body on a plane": body("a") + joint("floor", "point-on-plane", "ground", "a", "axis = [0, 1, 0]"),
    "two bodies on a string": body("a", "b")
    + joint("pivot", "revolute", "ground", "a")
    + joint("string", "distance", "a.tip", "b", "position = [0, 0.2, 0]\nlength = 0.5"),
    "friction of a ball": body("a") + joint("j", "spherical", "ground", "a", "friction = { coefficient = 0.3, normal_force = 1 }"),
    "a massless body on a spring": '[[body]]\nname = "a"\nkind = "rigid"\nmass = 0\n'
    + joint("j", "prismatic", "ground", "a", "axis = [0, 1, 0]\nspring = { stiffness = 100, rest = 0.1 }"),
    "a massless block on a rail": body("a", "b")
    + '[[body]]\nname = "block"\nkind = "rigid"\nmass = 0\n'
    + joint("ja", "revolute", "ground", "a", "initial = { value = 0.8 }")
    + joint("jb", "revolute", "a.tip", "b")
    + joint("pin", "revolute", "b.tip", "block")
    + joint("rail", "prismatic", "ground", "block", "axis = [1, 0, 0]"),
}

# name: (scene, exit code, words of the message)
wrong = {
    "child is ground": (body("a") + joint("j", "revolute", "a", "ground"), 2, ["j", "exchange 'parent' and 'child'"]),
    "both ends on one body": (body("a") + joint("j", "revolute", "a.tip", "a"), 2, ["j", "same body"]),
    "unknown kind": (body("a") + joint("j", "revolut", "ground", "a"), 2, ["revolut", "did you mean 'revolute'"]),
    "pitch of a slide": (body("a") + joint("j", "prismatic", "ground", "a", "pitch = 1"), 2, ["pitch", "screw"]),
    "screw without pitch": (body("a") + joint("j", "screw", "ground", "a"), 2, ["pitch"]),
    "screw of no pitch": (body("a") + joint("j", "screw", "ground", "a", "pitch = 0"), 2, ["pitch", "revolute"]),
    "motion and a start": (
        body("a") + joint("j", "revolute", "ground", "a", 'motion = "t"\ninitial = { value = 1 }'),
        2,
        ["initial", "motion"],
    ),
    "motion of a ball": (body("a") + joint("j", "spherical", "ground", "a", 'motion = "t"'), 2, ["motion", "one coordinate"]),
    "stop upside down": (
        body("a") + joint("j", "revolute", "ground", "a", "stop = { lower = 1, upper = -1, stiffness = 1 }"),
        2,
        ["lower", "upper"],
    ),
    "stop of two coordinates": (
        body("a") + joint("j", "cylindrical", "ground", "a", "stop = { lower = 1, stiffness = 1 }"),
        2,
        ["stop", "one coordinate"],
    ),
    "static below kinetic friction": (
        body("a") + joint("j", "revolute", "ground", "a", "friction = { coefficient = 0.3, static_coefficient = 0.2, normal_force = 1 }"),
        2,
        ["static_coefficient", "0.3"],
    ),
    "normal force by a wrong word": (
        body("a") + joint("j", "revolute", "ground", "a", 'friction = { coefficient = 0.3, normal_force = "reactions" }'),
        2,
        ["normal_force", "reaction"],
    ),
    "string without length": (body("a") + joint("j", "distance", "ground", "a"), 2, ["length"]),
    "loop that cannot close": (
        FOUR_BAR + joint("jd", "revolute", "b.tip", "c.tip", "position = [5, 0, 0]"),
        2,
        ["jd", "cannot be assembled", "open by", "ja"],
    ),
    "rates against each other": (
        body("a", "b", "c")
        + joint("ja", "revolute", "ground", "a", "initial = { value = 1, rate = 1 }")
        + joint("jb", "revolute", "a.tip", "b", "initial = { value = -1, rate = 5 }")
        + joint("jc", "revolute", "ground", "c", "position = [1, 0, 0]\ninitial = { value = 1, rate = -2 }")
        + joint("jd", "revolute", "b.tip", "c.tip"),
        2,
        ["rate", "jd", "remove one rate"],
    ),
    "nothing carries inertia": (
        '[[body]]\nname = "a"\nkind = "rigid"\nmass = 0\n' + joint("j", "revolute", "ground", "a"),
        1,
        ["j", "without inertia", "mass"],
    ),
    "nothing holds it": (f'start = "static"\n{body("a")}', 2, ["static equilibrium", "a (free)", "spring"]),
    "a start by a wrong word": (f'start = "statics"\n{PIVOT}', 2, ["start", "did you mean 'static'"]),
    "table that turns back": (
        body("a") + joint("j", "revolute", "ground", "a", "motion = { table = [[0, 0], [0.2, 1], [0.1, 2]] }"),
        2,
        ["table", "ascend", "point 3"],
    ),
    "table that is too short": (
        body("a") + joint("j", "revolute", "ground", "a", "motion = { table = [[0, 0], [0.1, 1]] }"),
        2,
        ["table", "0.1", "0.2", "period"],
    ),
    "table of no joint": (
        PIVOT + force('kind = "torque"\non = "a"\ndirection = [0, 0, 1]\nvalue = { table = [[0, 0], [1, 1]], of = "pivt" }'),
        2,
        ["pivt", "did you mean 'pivot'"],
    ),
    "one number for two coordinates": (
        body("a") + joint("j", "universal", "ground", "a", "initial = { value = 1 }"),
        2,
        ["value", "second axis"],
    ),
    "force on ground": (PIVOT + force('kind = "force"\non = "ground"\ndirection = [1, 0, 0]\nvalue = 1'), 2, ["on", "does not move"]),
    "spring in one body": (PIVOT + force('kind = "spring-damper"\non = "a"\nfrom = "a.tip"\nstiffness = 1'), 2, ["same body"]),
    "frame of a position": (
        PIVOT + '[[output]]\nname = "p"\nof = "a.tip"\nquantity = "position"\nframe = "child"\n',
        2,
        ["frame", "reaction"],
    ),
    "motions against each other": (
        FOUR_BAR.replace("rotation = [0, 0, 1]\n", 'rotation = [0, 0, 1]\nmotion = "t"\n', 1).replace(
            "position = [1, 0, 0]\n", 'position = [1, 0, 0]\nmotion = "2*t"\n'
        )
        + joint("jd", "revolute", "b.tip", "c.tip"),
        2,
        ["motions", "jd", "'ja', 'jc'", "remove one motion"],
    ),
    "motions that part later": (
        FOUR_BAR.replace("rotation = [0, 0, 1]\n", 'rotation = [0, 0, 1]\nmotion = "t"\n', 1).replace(
            "position = [1, 0, 0]\n", 'position = [1, 0, 0]\nmotion = "t + 9*t^3"\n'
        )
        + joint("jd", "revolute", "b.tip", "c.tip"),
        1,
        ["motions", "jd", "'ja', 'jc'", "remove one motion"],
    ),
    "a value too many": (
        FOUR_BAR.replace("rotation = [0, 0, 1]\n", "rotation = [0, 0, 1]\ninitial = { value = 0.1 }\n", 1)
        .replace("rotation = [0, 0, -1]\n", "rotation = [0, 0, -1]\ninitial = { value = 0.2 }\n")
        .replace("position = [1, 0, 0]\n", "position = [1, 0, 0]\ninitial = { value = 0.3 }\n")
        + joint("jd", "revolute", "b.tip", "c.tip"),
        2,
        ["cannot be assembled", "jd", "initial.guess instead of initial.value at 'jc', 'jb'", "joint 'jc' 0.1"],
    ),
    "motion that jumps": (
        body("a") + joint("j", "revolute", "ground", "a", 'motion = "t < 0.1 ? 0 : 0.5"'),
        2,
        ["j", "motion", "jumps by 0.5", "t = 0.1"],
    ),
    "friction on a massless body on a spring": (
        '[[body]]\nname = "a"\nkind = "rigid"\nmass = 0\n'
        + joint(
            "j",
            "prismatic",
            "ground",
            "a",
            "axis = [0, 1, 0]\nspring = { stiffness = 100, rest = 0.1 }\nfriction = { coefficient = 0.1, normal_force = 1 }",
        ),
        2,
        ["j", "friction", "mass", "damping instead"],
    ),
    "a carriage without mass over a point mass": (
        '[[body]]\nname = "c"\nkind = "rigid"\nmass = 0\n[[body]]\nname = "bob"\nkind = "rigid"\nmass = 1\ncentre_of_mass = [0, -0.04, 0]\n'
        + joint("rail", "prismatic", "ground", "c", "axis = [1, 0, 0]\nspring = { stiffness = 50 }")
        + joint("pin", "revolute", "c", "bob", "initial = { value = 0.5 }"),
        1,
        ["stopped at", "rail", "mass"],
    ),
    "a massless ball between balls": (
        body("b")
        + '[[body]]\nname = "a"\nkind = "rigid"\nmass = 0\n'
        + joint("j", "spherical", "ground", "a", "spring = { stiffness = 1 }")
        + joint("k", "spherical", "a", "b", "spring = { stiffness = 1 }"),
        2,
        ["j", "change with the position", "mass"],
    ),
    "beyond its reach": (
        body("a", "b")
        + joint("ja", "revolute", "ground", "a", 'motion = "20*t"')
        + joint("jb", "revolute", "a.tip", "b")
        + joint("rail", "point-on-line", "ground", "b.tip", "axis = [1, 0, 0]\nposition = [0, 0.5, 0]"),
        1,
        ["rail", "t =", "reach"],
    ),
}

with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    scene = folder / "mechanism.toml"
    for name, text in right.items():
        scene.write_text(HEAD + text)
        run("simulate", scene, "-o", folder / "r.h5", cwd=folder)
        (folder / "r.h5").unlink()
    for name, (text, code, words) in wrong.items():
        scene.write_text(HEAD + text)
        done = run("simulate", scene, "-o", folder / "r.h5", code=code, cwd=folder, timeout=60)
        for word in ["flexframe: ", *words]:
            expect(word in done.stderr, f"{name}: the message lacks '{word}': {done.stderr.strip()}")
        left = sorted(p.name for p in folder.iterdir())
        expect(left == ["mechanism.toml"], f"{name}: written: {left}")
    # A table whose ends are those of the run but for rounding reaches over it: the motion goes on to the last sample.
    short = "motion = { table = [[1e-17, 0], [0.1, 0.2], [0.15, 0.8], [0.19999999999999998, 1]] }"
    seen = '[[output]]\nname = "w"\nof = "j"\nquantity = "rate"\n'
    rates = []
    for table in (short, short.replace("0.19999999999999998", "0.2").replace("1e-17", "0")):
        scene.write_text(HEAD + body("a") + joint("j", "revolute", "ground", "a", table) + seen)
        run("simulate", scene, "--csv", folder / "h.csv", cwd=folder)
        rates.append(history(folder / "h.csv")["w"])
    near(rates[0][-1], rates[1][-1], 1e-9, "rate at the end of a table")
    # A point mass on a pin through it, the only body or beside others, keeps its rate; small motions have it as a rigid one.
    spin = '[[body]]\nname = "dot"\nkind = "rigid"\nmass = 1\n' + joint("pin", "revolute", "ground", "dot", "initial = { rate = 3 }")
    for name, more in (("alone", ""), ("beside a pendulum", PIVOT)):
        scene.write_text(HEAD + spin + more + '[[output]]\nname = "turn"\nof = "pin"\nquantity = "value"\n')
        run("simulate", scene, "--csv", folder / "h.csv", cwd=folder)
        h = history(folder / "h.csv")
        near(h["turn"][-1], 3 * h["t"][-1], 1e-9, f"a point mass on a pin, {name}")
        checked = run("check", scene).stdout
        expect("nan" not in checked and "(rigid)" in checked, f"small motions of a point mass on a pin, {name}: {checked}")
finish()
