"""Elastic parts as machine builders use them: flexures, stayed beams, crossed beams."""
import math

import numpy as np
from plain_case import case
from plain_effects import E, G, STEEL, circle, still
from plain_fifth import out
from scene import Scene, beam, force, joint, output, rigid, simulation, weld
from truths import ode

g = 9.81


@case("a block on two parallel leaves: stiffness, and how far it sinks as it moves across")
def parallel_leaves():
    L, b, h = 0.1, 0.02, 0.001
    I = b * h**3 / 12
    for share in (0.002, 0.01, 0.03):
        d = share * L
        F = 24 * E * I * d / L**3
        sink = 0.6 * d * d / L
        for model in ("", 'model = "mixed"\nvolumes = 4'):
            leaf = lambda n: beam(n, L, f'{{ shape = "rectangle", height = {h}, width = {b} }}', STEEL, model)
            up = 'rotation = [0, 0, "pi/2"]'
            yield Scene(
                simulation(0.01, 200, start="static")
                + leaf("one")
                + leaf("two")
                + rigid("block", 0.1, (1e-4,) * 3, {"a": (-0.05, 0, 0), "b": (0.05, 0, 0), "low": (0, -L / 2, 0)})
                + weld("w1", "ground", "one", "position = [-0.05, 0, 0]\n" + up)
                + weld("w2", "ground", "two", "position = [0.05, 0, 0]\n" + up)
                + weld("a", "one.tip", "block.a", 'rotation = [0, 0, "-pi/2"]')
                + weld("b", "two.tip", "block.b", 'rotation = [0, 0, "-pi/2"]')
                # At half the height the force neither tips the block nor presses a leaf.
                + '[[force]]\nkind = "force"\non = "block.low"\ndirection = [1, 0, 0]\nvalue = '
                + f"{F!r}\n\n"
                + output("block", "block", "position"),
                still(block=[d, L - sink, 0]),
                {"block": d},
                f"by {share} of the length, {model[9:14]}",
            )


@case("a beam held by a stay: the cable carries its share, or goes slack")
def stayed_beam():
    L, d, k = 2.0, 0.04, 2e5
    I = math.pi * d**4 / 64
    b = 3 * E * I / L**3
    for F in (200.0, -200.0):
        # The stay rises from the tip at 45 degrees to the wall; its stretch is u / sqrt(2), what it does is k / 2 across.
        u = F / (b + k / 2) if F > 0 else F / b
        yield Scene(
            simulation(0.01, 200, start="static")
            + f"[ground]\nframes = {{ high = [0, {L}, 0] }}\n"
            + beam("boom", L, circle(d)[0], STEEL)
            + weld("wall", "ground", "boom")
            + f'[[force]]\nkind = "cable"\nname = "stay"\non = "boom.tip"\nfrom = "ground.high"\n'
            + f"stiffness = {k}\nrest = {L * math.sqrt(2)!r}\n\n"
            + force("force", "boom.tip", F, (0, -1, 0))
            + output("tip", "boom.tip", "position")
            + out("pull", "stay", "force"),
            still(tip=[np.nan, -u, 0], pull=[max(0.0, k * u / math.sqrt(2))]),
            {"tip": abs(u), "pull": max(1.0, k * abs(u) / math.sqrt(2))},
            f"{F} N",
        )


@case("two beams cross in their middles, clamped at one end and hinged, joined by a ball: the load is shared")
def crossed_beams():
    L, d = 1.0, 0.02
    I = math.pi * d**4 / 64
    F = 50.0
    kinds = {"weld": 192, "ball": 48}
    for first, second in (("weld", "weld"), ("ball", "ball"), ("weld", "ball")):
        k = (kinds[first] + kinds[second]) * E * I / L**3

        def bar(n, end, turn):
            at = f"rotation = [0, {turn}, 0]"
            text = beam(n, L, circle(d)[0], STEEL, "frames = { middle = 0.5 }")
            if end == "weld":
                x = (-0.5 * L * math.cos(turn), 0.0, 0.5 * L * math.sin(turn))
                y = (0.5 * L * math.cos(turn), 0.0, -0.5 * L * math.sin(turn))
                text += weld(n + "a", "ground", n, f"position = {list(x)}\n{at}")
                text += rigid(n + "s", 0.01, (1e-6,) * 3)
                # Free to come in along the beam.
                text += joint(n + "p", "prismatic", "ground", n + "s", f"position = {list(y)}\n{at}\naxis = [1, 0, 0]")
                text += weld(n + "b", n + "s", n + ".tip")
                return text
            x = (-0.5 * L * math.cos(turn), 0.0, 0.5 * L * math.sin(turn))
            y = (0.5 * L * math.cos(turn), 0.0, -0.5 * L * math.sin(turn))
            text += joint(n + "a", "universal", "ground", n, f"position = {list(x)}\n{at}\naxis = [0, 0, 1]")
            text += rigid(n + "s", 0.01, (1e-6,) * 3)
            text += joint(n + "p", "prismatic", "ground", n + "s", f"position = {list(y)}\n{at}\naxis = [1, 0, 0]")
            return text + joint(n + "b", "spherical", n + "s", n + ".tip")

        yield Scene(
            simulation(0.01, 200, start="static")
            + bar("one", first, 0.0)
            + bar("two", second, math.pi / 2)
            + joint("cross", "spherical", "one.middle", "two.middle")
            + force("force", "one.middle", F, (0, -1, 0))
            + output("middle", "one.middle", "position"),
            still(middle=[np.nan, -F / k, np.nan]),
            {"middle": F / k},
            f"{first} and {second}",
        )


