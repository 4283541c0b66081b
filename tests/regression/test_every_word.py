"""Every coupling, contact, force, block and output against a formula or scipy: as it stands, in a turned world, and with parent and child
exchanged; energy is kept where nothing takes it out.

A scene is written with LAB for the ground and <x, y, z> for directions of the world. In the turned world LAB is a body welded to the ground
askew. Exchanged joints have the other body as parent and the other way along their axis, so that their coordinates stay as they are; the
ends of forces and contacts change places by what `swap` replaces. What SCENE.md lists of couplings, forces, blocks, shapes of contacts and
quantities of outputs has to be among the scenes.
"""
import inspect
import math
import pathlib
import re

import numpy as np
from arrays import simulate, simulate_and_say
from program import expect, finish, temporary_folder
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

sin, cos, pi, sqrt, g = np.sin, np.cos, math.pi, math.sqrt, 9.81
turn = [0.4, -0.7, 0.3]
R = Rotation.from_rotvec(turn).as_matrix()


def rigid(name, mass=1.0, inertia="[0.1, 0.1, 0.1]", more=""):
    return f'[[body]]\nname = "{name}"\nkind = "rigid"\nmass = {mass}\ninertia = {inertia}\n{more}\n'


def joint(name, kind, child, axis="[0, 0, 1]", parent="LAB", more=""):
    return f'[[joint]]\nname = "{name}"\nkind = "{kind}"\nparent = "{parent}"\nchild = "{child}"\naxis = {axis}\n{more}\n'


def out(name, of, quantity, more=""):
    return f'[[output]]\nname = "{name}"\nof = "{of}"\nquantity = "{quantity}"\n{more}\n'


def coupling(kind, more):
    return f'[[coupling]]\nname = "c"\nkind = "{kind}"\n{more}\n'


def push(on, direction, value, kind="force", name="push"):
    return f'[[force]]\nname = "{name}"\nkind = "{kind}"\non = "{on}"\ndirection = {direction}\nvalue = {value}\n'


def force(kind, more):
    return f'[[force]]\nname = "f"\nkind = "{kind}"\n{more}\n'


def ode(f, start):
    """Solution of y' = f(t, y) as functions of time, one a component."""
    done = solve_ivp(f, (0, 2.0), start, rtol=1e-10, atol=1e-12, dense_output=True)
    return [lambda t, k=k: done.sol(t)[k] for k in range(len(start))]


x_axis, y_axis = "[1, 0, 0]", "[0, 1, 0]"
shafts = rigid("a", 1, "[0.02, 0.02, 0.02]") + rigid("b", 2, "[0.3, 0.3, 0.3]") + joint("a", "revolute", "a") + joint("b", "revolute", "b")
values = out("va", "a", "value") + out("vb", "b", "value") + out("ra", "a", "rate")
slide = rigid("m", 2, "[0, 0, 0]") + joint("m", "prismatic", "m", x_axis) + out("x", "m", "value") + out("v", "m", "rate")
cases = {}


def case(name, text, truth, bound=1e-5, energy=False, exchanged=(), swap=(), duration=1.0, gravity=None, frames=None, simulation=""):
    """Columns of `truth` are functions of time, or of time and the other columns. `swap`: pairs of words, the second for exchanged ends."""
    for old, _ in swap:
        assert old in text, (name, old)
    cases[name] = dict(
        text=text,
        truth=truth,
        bound=bound,
        energy=energy,
        exchanged=exchanged,
        swap=swap,
        duration=duration,
        gravity=gravity,
        frames=frames or {},
        simulation=simulation,
    )


# ---- couplings ------------------------------------------------------------------------------------------------------------------------
for word, keys, n in (("gear", "teeth = [20, 50]", -0.4), ("gear", "teeth = [20, 50]\ninternal = true", 0.4), ("gear", "ratio = 1.5", 1.5)):
    a = 3 / (0.02 + n * n * 0.3)
    case(
        f"gear, {keys}",
        shafts
        + values
        + out("f", "c", "force")
        + coupling(word, f'joints = ["a", "b"]\n{keys}')
        + push("a", "<0, 0, 1>", 3, "torque")
        + out("w", "push", "work")
        + out("T", "system", "kinetic"),
        {
            "va": lambda t, a=a: a * t * t / 2,
            "vb": lambda t, a=a, n=n: n * a * t * t / 2,
            "f.1": lambda t, a=a: 0.02 * a - 3 + 0 * t,
            "f.2": lambda t, a=a, n=n: 0.3 * n * a + 0 * t,
            "w": lambda t, a=a: 1.5 * a * t * t,
            "T": lambda t, a=a: 1.5 * a * t * t,
        },
        exchanged=("a", "b"),
    )
