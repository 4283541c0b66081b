"""Machines and toys that the suite did not have: each a few lines of equations by hand, or a closed formula."""
import math

import numpy as np
from plain_case import case
from plain_effects import E, G, RHO, STEEL, circle, still
from scene import Scene, beam, force, joint, output, rigid, simulation, spring, weld
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root
from truths import ode

g = 9.81
TINY = (1e-12,) * 3


def out(name, of, quantity, more=""):
    return output(name, of, quantity).rstrip() + "\n" + more + "\n\n"


def lagrange(mass, rest, y0, t, rtol=1e-11):
    """q and its rates of mass(q) q'' = rest(q, q')."""
    n = len(y0) // 2
    return ode(lambda s, y: np.r_[y[n:], np.linalg.solve(mass(y[:n]), rest(y[:n], y[n:], s))], y0, t, rtol=rtol)


@case("a rotary pendulum on a hub that turns freely: both angles")
def rotary_pendulum():
    r, m, l, Jh, J = 0.2, 0.1, 0.15, 3e-3, 4e-4  # J: of the pendulum across its rod, about its centre of mass; none along it
    for tilt, spin, c in ((1.0, 3.0, 0.0), (2.8, 0.0, 2e-4), (0.3, 12.0, 0.0)):
        # Hub about z; at r along its x the pendulum turns about that x, its rod down at a = 0.
        def mass(q):
            s, c_ = math.sin(q[1]), math.cos(q[1])
            return np.array([[Jh + m * r * r + (m * l * l + J) * s * s, m * r * l * c_], [m * r * l * c_, m * l * l + J]])

        def rest(q, v, _, c=c):
            s, c_ = math.sin(q[1]), math.cos(q[1])
            I = m * l * l + J
            return [-2 * I * s * c_ * v[0] * v[1] + m * r * l * s * v[1] ** 2, I * s * c_ * v[0] ** 2 - m * g * l * s - c * v[1]]

        yield Scene(
            simulation(3, 100, (0, 0, -g))
            + rigid("hub", 1.0, (2e-3, 2e-3, Jh), {"eye": (r, 0, 0)})
            + rigid("rod", m, (J, J, 0.0), centre=(0, 0, -l))
            + joint("post", "revolute", "ground", "hub", f"initial = {{ value = 0, rate = {spin} }}")
            + joint(
                "eye",
                "revolute",
                "hub.eye",
                "rod",
                f"axis = [1, 0, 0]\ninitial = {{ value = {tilt}, rate = 0 }}\nspring = {{ stiffness = 0, damping = {c} }}",
            )
            + out("hub", "post", "value")
            + out("rod", "eye", "value"),
            lambda t, tilt=tilt, spin=spin, mass=mass, rest=rest: (lambda y: {"hub": y[:, :1], "rod": y[:, 1:2]})(
                lagrange(mass, rest, [0.0, tilt, spin, 0.0], t)
            ),
            {},
            f"tilt {tilt}, spin {spin}",
        )


@case("a pendulum on a point that a motor shakes up and down fast: it stands (Kapitza), or falls")
def shaken_pivot():
    L = 0.1
    for amplitude, w, start in ((0.008, 300.0, math.pi - 0.2), (0.008, 120.0, math.pi - 0.2), (0.02, 40.0, 0.5)):
        yield Scene(
            simulation(2, 200, (0, -g, 0))
            + rigid("head", 0.5, TINY)
            + rigid("bob", 0.1, (1e-9, 1e-9, 1e-9), centre=(0, -L, 0))
            + joint("guide", "prismatic", "ground", "head", f'axis = [0, 1, 0]\nmotion = "{amplitude}*sin({w}*t)"')
            + joint("pin", "revolute", "head", "bob", f"initial = {{ value = {start!r}, rate = 0 }}")
            + out("angle", "pin", "value"),
            lambda t, a=amplitude, w=w, s=start: {
                "angle": ode(
                    lambda x, y: [y[1], -(g - a * w * w * math.sin(w * x)) * math.sin(y[0]) * 0.1 * L / (0.1 * L * L + 1e-9)],
                    [s, 0.0],
                    t,
                    rtol=1e-11,
                )[:, :1]
            },
            {},
            f"{amplitude} m at {w} rad/s",
        )