@case("a bar that turns with a blade welded to it at an angle: what the root of a spinning oblique rod carries")
def oblique_rod():
    # A uniform rod at 45 degrees to the axis it turns about: moment m L^2 W^2 sin a cos a / 3 across, force m W^2 L/2 sin a.
    L, d, W, a = 0.5, 0.02, 30.0, math.pi / 4
    m = STEEL["rho"] * math.pi * d * d / 4 * L
    for more in ("", "keep_modes = 0", 'model = "mixed"\nvolumes = 4'):
        moment = m * L * L * W * W * math.sin(a) * math.cos(a) / 3
        pull = m * W * W * L / 2 * math.sin(a)
        yield Scene(
            simulation(0.5, 200, start="static")
            + rigid("hub", 1.0, (1e-3,) * 3)
            + beam("rod", L, circle(d)[0], STEEL, more)
            + joint("motor", "revolute", "ground", "hub", f'motion = "{W}*t"')
            + weld("root", "hub", "rod", f"rotation = [0, {-a!r}, 0]")
            + out("root", "root", "reaction", 'frame = "parent"'),
            lambda t, moment=moment, pull=pull: {
                "root": np.c_[0 * t - pull * math.cos(a), 0 * t, 0 * t + pull * math.sin(a), 0 * t, 0 * t + moment, 0 * t]
            },
            {"root": max(pull, moment)},
            more or "default",
            sizes_only=True,
        )


@case("gears whose shafts bend: an elastic arm on each wheel, in small motion; poles that Lagrange gives for two rods and a ratio")
def arm_on_gears():
    # Torsion springs ground both wheels' shafts; q2 = -2 q1.
    J1, J2, k1, k2, c = 0.02, 0.005, 50.0, 20.0, 0.1
    J, k = J1 + 4 * J2, k1 + 4 * k2
    for start in (0.2, 1.0):
        w = math.sqrt(k / J - (c / (2 * J)) ** 2)
        yield Scene(
            simulation(2, 200)
            + rigid("a", 1.0, (J1,) * 3)
            + rigid("b", 1.0, (J2,) * 3)
            + joint(
                "ja",
                "revolute",
                "ground",
                "a",
                f"initial = {{ value = {start}, rate = 0 }}\nspring = {{ stiffness = {k1}, damping = {c}, rest = 0 }}",
            )
            + joint(
                "jb",
                "revolute",
                "ground",
                "b",
                f"position = [0.3, 0, 0]\ninitial = {{ value = {-2 * start}, rate = 0 }}\nspring = {{ stiffness = {k2}, rest = 0 }}",
            )
            + '[[coupling]]\nname = "mesh"\nkind = "gear"\njoints = ["ja", "jb"]\nteeth = [40, 20]\n\n'
            + out("a", "ja", "value")
            + out("b", "jb", "value"),
            lambda t, s=start, w=w: (lambda x: {"a": x[:, None], "b": -2 * x[:, None]})(
                s * np.exp(-c / (2 * J) * t) * (np.cos(w * t) + c / (2 * J) / w * np.sin(w * t))
            ),
            {},
            f"from {start}",
        )


@case("a deep beam's end moves a lever: a torsion bar with arms at both ends, a load on one arm")
def torsion_bar():
    L, d, r, F = 1.2, 0.02, 0.3, 40.0
    J, I = math.pi * d**4 / 32, math.pi * d**4 / 64
    for D in (0.02, 0.05):
        Ia = math.pi * D**4 / 64
        # Bearing at the bar's far end carries the force; the bar twists by F r / (G J / L), the arm bends as a cantilever.
        u = F * r * r * L / (G * J) + F * r**3 / (3 * E * Ia) + F * r / (G * math.pi * D * D / 4 * 6 / 7)
        yield Scene(
            simulation(0.01, 200, start="static")
            + beam("bar", L, circle(d)[0], STEEL)
            + beam("arm", r, circle(D)[0], STEEL)
            + weld("wall", "ground", "bar")
            + rigid("ring", 0.01, (1e-5,) * 3)
            + joint("bearing", "cylindrical", "ground", "ring", f"position = [{L}, 0, 0]\naxis = [1, 0, 0]")
            + weld("eye", "bar.tip", "ring")
            + weld("lever", "ring", "arm", 'rotation = [0, "-pi/2", 0]')
            + force("force", "arm.tip", F, (0, -1, 0))
            + output("end", "arm.tip", "position"),
            still(end=[np.nan, -u, np.nan]),
            {"end": u},
            f"arm of {D} m",
        )