arm = rigid("arm", 1, "[0.05, 0.05, 0.05]") + joint("arm", "revolute", "arm", more='motion = "2*t"')
planet = rigid("sun", 1) + joint("sun", "revolute", "sun", more='motion = "5*t"')
planet += rigid("p", 0.2, "[1e-3, 1e-3, 1e-3]") + joint("p", "revolute", "p", parent="arm", more="position = [0.1, 0, 0]")
# seen from the arm the sun turns by 3 t
case(
    "gear on a carrier",
    arm + planet + coupling("gear", 'joints = ["sun", "p"]\nteeth = [30, 15]\ncarrier = "arm"') + out("p", "p", "value"),
    {"p": lambda t: -2 * 3 * t},
)
# Two shafts that meet at half a radian turn alike at every moment, by a cardan joint tan(out) = cos(0.5) tan(in): the fork starts normal to
# the shafts' plane.
bent = rigid("a") + joint("a", "revolute", "a", more='motion = "5*t"') + rigid("b")
bent += out("b", "bearing", "value") + out("v", "bearing", "rate") + joint("bearing", "revolute", "b", more="rotation = [0.5, 0, 0]")
case(
    "constant-velocity joint",
    bent + joint("cv", "constant-velocity", "b", parent="a", more="initial = { guess = [0.5, 0] }"),
    {"b": lambda t: 5 * t, "v": lambda t: 5 + 0 * t},
    exchanged=("cv",),
)
case(
    "cardan joint",
    bent + joint("cross", "universal", "b", axis="[1, 0, 0]", parent="a", more="initial = { guess = [0.5, 0] }"),
    {"b": lambda t: np.unwrap(np.arctan2(cos(0.5) * sin(5 * t), cos(5 * t)))},
)
rack = rigid("w", 1, "[0.02, 0.02, 0.02]") + slide + joint("w", "revolute", "w") + out("w", "w", "value") + out("E", "system", "energy")
spring = "spring = { stiffness = 50 }\ninitial = { value = 0.1 }"
wm = sqrt(50 / (2 + 0.02 / 0.04**2))
case(
    "rack",
    rack.replace(f"axis = {x_axis}\n", f"axis = {x_axis}\n{spring}\n") + coupling("rack", 'joints = ["w", "m"]\nradius = 0.04'),
    {"x": lambda t: 0.1 * cos(wm * t), "w": lambda t: 2.5 * (cos(wm * t) - 1)},
    energy=True,
    exchanged=("w", "m"),
)
case(
    "screw between joints",
    rack + coupling("screw", 'joints = ["w", "m"]\npitch = 0.04') + push("m", "<1, 0, 0>", 7),
    {"x": lambda t: 7 / (2 + 0.02 / 0.04**2) * t * t / 2},
    exchanged=("w", "m"),
)
third = rigid("c", 1, "[0.05, 0.05, 0.05]") + joint("c", "revolute", "c") + out("vc", "c", "value")
m = 4 / (1 + 0.05 / 4 * (1 / 0.02 + 1 / 0.3))
case(
    "differential",
    shafts + values + third + coupling("differential", 'joints = ["a", "b", "c"]') + push("c", "<0, 0, 1>", 4, "torque"),
    {"va": lambda t: m / 2 / 0.02 * t * t / 2, "vb": lambda t: m / 2 / 0.3 * t * t / 2},
    bound=1e-4,
    exchanged=("a", "b", "c"),
)
k = 4 / (0.02 + 0.3 / 9 + 0.05 / 4)
case(
    "linear",
    shafts
    + values
    + third
    + coupling("linear", 'terms = [{ joint = "a", factor = 1 }, { joint = "b", factor = 2 },' ' { joint = "c", factor = -2 }]')
    + push("a", "<0, 0, 1>", 4, "torque"),
    # lambda on (1, 2, -2): 0.02 a = 4 + l, 0.3 b = 2 l, 0.05 c = -2 l, a + 2 b - 2 c = 0
    {"va": lambda t: (4 + -4 / 0.02 / (1 / 0.02 + 4 / 0.3 + 4 / 0.05)) / 0.02 * t * t / 2},
    bound=1e-4,
    exchanged=("a", "b", "c"),
)
follower = slide + rigid("cam", 1, "[0.01, 0.01, 0.01]") + joint("cam", "revolute", "cam", more='motion = "6*t"')
case(
    "cam",
    follower + coupling("cam", 'joints = ["cam", "m"]\nlift = "0.02*sin(angle)^2"') + out("f", "c", "force"),
    {"x": lambda t: 0.02 * sin(6 * t) ** 2, "f.2": lambda t: 2 * 0.02 * 72 * cos(12 * t)},
    exchanged=("cam", "m"),
)
drum = rigid("drum", 1, "[0.02, 0.02, 0.02]") + joint("drum", "revolute", "drum")
case(
    "rope",
    slide
    + drum
    + coupling("rope", 'through = ["LAB.hook", "m"]\nlength = 1\nterms = [{ joint = "drum", factor = 0.1 }]')
    + push("m", "<1, 0, 0>", 8)
    + out("f", "c", "force"),
    {"x": lambda t: 8 / (2 + 2) * t * t / 2, "f": lambda t: 4 + 0 * t},
    frames={"hook": [-1, 0, 0]},
    exchanged=("m",),
)

