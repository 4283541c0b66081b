"""Twenty-four textbook mechanisms as a reader of SCENE.md writes them, numbers of three digits, against formulas or an own integration."""
import cmath
import json
import math
import pathlib

from program import expect, finish, history, near, run, temporary_folder
from scene_text import body, coupling, force, ground, joint, output, rigid, section, simulation, table

sin, cos, pi, sqrt, g = math.sin, math.cos, math.pi, math.sqrt, 9.81
written = []


def simulate(folder, name, *tables, words=()):
    """The history of the scene of these tables; a warning is a failure."""
    written.append(name)
    (folder / f"{name}.toml").write_text("".join(tables))
    done = run("simulate", folder / f"{name}.toml", "-o", folder / "r.h5", "--csv", folder / f"{name}.csv", *words)
    expect("WARNING" not in done.stdout.upper(), f"{name}: {done.stdout}")
    return history(folder / f"{name}.csv")


def worst(name, h, column, truth, tolerance):
    """Every sample of `column` against truth(sample's number, time)."""
    off = max(abs(x - truth(i, h["t"][i])) for i, x in enumerate(h[column]))
    near(off, 0.0, tolerance, f"{name}: {column} off its truth")


def runge_kutta(f, y, step, count, each=1):
    """States of y' = f(t, y) after every `each` of `count` steps (fourth order), the start first."""
    rows, t = [list(y)], 0.0
    for i in range(count):
        a = f(t, y)
        b = f(t + step / 2, [v + step / 2 * k for v, k in zip(y, a)])
        c = f(t + step / 2, [v + step / 2 * k for v, k in zip(y, b)])
        d = f(t + step, [v + step * k for v, k in zip(y, c)])
        y = [v + step / 6 * (k + 2 * m + 2 * n + o) for v, k, m, n, o in zip(y, a, b, c, d)]
        t += step
        if (i + 1) % each == 0:
            rows.append(y)
    return rows


def circles(a, r, b, s, side):
    """The point r from a and s from b, left (side = 1) or right (-1) of the way from a to b; complex numbers."""
    d = abs(b - a)
    x = (d * d + r * r - s * s) / (2 * d)
    return a + (b - a) / d * complex(x, side * sqrt(r * r - x * x))


# ---- linkages -------------------------------------------------------------------------------------------------------------------------


def oldham(folder):
    """Two parallel shafts 12 mm apart: they turn alike, the disc's centre runs on a circle at twice their speed."""
    h = simulate(
        folder,
        "oldham",
        simulation(0.5),
        ground(far=["12 mm", 0, 0]),
        rigid("in", mass=1, inertia=[0.001, 0.001, 0.002]),
        rigid("disc", mass=0.4, inertia=[2e-4, 2e-4, 4e-4]),
        rigid("out", mass=1, inertia=[0.001, 0.001, 0.002]),
        joint("in", "revolute", "ground", "in", motion="20*t"),
        joint("slot in", "prismatic", "in", "disc", axis=[1, 0, 0]),
        joint("out", "revolute", "ground.far", "out"),
        joint("slot out", "prismatic", "out", "disc", axis=[0, 1, 0]),
        output("turned", "out", "value"),
        output("disc", "disc", "position"),
    )
    worst("oldham", h, "turned", lambda i, t: 20 * t, 1e-9)
    worst("oldham", h, "disc.x", lambda i, t: 0.012 * cos(20 * t) ** 2, 1e-9)
    worst("oldham", h, "disc.y", lambda i, t: 0.012 * cos(20 * t) * sin(20 * t), 1e-9)


def watt(folder):
    """Watt's straight line: arms of 200 mm, coupler of 80 mm."""
    h = simulate(
        folder,
        "watt",
        simulation(1),
        ground(a=[0, 0, 0], d=[0.4, -0.08, 0]),
        rigid("arm", mass=0.5, inertia=[0, 0.002, 0.002], centre_of_mass=[0.1, 0, 0], frames=dict(end=[0.2, 0, 0])),
        rigid(
            "coupler", mass=0.2, inertia=[0, 1e-4, 1e-4], centre_of_mass=[0.04, 0, 0], frames=dict(middle=[0.04, 0, 0], end=[0.08, 0, 0])
        ),
        rigid("beam", mass=0.5, inertia=[0, 0.002, 0.002], centre_of_mass=[0.1, 0, 0], frames=dict(end=[0.2, 0, 0])),
        joint("A", "revolute", "ground.a", "arm", motion="0.3*sin(2*pi*t)"),
        joint("B", "revolute", "arm.end", "coupler", initial=dict(guess="-90 deg")),
        joint("D", "revolute", "ground.d", "beam", initial=dict(guess="180 deg")),
        joint("C", "revolute", "coupler.end", "beam.end"),
        output("P", "coupler.middle", "position"),
    )

    def middle(i, t):
        b = 0.2 * cmath.exp(0.3j * sin(2 * pi * t))
        return (b + circles(b, 0.08, 0.4 - 0.08j, 0.2, -1)) / 2

    worst("watt", h, "P.x", lambda i, t: middle(i, t).real, 1e-7)
    worst("watt", h, "P.y", lambda i, t: middle(i, t).imag, 1e-7)