@case("two loads on a rope over a pulley on the ceiling, one of them swings (Atwood's swinging machine)")
def swinging_atwood():
    L = 1.5
    for M, m, start in ((1.1, 0.6, 0.9), (2.0, 0.8, 1.2), (0.9, 0.85, 0.3)):
        r0 = 0.7

        def f(_, y, M=M, m=m):
            r, a, v, w = y
            return [v, w, (m * r * w * w - M * g + m * g * math.cos(a)) / (M + m), (-g * math.sin(a) - 2 * v * w) / r]

        yield Scene(
            simulation(1.0, 200, (0, -g, 0))
            + rigid("bob", m, TINY)
            + rigid("weight", M, TINY)
            + joint(
                "plane",
                "planar",
                "ground",
                "bob",
                f"initial = {{ value = [{r0 * math.sin(start)!r}, {-r0 * math.cos(start)!r}, 0], rate = [0, 0, 0] }}",
            )
            + joint(
                "shaft",
                "prismatic",
                "ground",
                "weight",
                f"axis = [0, -1, 0]\nposition = [-0.4, 0, 0]\ninitial = {{ value = {L - r0}, rate = 0 }}",
            )
            + "[ground]\nframes = { eye = [0, 0, 0], other = [-0.4, 0, 0] }\n"
            + f'[[coupling]]\nname = "rope"\nkind = "rope"\nthrough = ["bob", "ground.eye"]\n'
            + f'length = {L}\nterms = [{{ joint = "shaft", factor = 1 }}]\n\n'
            + output("bob", "bob", "position")
            + out("pull", "rope", "force"),
            lambda t, f=f, m=m, M=M, s=start: (
                lambda y: {
                    "bob": np.c_[y[:, 0] * np.sin(y[:, 1]), -y[:, 0] * np.cos(y[:, 1]), 0 * t],
                    "pull": np.array([[M * (g + f(0, row)[2])] for row in y]),
                }
            )(ode(f, [r0, s, 0.0, 0.0], t, rtol=1e-11)),
            {},
            f"{M} and {m} kg",
        )


@case("a jumper on an elastic rope that is slack at first, against the drag of the air")
def bungee():
    for m, k, L, d, drag in ((80.0, 60.0, 20.0, 15.0, 0.25), (60.0, 150.0, 12.0, 0.0, 0.4), (100.0, 45.0, 5.0, 200.0, 0.1)):

        def f(_, y, m=m, k=k, L=L, d=d, drag=drag):
            pull = k * (y[0] - L) + d * y[1] if y[0] > L else 0.0
            return [y[1], g - (max(pull, 0.0) + drag * abs(y[1]) * y[1]) / m]

        def truth(t, f=f, L=L, d=d, k=k):
            # Small steps over the corners: where it tightens and where it no longer pulls.
            s = solve_ivp(f, (0, t[-1]), [0.0, 0.0], t_eval=t, rtol=1e-9, atol=1e-10, max_step=2e-3, method="RK45")
            return {"way": -s.y[0][:, None], "speed": -s.y[1][:, None]}

        yield Scene(
            simulation(12, 50, (0, 0, -g))
            + rigid("jumper", m, (1, 1, 1))
            + joint("line", "prismatic", "ground", "jumper", "initial = { value = -1e-6, rate = 0 }")
            + f'[[force]]\nkind = "cable"\non = "jumper"\nstiffness = {k}\ndamping = {d}\nrest = {L}\n\n'
            + f'[[force]]\nkind = "drag"\non = "jumper"\nquadratic = {drag}\n\n'
            + out("way", "line", "value")
            + out("speed", "line", "rate"),
            truth,
            {},
            f"{m} kg on {k} N/m",
        )


