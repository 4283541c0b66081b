"""Structures of beams at rest: mounts, props, stays, rings, flexures; what reads forces and displacements."""
import math

import numpy as np
from cases.case import case
from cases.common import E, G, RHO, STEEL, TINY, circle, out, still
from scene import Scene, beam, force, joint, output, rigid, simulation, spring, weld
from scipy.optimize import brentq


@case("curved beams under their own weight, across and in their plane; reactions at the foot")
def hooks():
    s, A, I = circle(0.01)
    for angle, R, across in ((math.pi / 2, 0.5, True), (math.pi, 0.3, True), (math.pi / 2, 0.5, False)):
        w = RHO * A * 9.81
        phi, wts = np.polynomial.legendre.leggauss(80)
        phi, wts = (phi + 1) / 2 * angle, wts / 2 * angle
        P = lambda q: np.array([R * np.sin(q), R * (1 - np.cos(q))])
        end = P(angle)

        def beyond(q, F):  # moment about P(q) of the weight beyond and of a unit force at the end
            out = np.zeros(3)
            xs, ws = np.polynomial.legendre.leggauss(20)
            for x, ww in zip((xs + 1) / 2 * (angle - q) + q, ws / 2 * (angle - q)):
                out += np.cross([*(P(x) - P(q)), 0], np.array(F) * w * R * ww)
            return out

        d = (0, 0, -1) if across else (0, -1, 0)
        u = 0.0
        for q, ww in zip(phi, wts):
            t = np.array([math.cos(q), math.sin(q), 0])
            Mw, M1 = beyond(q, d), np.cross([*(end - P(q)), 0], d)
            T, B = Mw @ t, Mw - (Mw @ t) * t
            u += ww * R * ((Mw @ t) * (M1 @ t) / (G * 2 * I) + B @ (M1 - (M1 @ t) * t) / (E * I))
        foot = -beyond(0.0, d)
        yield Scene(
            simulation(0.01, 100, tuple(9.81 * np.array(d)), start="static")
            + beam("hook", 1.0, s, STEEL, f'axis = {{ x = "{R!r}*sin(u)", y = "{R!r}*(1 - cos(u))", to = {angle!r} }}').replace(
                "length = 1.0\n", ""
            )
            + weld("wall", "ground", "hook.root")
            + output("tip", "hook.tip", "position")
            + output("R", "wall", "reaction"),
            still(
                tip=[np.nan if across else np.nan, np.nan if across else end[1] - u, -u if across else np.nan],
                R=[np.nan, np.nan, np.nan, *foot],
            ),
            {"tip": u, "R": float(np.linalg.norm(foot))},
            f"{math.degrees(angle):.0f} degrees, {'across' if across else 'in'} its plane",
        )


@case("a closed ring of two curved beams pulled along its diameter: Castigliano")
def ring():
    R, d, F = 0.3, 0.012, 5.0
    A, I = math.pi * d * d / 4, math.pi * d**4 / 64
    u = F * R**3 / (E * I) * (math.pi / 4 - 2 / math.pi) + math.pi / 4 * F * R * (1 / (E * A) + 1 / (G * A * 6 / 7))

    def half(name, side, volumes):
        return (
            f'[[body]]\nname = "{name}"\nkind = "beam"\naxis = {{ x = "{R}*sin(u)", y = "{side * R}*(1 - cos(u))", to = "pi" }}\n'
            f"volumes = {volumes}\nsection = {circle(d)[0]}\n"
            f"material = {{ density = {RHO}, youngs_modulus = {E}, poisson = 0.3 }}\n\n"
        )

    for volumes, way in ((16, (0, 1, 0)), (16, (0, -1, 0))):
        yield Scene(
            simulation(0.01, 200, start="static")
            + half("one", 1, volumes)
            + half("two", -1, volumes)
            + weld("wall", "ground", "one")
            + weld("start", "ground", "two", 'rotation = [0, 0, "pi"]')
            + weld("end", "one.tip", "two.tip", 'rotation = [0, 0, "pi"]')
            + force("force", "one.tip", F, way)
            + output("top", "one.tip", "position"),
            still(top=[0, 2 * R + way[1] * u, 0]),
            {"top": u},
            f"{volumes} volumes, along {way}",
        )