def stephenson(folder):
    """A four-bar linkage whose coupler point drives a second rocker."""
    h = simulate(
        folder,
        "stephenson",
        simulation(1),
        ground(d=["160 mm", 0, 0], e=["100 mm", "280 mm", 0]),
        rigid("crank", mass=0.3, inertia=[0, 1e-4, 1e-4], frames=dict(end=["50 mm", 0, 0])),
        rigid(
            "coupler",
            mass=0.6,
            inertia=[1e-3, 1e-3, 2e-3],
            centre_of_mass=[0.07, 0.02, 0],
            frames=dict(end=["150 mm", 0, 0], p=["80 mm", "60 mm", 0]),
        ),
        rigid("rocker", mass=0.4, inertia=[0, 5e-4, 5e-4], frames=dict(end=["120 mm", 0, 0])),
        rigid("rod", mass=0.4, inertia=[0, 5e-4, 5e-4], frames=dict(end=["140 mm", 0, 0])),
        rigid("lever", mass=0.4, inertia=[0, 5e-4, 5e-4], frames=dict(end=["130 mm", 0, 0])),
        joint("A", "revolute", "ground", "crank", motion="2*pi*t"),
        joint("B", "revolute", "crank.end", "coupler", initial=dict(guess="50 deg")),
        joint("D", "revolute", "ground.d", "rocker", initial=dict(guess="100 deg")),
        joint("C", "revolute", "coupler.end", "rocker.end"),
        joint("P", "revolute", "coupler.p", "rod"),
        joint("E", "revolute", "ground.e", "lever", initial=dict(guess=0)),
        joint("Q", "revolute", "rod.end", "lever.end"),
        output("lever", "E", "value"),
        output("Q", "lever.end", "position"),
    )

    def tip(i, t):
        b = 0.05 * cmath.exp(2j * pi * t)
        c = circles(b, 0.15, 0.16 + 0j, 0.12, 1)
        p = b + (c - b) / 0.15 * (0.08 + 0.06j)
        return circles(p, 0.14, 0.1 + 0.28j, 0.13, -1)

    worst("stephenson", h, "Q.x", lambda i, t: tip(i, t).real, 1e-7)
    worst("stephenson", h, "Q.y", lambda i, t: tip(i, t).imag, 1e-7)


def stewart(folder):
    """Six legs whose lengths are those of a platform that goes up and down and stays level."""
    h = simulate(
        folder,
        "stewart",
        simulation(1, gravity=[0, 0, -9.81]),
        rigid("top", mass=20, inertia=[0.5, 0.5, 1]),
        joint("top", "free", "ground", "top", initial=dict(guess=[0, 0, 0.6, 0, 0, 0])),
        table("group", name="leg", parameters=dict(b=0, p=0)),
        table("group.body", name="foot", kind="rigid", mass=1, inertia=[0.01, 0.01, 0.001]),
        table("group.body", name="rod", kind="rigid", mass=0.5, inertia=[0.01, 0.01, 0.001]),
        table(
            "group.joint",
            name="cross",
            kind="universal",
            parent="ground",
            child="foot",
            axis=[1, 0, 0],
            position="[0.5*cos(b), 0.5*sin(b), 0]",
        ),
        table(
            "group.joint",
            name="jack",
            kind="prismatic",
            parent="foot",
            child="rod",
            motion="sqrt((0.3*cos(p) - 0.5*cos(b))^2 + (0.3*sin(p) - 0.5*sin(b))^2 + (0.6 + 0.05*sin(2*pi*t))^2)",
        ),
        table("group.joint", name="ball", kind="spherical", parent="top", child="rod", position="[0.3*cos(p), 0.3*sin(p), 0]"),
        table("instance", group="leg", name="l", count=6, parameters=dict(b="pi/3*i + 0.2*(-1)^i", p="pi/3*i - 0.3*(-1)^i")),
        output("top", "top", "position"),
        output("tilt", "top", "angle", relative_to="ground"),
    )
    worst("stewart", h, "top.z", lambda i, t: 0.6 + 0.05 * sin(2 * pi * t), 1e-8)
    worst("stewart", h, "top.x", lambda i, t: 0, 1e-8)
    worst("stewart", h, "tilt", lambda i, t: 0, 1e-6)


