"""What bodies mean: displacement from the joints, damping ratios as mounted, stress in sections, reactions."""
import math

import numpy as np
from cases.case import Modes, case
from cases.common import E, RHO, SIZE, STEEL, circle, still
from scene import Scene, beam, force, joint, output, rigid, simulation, weld
from truths.formulas import Linear, beam_matrices, of_rectangles


@case("displacement is measured from the joints that hold the body", "regression bodies; stability coupler_from_its_pins")
def displacement():
    s, A, I = circle(0.02)
    L, F = 1.0, 50.0
    tip = F * L**3 / (3 * E * I)
    middle = F * L / (48 * E * I) * L * L
    for boundary in ("clamped-free", "free-free", "supported-supported"):
        yield Scene(
            simulation(0.01, 100, start="static")
            + beam("rod", L, s, STEEL, f'boundary = "{boundary}"')
            + weld("wall", "ground", "rod")
            + force("force", "rod.tip", F, (0, 1, 0))
            + output("tip", "rod.tip", "displacement")
            + output("root", "rod.root", "displacement"),
            still(tip=[np.nan, tip, 0.0], root=[0.0, 0.0, 0.0]),
            {"tip": tip, "root": tip},
            f"welded at its root, {boundary}",
        )
        yield Scene(
            simulation(0.01, 100, start="static")
            + beam("rod", L, s, STEEL, f'boundary = "{boundary}"\nframes = {{ middle = 0.5 }}')
            + joint("a", "revolute", "ground", "rod")
            + joint("b", "point-on-line", "ground", "rod.tip", "axis = [1, 0, 0]")
            + force("force", "rod.middle", F, (0, 1, 0))
            + output("middle", "rod.middle", "displacement")
            + output("tip", "rod.tip", "displacement")
            + output("root", "rod.root", "displacement"),
            still(middle=[np.nan, middle, 0.0], root=[0.0, 0.0, 0.0], tip=[np.nan, 0.0, 0.0]),
            {"middle": middle, "root": middle, "tip": middle},
            f"between two hinges, {boundary}",
        )


@case("a damping ratio is that of the body as the scene mounts it", "stability ratio_as_mounted, ratio_of_pieces; regression bodies")
def ratio():
    s, A, I = circle(0.02)
    w1 = 1.875104**2 * math.sqrt(E * I / (RHO * A))
    w_hinged = math.pi**2 * math.sqrt(E * I / (RHO * A))
    for zeta in (0.01, 0.2, 1e-4):
        for boundary in ("clamped-free", "free-free"):
            pole = complex(-zeta * w1, w1 * math.sqrt(1 - zeta * zeta))
            for hold in ("rod.root", "rod.tip"):
                yield Modes(
                    simulation(1.0, 100)
                    + beam("rod", 1.0, s, STEEL, f'boundary = "{boundary}"\ndamping = {{ ratio = {zeta} }}\neffects = ["bending_xy"]')
                    + weld("wall", "ground", hold),
                    (pole,),
                    f"{zeta}, {boundary}, welded at {hold}",
                    claim=1e-3,
                )
            pole = complex(-zeta * w_hinged, w_hinged * math.sqrt(1 - zeta * zeta))
            yield Modes(
                simulation(1.0, 100)
                + beam("rod", 1.0, s, STEEL, f'boundary = "{boundary}"\ndamping = {{ ratio = {zeta} }}\neffects = ["bending_xy"]')
                + joint("a", "revolute", "ground", "rod")
                + joint("b", "point-on-line", "ground", "rod.tip", "axis = [1, 0, 0]"),
                (pole,),
                f"{zeta}, {boundary}, between hinges",
                claim=1e-3,
            )
        pole = complex(-zeta * w1, w1 * math.sqrt(1 - zeta * zeta))
        for model in ("lumped", "mixed"):
            yield Modes(
                simulation(1.0, 100)
                + beam(
                    "rod", 1.0, s, STEEL, f'model = "{model}"\nelements = {20 if model == "lumped" else 2}\ndamping = {{ ratio = {zeta} }}'
                )
                + weld("wall", "ground", "rod"),
                (pole,),
                f"{zeta}, {model}",
                claim=0.01,
            )