# A bead on a hoop is a pendulum: its way along the wire is R times the angle, which counts from the lowest point.
swung = ode(lambda t, y: (y[1], -g / 0.4 * sin(y[0])), (1.0, 0.0))
hoop = 'curve = { x = "0.4*sin(u)", y = "-0.4*cos(u)", to = "2*pi", closed = true }\ninitial = { value = 0.4 }'
case(
    "point-on-curve",
    rigid("m", 2, "[0, 0, 0]")
    + '[[joint]]\nname = "m"\nkind = "point-on-curve"\nparent = "LAB"\nchild = "m"\n'
    + hoop
    + "\n"
    + out("s", "m", "value")
    + out("R", "m", "reaction", 'frame = "parent"')
    + '[[output]]\nname = "N"\nexpression = "sqrt(R.x^2 + R.y^2 + R.z^2)"\n'
    + out("E", "system", "kinetic"),
    {
        "s": lambda t: 0.4 * swung[0](t),
        "N": lambda t: np.abs(2 * (0.4 * swung[1](t) ** 2 + g * cos(swung[0](t)))),
        "E": lambda t: 0.4**2 * swung[1](t) ** 2,
    },
    bound=5e-5,
    gravity=[0, -g, 0],
)

# ---- forces ---------------------------------------------------------------------------------------------------------------------------
case(
    "force and torque",
    slide + push("m", "<1, 0, 0>", '"3*t"') + out("P", "push", "power") + out("W", "push", "work"),
    {"x": lambda t: t**3 / 4, "P": lambda t: 3 * t * 0.75 * t * t, "W": lambda t: 9 / 16 * t**4},
    exchanged=("m",),
)
w0 = sqrt(80 / 2)
case(
    "spring-damper",
    slide.replace(f"axis = {x_axis}\n", f"axis = {x_axis}\ninitial = {{ value = 1.3 }}\n")
    + force("spring-damper", 'on = "m"\nfrom = "LAB"\nstiffness = 80\nrest = 1')
    + out("l", "f", "length")
    + out("dl", "f", "length_rate")
    + out("F", "f", "force")
    + out("U", "system", "strain")
    + out("E", "system", "energy"),
    {
        "x": lambda t: 1 + 0.3 * cos(w0 * t),
        "l": lambda t: 1 + 0.3 * cos(w0 * t),
        "dl": lambda t: -0.3 * w0 * sin(w0 * t),
        "F": lambda t: 24 * cos(w0 * t),
    },
    bound=2e-5,
    energy=True,
    exchanged=("m",),
    swap=[('on = "m"\nfrom = "LAB"', 'on = "LAB"\nfrom = "m"')],
)
pulled = ode(lambda t, y: (y[1], -40 * max(0.0, y[0] - 0.1) + 0.5 * g * 0), (0.3, 0.0))
case(
    "cable",
    slide.replace(f"axis = {x_axis}\n", f"axis = {x_axis}\ninitial = {{ value = 0.3 }}\n")
    + force("cable", 'on = "m"\nfrom = "LAB.hook"\nstiffness = 80\nrest = 1.1')
    + out("E", "system", "energy"),
    {"x": pulled[0]},
    bound=1e-4,
    frames={"hook": [-1, 0, 0]},
    duration=0.5,
    swap=[('on = "m"\nfrom = "LAB.hook"', 'on = "LAB.hook"\nfrom = "m"')],
)
held = rigid("m", 2, "[0.1, 0.2, 0.3]") + joint("m", "free", "m", more="initial = { value = [0.01, 0, 0, 0, 0, 0.02] }")
case(
    "bushing",
    held
    + force("bushing", 'on = "m"\nfrom = "LAB"\nstiffness = [200, 300, 400, 5, 6, 7]\ndamping = [0, 0, 0, 0, 0, 0]')
    + out("q", "m", "value")
    + out("F", "f", "force")
    + out("E", "system", "energy"),
    {"q.1": lambda t: 0.01 * cos(10 * t), "q.6": lambda t: 0.02 * cos(sqrt(7 / 0.3) * t), "F.x": lambda t: -2 * cos(10 * t)},
    bound=2e-5,
    energy=True,
)
# Its force is that on `on`: of exchanged ends the other way.
case(
    "bushing along x",
    held.replace("0.01, 0, 0, 0, 0, 0.02", "0.01, 0, 0, 0, 0, 0")
    + force("bushing", 'on = "m"\nfrom = "LAB"\nstiffness = [200, 300, 400, 5, 6, 7]\ndamping = [4, 0, 0, 0, 0, 0]')
    + out("q", "m", "value")
    + out("dq", "m", "rate")
    + out("F", "f", "force")
    + out("P", "f", "power"),
    {
        "q.1": lambda t: 0.01 * np.exp(-t) * (cos(sqrt(99) * t) + sin(sqrt(99) * t) / sqrt(99)),
        "P": lambda t, h: (-200 * h["q.1"] - 4 * h["dq.1"]) * h["dq.1"],
    },
    swap=[('on = "m"\nfrom = "LAB"', 'on = "LAB"\nfrom = "m"')],
)
slowed = slide.replace(f"axis = {x_axis}\n", f"axis = {x_axis}\ninitial = {{ rate = 3 }}\n")
case(
    "drag",
    slowed + force("drag", 'on = "m"\nlinear = 0.5\nquadratic = 0.7'),
    {"v": lambda t: 0.5 / (np.exp(0.25 * t) * (0.5 / 3 + 0.7) - 0.7)},
)
case(
    "drag in the wind",
    slide + force("drag", 'on = "m"\nlinear = 0.5\nquadratic = 0.7\nwind = <4, 0, 0>'),
    {"v": ode(lambda t, y: ((0.5 * (4 - y[0]) + 0.7 * (4 - y[0]) ** 2) / 2,), (0.0,))[0]},
)
case(
    "friction of a joint",
    slowed.replace("rate = 3 }\n", "rate = 3 }\nfriction = { coefficient = 0.2, normal_force = 40 }\n") + out("R", "m", "friction_force"),
    {"v": lambda t: np.maximum(3 - 4 * t, 0), "R": lambda t: np.where(np.abs(t - 0.75) < 0.006, np.nan, np.where(t < 0.75, -8.0, 0))},
)
case(
    "a fall",
    rigid("m", 2, "[0, 0, 0]") + joint("m", "prismatic", "m", y_axis) + out("y", "m", "value") + out("V", "system", "potential")
    # in the turned world the lab stands elsewhere
    + out("E", "system", "energy"),
    {"y": lambda t: -g * t * t / 2, "V": lambda t, h: h["V"][0] - g * g * t * t},
    gravity=[0, -g, 0],
    exchanged=("m",),
)
case(
    "table of a coordinate",
    slowed + force("force", 'on = "m"\ndirection = <1, 0, 0>\nvalue = { table = [[-5, 40], [0, 0], [5, -40]], of = "m" }'),
    {"x": lambda t: 1.5 * sin(2 * t)},
)
case(
    "point-on-line and distance",
    rigid("m", 2, "[0, 0, 0]")
    + joint("rod", "distance", "m", more="length = 0.5")
    + joint("wall", "point-on-plane", "m", x_axis)
    + joint("m", "free", "m", more="initial = { guess = [0, -0.5, 0.02, 0, 0, 0] }")
    + out("d", "m", "distance", 'relative_to = "LAB"'),
    {"d": lambda t: 0.5 + 0 * t},
    gravity=[0, -g, 0],
)