def toggle(folder):
    """A toggle press: a force P on its knee presses with P/(2 tan(angle)); slow, so inertia is 1e-5 of it."""
    h = simulate(
        folder,
        "toggle",
        simulation(1),
        rigid("lower", mass=0.1, inertia=[0, 3e-4, 3e-4], frames=dict(knee=[0.2, 0, 0])),
        rigid("upper", mass=0.1, inertia=[0, 3e-4, 3e-4], frames=dict(end=[0.2, 0, 0])),
        rigid("ram", mass=0.1),
        joint("foot", "revolute", "ground", "lower", initial=dict(guess="80 deg")),
        joint("knee", "revolute", "lower.knee", "upper", initial=dict(guess="20 deg")),
        joint("guide", "prismatic", "ground", "ram", axis=[0, 1, 0], motion="0.38 + 0.01*t"),
        joint("pin", "revolute", "upper.end", "ram"),
        force("force", "lower.knee", name="push", direction=[-1, 0, 0], value="1 kN"),
        output("way", "guide", "value"),
        output("press", "guide", "reaction"),
    )
    # half the way is 0.2 cos(a); the ram is held down with P/(2 tan a)
    worst("toggle", h, "press.y", lambda i, t: -500 / math.tan(math.acos((0.38 + 0.01 * t) / 0.4)), 0.1)


def hooke(folder):
    """Two universal joints with their forks in one plane: the outer shafts turn alike, the one between them does not."""
    h = simulate(
        folder,
        "hooke",
        section("parameters", bend="25 deg", L=0.3),
        simulation(0.5),
        ground(far="[0, -L*sin(bend), L*cos(bend)]"),
        rigid("in", mass=1, inertia=[0.001, 0.001, 0.002]),
        rigid("between", mass=1, inertia=[0.008, 0.008, 0.001], centre_of_mass=[0, 0, "L/2"], frames=dict(end=[0, 0, "L"])),
        rigid("out", mass=1, inertia=[0.001, 0.001, 0.002]),
        joint("in", "revolute", "ground", "in", motion="30*t"),
        joint("first", "universal", "in", "between", axis=[0, 1, 0], initial=dict(guess=[0, "bend"])),
        joint("second", "universal", "between.end", "out", axis=[1, 0, 0], initial=dict(guess=["-bend", 0])),
        joint("out", "cylindrical", "ground.far", "out"),
        output("out", "out", "value"),
        output("between", "between", "angular_velocity"),
    )
    worst("hooke", h, "out.2", lambda i, t: 30 * t, 1e-6)
    c = cos(25 * pi / 180)
    # Hooke: w2 = w1 cos(bend)/(1 - sin^2(bend) cos^2(a)), a from where the driving fork lies in the plane of both shafts
    speed = [y * -sin(25 * pi / 180) + z * c for y, z in zip(h["between.y"], h["between.z"])]
    near(max(abs(s - 30 * c / (1 - (1 - c * c) * cos(30 * t) ** 2)) for s, t in zip(speed, h["t"])), 0.0, 1e-4, "hooke: shaft between")


# ---- gears, ropes, drives -------------------------------------------------------------------------------------------------------------


def gears(folder):
    """A motor drives a load through 18 and 54 teeth."""
    h = simulate(
        folder,
        "gears",
        simulation(1),
        rigid("motor", mass=1, inertia=[0.002, 0.002, 0.002]),
        rigid("load", mass=5, inertia=[0.05, 0.05, 0.05]),
        joint("motor", "revolute", "ground", "motor"),
        joint("load", "revolute", "ground", "load", position=[0.144, 0, 0]),
        coupling("teeth", "gear", ["motor", "load"], teeth=[18, 54]),
        force("torque", "motor", direction=[0, 0, 1], value=2),
        force("torque", "load", direction=[0, 0, 1], value=3),
        output("motor", "motor", "rate"),
        output("teeth", "teeth", "force"),
    )
    a = (2 - 3 / 3) / (0.002 + 0.05 / 9)
    worst("gears", h, "motor", lambda i, t: a * t, 1e-5)
    worst("gears", h, "teeth.1", lambda i, t: 0.002 * a - 2, 1e-6)
    worst("gears", h, "teeth.2", lambda i, t: -0.05 * a / 3 - 3, 1e-6)