@case("a beam that just misses its prop: a gap closes under the load, the prop then carries its share; at rest")
def gap_at_tip():
    L, d, gap, k = 1.0, 0.02, 2e-3, 1e6
    I = math.pi * d**4 / 64
    b = 3 * E * I / L**3
    for F in (5.0, 30.0, 120.0):
        sag = F / b if F / b < gap else (F + k * gap) / (b + k)
        yield Scene(
            simulation(0.01, 200, start="static")
            + "[ground]\nframes = { prop = [1, "
            + f"{-gap}"
            + ", 0] }\n"
            + beam("rod", L, circle(d)[0], STEEL)
            + weld("wall", "ground", "rod")
            + force("force", "rod.tip", F, (0, -1, 0))
            + f'[[force]]\nkind = "contact"\nname = "touch"\non = "rod.tip"\nfrom = "ground.prop"\nshape = "point"\n'
            + f"normal = [0, 1, 0]\nstiffness = {k}\n\n"
            + output("tip", "rod.tip", "position"),
            still(tip=[np.nan, -sag, 0]),
            {"tip": sag},
            f"{F} N",
        )


@case("a support that sinks and a clamp that turns: what a beam takes from that, at rest and slowly in time")
def settlement():
    L, d = 2.0, 0.04
    I = math.pi * d**4 / 64
    for kind in ("sinks", "turns"):
        s = 2e-3
        y = 3 * E * I * s / L**3 if kind == "sinks" else 3 * E * I * s / L**2
        motion = f'motion = "{s}*(t < 1 ? t^3*(10 - 15*t + 6*t^2) : 1)"'
        head = rigid("shoe", 0.01, TINY) + rigid("trolley", 1e-3, TINY)
        ends = (
            joint("wall", "weld", "ground", "rod")
            + joint("lift", "prismatic", "ground", "shoe", f"axis = [0, -1, 0]\nposition = [{L}, 0, 0]\n{motion}")
            if kind == "sinks"
            else joint("wall", "revolute", "ground", "rod", motion) + joint("lift", "weld", "ground", "shoe", f"position = [{L}, 0, 0]")
        )
        yield Scene(
            simulation(2, 100)
            + beam("rod", L, circle(d)[0], STEEL, "damping = { ratio = 0.2 }")
            + head
            + ends
            + joint("roller", "prismatic", "shoe", "trolley", "axis = [1, 0, 0]")
            + joint("pin", "revolute", "trolley", "rod.tip")
            + out("root", "rod", "section_force", "at = 0.5"),
            lambda t, y=y, kind=kind: {
                "root": np.c_[
                    np.nan * t, np.where(t < 1.9, np.nan, y), np.nan * t, np.nan * t, np.nan * t, np.where(t < 1.9, np.nan, y * L / 2)
                ]
            },
            {"root": y * L / 2},
            kind,
            sizes_only=True,
        )


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