# ---- contacts -------------------------------------------------------------------------------------------------------------------------
ball = (
    rigid("m", 2, "[0.01, 0.01, 0.01]")
    + joint("m", "free", "m", more="initial = { value = [0, 0, 0.2, 0, 0, 0] }")
    + out("q", "m", "value")
)


def bounced(h, e=1.0):
    t1, v = sqrt(2 * h / g), sqrt(2 * g * h)
    return lambda t: np.where(t < t1, h - g * t * t / 2, e * v * (t - t1) - g * (t - t1) ** 2 / 2)


for shape, partner, height in (
    ("point", "", 0.2),
    ("sphere", "radius = 0.05", 0.15),
    ("cylinder", "radius = 0.05\naxis = [1, 0, 0]\nwidth = 0.1", 0.15),
):
    for law, e in (("", 1.0), ("restitution = 0.6", 0.6)):
        case(
            f"contact, {shape} {law}",
            ball
            + force("contact", f'on = "m"\nfrom = "LAB"\nshape = "{shape}"\n{partner}\nstiffness = 1e9\n{law}')
            + out("E", "system", "energy"),
            {"q.3": lambda t, h=height, e=e: bounced(h, e)(t) + 0.2 - h},
            bound=2e-3,
            energy=not law,
            duration=0.22 + 0.5 * (e - 0.6),
            gravity=[0, 0, -g],
            # the plane falls on what stands still
            swap=[('on = "m"\nfrom = "LAB"', 'on = "LAB"\nfrom = "m"\nnormal = [0, 0, -1]')],
        )