def differential(folder):
    """A car's axle: the input's torque is shared evenly, whatever the wheels do."""

    def wheel(name, inertia, torque):
        return (
            rigid(name, mass=10, inertia=[inertia, 0.5, 0.5])
            + joint(name, "revolute", "ground", name, axis=[1, 0, 0])
            + output(name, name, "rate")
            + force("torque", name, direction=[1, 0, 0], value=torque)
        )

    h = simulate(
        folder,
        "differential",
        simulation(1),
        coupling("bevels", "differential", ["left", "right", "shaft"]),
        wheel("left", 0.5, -4),
        wheel("right", 0.7, -9),
        wheel("shaft", 0.2, 30),
    )
    # ja a = -4 + m/2, jb b = -9 + m/2, js (a + b)/2 = 30 - m
    m = (30 + 0.2 / 2 * (4 / 0.5 + 9 / 0.7)) / (1 + 0.2 / 4 * (1 / 0.5 + 1 / 0.7))
    worst("differential", h, "left", lambda i, t: (m / 2 - 4) / 0.5 * t, 1e-5)
    worst("differential", h, "right", lambda i, t: (m / 2 - 9) / 0.7 * t, 1e-5)


def atwood(folder):
    """Two masses on a rope over a heavy pulley."""
    h = simulate(
        folder,
        "atwood",
        section("parameters", r="150 mm"),
        simulation(1, gravity=[0, -9.81, 0]),
        rigid("pulley", shapes=[dict(shape="disc", radius="r", thickness=0.02)], mass=8, inertia="shapes"),
        rigid("light", mass=3),
        rigid("heavy", mass=5),
        joint("axle", "revolute", "ground", "pulley"),
        joint("light", "prismatic", "ground", "light", axis=[0, 1, 0], position=["r", -1, 0]),
        joint("heavy", "prismatic", "ground", "heavy", axis=[0, 1, 0], position=["-r", -1, 0]),
        coupling("right", "rack", ["axle", "light"], radius="r"),
        coupling("left", "rack", ["axle", "heavy"], radius="-r"),
        output("up", "light", "value"),
        output("rope", "right", "force"),
    )
    a = (5 - 3) * g / (5 + 3 + 8 / 2)
    worst("atwood", h, "up", lambda i, t: a * t * t / 2, 1e-6)
    worst("atwood", h, "rope.2", lambda i, t: 3 * (g + a), 1e-6)


def rack(folder):
    """A mass on a spring that turns a pinion by its rack."""
    h = simulate(
        folder,
        "rack",
        simulation(2),
        rigid("pinion", mass=2, inertia=[0.002, 0.002, 0.004]),
        rigid("slide", mass=1.5),
        joint("axle", "revolute", "ground", "pinion"),
        joint("slide", "prismatic", "ground", "slide", axis=[1, 0, 0], initial=dict(value="20 mm"), spring=dict(stiffness=300)),
        coupling("teeth", "rack", ["axle", "slide"], radius="40 mm"),
        output("x", "slide", "value"),
        output("angle", "axle", "value"),
    )
    w = sqrt(300 / (1.5 + 0.004 / 0.04**2))
    worst("rack", h, "x", lambda i, t: 0.02 * cos(w * t), 2e-7)
    worst("rack", h, "angle", lambda i, t: 0.5 * (cos(w * t) - 1), 5e-6)


def brake(folder):
    """A drum of 0.8 kg m^2 is braked with 0.35 x 200 N x 150 mm: it stops after J w / M."""
    h = simulate(
        folder,
        "brake",
        simulation(3),
        rigid("drum", mass=20, inertia=[0.5, 0.5, 0.8]),
        joint(
            "axle", "revolute", "ground", "drum", initial=dict(rate=30), friction=dict(coefficient=0.35, normal_force=200, radius="150 mm")
        ),
        output("speed", "axle", "rate"),
        output("angle", "axle", "value"),
    )
    worst("brake", h, "speed", lambda i, t: max(0.0, 30 - 10.5 / 0.8 * t), 1e-5)
    near(h["angle"][-1], 30**2 * 0.8 / (2 * 10.5), 1e-5, "brake: angle at rest")