@case("static starts: a guyed mast, a bent console across its plane, a beam on three supports, an arm on an oblique spring")
def resting_frames():
    s, A, I = circle(0.02)
    L, F, k = 1.0, 60.0, 3000.0
    beam_k = 1 / (L**3 / (3 * E * I) + L / (6 / 7 * G * A))
    tip = F / (beam_k + k)
    yield Scene(
        simulation(0.01, 100, start="static")
        + beam("mast", L, s, STEEL)
        + weld("foot", "ground", "mast")
        + '[[force]]\nkind = "bushing"\non = "mast.tip"\nstiffness = [0, 3000.0, 0, 0, 0, 0]\ndamping = [0, 0, 0, 0, 0, 0]\n\n'
        + force("force", "mast.tip", F, (0, 1, 0))
        + output("tip", "mast.tip", "displacement"),
        still(tip=[np.nan, tip, np.nan]),
        {"tip": tip},
        "guyed mast",
    )
    a, b = 0.6, 0.4  # L in the plane, force along z at its end: bending of both, torsion of the first
    J = 2 * I
    down = F * (a**3 / (3 * E * I) + b**3 / (3 * E * I) + a * b * b / (G * J) + (a + b) / (6 / 7 * G * A))
    yield Scene(
        simulation(0.01, 100, start="static")
        + beam("one", a, s, STEEL)
        + beam("two", b, s, STEEL)
        + weld("foot", "ground", "one")
        + weld("corner", "one.tip", "two", "rotation = [0, 0, 1.5707963267948966]")
        + force("force", "two.tip", F, (0, 0, 1))
        + output("tip", "two.tip", "position"),
        still(tip=[np.nan, np.nan, down]),
        {"tip": down},
        "bent console",
    )
    w = 200.0
    middle = 10 * w * (L / 2) / 8  # 1.25 w l, two spans
    yield Scene(
        simulation(0.01, 100, start="static")
        + beam("rod", L, s, STEEL, "frames = { middle = 0.5 }")
        + joint("a", "revolute", "ground", "rod")
        + joint("m", "point-on-line", "ground", "rod.middle", f"axis = [1, 0, 0]\nposition = [{L / 2}, 0, 0]")
        + joint("b", "point-on-line", "ground", "rod.tip", f"axis = [1, 0, 0]\nposition = [{L}, 0, 0]")
        + force("distributed", "rod", w, (0, -1, 0))
        + output("R", "m", "reaction"),
        lambda t: {"R": np.c_[np.nan * t, 0 * t + middle, np.nan * t, np.nan * t, np.nan * t, np.nan * t]},
        {"R": middle},
        "beam on three supports, the middle reaction",
        sizes_only=True,
    )
    m, l0, ks = 3.0, 0.3, 2000.0
    top = np.array([0.1, 0.5])

    def moment(x):
        p = np.array([0.4 * math.cos(x), 0.4 * math.sin(x)])
        d = top - p
        n = np.hypot(*d)
        f = ks * (n - l0) * d / n
        return p[0] * f[1] - p[1] * f[0] - m * 9.81 * 0.2 * math.cos(x)

    rest = brentq(moment, -1.2, 0.8)
    yield Scene(
        simulation(0.01, 100, (0, -9.81, 0), start="static")
        + rigid("post", 1.0, (1,) * 3, {"top": (*top, 0)})
        + weld("w", "ground", "post")
        + rigid("arm", m, (0.01, 0.04, 0.04), {"end": (0.4, 0, 0)}, (0.2, 0, 0))
        + joint("j", "revolute", "ground", "arm")
        + spring("arm.end", "post.top", ks, rest=l0)
        + output("a", "j", "value"),
        still(a=[rest]),
        {"a": 1.0},
        "arm on an oblique spring",
        claim=1e-6,
    )


@case("displacement of an overhanging beam, of a coupler between its pins, of a mast on a cart")
def displaced_frames():
    s, A, I = circle(0.02)
    F, l, a = 20.0, 0.7, 0.3
    tip = F * a * a * (l + a) / (3 * E * I) + F / (6 / 7 * G * A) * (a + a * a / l)
    yield Scene(
        simulation(0.01, 100, start="static")
        + beam("rod", 1.0, s, STEEL, "frames = { seat = 0.7 }")
        + joint("a", "revolute", "ground", "rod")
        + joint("b", "point-on-line", "ground", "rod.seat", "axis = [1, 0, 0]\nposition = [0.7, 0, 0]")
        + force("force", "rod.tip", F, (0, 1, 0))
        + output("tip", "rod.tip", "displacement"),
        still(tip=[np.nan, tip, np.nan]),
        {"tip": tip},
        "overhanging",
    )
    sag = 5 * RHO * A * 9.81 / (384 * E * I)
    yield Scene(
        simulation(0.01, 100, (0, -9.81, 0), start="static")
        + rigid("left", 1.0, (1,) * 3, {"end": (0, 0.5, 0)})
        + rigid("right", 1.0, (1,) * 3, {"end": (0, 0.5, 0)})
        + beam("coupler", 1.0, s, STEEL, "frames = { middle = 0.5 }")
        + joint("j", "revolute", "ground", "left", 'motion = "0"')
        + joint("k", "revolute", "ground", "right", "position = [1, 0, 0]")
        + joint("p", "revolute", "left.end", "coupler")
        + joint("q", "revolute", "coupler.tip", "right.end")
        + output("middle", "coupler.middle", "displacement")
        + output("root", "coupler.root", "displacement"),
        still(middle=[np.nan, -sag, np.nan], root=[0.0, 0.0, 0.0]),
        {"middle": sag, "root": sag},
        "coupler between its pins",
    )
    bend = 2.0 * RHO * A / (8 * E * I)
    yield Scene(
        simulation(0.01, 100, start="static")
        + rigid("cart", 1.0, (1,) * 3)
        + beam("mast", 1.0, s, STEEL)
        + joint("j", "prismatic", "ground", "cart", 'axis = [1, 0, 0]\nmotion = "t^2"')
        + weld("foot", "cart", "mast", "rotation = [0, 0, 1.5707963267948966]")
        + output("tip", "mast.tip", "displacement"),
        still(tip=[np.nan, bend, np.nan]),
        {"tip": bend},
        "mast on a cart that accelerates",
    )