both = "stiffness = 1e9\nradius = 0.05\nfrom_radius = 0.1"
case(
    "contact, sphere on sphere",
    ball + force("contact", f'on = "m"\nfrom = "LAB.below"\nshape = "sphere"\nagainst = "sphere"\n{both}'),
    {"q.3": lambda t: bounced(0.15)(t) + 0.05},
    bound=2e-3,
    duration=0.3,
    gravity=[0, 0, -g],
    frames={"below": [0, 0, -0.1]},
    swap=[
        ('on = "m"\nfrom = "LAB.below"', 'on = "LAB.below"\nfrom = "m"'),
        (both, "stiffness = 1e9\nradius = 0.1\nfrom_radius = 0.05"),
    ],
)
for shape, size, height in (("point", "", 0.2), ("cylinder", "radius = 0.05\naxis = [1, 0, 0]\nwidth = 0.1\n", 0.15)):
    # Exchanged: the sphere falls on the point or the cylinder.
    end = f'shape = "{shape}"\n{size}against = "sphere"\nfrom_radius = 0.1\nstiffness = 1e9'
    case(
        f"contact, {shape} on sphere",
        ball + force("contact", f'on = "m"\nfrom = "LAB.below"\n{end}'),
        {"q.3": lambda t, h=height: bounced(h)(t) + 0.2 - h},
        bound=2e-3,
        duration=0.3,
        gravity=[0, 0, -g],
        frames={"below": [0, 0, -0.1]},
        swap=[('on = "m"\nfrom = "LAB.below"', 'on = "LAB.below"\nfrom = "m"')],
    )
flat = ball.replace("[0, 0, 0.2, 0, 0, 0]", "[0, 0.2, 0, 0, 0, 0]")
for shape, size, height in (("point", "", 0.2), ("sphere", "radius = 0.05\n", 0.15), ("cylinder", "radius = 0.05\n", 0.15)):
    case(
        f"contact, {shape} on a curve",
        flat
        + force(
            "contact",
            f'on = "m"\nfrom = "LAB"\nshape = "{shape}"\n{size}against = "curve"\n'
            'curve = { x = "-2 + 4*u", y = "0", to = 1 }\nstiffness = 1e9',
        ),
        {"q.2": lambda t, h=height: bounced(h)(t) + 0.2 - h},
        bound=2e-3,
        duration=0.3,
        gravity=[0, -g, 0],
        # The curve falls on what stands still: it is left of an open one, so it runs the other way.
        swap=[('on = "m"\nfrom = "LAB"', 'on = "LAB"\nfrom = "m"'), ("-2 + 4*u", "2 - 4*u")],
    )
# A flat-faced follower on an ellipse (half axes a, b) that turns by angle: its lift is sqrt(a^2 sin^2 + b^2 cos^2) over the cam's centre.
case(
    "contact, an outline under a flat",
    rigid("m", 2, "[0.01, 0.01, 0.01]")
    + joint("m", "prismatic", "m", y_axis, more="initial = { value = 0.02 }")
    + rigid("cam", 1, "[0.01, 0.01, 0.01]")
    + joint("cam", "revolute", "cam", more='motion = "4*t"')
    + force(
        "contact",
        'on = "cam"\nfrom = "m"\nshape = "curve"\nnormal = [0, -1, 0]\nstiffness = 1e7\nrestitution = 0.05\n'
        'curve = { x = "0.03*cos(u)", y = "0.02*sin(u)", to = "2*pi", closed = true }',
    )
    + out("x", "m", "value")
    + out("F", "f", "force"),
    {"x": lambda t: np.sqrt((0.03 * sin(4 * t)) ** 2 + (0.02 * cos(4 * t)) ** 2)},
    bound=1e-4,
    gravity=[0, -g, 0],
    exchanged=("m", "cam"),
)
case(
    "friction of a contact",
    rigid("m", 2, "[0.01, 0.01, 0.01]")
    + joint("m", "planar", "m", more="initial = { rate = [1.5, 0, 0] }")
    + force(
        "contact",
        'on = "m"\nfrom = "LAB"\nshape = "point"\nnormal = [0, 1, 0]\nstiffness = 1e7\nrestitution = 0.1\nfriction = { coefficient = 0.3 }',
    )
    + out("q", "m", "value"),
    {"q.1": lambda t: np.where(t < 1.5 / 0.3 / g, 1.5 * t - 0.15 * g * t * t, 1.5**2 / 0.6 / g)},
    bound=2e-4,
    gravity=[0, -g, 0],
)