def motor(folder):
    """A speed controller (proportional and integral) on a motor with bearing drag."""
    h = simulate(
        folder,
        "motor",
        simulation(3),
        rigid("rotor", mass=1, inertia=[0.02, 0.02, 0.02]),
        joint("shaft", "revolute", "ground", "rotor", spring=dict(damping=0.03)),
        output("speed", "shaft", "rate"),
        table("block", name="control", kind="pid", input="100 - speed", proportional=0.05, integral=0.4),
        force("torque", "rotor", direction=[0, 0, 1], value="control"),
    )
    # J s^2 + (b + p) s + i = 0; the step answer 100 (p s + i)/(J s^2 + (b + p) s + i)/s
    a, b = (0.03 + 0.05) / (2 * 0.02), sqrt(0.4 / 0.02 - (0.08 / 0.04) ** 2)

    def speed(i, t):
        return 100 * (1 - math.exp(-a * t) * (cos(b * t) + (a - 0.05 / 0.02) / b * sin(b * t)))

    worst("motor", h, "speed", speed, 1e-3)


# ---- contacts -------------------------------------------------------------------------------------------------------------------------


def ladder(folder):
    """A smooth ladder slides down a wall; it leaves the wall where its top is at two thirds of its height at the start."""
    h = simulate(
        folder,
        "ladder",
        simulation(0.9, gravity=[0, -9.81, 0]),
        rigid("ladder", mass=12, inertia=[0, 4, 4], frames=dict(foot=[-1, 0, 0], head=[1, 0, 0])),
        joint("plane", "planar", "ground", "ladder", initial=dict(value=["cos(60 deg)", "sin(60 deg)", "120 deg"])),
        force("contact", "ladder.foot", name="floor", shape="point", normal=[0, 1, 0], stiffness=1e7, restitution=0.1),
        force("contact", "ladder.head", name="wall", shape="point", normal=[1, 0, 0], stiffness=1e7, restitution=0.1),
        output("head", "ladder.head", "position"),
        output("wall", "wall", "force"),
    )
    last = max(i for i, f in enumerate(h["wall"]) if f > 0)
    near(h["head.y"][last], 2 / 3 * 2 * sin(pi / 3), 0.01, "ladder: height where it leaves the wall")


def roller(folder):
    """A cylinder on an incline of 30 deg rolls with mu = 0.25 and slips with 0.1 (tan(30 deg)/3 = 0.19 is needed)."""
    scene = [
        section("parameters", R="100 mm", mu=0.25),
        simulation(0.8, gravity=[0, -9.81, 0]),
        rigid("roller", mass=4, inertia=[0.02, 0.02, 0.02]),
        joint("plane", "planar", "ground", "roller", initial=dict(value=["R*sin(30 deg)", "R*cos(30 deg)", 0])),
        force(
            "contact",
            "roller",
            name="ramp",
            shape="cylinder",
            radius="R",
            normal=["sin(30 deg)", "cos(30 deg)", 0],
            stiffness=1e6,
            damping=0.2,
            friction=dict(coefficient="mu"),
        ),
        output("v", "roller", "velocity"),
        output("spin", "roller", "angular_velocity"),
    ]
    for mu, speed, spin in [(0.25, 2 / 3 * g / 2, 2 / 3 * g / 2 / 0.1), (0.1, g * (0.5 - 0.1 * cos(pi / 6)), 0.1 * g * cos(pi / 6) * 20)]:
        h = simulate(folder, "roller", *scene, words=("--set", f"mu={mu}"))
        t = h["t"][-1]
        near(math.hypot(h["v.x"][-1], h["v.y"][-1]), speed * t, 2e-3 * speed * t, f"roller: speed with mu = {mu}")
        near(-h["spin.z"][-1], spin * t, 2e-3 * spin * t, f"roller: spin with mu = {mu}")