@case("a bead on a cycloid: the period does not depend on how far it swings")
def tautochrone():
    r = 0.25
    for share in (0.05, 0.4, 0.8):
        # s = 4 r sin, s'' = -g / (4 r) s from the lowest point; parameter u from -pi to pi, y = r (1 - cos u).
        s0 = share * 4 * r
        yield Scene(
            simulation(4, 100, (0, -g, 0))
            + rigid("bead", 0.3, (0, 0, 0))
            + joint(
                "wire",
                "point-on-curve",
                "ground",
                "bead",
                f'curve = {{ x = "{r}*(u + sin(u))", y = "{r}*(1 - cos(u))", from = -3.1, to = 3.1 }}\n'
                f"initial = {{ value = {4 * r * math.sin(1.55) + s0!r}, rate = 0 }}",
            )
            + out("way", "wire", "value"),
            lambda t, s0=s0: {"way": (4 * r * math.sin(1.55) + s0 * np.cos(math.sqrt(g / (4 * r)) * t))[:, None]},
            {},
            f"{share} of the way",
        )


@case("a ladder slides down between two smooth guides; a rod between two slides at a right angle")
def ladder():
    L, m = 2.0, 10.0
    for start, J in ((0.3, m * L * L / 12), (0.05, 0.3 * m * L * L)):
        # a from upright; centre at (L/2 sin, L/2 cos). (m L^2/4 + J) a'' = m g L/2 sin a. Feet's forces by Newton.
        I = m * L * L / 4 + J

        def truth(t, start=start, I=I):
            y = ode(lambda _, y: [y[1], m * g * L / 2 * math.sin(y[0]) / I], [start, 0.0], t, rtol=1e-11)
            a, w = y[:, 0], y[:, 1]
            acc = m * g * L / 2 * np.sin(a) / I
            fx = m * L / 2 * (np.cos(a) * acc - np.sin(a) * w * w)
            fy = m * g + m * L / 2 * (-np.sin(a) * acc - np.cos(a) * w * w)
            z = 0 * t
            return {
                "foot": np.c_[L * np.sin(a), z, z],
                "wall": np.c_[fx, z, z, z * np.nan, z * np.nan, z * np.nan],
                "floor": np.c_[z, fy, z, z * np.nan, z * np.nan, z * np.nan],
            }

        end = 0.9 * brentq(
            lambda T: ode(lambda _, y: [y[1], m * g * L / 2 * math.sin(y[0]) / I], [start, 0.0], np.array([0, T]))[-1, 0] - 1.5, 0.1, 3
        )
        yield Scene(
            simulation(end, 200, (0, -g, 0))
            + rigid("ladder", m, (J, 0, J), {"foot": (0, -L / 2, 0), "head": (0, L / 2, 0)})
            + rigid("shoe", 0.0, (0, 0, 0))
            + rigid("cap", 0.0, (0, 0, 0))
            + joint("floor", "prismatic", "ground", "shoe", f"axis = [1, 0, 0]\ninitial = {{ guess = {L * math.sin(start)!r} }}")
            + joint("wall", "prismatic", "ground", "cap", f"axis = [0, 1, 0]\ninitial = {{ guess = {L * math.cos(start)!r} }}")
            + joint("low", "revolute", "shoe", "ladder.foot", f"initial = {{ value = {start!r}, rate = 0 }}")
            + joint("high", "revolute", "cap", "ladder.head")
            + output("foot", "ladder.foot", "position")
            + out("wall", "wall", "reaction")
            + out("floor", "floor", "reaction"),
            truth,
            {"wall": m * g, "floor": m * g},
            f"from {start} rad",
        )