# ---- blocks ---------------------------------------------------------------------------------------------------------------------------


def block(kind, more):
    return f'[[block]]\nname = "b"\nkind = "{kind}"\n{more}\n'


driven = slide + push("m", "<1, 0, 0>", '"b"') + out("y", "b", "output")
loop = ode(lambda t, y: (y[1], (30 * (0.3 - y[0]) + 20 * y[2] - 8 * y[1]) / 2, 0.3 - y[0]), (0.0, 0.0, 0.0))
case(
    "pid",
    driven + block("pid", 'input = "0.3 - x"\nrate = "-v"\nproportional = 30\nintegral = 20\nderivative = 8'),
    {"x": loop[0]},
    bound=1e-4,
)
case(
    "pid with a filter",
    driven + block("pid", 'input = "sin(3*t)"\nproportional = 2\nderivative = 0.4\nfilter = 0.1'),
    {
        "y": ode(lambda t, y: ((sin(3 * t) - y[0]) / 0.1,), (0.0,))[0]
        and (lambda t, s=ode(lambda t, y: ((sin(3 * t) - y[0]) / 0.1,), (0.0,))[0]: 2 * sin(3 * t) + 0.4 * (sin(3 * t) - s(t)) / 0.1)
    },
    bound=1e-5,
)
lag = ode(lambda t, y: (y[1], 5 - 6 * y[1] - 25 * y[0]), (0.0, 0.0))
case(
    "transfer function",
    driven + block("transfer-function", 'input = "5"\nnumerator = [2, 1]\ndenominator = [1, 6, 25]'),
    {"y": lambda t: 2 * lag[1](t) + lag[0](t)},
    bound=1e-5,
)
case(
    "state space",
    driven + block("state-space", 'input = ["5"]\nA = [[0, 1], [-25, -6]]\nB = [[0], [1]]\nC = [[1, 2]]\nD = [[0]]'),
    {"y": lambda t: 2 * lag[1](t) + lag[0](t)},
    bound=1e-5,
)
case("a gain", driven + block("state-space", 'input = "t"\nD = [[3]]'), {"y": lambda t: 3 * t, "x": lambda t: t**3 / 4})
case(
    "a sampled gain",
    driven + block("state-space", 'input = "t"\nD = [[3]]\nsample = 0.25'),
    # at the very samples the output may be either
    {"y": lambda t: np.where(np.abs(t / 0.25 - np.round(t / 0.25)) < 1e-9, np.nan, 0.75 * np.floor(t / 0.25))},
    bound=1e-9,
)
case(
    "an input of the driving program in a block",
    '[[input]]\nname = "valve"\nvalue = 1.5\n' + driven + block("state-space", 'input = "2*valve*t"\nD = [[3]]'),
    {"y": lambda t: 9 * t},
)