def bounce(folder):
    """A ball of 50 mm, dropped from 1 m, comes back to 0.64 and 0.41 of its height."""
    h = simulate(
        folder,
        "bounce",
        simulation(1.9, gravity=[0, 0, -9.81]),
        rigid("ball", mass=0.5, inertia=[5e-4, 5e-4, 5e-4]),
        joint("fall", "free", "ground", "ball", initial=dict(value=[0, 0, 1.05, 0, 0, 0])),
        force("contact", "ball", name="floor", shape="sphere", radius="50 mm", stiffness=1e6, restitution=0.8),
        output("z", "ball", "position"),
    )
    z = h["z.z"]
    tops = [z[i] - 0.05 for i in range(1, len(z) - 1) if z[i - 1] < z[i] >= z[i + 1] and z[i] > 0.1]
    for top, wanted in zip(tops, [0.64, 0.4096]):
        near(top, wanted, 0.004, "bounce: height")
    expect(len(tops) == 2, f"bounce: {len(tops)} heights")


# ---- swings in space ------------------------------------------------------------------------------------------------------------------


def bead(folder):
    """A bead on a hoop that turns about its vertical diameter: phi'' = sin(phi) (w^2 cos(phi) - g/R)."""
    h = simulate(
        folder,
        "bead",
        simulation(3, gravity=[0, -9.81, 0]),
        rigid("hoop", mass=1, inertia=[0.1, 0.1, 0.1]),
        rigid("bead", mass=0.05),
        joint("axle", "revolute", "ground", "hoop", axis=[0, 1, 0], motion="8*t"),
        joint(
            "wire",
            "point-on-curve",
            "hoop",
            "bead",
            curve=dict(x="0.4*sin(u)", y="-0.4*cos(u)", to="2*pi", closed=True),
            initial=dict(value=0.2),
        ),
        output("s", "wire", "value"),
    )
    rows = runge_kutta(lambda t, y: (y[1], sin(y[0]) * (64 * cos(y[0]) - g / 0.4)), (0.5, 0.0), 1e-4, 30000, 10)
    worst("bead", h, "s", lambda i, t: 0.4 * rows[i][0], 1e-5)


def gyroscope(folder):
    """A rotor in gimbals with a weight on its axle goes round steadily with F l / (C w)."""
    h = simulate(
        folder,
        "gyroscope",
        section("parameters", spin=200, C=0.004, precession="5*0.1/(C*spin)"),
        simulation(2),
        rigid("outer", mass=0.5, inertia=[0.002, 0.002, 0.003]),
        rigid("inner", mass=0.3, inertia=[0.001, 0.001, 0.001], frames=dict(arm=[0, 0.1, 0])),
        rigid("rotor", mass=2, inertia=[0.0025, "C", 0.0025]),
        joint("post", "revolute", "ground", "outer", initial=dict(rate="precession")),
        joint("tilt", "revolute", "outer", "inner", axis=[1, 0, 0]),
        joint("axle", "revolute", "inner", "rotor", axis=[0, 1, 0], initial=dict(rate="spin")),
        force("force", "inner.arm", name="weight", direction=[0, 0, -1], value=5),
        output("round", "post", "value"),
        output("tilt", "tilt", "value"),
        output("spin", "axle", "value"),
    )
    worst("gyroscope", h, "round", lambda i, t: 0.5 / 0.8 * t, 1e-5)
    worst("gyroscope", h, "tilt", lambda i, t: 0, 1e-6)


def spring_pendulum(folder):
    """A mass on a spring swings in a plane."""
    h = simulate(
        folder,
        "spring_pendulum",
        simulation(4, gravity=[0, -9.81, 0]),
        rigid("mass", mass=1),
        joint("plane", "planar", "ground", "mass", initial=dict(value=[0.5, -0.7, 0])),
        force("spring-damper", "mass", name="spring", stiffness=40, rest=0.6),
        output("p", "mass", "position"),
        output("length", "spring", "length"),
    )

    def f(t, y):
        k = -40 * (1 - 0.6 / math.hypot(y[0], y[1]))
        return y[2], y[3], k * y[0], k * y[1] - g

    rows = runge_kutta(f, (0.5, -0.7, 0.0, 0.0), 5e-4, 8000, 2)
    worst("spring_pendulum", h, "p.x", lambda i, t: rows[i][0], 2e-5)
    worst("spring_pendulum", h, "p.y", lambda i, t: rows[i][1], 2e-5)
    worst("spring_pendulum", h, "length", lambda i, t: math.hypot(*rows[i][:2]), 2e-5)