@case("a body hung on two strings side by side turns about the upright (bifilar)")
def bifilar():
    h, a, m, J = 1.0, 0.3, 2.0, 0.05
    for start in (0.1, 1.2, 2.4):
        # z of the bar: strings of length h between (+-a, 0, 0) and the bar's ends at +-a turned by p: h^2 = z^2 + 4 a^2 sin^2(p/2).
        def f(_, y):
            p, w = y
            z = math.sqrt(h * h - 4 * a * a * math.sin(p / 2) ** 2)
            dz = -a * a * math.sin(p) / z  # dz/dp
            ddz = -(a * a * math.cos(p) + dz * dz) / z
            return [w, (m * g * dz - m * dz * ddz * w * w) / (J + m * dz * dz)]

        yield Scene(
            simulation(4, 100, (0, 0, -g))
            + "[ground]\nframes = { left = [-0.3, 0, 0], right = [0.3, 0, 0] }\n"
            + rigid("bar", m, (1e-3, J, J), {"left": (-a, 0, 0), "right": (a, 0, 0)})
            + joint(
                "line",
                "cylindrical",
                "ground",
                "bar",
                f"initial = {{ value = [{-math.sqrt(h * h - 4 * a * a * math.sin(start / 2) ** 2)!r}, {start}], rate = [0, 0] }}",
            )
            + joint("one", "distance", "ground.left", "bar.left", f"length = {h}")
            + joint("two", "distance", "ground.right", "bar.right", f"length = {h}")
            + out("turn", "line", "value"),
            lambda t, f=f, s=start: (lambda y: {"turn": np.c_[-np.sqrt(h * h - 4 * a * a * np.sin(y[:, 0] / 2) ** 2), y[:, 0]]})(
                ode(f, [s, 0.0], t, rtol=1e-11)
            ),
            {},
            f"from {start} rad",
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


@case("a yo-yo on its thread, a spool on a rack, a load that a screw lets turn: constant accelerations by hand")
def yo_yo():
    m, r, J = 0.2, 0.01, 6e-5
    a = m * g / (m + J / r**2)
    yield Scene(
        simulation(1, 100, (0, -g, 0))
        + rigid("carriage", 1e-9, TINY)
        + rigid("spool", m, (J / 2, J / 2, J))
        + joint("line", "prismatic", "ground", "carriage", "axis = [0, -1, 0]")
        + joint("axle", "revolute", "carriage", "spool")
        + f'[[coupling]]\nname = "thread"\nkind = "rack"\njoints = ["axle", "line"]\nradius = {r}\n\n'
        + out("way", "line", "value")
        + out("pull", "thread", "force"),
        lambda t: {"way": (a / 2 * t * t)[:, None], "pull": np.c_[0 * t + m * (g - a) * r, 0 * t - m * (g - a)]},
        {"pull": m * (g - a)},
        "yo-yo",
        sizes_only=True,
    )
    p, J2, M = 0.004, 3e-5, 3.0
    b = M * g / (M + J2 / p**2)
    yield Scene(
        simulation(1, 100, (0, 0, -g))
        + rigid("load", M, (J2, J2, J2))
        + joint("nut", "screw", "ground", "load", f"pitch = {p}\naxis = [0, 0, -1]")
        + output("load", "load", "position"),
        lambda t: {"load": np.c_[0 * t, 0 * t, -b / 2 * t * t]},
        {},
        "screw",
    )


@case("a mass in a tube that turns freely: a spring holds it, the spin slows down as it goes out")
def spinning_tube():
    m, k, L, J = 0.5, 200.0, 0.1, 0.02
    for spin, c in ((5.0, 0.0), (15.0, 0.0), (30.0, 2.0)):

        def f(_, y, c=c):
            x, a, v, w = y
            return [v, w, x * w * w - k / m * (x - L) - c / m * v, -2 * m * x * v * w / (J + m * x * x)]

        yield Scene(
            simulation(3, 200)
            + rigid("tube", 1.0, (1e-3, J, J))
            + rigid("mass", m, TINY)
            + joint("post", "revolute", "ground", "tube", f"initial = {{ value = 0, rate = {spin} }}")
            + joint(
                "slide",
                "prismatic",
                "tube",
                "mass",
                f"axis = [1, 0, 0]\ninitial = {{ value = {L}, rate = 0 }}\nspring = {{ stiffness = {k}, damping = {c}, rest = {L} }}",
            )
            + out("turn", "post", "rate")
            + out("way", "slide", "value"),
            lambda t, f=f, s=spin: (lambda y: {"turn": y[:, 3:], "way": y[:, :1]})(ode(f, [L, 0.0, 0.0, s], t)),
            {},
            f"{spin} rad/s, damper {c}",
        )


@case("three discs on two elastic shafts, driven by a torque that comes and goes: numbers of the chain by hand")
def torsional_chain():
    d, L = 0.02, 0.4
    K = G * math.pi * d**4 / 32 / L
    J = np.array([0.02, 0.05, 0.03])
    for T, w in ((10.0, 60.0), (10.0, 300.0)):

        def f(t, y, T=T, w=w):
            q, v = y[:3], y[3:]
            m = K * np.array([q[1] - q[0], q[0] - 2 * q[1] + q[2], q[1] - q[2]])
            m[0] += T * math.sin(w * t)
            return np.r_[v, m / (J + Jb)]

        rho = 1.0  # shafts of next to no mass
        Jb = rho * math.pi * d**4 / 32 * L * np.array([1 / 3, 2 / 3, 1 / 3])
        shaft = lambda n: beam(n, L, circle(d)[0], {**STEEL, "rho": rho})
        yield Scene(
            simulation(0.4, 500)
            + "".join(rigid(f"d{i}", 1.0, (j, j, j)) for i, j in enumerate(J))
            + shaft("one")
            + shaft("two")
            + joint("bearing", "revolute", "ground", "d0", "axis = [1, 0, 0]")
            + weld("a", "d0", "one.root")
            + weld("b", "one.tip", "d1")
            + weld("c", "d1", "two.root")
            + weld("d", "two.tip", "d2")
            + force("torque", "d0", f"{T}*sin({w}*t)", (1, 0, 0))
            + output("spin0", "d0", "angular_velocity")
            + output("spin2", "d2", "angular_velocity"),
            lambda t, f=f: (lambda y: {"spin0": np.c_[y[:, 3], 0 * t, 0 * t], "spin2": np.c_[y[:, 5], 0 * t, 0 * t]})(ode(f, [0.0] * 6, t)),
            {},
            f"{w} rad/s",
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


@case("a trebuchet: counterweight, arm and sling, until the sling is along the arm")
def trebuchet():
    a, b, l, M, m, Ja, ma = 0.5, 2.0, 1.2, 300.0, 5.0, 20.0, 15.0

    # Arm about its pivot: the counterweight hangs on a point at -a, the sling of length l from +b with the stone.
    def mass(q):
        p, s, h = q
        A = Ja + M * a * a + m * b * b
        ps, ph = m * b * l * math.cos(p - s), -M * a * 0.4 * math.cos(p - h)
        return np.array([[A, ps, ph], [ps, m * l * l, 0], [ph, 0, M * 0.16]])

    def rest(q, v, _):
        p, s, h = q
        # Potential: y of stone b sin p + l sin s, of weight -a sin p + 0.4 sin h.
        Q = [-g * math.cos(p) * (m * b - M * a), -g * math.cos(s) * m * l, -g * math.cos(h) * M * 0.4]
        Q[0] += -m * b * l * math.sin(p - s) * v[1] ** 2 + M * a * 0.4 * math.sin(p - h) * v[2] ** 2
        Q[1] += m * b * l * math.sin(p - s) * v[0] ** 2
        Q[2] += -M * a * 0.4 * math.sin(p - h) * v[0] ** 2
        return Q

    for start in (-0.8, -0.3):
        q0 = [start, 0.1, -math.pi / 2]
        yield Scene(
            simulation(0.9, 200, (0, -g, 0))
            + rigid("arm", ma, (0.0, Ja, Ja), {"short": (-a, 0, 0), "long": (b, 0, 0)})
            + rigid("weight", M, TINY, centre=(0.4, 0, 0))
            + rigid("sling", m, TINY, centre=(l, 0, 0))
            + joint("axle", "revolute", "ground", "arm", f"initial = {{ value = {q0[0]}, rate = 0 }}")
            + joint("hook", "revolute", "arm.short", "weight", f"initial = {{ value = {q0[2] - q0[0]!r}, rate = 0 }}")
            + joint("loop", "revolute", "arm.long", "sling", f"initial = {{ value = {q0[1] - q0[0]!r}, rate = 0 }}")
            + out("axle", "axle", "value")
            + out("loop", "loop", "value"),
            lambda t, q0=q0: (lambda y: {"axle": y[:, :1], "loop": y[:, 1:2] - y[:, :1]})(lagrange(mass, rest, [*q0, 0.0, 0.0, 0.0], t)),
            {},
            f"from {start} rad",
        )


@case("Newton's cradle of pendulums that knock (linear contact)")
def cradle():
    L, R, m, k = 0.5, 0.03, 0.2, 2e5
    for n, lifted in ((2, 1), (3, 1), (4, 2)):
        q0 = np.array([-0.4 if i < lifted else 0.0 for i in range(n)])

        def f(_, y, n=n):
            q, v = y[:n], y[n:]
            x, z = 2 * R * np.arange(n) + L * np.sin(q), -L * np.cos(q)
            Q = -m * g * L * np.sin(q)
            for i in range(n - 1):
                dx, dz = x[i + 1] - x[i], z[i + 1] - z[i]
                D = math.hypot(dx, dz)
                if D < 2 * R:
                    F = k * (2 * R - D)
                    Q[i] -= F * (dx * math.cos(q[i]) + dz * math.sin(q[i])) / D * L
                    Q[i + 1] += F * (dx * math.cos(q[i + 1]) + dz * math.sin(q[i + 1])) / D * L
            return np.r_[v, Q / (m * L * L)]

        yield Scene(
            simulation(2.0, 200, (0, -g, 0), tolerance=1e-8)
            + "".join(
                rigid(f"b{i}", m, TINY, {"c": (0, -L, 0)}, centre=(0, -L, 0))
                + joint(
                    f"p{i}", "revolute", "ground", f"b{i}", f"position = [{2 * R * i!r}, 0, 0]\ninitial = {{ value = {q0[i]!r}, rate = 0 }}"
                )
                + out(f"a{i}", f"p{i}", "value")
                for i in range(n)
            )
            + "".join(
                f'[[force]]\nkind = "contact"\nname = "k{i}"\non = "b{i}.c"\nfrom = "b{i + 1}.c"\nshape = "sphere"\nradius = {R}\n'
                f'against = "sphere"\nfrom_radius = {R}\nstiffness = {k}\n\n'
                for i in range(n - 1)
            ),
            lambda t, f=f, n=n, q0=q0: (lambda y: {f"a{i}": y[:, i : i + 1] for i in range(n)})(
                ode(f, [*q0, *[0.0] * n], t, rtol=1e-10, max_step=2e-4)
            ),
            {f"a{i}": 0.4 for i in range(n)},
            f"{n} balls, {lifted} lifted",
        )


@case("a platform on six struts (Stewart): where it rests under a load beside its middle")
def hexapod():
    base = [(math.cos(x), math.sin(x), 0.0) for x in np.radians([10, 110, 130, 230, 250, 350])]
    plate = [(0.6 * math.cos(x), 0.6 * math.sin(x), 0.0) for x in np.radians([50, 70, 170, 190, 290, 310])]
    k, m, h = 2e4, 40.0, 0.9
    rest = [math.dist(b, (p[0], p[1], h)) for b, p in zip(base, plate)]
    for c in ((0.0, 0.0, 0.0), (0.25, 0.1, 0.05)):

        def forces(x, c=c):
            angle = np.linalg.norm(x[3:]) + 1e-300
            K = np.array([[0, -x[5], x[4]], [x[5], 0, -x[3]], [-x[4], x[3], 0]]) / angle
            Rm = np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K
            F, M = np.array([0, 0, -m * g]), np.cross(Rm @ c, [0, 0, -m * g])
            for b, p, r0 in zip(base, plate, rest):
                arm = Rm @ p
                d = x[:3] + arm - b
                s = np.linalg.norm(d)
                f = -k * (s - r0) * d / s
                F, M = F + f, M + np.cross(arm, f)
            return np.r_[F, M]

        x = root(forces, [0, 0, h - 0.01, 1e-3, 1e-3, 1e-3], tol=1e-12).x
        yield Scene(
            simulation(0.01, 200, (0, 0, -g), start="static")
            + "[ground]\nframes = { "
            + ", ".join(f"b{i} = {[float(v) for v in b]}" for i, b in enumerate(base))
            + " }\n"
            + rigid("plate", m, (2, 2, 4), {f"p{i}": p for i, p in enumerate(plate)}, centre=c)
            + joint("free", "free", "ground", "plate", f"position = [0, 0, {h}]")
            + "".join(spring(f"plate.p{i}", f"ground.b{i}", k, 100.0, rest[i]) for i in range(6))
            + output("plate", "plate", "position"),
            still(plate=x[:3]),
            {"plate": max(1e-4, float(np.linalg.norm(x[:3] - [0, 0, h])))},
            f"centre of mass {c}",
        )


@case("a robot of two links on springy gears: its motors hold a course by proportional and derivative action")
def elastic_gears():
    l, m, J, k, d = 0.5, 2.0, 0.05, 400.0, 1.0

    def mass(q):
        c = math.cos(q[1])
        A = J + m * l * l / 4
        return np.array(
            [
                [A + J + m * (l * l + l * l / 4 + l * l * c), J + m * (l * l / 4 + l * l / 2 * c)],
                [J + m * (l * l / 4 + l * l / 2 * c), J + m * l * l / 4],
            ]
        )

    for a, w in ((0.8, 3.0), (0.3, 12.0)):

        def rest(q, v, t, a=a, w=w):
            s = math.sin(q[1])
            h = m * l * l / 2 * s
            G_ = [
                m * g * l / 2 * math.cos(q[0]) + m * g * (l * math.cos(q[0]) + l / 2 * math.cos(q[0] + q[1])),
                m * g * l / 2 * math.cos(q[0] + q[1]),
            ]
            wish, speed = a * math.sin(w * t), a * w * math.cos(w * t)
            u = [k * (wish - q[0]) + 20 * (speed - v[0]), k * (-wish - q[1]) + 20 * (-speed - v[1])]
            return [u[0] - G_[0] + h * (2 * v[0] * v[1] + v[1] ** 2) - d * v[0], u[1] - G_[1] - h * v[0] ** 2 - d * v[1]]

        yield Scene(
            simulation(3, 200, (0, -g, 0))
            + rigid("one", m, (J, J, J), {"elbow": (l, 0, 0)}, centre=(l / 2, 0, 0))
            + rigid("two", m, (J, J, J), {"hand": (l, 0, 0)}, centre=(l / 2, 0, 0))
            + joint("shoulder", "revolute", "ground", "one", f"initial = {{ value = 0, rate = 0 }}\nspring = {{ damping = {d} }}")
            + joint("elbow", "revolute", "one.elbow", "two", f"initial = {{ value = 0, rate = 0 }}\nspring = {{ damping = {d} }}")
            + out("q1", "shoulder", "value")
            + out("v1", "shoulder", "rate")
            + out("q2", "elbow", "value")
            + out("v2", "elbow", "rate")
            + f'[[block]]\nname = "c1"\nkind = "pid"\n'
            + f'input = "{a}*sin({w}*t) - q1"\nrate = "{a * w}*cos({w}*t) - v1"\nproportional = {k}\nintegral = 0\nderivative = 20\n\n'
            + f'[[block]]\nname = "c2"\nkind = "pid"\n'
            + f'input = "-{a}*sin({w}*t) - q2"\nrate = "-{a * w}*cos({w}*t) - v2"\nproportional = {k}\nintegral = 0\nderivative = 20\n\n'
            + force("torque", "one", "c1 - c2", (0, 0, 1))
            + force("torque", "two", "c2", (0, 0, 1)),
            lambda t, rest=rest: (lambda y: {"q1": y[:, :1], "q2": y[:, 1:2]})(lagrange(mass, rest, [0.0] * 4, t)),
            {},
            f"{a} rad at {w} rad/s",
        )


@case("half a car over a bump in the road: wheels as circles on a curve, springs and dampers (flat where it rests)")
def quarter_car():
    m, mu, ks, cs, kt, R, v = 300.0, 40.0, 2e4, 1.5e3, 2e5, 0.3, 5.0
    for height, width in ((0.04, 2.0), (0.08, 3.0)):
        # Road y = h exp(-(x/w)^2), x from -4; a circle of radius R on it: nearest point by Newton, convex enough.
        x0 = -4.0
        road = lambda u, h=height, w=width: h * math.exp(-((u / w) ** 2))
        slope = lambda u, h=height, w=width: -2 * u / w**2 * road(u, h, w)

        def f(t, y, road=road, slope=slope):
            x = x0 + v * t
            c = y[0]
            u = x
            for _ in range(30):
                F = (u - x) + (road(u) - c) * slope(u)
                dF = 1 + slope(u) ** 2 + (road(u) - c) * (slope(u + 1e-6) - slope(u - 1e-6)) / 2e-6
                u -= F / dF
            D = math.hypot(x - u, c - road(u))
            N = kt * max(0.0, R - D) * (c - road(u)) / D
            S = ks * (y[1] - y[0] - 0.5) + cs * (y[3] - y[2])
            return [y[2], y[3], (N + S - mu * g) / mu, (-S - m * g) / m]

        c0 = R - (m + mu) * g / kt + 0.0
        start = root(lambda z: f(0, [z[0], z[1], 0, 0])[2:], [c0 + road(x0), c0 + 0.5 - m * g / ks], tol=1e-13).x
        yield Scene(
            simulation(1.8, 200, (0, -g, 0), tolerance=1e-8)
            + rigid("sledge", 10.0, TINY)
            + rigid("wheel", mu, TINY)
            + rigid("body", m, TINY)
            + joint("drive", "prismatic", "ground", "sledge", f'axis = [1, 0, 0]\nmotion = "{x0} + {v}*t"')
            + joint("low", "prismatic", "sledge", "wheel", f"axis = [0, 1, 0]\ninitial = {{ value = {float(start[0])!r}, rate = 0 }}")
            + joint("high", "prismatic", "sledge", "body", f"axis = [0, 1, 0]\ninitial = {{ value = {float(start[1])!r}, rate = 0 }}")
            + spring("body", "wheel", ks, cs, 0.5)
            + f'[[force]]\nkind = "contact"\nname = "tyre"\non = "wheel"\nshape = "sphere"\nradius = {R}\nagainst = "curve"\n'
            + f'curve = {{ x = "u", y = "{height}*exp(-(u/{width})^2)", from = -8, to = 8 }}\nstiffness = {kt}\n\n'
            + out("wheel", "low", "value")
            + out("body", "high", "value"),
            lambda t, f=f, start=start: (lambda y: {"wheel": y[:, :1], "body": y[:, 1:2]})(ode(f, [*start, 0.0, 0.0], t, rtol=1e-10)),
            {},
            f"{height} m by {width} m",
        )