@case("a hammer on a leaf strikes a wall: a mass on a clamped light beam against a stiff plane, many blows")
def leaf_hammer():
    L, b, h, m, k = 0.2, 0.02, 0.002, 0.5, 5e5
    I = b * h**3 / 12
    kb = 3 * E * I / L**3
    for y0, gap, D in ((0.01, 0.002, 0.0), (0.01, 0.0, 2.0)):

        def f(_, y, gap=gap, D=D):
            depth = -y[0] - gap
            N = max(0.0, k * depth * (1 - D * y[1])) if depth > 0 else 0.0
            return [y[1], (-kb * y[0] + N) / m]

        v0 = 0.3
        yield Scene(
            simulation(0.6, 500, tolerance=1e-8)
            + "[ground]\nframes = { wall = ["
            + f"{L}, {-gap}, 0] }}\n"
            + beam("leaf", L, f'{{ shape = "rectangle", height = {h}, width = {b} }}', {**STEEL, "rho": 10.0}, "keep_modes = 1")
            + rigid("head", m, (1e-9,) * 3)
            + weld("root", "ground", "leaf")
            + joint("pin", "revolute", "leaf.tip", "head")
            + f'[[force]]\nkind = "force"\non = "head"\ndirection = [0, 1, 0]\nvalue = "{m * v0 / 1e-3!r}*(t < 1e-3 ? 1 : 0)"\n\n'
            + f'[[force]]\nkind = "contact"\nname = "blow"\non = "head"\nfrom = "ground.wall"\nshape = "point"\n'
            + f"normal = [0, 1, 0]\nstiffness = {k}\ndamping = {D}\n\n"
            + output("head", "head", "position"),
            lambda t, f=f: (lambda y: {"head": np.c_[np.nan * t, y[:, 0], 0 * t]})(
                ode(lambda s, y: [f(s, y)[0], f(s, y)[1] + (v0 / 1e-3 if s < 1e-3 else 0.0)], [0.0, 0.0], t, rtol=1e-10, max_step=1e-4)
            ),
            {},
            f"gap {gap}, damped {D}",
            claim=0.02,
        )


@case("a lamp on a chain of bars that hangs between two points: where the pins rest (links of equal length)")
def hanging_links():
    from scipy.optimize import fsolve

    n, l, m, span = 5, 0.3, 0.4, 1.0
    for load in (0.0, 3.0):

        def balance(x):
            # Unknown: horizontal pull H, vertical force at the left; angle of each link from its forces.
            H, V = x
            X = Y = 0.0
            v = V
            for i in range(n):
                # A uniform link's line: moments about its end: tan = (v - m g / 2) / H.
                a = math.atan2(v - m * g / 2, H)
                X, Y = X + l * math.cos(a), Y - l * math.sin(a)
                v -= m * g + (load * g if i == 1 else 0.0)
            return [X - span, Y]

        H, V = fsolve(balance, [5.0, n * m * g / 2 + load * g * 0.6], xtol=1e-13)
        places, X, Y, v = [], 0.0, 0.0, V
        for i in range(n):
            a = math.atan2(v - m * g / 2, H)
            X, Y = X + l * math.cos(a), Y - l * math.sin(a)
            places.append((X, Y))
            v -= m * g + (load * g if i == 1 else 0.0)
        text = simulation(0.01, 200, (0, -g, 0), start="static") + f"[ground]\nframes = {{ far = [{span}, 0, 0] }}\n"
        for i in range(n):
            text += rigid(f"l{i}", m, (0.0, m * l * l / 12, m * l * l / 12), {"end": (l, 0, 0)}, centre=(l / 2, 0, 0))
        guess = [-0.9, -0.5, 0.0, 0.5, 0.9]
        for i in range(n):
            turn = guess[i] - (guess[i - 1] if i else 0.0)
            text += joint(f"j{i}", "revolute", "ground" if i == 0 else f"l{i - 1}.end", f"l{i}", f"initial = {{ guess = {turn} }}")
        text += joint("last", "revolute", "ground.far", f"l{n - 1}.end")
        if load:
            text += force("force", "l1.end", load * g, (0, -1, 0))
        text += "".join(output(f"p{i}", f"l{i}.end", "position") for i in range(n - 1)) + out("last", "last", "reaction")
        yield Scene(
            text,
            still(**{f"p{i}": [*places[i], 0] for i in range(n - 1)}, last=[H, -v, 0, np.nan, np.nan, np.nan]),
            {**{f"p{i}": l for i in range(n - 1)}, "last": H},
            f"load {load} kg",
            sizes_only=True,
        )