def crane(folder):
    """A trolley speeds up while its load is hoisted: l a'' + 2 l' a' + g sin(a) + x'' cos(a) = 0."""
    h = simulate(
        folder,
        "crane",
        simulation(5, gravity=[0, -9.81, 0]),
        rigid("trolley", mass=300),
        rigid("rope", mass=0),
        rigid("load", mass=800),
        joint("bridge", "prismatic", "ground", "trolley", axis=[1, 0, 0], motion="0.2*t^2"),
        joint("swing", "revolute", "trolley", "rope"),
        joint("hoist", "prismatic", "rope", "load", axis=[0, -1, 0], motion="5 - 0.3*t"),
        output("swing", "swing", "value"),
    )

    def f(t, y):
        return y[1], (0.6 * y[1] - g * sin(y[0]) - 0.4 * cos(y[0])) / (5 - 0.3 * t)

    rows = runge_kutta(f, (0.0, 0.0), 1e-3, 5000)
    worst("crane", h, "swing", lambda i, t: rows[i][0], 1e-6)


def tumbling(folder):
    """A thrown box that turns about its middle axis tips over again and again; Euler's equations."""
    h = simulate(
        folder,
        "tumbling",
        simulation(4, tolerance=1e-8),
        rigid("box", mass=2, inertia=[0.01, 0.02, 0.03]),
        joint("throw", "free", "ground", "box", initial=dict(rate=[1, 0, 0, 0.05, 6, 0.05])),
        output("w", "box", "angular_velocity"),
        output("p", "box", "position"),
    )

    def f(t, y):
        (x, u, v), (a, b, c, d) = y[:3], y[3:]
        return (
            (0.02 - 0.03) / 0.01 * u * v,
            (0.03 - 0.01) / 0.02 * v * x,
            (0.01 - 0.02) / 0.03 * x * u,
            (-b * x - c * u - d * v) / 2,
            (a * x + c * v - d * u) / 2,
            (a * u + d * x - b * v) / 2,
            (a * v + b * u - c * x) / 2,
        )

    rows = runge_kutta(f, (0.05, 6.0, 0.05, 1.0, 0.0, 0.0, 0.0), 5e-4, 8000, 2)

    def world_y(i, t):
        (x, u, v), (a, b, c, d) = rows[i][:3], rows[i][3:]
        return 2 * (b * c + a * d) * x + (1 - 2 * (b * b + d * d)) * u + 2 * (c * d - a * b) * v

    worst("tumbling", h, "w.y", world_y, 1e-4)
    worst("tumbling", h, "p.x", lambda i, t: t, 1e-6)


# ---- vibrations -----------------------------------------------------------------------------------------------------------------------


def jeffcott(folder):
    """An unbalanced disc on an elastic shaft, below its critical speed: e w^2 / (k/m - w^2)."""
    h = simulate(
        folder,
        "jeffcott",
        section("parameters", off="1 mm", k=5e4, m=10, w=50, r="off*w^2/(k/m - w^2)"),
        simulation(1),
        rigid("slide", mass=0),
        rigid("hub", mass=0),
        rigid("disc", mass="m", inertia=[0.05, 0.05, 0.1], centre_of_mass=["off", 0, 0]),
        joint("x", "prismatic", "ground", "slide", axis=[1, 0, 0], initial=dict(value="r", rate=0), spring=dict(stiffness="k")),
        joint("y", "prismatic", "slide", "hub", axis=[0, 1, 0], initial=dict(value=0, rate="r*w"), spring=dict(stiffness="k")),
        joint("turn", "revolute", "hub", "disc", motion="w*t"),
        output("hub", "hub", "position"),
    )
    worst("jeffcott", h, "hub.x", lambda i, t: 0.001 * cos(50 * t), 1e-7)
    worst("jeffcott", h, "hub.y", lambda i, t: 0.001 * sin(50 * t), 1e-7)


def discs(folder):
    """Two discs on a shaft that twists; one of them is struck."""
    h = simulate(
        folder,
        "discs",
        simulation(1),
        rigid("first", mass=5, inertia=[0.05, 0.05, 0.1]),
        rigid("second", mass=5, inertia=[0.1, 0.1, 0.2]),
        joint("bearing", "revolute", "ground", "first", initial=dict(rate=3)),
        joint("shaft", "revolute", "first", "second", position=[0, 0, 0.5], spring=dict(stiffness=60), initial=dict(rate=-3)),
        output("twist", "shaft", "value"),
        output("first", "bearing", "value"),
    )
    w = sqrt(60 * (1 / 0.1 + 1 / 0.2))
    worst("discs", h, "twist", lambda i, t: -3 / w * sin(w * t), 5e-6)
    worst("discs", h, "first", lambda i, t: t + 2 / w * sin(w * t), 5e-6)