# ---- outputs of frames, energies, sections --------------------------------------------------------------------------------------------
rod = rigid("m", 2, "[0.01, 0.02, 0.03]", "centre_of_mass = [0.2, 0, 0]\nframes = { tip = [0.4, 0, 0] }") + joint(
    "m", "revolute", "m", more='motion = "t^2"'
)
seen = 'relative_to = "LAB"'
case(
    "frames",
    rod
    + out("p", "m.tip", "position", seen)
    + out("v", "m.tip", "velocity", seen)
    + out("r", "m", "rotation", seen)
    + out("w", "m", "angular_velocity", seen)
    + out("d", "m.tip", "distance", 'relative_to = "LAB.o"')
    + out("dd", "m.tip", "distance_rate", 'relative_to = "LAB.o"')
    + out("a", "m", "angle", seen)
    + out("T", "system", "kinetic")
    + out("N", "m", "reaction", 'frame = "parent"')
    + out("n", "m", "reaction", 'frame = "child"')
    + out("A", "m.tip", "acceleration")
    + '[[output]]\nname = "size"\nexpression = "sqrt(A.x^2 + A.y^2 + A.z^2)"\n'
    + '[[output]]\nname = "e"\nexpression = "p.x^2 + p.y^2"\nunit = "m^2"\n',
    {
        "p.x": lambda t: 0.4 * cos(t * t),
        "v.y": lambda t: 0.8 * t * cos(t * t),
        "r.z": lambda t: t * t,
        "w.z": lambda t: 2 * t,
        "d": lambda t: np.sqrt(0.16 + 0.09 - 0.24 * cos(t * t)),
        "dd": lambda t: 0.12 * sin(t * t) * 2 * t / np.sqrt(0.25 - 0.24 * cos(t * t)),
        "a": lambda t: t * t,
        "T": lambda t: 0.5 * (0.03 + 2 * 0.04) * 4 * t * t,
        "e": lambda t: 0.16 + 0 * t,
        "N.x": lambda t: -0.4 * (2 * sin(t * t) + 4 * t * t * cos(t * t)),
        "N.mz": lambda t: 2 * (0.03 + 0.08) + 0 * t,
        "n.x": lambda t: -0.4 * 4 * t * t,
        "n.y": lambda t: 0.8 + 0 * t,
        "size": lambda t: 0.4 * np.sqrt(4 + 16 * t**4),
    },
    bound=1e-7,
    frames={"o": [0.3, 0, 0]},
)
case(
    "stop, spring and friction of a joint",
    rigid("m", 2, "[0, 0, 0]")
    + joint(
        "m",
        "prismatic",
        "m",
        x_axis,
        more="initial = { rate = 1 }\n" "stop = { upper = 0.2, stiffness = 2e4 }\nspring = { stiffness = 3, preload = 1 }",
    )
    + out("S", "m", "spring_force")
    + out("K", "m", "stop_force")
    + out("x", "m", "value")
    + out("E", "system", "energy"),
    {"S": lambda t, h: -(3 * h["x"] + 1), "K": lambda t, h: -2e4 * np.maximum(0, h["x"] - 0.2)},
    energy=True,
    exchanged=("m",),
)
beam = '[[body]]\nname = "m"\nkind = "beam"\nlength = 1\nframes = { middle = 0.5 }\n'
beam += 'section = { shape = "rectangle", width = 0.04, height = 0.02 }\n'
beam += "material = { density = 2700, youngs_modulus = 70e9 }\n" + joint("wall", "weld", "m", more="") + push("m.tip", "<0, 1, 0>", 5)
case(
    "section forces and stress",
    beam
    + out("s", "m", "section_force", "at = 0.25")
    + out("q", "m", "stress", "at = 0.25")
    + out("u", "m.tip", "displacement")
    + out("c", "m.middle", "displacement", 'relative_to = ["root", "tip"]')
    + out("U", "system", "strain"),
    {
        # the middle hangs (16 - 5) / 96 of P L^3 / EI off the chord's middle, 1/6 - 5/48
        "c.y": lambda t: -(1 / 6 - 5 / 48) * 5 / (70e9 * 0.04 * 0.02**3 / 12) + 0 * t,
        "s.Vy": lambda t: 5 + 0 * t,
        "s.Mz": lambda t: 3.75 + 0 * t,
        "q": lambda t: 3.75 * 0.01 / (0.04 * 0.02**3 / 12) + 0 * t,
        "u.y": lambda t: 5 / 3 / (70e9 * 0.04 * 0.02**3 / 12) + 0 * t,
        "U": lambda t: 25 / 6 / (70e9 * 0.04 * 0.02**3 / 12) + 0 * t,
    },
    bound=2e-3,
    duration=0.01,
    simulation='start = "static"',
)
load = '[[force]]\nname = "load"\nkind = "distributed"\non = "m"\ndirection = <0, 1, 0>\nvalue = 6\n'
case(
    "a load along a beam",
    beam.replace(push("m.tip", "<0, 1, 0>", 5), load) + out("s", "m", "section_force", "at = 0") + out("u", "m.tip", "displacement"),
    {"s.Vy": lambda t: 6 + 0 * t, "s.Mz": lambda t: 3 + 0 * t, "u.y": lambda t: 6 / 8 / (70e9 * 0.04 * 0.02**3 / 12) + 0 * t},
    bound=2e-3,
    duration=0.01,
    simulation='start = "static"',
)
# Forms of a clamped beam, which are 2 and -2 at its end by turns where their mean square is 1.
case(
    "coordinates of a beam",
    beam.replace("length = 1\n", 'length = 1\nmodel = "modal"\nmodes = { bending_xy = [1, 2, 3, 4] }\n').replace("= 5\n", '= "20*t^2"\n')
    + out("u", "m.tip", "displacement")
    + out("v", "m.tip", "velocity", seen)
    + out("q", "m", "q")
    + out("dq", "m", "qd"),
    {
        "u.y": lambda t, h: 2 * (h["q.1"] - h["q.2"] + h["q.3"] - h["q.4"]),
        "v.y": lambda t, h: 2 * (h["dq.1"] - h["dq.2"] + h["dq.3"] - h["dq.4"]),
    },
    bound=1e-4,
    duration=0.5,
)