@case(
    "stress of a section by hand: bending, torsion, both, I, box, tube; zero beyond the load",
    "regression bodies, beam_shapes; trust forces_in_sections",
)
def stress():
    L, F = 1.0, 200.0
    i = of_rectangles([(0.0, 0.0, 0.084, 0.006), (0.046, 0.0, 0.008, 0.05), (-0.046, 0.0, 0.008, 0.05)])
    box = of_rectangles([(0.0, 0.0, 0.06, 0.04)])[2] - of_rectangles([(0.0, 0.0, 0.054, 0.034)])[2]
    sections = {
        "circle": ('{ shape = "circle", diameter = 0.03 }', math.pi * 0.03**4 / 64, 0.03),
        "rectangle": ('{ shape = "rectangle", width = 0.02, height = 0.04 }', 0.02 * 0.04**3 / 12, 0.04),
        "i": ('{ shape = "i", width = 0.05, height = 0.1, web = 0.006, flange = 0.008 }', i[2], 0.1),
        "box": ('{ shape = "box", width = 0.04, height = 0.06, thickness = 0.003 }', box, 0.06),
    }
    for name, (text, iz, h) in sections.items():
        for at in (0.0, 0.3, 0.7):
            yield Scene(
                simulation(0.01, 100, start="static")
                + beam("rod", L, text, STEEL)
                + weld("wall", "ground", "rod")
                + force("force", "rod.tip", F, (0, 1, 0))
                + f'[[output]]\nname = "s"\nof = "rod"\nquantity = "stress"\nat = {at}\n\n',
                still(s=[F * (L - at) * h / 2 / iz]),
                {"s": SIZE},
                f"{name} at {at}",
                claim=0.01,
            )
    d = 0.03
    J = math.pi * d**4 / 32
    for torque in (100.0,):
        tau = torque * d / 2 / J
        body = beam("rod", L, f'{{ shape = "circle", diameter = {d} }}', STEEL) + weld("wall", "ground", "rod")
        out = '[[output]]\nname = "s"\nof = "rod"\nquantity = "stress"\nat = 0.5\n\n'
        yield Scene(
            simulation(0.01, 100, start="static") + body + force("torque", "rod.tip", torque, (1, 0, 0)) + out,
            still(s=[math.sqrt(3) * tau]),
            {"s": SIZE},
            "torsion alone, von Mises",
        )
        sigma = F * 0.5 * d / 2 / (J / 2)
        yield Scene(
            simulation(0.01, 100, start="static")
            + body
            + force("torque", "rod.tip", torque, (1, 0, 0))
            + force("force", "rod.tip", F, (0, 1, 0))
            + out,
            still(s=[math.hypot(sigma, math.sqrt(3) * tau)]),
            {"s": SIZE},
            "bending and torsion",
        )
        yield Scene(
            simulation(0.01, 100, start="static")
            + beam("rod", L, f'{{ shape = "circle", diameter = {d} }}', STEEL, "frames = { a = 0.5 }")
            + weld("wall", "ground", "rod")
            + force("force", "rod.a", F, (0, 1, 0))
            + '[[output]]\nname = "s"\nof = "rod"\nquantity = "stress"\nat = 0.8\n\n'
            + '[[output]]\nname = "r"\nof = "rod"\nquantity = "stress"\nat = 0\n\n',
            still(s=[0.0], r=[F * 0.5 * d / 2 / (J / 2)]),
            {"s": F * 0.5 * d / 2 / (J / 2), "r": SIZE},
            "beyond the load there is none",
        )


@case("reactions, motor moments and accelerations at start-up, at the default tolerance", "trust driven_chain; stability three_supports")
def start_up():
    # A rigid arm: moment J a + m g L cos; and its elastic twin, as stiff as rigid.
    L, m, J = 1.0, 3.0, 1.3
    motion = "1.5*(t - sin(2*pi*t)/(2*pi))"
    a = lambda t: 1.5 * 2 * np.pi * np.sin(2 * np.pi * t)
    v = lambda t: 1.5 * (1 - np.cos(2 * np.pi * t))
    q = lambda t: 1.5 * (t - np.sin(2 * np.pi * t) / (2 * np.pi))

    def truth(t):
        c, s = np.cos(q(t)), np.sin(q(t))
        ax, ay = -L / 2 * (s * a(t) + c * v(t) ** 2), L / 2 * (c * a(t) - s * v(t) ** 2)
        moment = (J + m * L * L / 4) * a(t) + m * 9.81 * L / 2 * c
        z = 0 * t
        return {"r": np.c_[m * ax, m * (ay + 9.81), z, z, z, moment], "acc": 2 * np.c_[ax, ay, z]}

    yield Scene(
        simulation(1.0, 200, (0, -9.81, 0))
        + rigid("arm", m, (J,) * 3, {"end": (L, 0, 0)}, (L / 2, 0, 0))
        + joint("motor", "revolute", "ground", "arm", f'motion = "{motion}"')
        + output("r", "motor", "reaction")
        + output("acc", "arm.end", "acceleration"),
        truth,
        {},
        "rigid arm",
    )
    # Elastic: linear beam in its turning frame, small deflection: driven by the motor's acceleration (rotor fixed), weight off.
    for d, T, tip in ((0.05, 1.0, 0.0), (0.02, 1.0, 0.0), (0.02, 0.3, 1.0)):
        s, A, I = circle(d)
        M, K = beam_matrices(L, E * I, RHO * A, 20, tip_mass=tip)
        n = len(M)
        r = np.zeros(n)
        r[0::2] = np.arange(1, n // 2 + 1) * L / (n // 2)
        r[1::2] = 1.0
        amplitude = 0.05  # small angle: no centrifugal terms
        acc = lambda t, T=T: amplitude * 2 * np.pi / T**2 * np.sin(2 * np.pi * t / T)

        def moment(t, M=M, K=K, r=r, acc=acc):
            # M (u'' + r a) = -K u, so the rate of the moment of momentum r^T M (u'' + r a) is -r^T K u.
            u = Linear(M, K).respond(-M @ r, acc, t, fine=8000)
            return {"r": np.stack([np.nan * t] * 5 + [-(u @ (K @ r))], axis=1)}

        yield Scene(
            simulation(T, 200 / T)
            + rigid("rotor", 1.0, (0, 0, 0))
            + beam("arm", L, s, STEEL, 'effects = ["bending_xy"]')
            + (rigid("load", tip, (0, 0, 0)) + weld("grip", "arm.tip", "load") if tip else "")
            + joint("motor", "revolute", "ground", "rotor", f'motion = "{amplitude}*(t/{T} - sin(2*pi*t/{T})/(2*pi))"')
            + weld("hub", "rotor", "arm")
            + output("r", "motor", "reaction"),
            moment,
            {},
            f"elastic arm {d} m, {T} s, {tip} kg",
        )