def root(f, a, b):
    """Bisection."""
    for _ in range(80):
        a, b = (a, (a + b) / 2) if f(a) * f((a + b) / 2) <= 0 else ((a + b) / 2, b)
    return a


def tip_mass(folder):
    """A cantilever with a lump at its tip: 1 + cos b cosh b + (M/m) b (cos b sinh b - sin b cosh b) = 0."""
    written.append("tip_mass")
    tables = [
        simulation(0.1),
        body(
            "blade",
            "beam",
            length="500 mm",
            section=dict(shape="rectangle", width="30 mm", height="3 mm"),
            material=dict(density=7850, youngs_modulus="210 GPa"),
            effects=["bending_xy"],
        ),
        rigid("lump", mass=0.2),
        joint("clamp", "weld", "ground", "blade.root"),
        joint("glue", "weld", "blade.tip", "lump"),
    ]
    (folder / "tip_mass.toml").write_text("".join(tables))
    modes = json.loads(run("check", folder / "tip_mass.toml", "--json").stdout)["modes"]
    m = 7850 * 0.03 * 0.003 * 0.5
    for number, (a, b) in enumerate([(0.5, 2.5), (3.5, 5.0)]):
        beta = root(lambda x: 1 + cos(x) * math.cosh(x) + 0.2 / m * x * (cos(x) * math.sinh(x) - sin(x) * math.cosh(x)), a, b)
        wanted = beta**2 / 0.5**2 * sqrt(210e9 * 0.003**2 / 12 / 7850) / (2 * pi)
        near(modes[number]["frequency"], wanted, 1e-3 * wanted, f"tip_mass: frequency {number + 1}")


def portal(folder):
    """A frame of three beams under a sideways load; slopes and sway by the deflection method."""

    def beam(name, length):
        section = dict(shape="box", width="100 mm", height="100 mm", thickness="5 mm")
        return body(name, "beam", length=length, section=section, material=dict(density=7850, youngs_modulus="210 GPa"))

    h = simulate(
        folder,
        "portal",
        simulation(0.01, start="static"),
        beam("left", 3),
        beam("girder", 4),
        beam("right", 3),
        joint("left foot", "weld", "ground", "left.root", rotation=[0, 0, "90 deg"]),
        joint("right foot", "weld", "ground", "right.root", position=[4, 0, 0], rotation=[0, 0, "90 deg"]),
        joint("left corner", "weld", "left.tip", "girder.root", rotation=[0, 0, "-90 deg"]),
        joint("right corner", "weld", "girder.tip", "right.tip", rotation=[0, 0, "90 deg"]),
        force("force", "left.tip", name="wind", direction=[1, 0, 0], value="2 kN"),
        output("sway", "girder.root", "position"),
        output("foot", "left foot", "reaction"),
    )
    ei, shear = 210e9 * (0.1**4 - 0.09**4) / 12, 210e9 / 2.6 * 2 * 0.1 * 0.005  # its two webs carry the transverse force
    column, girder = 1 + 12 * ei / (shear * 9), 1 + 12 * ei / (shear * 16)
    slope = 6 / 9 / column / ((3 + column) / 3 / column + 6 / 4 / girder)  # by unit sway
    sway = 2000 / (2 * ei / column * (12 / 27 - 6 / 9 * slope))
    near(h["sway.x"][0], sway, 2e-3 * sway, "portal: sway")
    moment = ei / column * (6 / 9 - (3 - column) / 3 * slope) * sway
    near(h["foot.mz"][0], moment, 2e-3 * moment, "portal: moment of the foot")


with temporary_folder() as name:
    for mechanism in [
        oldham,
        watt,
        stephenson,
        stewart,
        toggle,
        hooke,
        gears,
        differential,
        atwood,
        rack,
        brake,
        motor,
        ladder,
        roller,
        bounce,
        bead,
        gyroscope,
        spring_pendulum,
        crane,
        tumbling,
        jeffcott,
        discs,
        tip_mass,
        portal,
    ]:
        mechanism(pathlib.Path(name))
print(f"{len(set(written))} mechanisms")
finish()