def text_of(one, turned, exchanged):
    text = one["text"]
    if exchanged:
        for old, new in one["swap"]:
            text = text.replace(old, new)
        for name in one["exchanged"]:
            begin = text.index(f'[[joint]]\nname = "{name}"\n')
            end = text.find("\n[[", begin + 5)
            table = text[begin : end if end > 0 else len(text)]
            parent, child, axis = (re.search(f"^{key} = (.*)$", table, re.M).group(1) for key in ("parent", "child", "axis"))
            back = str([-float(v) for v in axis.strip("[]").split(",")])
            new = table.replace(f"parent = {parent}", f"parent = {child}").replace(f"\nchild = {child}", f"\nchild = {parent}")
            text = text.replace(table, new.replace(f"axis = {axis}", f"axis = {back}"))
    world = lambda v: str(list(map(float, (R @ v) if turned else v)))
    text = re.sub(r"<([^<>\n]+)>", lambda m: world(np.array([float(x) for x in m.group(1).split(",")])), text)
    gravity = world(np.array(one["gravity"] or [0, 0, 0]))
    head = f"[simulation]\nduration = {one['duration']}\noutput_rate = 200\ngravity = {gravity}\n{one['simulation']}\n"
    frames = "frames = { " + ", ".join(f"{k} = {v}" for k, v in one["frames"].items()) + " }\n" if one["frames"] else ""
    if not turned and not exchanged:
        return head + (f"[ground]\n{frames}" if frames else "") + text.replace("LAB", "ground")
    lab = rigid("lab", 3, "[1, 1, 1]", frames) + joint(
        "lab", "weld", "lab", parent="ground", more=f"rotation = {turn if turned else [0, 0, 0]}\nposition = [1, 2, 3]"
    )
    return head + lab.replace("LAB", "lab") + text.replace("LAB", "lab")


def look(folder, name, one, turned, exchanged):
    what = name + (", turned" if turned else "") + (", exchanged" if exchanged else "")
    h = simulate_and_say(folder, text_of(one, turned, exchanged))
    expect("WARNING" not in h["said"], f"{what}: {h['said']}")
    for column, truth in one["truth"].items():
        wanted = truth(h["t"], h) if "h" in inspect.signature(truth).parameters and truth.__defaults__ is None else truth(h["t"])
        off, size = np.nanmax(np.abs(h[column] - wanted)), np.nanmax(np.abs(wanted))
        expect(off <= one["bound"] * max(size, 1e-3), f"{what}: {column} is off by {off:.3g}, the largest is {size:.3g}")
    if one["energy"]:
        E = h["E"]
        expect(np.ptp(E) <= 2e-5 * np.max(np.abs(E)), f"{what}: energy changes by {np.ptp(E):.3g} of {np.max(np.abs(E)):.3g}")


def allowed(folder, table):
    """The words that the program says are allowed for what is "none" in a table."""
    says = simulate(folder, f'[simulation]\nduration = 1\n{rigid("a")}{joint("a", "free", "a", parent="ground")}{table}\n', code=2)
    return says.split("allowed: ")[1].strip().split(", ")


def all_words(folder):
    texts = "".join(one["text"] for one in cases.values())
    for header, key, more in (
        ("coupling", "kind", 'name = "n"'),
        ("force", "kind", 'on = "a"'),
        ("block", "kind", 'name = "n"\ninput = "t"'),
        ("output", "quantity", 'name = "n"\nof = "a"'),
    ):
        words = allowed(folder, f'[[{header}]]\n{more}\n{key} = "none"\n')
        missing = [w for w in words if f'{key} = "{w}"' not in texts]
        expect(len(words) > 2 and not missing, f"words of [[{header}]] without a scene here: {missing} of {words}")
    shapes = {(s, a) for s in ("point", "sphere", "cylinder") for a in ("plane", "sphere", "curve")}
    for one in re.findall(r'kind = "contact"\n(.*?)(?=\[\[|$)', texts, re.S):
        partner = re.search(r'against = "(\w+)"', one)
        shapes.discard((re.search(r'shape = "(\w+)"', one).group(1), partner.group(1) if partner else "plane"))
    expect(not shapes, f"contacts without a scene here: {sorted(shapes)}")


with temporary_folder() as folder:
    import sys

    runs = 0
    for name, one in cases.items():
        if len(sys.argv) > 3 and sys.argv[3] not in name:
            continue
        for turned, exchanged in ((False, False), (True, False)) + (((True, True),) if one["exchanged"] or one["swap"] else ()):
            try:
                look(pathlib.Path(folder), name, one, turned, exchanged)
            except (KeyError, FileNotFoundError) as error:
                expect(False, f"{name}: {error!r}")
            runs += 1
    all_words(pathlib.Path(folder))
print(f"{len(cases)} scenes, {runs} runs")
finish()
