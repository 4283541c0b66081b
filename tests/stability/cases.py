"""The hard cases: each a scene, what is hard about it, an invariant that holds exactly in theory, and the bound it is held to.

A case is a function that gets a Runner and returns the measured number; it passes if that is at most the bound. Bounds are about five
times what was measured when the case was written, unless theory gives one. `long` marks cases of the nightly run.
"""
import json
import math
import re
import statistics

from scenes import bar, beam, circle, energies, force, joint, output, rigid, rotation, simulation, slender, steel

cases = []


def case(hard, invariant, bound, long=False):
    def add(function):
        cases.append({"name": function.__name__, "hard": hard, "invariant": invariant, "bound": bound, "long": long, "measure": function})
        return function

    return add


def swing(h, column="energy", against="kinetic"):
    """Change of a conserved column relative to the largest value of another."""
    return (max(h[column]) - min(h[column])) / max(h[against])


def distance(a, b, column):
    """Largest difference of two histories' column relative to its range."""
    size = max(b[column]) - min(b[column])
    return max(abs(x - y) for x, y in zip(a[column], b[column])) / size


down = (0, -9.81, 0)


# Stiffness and shape of beams


@case("axial stiffness 1e8 times the bending stiffness (EA L^2 / EI)", "energy / largest kinetic energy", 1.5e-4)
def stiff_axial(run):
    # EA L^2 / EI = 16 (L / d)^2
    h = run(
        simulation(0.3, 1000, down)
        + beam("rod", 1.0, circle(4e-4), steel, 'elements = 6\neffects = ["axial", "bending_xy", "stiffening"]')
        + joint("pin", "revolute", "ground", "rod.root")
        + energies()
    )
    return swing(h)


def one_to_a_million_hertz(duration, more=""):
    # f_1 = 0.56 sqrt(EI / rho A) / L^2 = 1 Hz by the diameter; 30 elements with axial modes reach past 1e6 times as much
    length, fast = 1.0, math.sqrt(2.1e11 / 7800.0)
    d = 1.0 * length**2 / 0.5596 / fast * 4
    return (
        simulation(duration, 1000, down, more=more)
        + beam("rod", length, circle(d), steel, 'elements = 30\neffects = ["axial", "bending_xy"]')
        + joint("pin", "weld", "ground", "rod.root")
        + energies()
    )


@case("frequencies from 1 Hz to 1e6 Hz in one body", "energy / largest kinetic energy", 1e-3)
def wide_spectrum(run):
    return swing(run(one_to_a_million_hertz(1.0)), against="strain")


@case("slenderness 1e4", "energy / largest kinetic energy", 1e-3)
def slender_beam(run):
    h = run(
        simulation(0.5, 1000, down)
        + beam("rod", 1.0, circle(1e-4), steel, "elements = 6")
        + joint("pin", "revolute", "ground", "rod.root", "initial = { value = -1.5 }")
        + energies()
    )
    return swing(h)


@case("slenderness 3: stubby beam struck for 1 ms, 8 periods", "energy / largest strain energy", 5e-3)
def stubby(run):
    h = run(
        simulation(0.01, 1e5, down, 1e-8)
        + beam("rod", 0.3, circle(0.1), steel, 'elements = 8\neffects = ["bending_xy", "axial"]')
        + joint("root", "weld", "ground", "rod.root")
        + force("force", "rod.tip", "t < 1e-3 ? 1e4*sin(pi*t/1e-3)^2 : 0", (0, 1, 0))
        + energies()
    )
    late = {k: [x for t, x in zip(h["t"], v) if t > 1.01e-3] for k, v in h.items()}
    return swing(late, against="strain")


def dropped_between_hinges(run, diameter, duration):
    h = run(
        simulation(duration, 1000, down, 1e-8)
        + beam("rod", 1.0, circle(diameter), steel, "elements = 8")
        + joint("left", "revolute", "ground", "rod.root")
        + joint("right", "revolute", "ground", "rod.tip", "position = [1, 0, 0]")
        + output("tip", "rod.tip", "position")
        + energies()
    )
    closed = max(abs(x - 1) for x in h["tip.x"]) < 1e-12
    return swing(h, against="strain") if closed else math.inf


@case("rod of 2 mm dropped between two hinges that hold its length: stretching carries it", "energy / largest strain energy", 6e-4)
def held_ends(run):
    return dropped_between_hinges(run, 2e-3, 0.5)


@case("wire of 0.1 mm dropped between two hinges: 1e8 times stiffer along than across", "energy / largest strain energy", 1e-4)
def held_wire(run):
    return dropped_between_hinges(run, 1e-4, 0.25)


# Masses


def two_bars(first, second, duration, tolerance):
    return (
        simulation(duration, 100, down, tolerance)
        + bar("upper", 1.0, first)
        + bar("lower", 1.0, second)
        + joint("shoulder", "revolute", "ground", "upper")
        + joint("elbow", "revolute", "upper.end", "lower", "initial = { value = 0.5 }")
        + energies()
    )


@case("1e-6 kg hangs on 1 kg", "energy / largest kinetic energy", 1e-4)
def light_on_heavy(run):
    return swing(run(two_bars(1.0, 1e-6, 10.0, 1e-6)))


@case("1 kg hangs on 1e-6 kg", "energy / largest kinetic energy", 1e-4)
def heavy_on_light(run):
    return swing(run(two_bars(1e-6, 1.0, 10.0, 1e-6)))


@case("massless link between two bodies", "energy / largest kinetic energy", 1e-4)
def massless_link(run):
    h = run(
        simulation(5.0, 100, down)
        + rigid("link", 0.0, frames={"end": (0.5, 0, 0)})
        + rigid("bob", 1.0, (0.01, 0.01, 0.01), (0.3, 0, 0))
        + joint("top", "revolute", "ground", "link")
        + joint("low", "revolute", "link.end", "bob", "initial = { value = 0.3 }")
        + energies()
    )
    return swing(h)


@case("four-bar with a massless coupler", "energy / largest kinetic energy", 1e-4)
def massless_coupler(run):
    return swing(run(four_bar(4.0, coupler=0.0)))


@case("massless body at the end of a chain that nothing carries", "clear refusal", 0)
def massless_end(run):
    message = run.fails(
        simulation(1.0, 100, down)
        + bar("rod", 1.0, 1.0)
        + rigid("end", 0.0, frames={"p": (0.1, 0, 0)})
        + joint("top", "revolute", "ground", "rod")
        + joint("low", "revolute", "rod.end", "end"),
        (1, 2),
    )
    return 0 if "'end'" in message or "'low'" in message else 1


# Loops


def four_bar(
    duration, coupler=1.0, ground_length=0.6, length=0.3, rate=0.0, tolerance=1e-6, angle=1.0, bars=2, offset=0.0, gravity=down, rates=()
):
    """A parallelogram: bars of one length on a coupler as long as the distance of their pins; the last bar is longer by offset."""
    text = simulation(duration, 200, gravity, tolerance) + rigid(
        "coupler",
        coupler,
        slender(coupler, ground_length),
        (ground_length / 2, 0, 0),
        {f"p{k}": (ground_length * k / (bars - 1), 0, 0) for k in range(bars)},
    )
    for k in range(bars):
        initial = (
            f"initial = {{ value = {angle!r}, rate = {rate!r} }}" if k == 0 else f"initial = {{ rate = {rates[k]!r} }}" if rates else ""
        )
        text += bar(f"bar{k}", length + (offset if k == bars - 1 else 0.0), 0.5)
        text += joint(f"ground{k}", "revolute", "ground", f"bar{k}", f"position = [{ground_length * k / (bars - 1)!r}, 0, 0]\n{initial}")
        text += joint(f"pin{k}", "revolute", f"bar{k}.end", "coupler" if k == 0 else f"coupler.p{k}")
    return text + energies() + output("angle", "coupler", "rotation") + output("first", "ground0", "value")


@case("parallelogram with four parallel bars: nine redundant conditions besides the spatial ones", "energy / largest kinetic energy", 1e-4)
def redundant_bars(run):
    return swing(run(four_bar(2.0, bars=5)))


@case("parallelogram with a third bar that is 1e-12 m too long: nearly redundant", "energy / largest kinetic energy", 1e-4)
def nearly_redundant(run):
    return swing(run(four_bar(2.0, bars=3, offset=1e-12)))


@case("parallelogram with a third bar that is 1e-5 m too long: rigid or not to be assembled", "clear refusal or no motion", 1e-3)
def locked_bars(run):
    text = four_bar(0.2, bars=3, offset=1e-5, angle=1.0)
    message = run.fails(text, (0, 1, 2))
    if message:
        return 0 if "joint" in message else 1
    h = run(text)
    return max(h["first"]) - min(h["first"])


@case("slider-crank started in its dead centre by a torque, 25 turns", "work of the torque against kinetic energy", 1e-3)
def dead_centre(run):
    h = run(
        simulation(2.0, 500)
        + bar("crank", 0.1, 1.0)
        + bar("rod", 0.3, 1.0)
        + rigid("block", 0.5)
        + joint("shaft", "revolute", "ground", "crank", "initial = { value = 0, rate = 0 }")
        + joint("crank_pin", "revolute", "crank.end", "rod")
        + joint("wrist", "revolute", "rod.end", "block")
        + joint("guide", "prismatic", "ground", "block", "axis = [1, 0, 0]")
        + force("torque", "crank", "0.5")
        + output("crank", "shaft", "value")
        + energies()
    )
    return max(abs(k - 0.5 * a) for k, a in zip(h["kinetic"], h["crank"])) / max(h["kinetic"])


@case(
    "slider-crank with crank as long as the rod: the slider passes the shaft, a change point",
    "energy / largest kinetic energy, or a clear refusal",
    1e-4,
)
def change_point_slider(run):
    return swing(
        run(
            simulation(2.0, 500)
            + bar("crank", 0.2, 1.0)
            + bar("rod", 0.2, 1.0)
            + rigid("block", 0.5)
            + joint("shaft", "revolute", "ground", "crank", "initial = { value = 0.3, rate = 5 }")
            + joint("crank_pin", "revolute", "crank.end", "rod", "initial = { value = -0.6 }")
            + joint("wrist", "revolute", "rod.end", "block")
            + joint("guide", "prismatic", "ground", "block", "axis = [1, 0, 0]")
            + energies()
        )
    )


@case(
    "slider held fast by friction while an elastic crank is swung through its dead centre",
    "tolerance 1e-6 against 1e-9 / range; the slider stays",
    2e-3,
)
def dead_centre_held(run):
    # In the dead centre the crank's bending does not close the loop, where the rod is straight the rod's does not.
    crank, rod, angle = 3.0, 10.0, 0.1
    section, material = '{ shape = "general", area = 1e-3, iy = 4e-6, iz = 4e-6, j = 1e-6 }', "{ density = 1000.0, youngs_modulus = 1e9 }"
    start = crank * math.cos(angle) + math.sqrt(rod**2 - (crank * math.sin(angle)) ** 2)

    def scene(tolerance):
        return (
            simulation(10.0, 200, down, tolerance)
            + beam(
                "crank",
                crank,
                section,
                material,
                'model = "modal"\nboundary = "clamped-free"\nmodes = { bending_xy = [1] }\ndamping = { ratio = 0.02 }',
            )
            + beam(
                "rod",
                rod,
                section,
                material,
                'model = "modal"\nboundary = "supported-supported"\nmodes = { bending_xy = [1] }\ndamping = { ratio = 0.02 }',
            )
            + rigid("block", 4.0)
            + joint("shaft", "revolute", "ground", "crank.root", f'motion = "{angle} * cos(2 * t)"')
            + joint("crank_pin", "revolute", "crank.tip", "rod.root")
            + joint("wrist", "revolute", "rod.tip", "block")
            + joint(
                "guide",
                "prismatic",
                "ground",
                "block",
                f"axis = [1, 0, 0]\ninitial = {{ value = {start!r} }}\nfriction = {{ coefficient = 1, normal_force = 1e6 }}",
            )
            + output("x", "guide", "value")
            + output("tip", "crank.tip", "displacement")
        )

    loose, tight = run(scene(1e-6)), run(scene(1e-9))
    assert all(abs(x - start) < 1e-9 for h in (loose, tight) for x in h["x"]), "the slider moves"
    return distance(loose, tight, "tip.y")


@case("parallelogram four-bar through its flat position, a change point", "turn of the coupler (stays parallel), rad", 1e-6)
def change_point(run):
    h = run(four_bar(4.0, rate=6.0, gravity=(0, 0, 0)))
    assert swing(h) < 1e-4, "the energy changes"
    assert max(h["first"]) > 7, f"it only turns to {max(h['first'])}"
    return max(abs(a) for a in h["angle.z"])


@case("parallelogram four-bar started flat, in its change point", "turn of the coupler, rad", 1e-4)
def start_in_change_point(run):
    h = run(four_bar(1.0, rate=6.0, angle=0.0, gravity=(0, 0, 0), rates=[6.0, 6.0]))
    assert max(h["first"]) > 5, f"it only turns to {max(h['first'])}"
    return max(abs(a) for a in h["angle.z"])


@case("the same without a rate that says which way to go", "clear refusal", 0)
def undecided_change_point(run):
    message = run.fails(four_bar(1.0, rate=6.0, angle=0.0, gravity=(0, 0, 0)), (1, 2))
    return 0 if "change point" in message else 1


# Orientation


@case("free body tumbles about its middle axis (Dzhanibekov), 1000 s", "angular momentum / its size", 7.5e-4)
def tumbling(run):
    inertia = (1.0, 2.0, 3.0)
    h = run(
        simulation(1000.0, 10)
        + rigid("body", 1.0, inertia)
        + joint("free", "free", "ground", "body", "initial = { rate = [0, 0, 0, 1e-3, 1, 1e-3] }")
        + output("turn", "body", "rotation")
        + output("spin", "body", "angular_velocity")
        + energies()
    )
    worst = 0
    for i in range(len(h["t"])):
        R = rotation([h[f"turn.{c}"][i] for c in "xyz"])
        w = [h[f"spin.{c}"][i] for c in "xyz"]
        body = [sum(R[r][c] * w[r] for r in range(3)) * inertia[c] for c in range(3)]
        L = [sum(R[r][c] * body[c] for c in range(3)) for r in range(3)]
        worst = max(worst, math.dist(L, (1e-3, 2.0, 3e-3)) / 2.0)
    return worst


@case("start turned by pi about each axis (rotation vector's far end)", "position of a frame against the exact one, m", 5e-6)
def half_turns(run):
    worst = 0
    for k in range(3):
        v = [math.pi if i == k else 0 for i in range(3)]
        h = run(
            simulation(1.0, 100, down)
            + rigid("body", 1.0, (1, 1, 1), frames={"p": (1, 1, 1)})
            + joint("ball", "spherical", "ground", "body", f"initial = {{ value = {v}, rate = [0, 0, 2] }}")
            + output("p", "body.p", "position")
        )
        start = [1 if i == k else -1 for i in range(3)]
        for i, t in enumerate(h["t"]):
            c, s = math.cos(2 * t), math.sin(2 * t)
            wanted = (c * start[0] - s * start[1], s * start[0] + c * start[1], start[2])
            worst = max(worst, math.dist(wanted, [h[f"p.{c}"][i] for c in "xyz"]))
    return worst


@case("pendulum on a universal joint passes the pole, where its first axis turns nothing", "energy / largest kinetic energy", 1e-4)
def gimbal(run):
    h = run(
        simulation(3.0, 200, (0, 0, -9.81))
        + rigid("bob", 1.0, (1e-4, 1e-4, 1e-4), (1, 0, 0))
        + joint("hooke", "universal", "ground", "bob", "axis = [1, 0, 0]\ninitial = { value = [0, 0.2], rate = [0.3, 8] }")
        + energies()
    )
    return swing(h)


# Elastic bodies in motion


def spin_up(stiffening):
    """Kane, Ryan, Banerjee 1987: a beam is spun to 6 rad/s in 15 s, its first frequency at rest is 3.3 rad/s."""
    effects = '["bending_xy", "stiffening"]' if stiffening else '["bending_xy"]'
    return (
        simulation(20.0, 20)
        + beam(
            "blade",
            10.0,
            '{ shape = "general", area = 4e-4, iy = 2e-7, iz = 2e-7, j = 4e-7 }',
            "{ density = 3000.0, youngs_modulus = 7e10 }",
            f"elements = 8\neffects = {effects}",
        )
        + joint(
            "shaft", "revolute", "ground", "blade.root", 'motion = "t < 15 ? 6/15*(t*t/2 + (15/(2*pi))^2*(cos(2*pi*t/15) - 1)) : 6*t - 45"'
        )
        + output("tip", "blade.tip", "displacement")
    )


@case("spin-up beyond the first bending frequency with stiffening", "tip deflection at full speed / length", 1e-3)
def spin_stiffened(run):
    h = run(spin_up(True))
    assert 0.3 < max(abs(y) for y in h["tip.y"]) < 1.0, f"largest deflection {max(abs(y) for y in h['tip.y'])}"
    return max(abs(y) for t, y in zip(h["t"], h["tip.y"]) if t > 15) / 10


@case(
    "the same with stiffening off: the turning mean axes keep it stable, where a linear beam in its root's frame diverges",
    "tip deflection at full speed / length",
    2e-3,
)
def spin_unstiffened(run):
    h = run(spin_up(False))
    return max(abs(y) for t, y in zip(h["t"], h["tip.y"]) if t > 15) / 10


@case("column loaded to 1.2 of its buckling load, slowly", "bends out, or says that it cannot", 0)
def buckling(run):
    # cantilever 1 m, 10 mm: P_cr = pi^2 E I / 4 L^2
    critical = math.pi**2 * 2.1e11 * math.pi * 0.01**4 / 64 / 4
    text = (
        simulation(2.0, 200)
        + beam("column", 1.0, circle(0.01), steel, 'elements = 6\neffects = ["bending_xy", "stiffening"]\ndamping = { ratio = 0.02 }')
        + joint("foot", "weld", "ground", "column.root")
        + force("force", "column.tip", f"-{1.2 * critical!r}*t/2", (1, 0, 0))
        + force("force", "column.tip", "0.01", (0, 1, 0))
        + output("tip", "column.tip", "displacement")
    )
    message = run.fails(text, (0, 1))
    if message:
        return 0 if "column" in message else 1
    tip = run(text)["tip.y"]
    # It bends out to a tenth of its length and more, and stays what it is: no longer than itself.
    return 0 if 0.05 < max(abs(y) for y in tip) < 1.0 else 1


def tumbling_beam(more=""):
    return (
        simulation(20.0, 20, more=more)
        + beam("rod", 1.0, circle(0.01), steel, 'elements = 6\nboundary = "free-free"\neffects = ["bending_xy", "bending_xz"]')
        + joint("free", "free", "ground", "rod", "initial = { rate = [0.1, 0, 0, 1, 2, 3] }")
        + energies()
    )


@case("elastic beam flies and tumbles in zero gravity, 10 turns", "energy / largest kinetic energy", 3e-4)
def free_flight(run):
    return swing(run(tumbling_beam()))


def elastic_pendulum(tolerance, more=""):
    return (
        simulation(0.5, 200, down, tolerance, more)
        + beam(
            "rod",
            0.4,
            '{ shape = "rectangle", width = 0.2, height = 0.009 }',
            "{ density = 5540.0, youngs_modulus = 1e9 }",
            'elements = 4\neffects = ["bending_xy", "stiffening"]',
        )
        + joint("pin", "revolute", "ground", "rod.root")
        + output("tip", "rod.tip", "position")
    )


# What a body's deformation and damping mean


@case(
    "coupler of elastic volumes between two driven pins, 1 km from the origin",
    "displacement of the middle against that of the positions / largest",
    1e-5,
)
def coupler_from_its_pins(run):
    far = 1000.0
    text = (
        simulation(0.1, 500)
        + beam("rod", 0.5, circle(0.004), steel, 'model = "mixed"\nvolumes = 3\neffects = ["bending_xy"]\nframes = { middle = 0.5 }')
        + rigid("crank", 1.0, (0.01, 0.01, 0.01), frames={"pin": (0.15, 0, 0)})
        + rigid("rocker", 0.5, (0.01, 0.01, 0.01), frames={"pin": (0.3, 0, 0)})
        + joint("shaft", "revolute", "ground", "crank", f'position = [{far}, 0, 0]\nmotion = "1.2 + 30*t"')
        + joint("a", "revolute", "crank.pin", "rod.root")
        + joint("b", "revolute", "rod.tip", "rocker.pin")
        + joint("c", "revolute", "ground", "rocker", f"position = [{far + 0.5}, 0, 0]")
        + "".join(output(n, f"rod.{of}", "position") for n, of in (("r", "root"), ("t", "tip"), ("m", "middle")))
        + output("u", "rod.middle", "displacement")
    )
    h = run(text)
    wrong, largest = 0.0, 0.0
    for rx, ry, tx, ty, mx, my, u in zip(h["r.x"], h["r.y"], h["t.x"], h["t.y"], h["m.x"], h["m.y"], h["u.y"]):
        dx, dy = tx - rx, ty - ry
        across = (dx * (my - ry) - dy * (mx - rx)) / math.hypot(dx, dy)
        wrong, largest = max(wrong, abs(u - across)), max(largest, abs(across))
    return wrong / largest


def decay(t, x, start):
    """Damping ratio of a free vibration, from its largest peak after `start` and the last one."""
    peaks = []
    for k in range(1, len(x) - 1):
        if t[k] > start and x[k] > x[k - 1] and x[k] >= x[k + 1]:
            bend = x[k - 1] - 2 * x[k] + x[k + 1]
            slope = (x[k + 1] - x[k - 1]) / 2
            peaks.append(x[k] - slope * slope / (2 * bend))
    d = math.log(peaks[0] / peaks[-1]) / (len(peaks) - 1)
    return d / math.hypot(2 * math.pi, d)


def struck(joints, on, model="finite-element"):
    return (
        simulation(1.0, 4000, tolerance=1e-8)
        + beam("strip", 0.5, circle(0.01), steel, f'model = "{model}"\neffects = ["bending_xy"]\ndamping = {{ ratio = 0.01 }}')
        + joints
        + force("force", on, "t < 0.002 ? 10*sin(pi*t/0.002)^2 : 0", (0, 1, 0))
        + output("u", on, "displacement")
    )


@case(
    "beam welded at its tip, its frame at its root, struck at the free root: decay of its first vibration",
    "damping ratio found / ratio asked - 1",
    0.005,
)
def ratio_as_mounted(run):
    h = run(struck(joint("wall", "weld", "ground", "strip.tip"), "strip.root"))
    return abs(decay(h["t"], h["u.y"], 0.5) / 0.01 - 1)


@case("the same of a beam held by a slide at its root, of rigid pieces on springs", "damping ratio found / ratio asked - 1", 0.02)
def ratio_of_pieces(run):
    h = run(struck(joint("slide", "prismatic", "ground", "strip.root", "axis = [1, 0, 0]\ninitial = { value = 0 }"), "strip.tip", "lumped"))
    return abs(decay(h["t"], h["u.y"], 0.5) / 0.01 - 1)


# The exponential method, which follows every vibration however stiff

exponential = 'method = "exponential"'


@case("stiff_axial by the exponential method, which follows all of its vibrations", "energy / largest kinetic energy", 3e-5)
def exponential_stiff_axial(run):
    h = run(
        simulation(0.3, 1000, down, more=exponential)
        + beam("rod", 1.0, circle(4e-4), steel, 'elements = 6\neffects = ["axial", "bending_xy", "stiffening"]')
        + joint("pin", "revolute", "ground", "rod.root")
        + energies()
    )
    return swing(h)


@case("wide_spectrum by the exponential method: 6e5 radians of the fastest vibration", "energy / largest strain energy", 1e-4)
def exponential_spectrum(run):
    h = run(one_to_a_million_hertz(0.1, exponential))
    return swing(h, against="strain")


@case("elastic beam flies and tumbles, 10 turns, by the exponential method", "energy / largest kinetic energy", 1.5e-4)
def exponential_flight(run):
    return swing(run(tumbling_beam(exponential)))


@case(
    "elastic pendulum by the exponential method, tolerances 1e-2 to 1e-12",
    "error against the sixth-order method at 1e-12 / tolerance^(3/4)",
    1.5,
)
def exponential_tolerances(run):
    best = run(elastic_pendulum(1e-12, 'method = "erk"'))
    return max(distance(run(elastic_pendulum(10.0**-k, exponential)), best, "tip.y") / 10.0 ** (-0.75 * k) for k in range(2, 13))


@case("nothing moves of its own, or nothing at all, by the exponential method", "position against the motion that is given, m", 1e-12)
def exponential_driven(run):
    driven = run(
        simulation(1.0, 100, down, more=exponential)
        + bar("rod", 1.0, 1.0)
        + joint("pin", "revolute", "ground", "rod", 'motion = "sin(3 * t)"')
        + output("end", "rod.end", "position")
    )
    held = run(
        simulation(1.0, 100, down, more=exponential)
        + bar("rod", 1.0, 1.0)
        + joint("foot", "weld", "ground", "rod")
        + output("end", "rod.end", "position")
    )
    return max(
        max(abs(y - math.sin(math.sin(3 * t))) for t, y in zip(driven["t"], driven["end.y"])), max(abs(x - 1) for x in held["end.x"])
    )


# Small motions about the start (flexframe check)


def poles(report, rigid=False):
    """Poles of the modes, rad/s, the upper one of a pair; motions without stiffness only if asked for."""
    return [complex(m["real"], m["imaginary"]) for m in report["modes"] if rigid or m["kind"] != "rigid"]


def farthest(found, wanted):
    """Largest distance of a pole to the nearest of the exact ones, and the other way round, relative to the pole."""
    wanted = [complex(z.real, abs(z.imag)) for z in map(complex, wanted)]
    if not found or not wanted:
        return math.inf
    return max(max(min(abs(z - w) for w in wanted) / abs(z) for z in found), max(min(abs(z - w) for z in found) / abs(w) for w in wanted))


def unstable(report):
    return any(m["kind"] == "unstable" for m in report["modes"])


def vector(v, angles):
    """A vector of a world that is turned by a rotation vector."""
    return [sum(row[k] * v[k] for k in range(3)) for row in rotation(angles)]


def threshold(run, text_of, low, high):
    """Where a scene with one number begins to be unstable."""
    assert not unstable(run.check(text_of(low))) and unstable(run.check(text_of(high))), "the bounds do not enclose the threshold"
    for _ in range(10):
        middle = (low + high) / 2
        low, high = (low, middle) if unstable(run.check(text_of(middle))) else (middle, high)
    return (low + high) / 2


def loaded_column(load, words, model='elements = 8\neffects = ["bending_xy", "stiffening"]'):
    stiffness = 2.1e11 * math.pi * 0.01**4 / 64
    return (
        simulation(1.0)
        + beam("column", 1.0, circle(0.01), steel, model)
        + joint("foot", "weld", "ground", "column.root")
        + force("force", "column.tip", repr(load * stiffness), (-1, 0, 0), words)
    )


@case(
    "Beck's column: a load that follows the tip makes it flutter, without any static sign of it",
    "load at which flutter begins / (20.05 EI/L^2) - 1",
    5e-3,
)
def becks_column(run):
    return abs(threshold(run, lambda p: loaded_column(p, 'frame = "body"'), 15.0, 25.0) / 20.0509 - 1)


@case("Beck's column as a chain of rigid pieces, and a dead load beside it", "thresholds / theirs of the continuous column - 1", 1.5e-2)
def becks_chain(run):
    lumped = 'model = "lumped"\nelements = 16\neffects = ["bending_xy"]'
    flutter = threshold(run, lambda p: loaded_column(p, 'frame = "body"', lumped), 15.0, 25.0)
    buckling = threshold(run, lambda p: loaded_column(p, "", lumped), 2.0, 3.0)
    return max(abs(flutter / 20.0509 - 1), abs(buckling / (math.pi**2 / 4) - 1))


def jeffcott(speed, outer, inner, turn=(0, 0, 0), offset=0.0, more=""):
    """A disc of 1 kg, its centre of mass off the axis, on a shaft's springs (400 N/m), seen from the shaft that turns."""
    slide = f"spring = {{ stiffness = 400.0, damping = {inner!r} }}"
    return (
        simulation(0.01, 100, more=more)
        + rigid("hub", 1.0, (1, 1, 1))
        + rigid("link", 0.0)
        + rigid("disc", 1.0, (0.1, 0.1, 0.1), (offset, 0, 0))
        + joint("spin", "revolute", "ground", "hub", f'rotation = {list(turn)}\nmotion = "{speed!r}*t"')
        + joint("x", "prismatic", "hub", "link", "axis = [1, 0, 0]\n" + slide)
        + joint("y", "prismatic", "link", "disc", "axis = [0, 1, 0]\n" + slide)
        + f'[[force]]\nkind = "bushing"\non = "disc"\nstiffness = [0, 0, 0, 0, 0, 0]\ndamping = [{outer!r}, {outer!r}, {outer!r}, 0, 0,'
        " 0]\n"
    )


@case(
    "rotor below and above its critical speed, damped from outside and within, in turned worlds",
    "poles / those of m z'' + (c + ci + 2 i m W) z' + (k - m W^2 + i c W) z - 1",
    1e-7,
)
def damped_rotor(run):
    worst = 0.0
    for speed, outer, inner, turn in (
        (11.0, 3.0, 0.0, (0, 0, 0)),
        (30.0, 3.0, 0.0, (0.3, 0.8, -1.0)),
        (30.0, 0.0, 3.0, (0, 0, 0)),
        (50.0, 2.0, 1.6, (1.0, -2.0, 0.5)),
    ):
        half = (outer + inner + 2j * speed) / 2
        root = (half * half - (400.0 - speed**2 + 1j * outer * speed)) ** 0.5
        report = run.check(jeffcott(speed, outer, inner, turn))
        assert unstable(report) == (
            inner > 0 and speed > 20 * (1 + outer / inner)
        ), f"stability at {speed} rad/s with {outer} and {inner} Ns/m"
        worst = max(worst, farthest(poles(report), (-half + root, -half - root)))
    return worst


@case("two masses, one on a damper forty times its own critical one", "characteristic polynomial at the poles / its terms", 1e-10)
def one_strong_damper(run):
    k1, k2, k, c, a, b = 400.0, 500.0, 300.0, 4000.0, 1.0, 2.0
    report = run.check(
        simulation(1.0)
        + rigid("a", a, (1, 1, 1))
        + rigid("b", b, (1, 1, 1))
        + joint("a", "prismatic", "ground", "a", f"axis = [1, 0, 0]\nspring = {{ stiffness = {k1} }}")
        + joint("b", "prismatic", "ground", "b", f"axis = [1, 0, 0]\nspring = {{ stiffness = {k2}, damping = {c} }}")
        + f'[[force]]\nkind = "bushing"\non = "a"\nfrom = "b"\nstiffness = [{k}, 0, 0, 0, 0, 0]\n'
    )
    assert sorted(m["kind"] for m in report["modes"]) == ["overdamped", "overdamped", "vibration"], "one vibration and two decays"
    worst = 0.0
    for s in poles(report):
        first, second = a * s * s + k1 + k, b * s * s + c * s + k2 + k
        worst = max(worst, abs(first * second - k * k) / (abs(first) * (b * abs(s) ** 2 + c * abs(s) + k2 + k) + k * k))
    return worst


@case("mass on a spring with damping 1e-6 to 1e6 times the critical one", "poles / the exact ones - 1", 1e-9)
def all_dampings(run):
    worst = 0.0
    for ratio in (1e-6, 1e-3, 0.999, 1.001, 30.0, 1e6):
        report = run.check(
            simulation(1.0)
            + rigid("m", 2.0, (1, 1, 1))
            + joint("x", "prismatic", "ground", "m", f"axis = [1, 0, 0]\nspring = {{ stiffness = 800.0, damping = {80.0 * ratio!r} }}")
        )
        if ratio < 1:
            wanted = [complex(-20 * ratio, 20 * math.sqrt(1 - ratio * ratio))]
        else:
            fast = -20 * (ratio + math.sqrt(ratio * ratio - 1))
            wanted = [fast, 400 / fast]
        worst = max(worst, farthest(poles(report), wanted))
    return worst


@case(
    "a body without joints that falls and flies, in any units and orientation: rounding splits its twelve zero poles",
    "modes that are not called rigid",
    0,
)
def free_body_modes(run):
    strange = 0
    for mass, gravity, turn, speed in (
        (2.0, (0, 0, -9.81), (0, 0, 0), (0, 0, 0)),
        (1e-6, (300, 0, 0), (1, 2, 3), (5, 6, 7)),
        (1e7, (0, 0, -1.62), (-2, 0, 1), (1e4, 0, 0)),
    ):
        report = run.check(
            simulation(1.0, gravity=gravity)
            + rigid("box", mass, (mass, 1.5 * mass, 2 * mass), (0.1, 0.2, 0.3))
            + joint("free", "free", "ground", "box", f"initial = {{ value = {[1, 2, 3, *turn]}, rate = {list(speed)} }}")
        )
        strange += sum(m["kind"] != "rigid" for m in report["modes"]) + abs(len(report["modes"]) - 6)
    return strange


@case(
    "free elastic beam under gravity: six rigid motions beside frequencies up to 1e4 times the first",
    "first frequency of the free-free beam / theory - 1; six rigid modes",
    1e-3,
)
def free_beam_modes(run):
    report = run.check(
        simulation(1.0, gravity=(1.0, 2.0, -9.81))
        + beam("rod", 1.0, circle(0.01), steel, 'elements = 12\neffects = ["bending_xy", "bending_xz", "axial", "stiffening"]')
    )
    kinds = [m["kind"] for m in report["modes"]]
    assert kinds[:6] == ["rigid"] * 6 and set(kinds[6:]) == {"vibration"}, f"{kinds[:8]}"
    return abs(report["modes"][6]["frequency"] / (22.3733 * 0.0025 * math.sqrt(2.1e11 / 7800) / (2 * math.pi)) - 1)


@case(
    "sleeping top, 1 % below and above the spin that holds it, and at thirty times, in turned worlds",
    "poles / those of A z'' - i C W z' - m g l z - 1",
    1e-6,
)
def sleeping_top(run):
    m, l, g, C = 2.0, 0.5, 9.81, 0.03
    A, worst = 0.02 + m * l * l, 0.0
    for share, turn in ((0.99, (0, 0, 0)), (1.01, (0, 0, 0)), (30.0, (0, 0, 0)), (1.01, (0.4, -1.3, 0.8))):
        W = share * 2 * math.sqrt(A * m * g * l) / C
        report = run.check(
            simulation(1.0, gravity=vector((0, 0, -g), turn))
            + rigid("top", m, (0.02, 0.02, C), (0, 0, l))
            + joint("ball", "spherical", "ground", "top", f"initial = {{ value = {list(turn)}, rate = {vector((0, 0, W), turn)} }}")
        )
        assert unstable(report) == (share < 1), f"stability at {share} of the critical spin"
        root = complex(C * C * W * W - 4 * A * m * g * l) ** 0.5
        worst = max(worst, farthest(poles(report), (1j * (C * W + root) / (2 * A), 1j * (C * W - root) / (2 * A))))
    return worst


@case(
    "a body flies, falls and spins about each of its principal axes: unstable about the middle one only",
    "growth, or nutation, / Euler's - 1",
    1e-6,
)
def principal_spins(run):
    I, W, worst = (1.0, 2.0, 2.5), 7.0, 0.0
    for axis in range(3):
        for turn in ((0, 0, 0), (0.5, 1.5, -0.3)):
            rate = [2, -3, 1] + vector([W if k == axis else 0.0 for k in range(3)], turn)
            report = run.check(
                simulation(1.0, gravity=down)
                + rigid("body", 3.0, I)
                + joint("free", "free", "ground", "body", f"initial = {{ value = {[0, 0, 0, *turn]}, rate = {rate} }}")
            )
            own, a, b = I[axis], I[(axis + 1) % 3], I[(axis + 2) % 3]
            square = W * W * (own - a) * (own - b) / (a * b)
            assert unstable(report) == (square < 0), f"axis {axis}"
            wanted = math.sqrt(abs(square))
            values = [m["growth"] for m in report["modes"]] if square < 0 else [m["imaginary"] for m in report["modes"]]
            worst = max(worst, min(abs(v / wanted - 1) for v in values))
    return worst


@case("gyrostat: a wheel inside a carrier that turns about its middle axis", "the wheel's momentum that holds it / theory - 1", 2e-3)
def gyrostat(run):
    # (M - Ia W)(M - Ib W) > 0, M the whole momentum about the axis: from M = Ib W on.
    wheel, W = 0.1, 1.0

    def text(h):
        return (
            simulation(1.0)
            + rigid("carrier", 5.0, (1.0, 2.0, 2.5))
            + rigid("wheel", 1e-6, (wheel / 2, wheel, wheel / 2))
            + joint("free", "free", "ground", "carrier", f"initial = {{ rate = [0, 0, 0, 0, {W!r}, 0] }}")
            + joint("axle", "revolute", "carrier", "wheel", f"axis = [0, 1, 0]\ninitial = {{ rate = {h / wheel!r} }}")
        )

    return abs(threshold(run, lambda h: text(-h), -1.0, -0.2) / -(2.5 + wheel / 2 - 2.0 - wheel) - 1)


@case(
    "disc on a gimbal that turns at 3000 rad/s: precession and nutation apart by a factor of 1e4",
    "poles / those of the gyroscopic equations - 1",
    1e-6,
)
def gyroscopic_disc(run):
    A, C, W, k = 0.5, 0.9, 3000.0, (4000.0, 9000.0)
    text = (
        simulation(1.0)
        + rigid("outer", 0.1, (1e-3, 1e-3, 1e-3))
        + rigid("inner", 0.1, (1e-3, 1e-3, 1e-3))
        + rigid("disc", 1.0, (A, A, C))
        + joint("a", "revolute", "ground", "outer", f"axis = [1, 0, 0]\nrotation = [0.3, 1, 2]\nspring = {{ stiffness = {k[0]} }}")
        + joint("b", "revolute", "outer", "inner", f"axis = [0, 1, 0]\nspring = {{ stiffness = {k[1]} }}")
        + joint("spin", "revolute", "inner", "disc", f"axis = [0, 0, 1]\ninitial = {{ rate = {W} }}")
    )
    # ma mb s^4 + (ma kb + mb ka + (C W)^2) s^2 + ka kb
    ma, mb = A + 2e-3, A + 1e-3
    half = (ma * k[1] + mb * k[0] + (C * W) ** 2) / (2 * ma * mb)
    fast = half + math.sqrt(half * half - k[0] * k[1] / (ma * mb))
    return farthest(poles(run.check(text)), (1j * math.sqrt(fast), 1j * math.sqrt(k[0] * k[1] / (ma * mb) / fast)))


@case("an arm on a vertical shaft that turns steadily, free and driven", "its frequency about where it stays / theory - 1", 1e-7)
def steady_governor(run):
    g, l, W, worst = 9.81, 0.5, 8.0, 0.0
    c = g / (l * W * W)
    for driven in (False, True):
        report = run.check(
            simulation(1.0, gravity=(0, 0, -g))
            + rigid("shaft", 0.0, (1e-12, 1e-12, 1e-12))
            + rigid("bob", 2.0, (1e-12, 1e-12, 1e-12), (0, 0, -l))
            + joint("spin", "revolute", "ground", "shaft", f'motion = "{W}*t"' if driven else f"initial = {{ rate = {W} }}")
            + joint("hinge", "revolute", "shaft", "bob", f"axis = [0, 1, 0]\ninitial = {{ value = {math.acos(c)!r} }}")
        )
        wanted = W * math.sqrt(1 - c * c) if driven else W * math.sqrt(1 + 3 * c * c)
        worst = max(worst, min(abs(z.imag / wanted - 1) for z in poles(report)))
    return worst


@case("a soft pendulum hung on a spring 1e12 times as stiff", "its frequency / sqrt(g/l) - 1", 1e-6)
def soft_beside_stiff(run):
    report = run.check(
        simulation(1.0, gravity=down, more='start = "static"')
        + rigid("block", 1.0, (1, 1, 1))
        + rigid("bob", 1.0, (0, 0, 0), (1, 0, 0))
        + joint("post", "prismatic", "ground", "block", "axis = [0, 1, 0]\nspring = { stiffness = 1e13 }")
        + joint("pin", "revolute", "block", "bob", "rotation = [0, 0, -1.5707963267948966]")
    )
    return min(abs(z.imag / math.sqrt(9.81) - 1) for z in poles(report))


@case(
    "four-bar with springs and dampers in its joints, every joint told with parent and child exchanged, and in a turned world",
    "poles of the two / each other - 1",
    1e-7,
)
def exchanged_loop(run):
    found = []
    for exchanged, turn in ((False, (0, 0, 0)), (True, (0.7, -0.4, 1.1))):

        def hinge(name, a, b, more=""):
            if exchanged and a != "ground":
                a, b = b, a
            return joint(name, "revolute", a, b, more + f"\nspring = {{ stiffness = {40.0 + len(name)}, damping = {0.1 * len(name)} }}")

        found.append(
            poles(
                run.check(
                    simulation(1.0, gravity=vector(down, turn), more='start = "static"')
                    + bar("crank", 0.3, 1.0)
                    + bar("coupler", 0.8, 2.0)
                    + bar("rocker", 0.6, 1.5)
                    + rigid("frame", 1.0, (1, 1, 1), (0, 0, 0), {"end": (0.9, 0, 0)})
                    + joint("floor", "weld", "ground", "frame", f"rotation = {list(turn)}")
                    + hinge("a", "frame", "crank")
                    + hinge("bb", "crank.end", "coupler")
                    + hinge("ccc", "coupler.end", "rocker.end")
                    + hinge("dddd", "frame.end", "rocker")
                )
            )
        )
    return farthest(*found)


# Static starts


@case("lumped cantilever under its weight: a chain held by its springs alone", "deflection / (w L^4 / 8 EI) - 1", 5e-3)
def lumped_at_rest(run):
    h = run(
        simulation(0.01, 100, down, more='start = "static"')
        + beam("rod", 1.0, circle(0.05), steel, 'model = "lumped"\nelements = 16')
        + joint("foot", "weld", "ground", "rod.root")
        + output("tip", "rod.tip", "position")
    )
    return abs(-h["tip.y"][0] / (7800 * 9.81 * math.pi * 0.05**2 / 4 / (8 * 2.1e11 * math.pi * 0.05**4 / 64)) - 1)


@case(
    "eccentric rotor at rest relative to its shaft, below and above the critical speed: a saddle of its energy, held by gyroscopic forces",
    "whirl / (e W^2 / (k/m - W^2)) - 1",
    1e-8,
)
def whirl_above_critical(run):
    worst = 0.0
    for speed in (11.0, 30.0, 200.0):
        text = jeffcott(speed, 0.0, 0.0, offset=1e-3, more='start = "static"')
        h = run(text + output("x", "x", "value") + output("y", "y", "value"))
        worst = max(worst, abs(h["x"][0] / (1e-3 * speed**2 / (400.0 - speed**2)) - 1), abs(h["y"][0] / 1e-3))
    return worst


def struts(load, height=0.05, more='start = "static"'):
    """Two elastic bars in a flat roof."""
    length, slope = math.hypot(1, height), math.atan2(height, 1)
    material, section = "{ density = 1000.0, youngs_modulus = 1e9 }", '{ shape = "general", area = 1e-4, iy = 1e-9, iz = 1e-9, j = 1e-9 }'
    return (
        simulation(0.01, 100, more=more)
        + "".join(beam(n, length, section, material, 'elements = 1\neffects = ["axial"]') for n in "lr")
        + joint("left", "revolute", "ground", "l.root", f"position = [-1, 0, 0]\nrotation = [0, 0, {slope!r}]")
        + joint("right", "revolute", "ground", "r.root", f"position = [1, 0, 0]\nrotation = [0, 0, {math.pi - slope!r}]")
        + joint("apex", "revolute", "l.tip", "r.tip")
        + force("force", "l.tip", repr(load), (0, -1, 0))
        + output("y", "l.tip", "position")
    )


@case(
    "two elastic struts pushed through flat: below the limit load, and beyond it to the state on the other side",
    "height / that of the exact equilibrium - 1; told where it snapped",
    1e-6,
)
def snapped_roof(run):
    area, L, worst = 1e5, math.hypot(1, 0.05), 0.0
    for load, low, high in ((4.0, 0.03, 0.05), (6.0, -0.2, -0.05), (20.0, -0.2, -0.05)):
        h = run(struts(load))

        def left(y):
            return 2 * area * (math.hypot(1, y) / L - 1) * y / math.hypot(1, y) + load

        a, b = low, high
        for _ in range(100):
            a, b = (a, (a + b) / 2) if left(a) * left((a + b) / 2) <= 0 else ((a + b) / 2, b)
        worst = max(worst, abs(h["y.y"][0] / a - 1))
        assert ("snapped to" in run.notes) == (load > 5), f"told of at {load} N: {run.notes[:300]}"
    return worst


def strip(model, load):
    return (
        simulation(0.01, 100, more='start = "static"')
        + beam(
            "strip",
            1.0,
            '{ shape = "general", area = 1e-3, iy = 1e-8, iz = 1e-8, j = 2e-8 }',
            "{ density = 1000.0, youngs_modulus = 1e8 }",
            model,
        )
        + joint("clamp", "weld", "ground", "strip.root")
        + force("force", "strip.tip", repr(load), (0, 1, 0))
        + output("tip", "strip.tip", "position")
    )


@case(
    "strip bent far beyond small angles by a finite-element beam: refused, or told of",
    "silent answers farther than 5 % from the elastica",
    0,
)
def far_bent_strip(run):
    silent = 0
    # P L^2 / EI and the elastica's deflection / L
    for load, exact in ((1.0, 0.30172), (2.0, 0.49346), (5.0, 0.71379), (10.0, 0.81061), (50.0, 0.91716)):
        for model in (
            'elements = 8\neffects = ["bending_xy"]',
            'elements = 8\neffects = ["bending_xy", "stiffening"]',
            'model = "modal"\nmodes = { bending_xy = [1, 2, 3] }',
        ):
            if run.fails(strip(model, load), (0, 2)):
                continue
            h = run(strip(model, load))
            silent += abs(h["tip.y"][0] / exact - 1) > 0.05 and '"warnings": []' in run.notes
    return silent


@case("a body that slides freely on a cart which is driven with an acceleration: no rest, and why", "the refusal names the acceleration", 0)
def accelerated_rest(run):
    message = run.fails(
        simulation(0.1, more='start = "static"')
        + rigid("cart", 1.0, (1, 1, 1))
        + rigid("box", 1.0, (1, 1, 1))
        + joint("drive", "prismatic", "ground", "cart", 'axis = [1, 0, 0]\nmotion = "3*t*t"')
        + joint("slide", "prismatic", "cart", "box", "axis = [1, 0, 0]"),
        (2,),
    )
    return 0 if "accelerate" in message and "'drive'" in message and "buckles" not in message else 1


@case("a force that ends at t = 0 bends a spring at a static start and lets go", "position against F/k cos(w t) / (F/k)", 1e-5)
def let_go(run):
    h = run(
        simulation(1.0, 100, tolerance=1e-8, more='start = "static"')
        + rigid("m", 4.0, (1, 1, 1))
        + joint("x", "prismatic", "ground", "m", "axis = [1, 0, 0]\nspring = { stiffness = 100 }")
        + force("force", "m", "t <= 0 ? 5 : 0", (1, 0, 0))
        + output("x", "x", "value")
    )
    return max(abs(x - 0.05 * math.cos(5 * t)) for t, x in zip(h["t"], h["x"])) / 0.05


@case("cantilever of mixed volumes under a load that follows its tip: no energy to run down", "tip angle / that of the elastica - 1", 1e-2)
def follower_at_rest(run):
    # theta'' = -p sin(theta - theta_L - pi/2) with EI = L = 1, theta(0) = 0, theta'(1) = 0: from the tip back, by the angle there.
    load = 6.0
    text = strip('model = "mixed"\nvolumes = 8\nelements = 1\neffects = ["bending_xy", "stiffening"]', load).replace(
        "direction = [0, 1, 0]", 'direction = [0, 1, 0]\nframe = "body"'
    )
    h = run(text.replace('quantity = "position"', 'quantity = "rotation"'))

    # In axes of the tip the load is fixed, so the shape is one integration: psi = theta - theta_L, psi'' = -p cos(psi), psi(1) = psi'(1)
    # = 0.
    psi, slope, n = 0.0, 0.0, 2000
    step = -1.0 / n
    for _ in range(n):

        def rate(y):
            return (y[1], -load * math.cos(y[0]))

        y = (psi, slope)
        k1 = rate(y)
        k2 = rate((y[0] + step / 2 * k1[0], y[1] + step / 2 * k1[1]))
        k3 = rate((y[0] + step / 2 * k2[0], y[1] + step / 2 * k2[1]))
        k4 = rate((y[0] + step * k3[0], y[1] + step * k3[1]))
        psi, slope = (y[i] + step / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]) for i in range(2))
    return abs(h["tip.z"][0] / -psi - 1)


@case("inverted pendulum on a spring too weak to hold it, let down from a small tilt", "angle / the root of k a = m g l sin a - 1", 1e-8)
def fallen_pendulum(run):
    # (sin a) / a = k / (m g l) = 0.9
    h = run(
        simulation(0.01, 100, down, more='start = "static"')
        + rigid("bob", 1.0, (0.01, 0.01, 0.01), (0, 1, 0))
        + joint("pin", "revolute", "ground", "bob", f"spring = {{ stiffness = {0.9 * 9.81!r}, preload = -1e-9 }}")
        + output("a", "pin", "value")
    )
    a, b = 0.1, 3.0
    for _ in range(100):
        a, b = ((a + b) / 2, b) if math.sin((a + b) / 2) > 0.9 * (a + b) / 2 else (a, (a + b) / 2)
    return abs(h["a"][0] / a - 1)


# Contacts


@case("three balls reach their stops at the same moment, again and again", "they move alike, m; energy kept to 1e-4", 1e-9)
def simultaneous_stops(run):
    text = simulation(3.0, 200, (0, 0, -9.81), 1e-8) + energies()
    for k in range(3):
        text += rigid(f"ball{k}", 0.5, (1e-3, 1e-3, 1e-3)) + output(f"ball{k}", f"slide{k}", "value")
        text += joint(
            f"slide{k}",
            "prismatic",
            "ground",
            f"ball{k}",
            f"position = [{k}, 0, 0]\ninitial = {{ value = 0.3 }}\nstop = {{ lower = 0, stiffness = 1e5 }}",
        )
    h = run(text)
    assert min(h["ball0"]) > -0.02 and swing(h) < 1e-4, f"energy changes by {swing(h)}, lowest {min(h['ball0'])}"
    return max(abs(a - b) for k in (1, 2) for a, b in zip(h["ball0"], h[f"ball{k}"]))


# Long runs, many samples, tolerances


@case(
    "stick-slip chatter: a block dragged by a spring, 100 times stuck and torn off",
    "position against the exact one / length of a slip",
    1.5e-5,
)
def stick_slip(run):
    # Stretch s of the spring, while slipping: m s'' = mu N - k s from s = mu_0 N / k, s' = v, until s' = v again.
    m, k, v, normal, mu, mu0 = 1.0, 400.0, 0.02, 10.0, 0.3, 0.4
    w, mean, over = math.sqrt(k / m), mu * normal / k, (mu0 - mu) * normal / k
    slip = (2 * math.pi - 2 * math.atan(over * w / v)) / w
    period, first = slip + 2 * over / v, mu0 * normal / k / v

    def exact(t):
        if t <= first:
            return 0.0
        n, t0 = divmod(t - first, period)
        stretch = mean + over * math.cos(w * t0) + v / w * math.sin(w * t0) if t0 < slip else mean - over + v * (t0 - slip)
        return v * t - stretch

    h = run(
        simulation(first + 100 * period, 50, tolerance=1e-8)
        + rigid("block", m)
        + rigid("hand", 1.0)
        + joint(
            "slide",
            "prismatic",
            "ground",
            "block",
            f"axis = [1, 0, 0]\nfriction = {{ coefficient = {mu}, static_coefficient = {mu0}, normal_force = {normal} }}",
        )
        + joint("pull", "prismatic", "ground", "hand", f'axis = [1, 0, 0]\nposition = [1, 0, 0]\nmotion = "{v} * t"')
        + f'[[force]]\nkind = "spring-damper"\non = "block"\nfrom = "hand"\nstiffness = {k}\nrest = 1.0\n'
        + output("x", "slide", "value")
    )
    return max(abs(x - exact(t)) for t, x in zip(h["t"], h["x"])) / (2 * over + v * slip)


@case("undamped pendulum, 1000 periods at tolerance 1e-8", "energy / largest kinetic energy", 1e-5)
def thousand_periods(run):
    h = run(
        simulation(2000.0, 10, down, 1e-8)
        + bar("rod", 1.0, 1.0)
        + joint("pin", "revolute", "ground", "rod", "initial = { value = -0.8 }")
        + energies()
    )
    return swing(h)


@case("elastic pendulum, 1000 periods at tolerance 1e-8", "energy / largest kinetic energy", 1e-5, long=True)
def thousand_elastic_periods(run):
    h = run(
        simulation(1400.0, 10, down, 1e-8).replace("tolerance", "max_steps = 1e8\ntolerance")
        + beam("rod", 1.0, circle(0.02), steel, 'elements = 2\neffects = ["bending_xy", "stiffening"]')
        + joint("pin", "revolute", "ground", "rod.root", "initial = { value = -0.8 }")
        + energies()
    )
    return swing(h)


@case("1e6 output samples", "memory of the process, bytes / (samples x columns)", 400)
def million_samples(run):
    h = run(
        simulation(10.0, 1e5, down)
        + bar("rod", 1.0, 1.0)
        + joint("pin", "revolute", "ground", "rod")
        + energies()
        + output("angle", "pin", "value")
    )
    assert len(h["t"]) == 1000001, f"{len(h['t'])} samples"
    return run.peak_memory / (len(h["t"]) * 4.0)


def tolerance_ladder(tolerances, text_of, column, run):
    """Largest error / tolerance against the run ten times tighter than the tightest."""
    best = run(text_of(min(tolerances) / 10))
    worst = 0.0
    for tolerance in tolerances:
        error = distance(run(text_of(tolerance)), best, column)
        print(f"   tolerance {tolerance:g}: error {error:.3g}, {run.cpu:.2f} s")
        worst = max(worst, error / max(tolerance, 1e-12) ** 0.75)
    return worst


@case("rigid double pendulum, tolerances 1e-2 to 1e-12", "error / tolerance^(3/4)", 100)
def rigid_tolerances(run):
    return tolerance_ladder([10.0**-k for k in range(2, 13)], lambda tol: two_bars(1.0, 0.5, 1.0, tol), "kinetic", run)


@case("elastic pendulum, tolerances 1e-2 to 1e-9", "error / tolerance^(3/4)", 100)
def elastic_tolerances(run):
    return tolerance_ladder([10.0**-k for k in range(2, 9)], elastic_pendulum, "tip.y", run)


def scaled(length, time, tolerance=1e-8):
    """An elastic double pendulum and a slider-crank, scaled: equal in dimensionless numbers whatever length and time are."""
    g = 9.81 * length / time**2
    youngs = 2e9 * length**2 / time**2
    mass = length**3
    text = simulation(1.0 * time, 50 / time, (0, -g, 0), tolerance)
    text += rigid("bob", 10 * mass, (0.1 * mass * length**2,) * 3, (0.3 * length, 0, 0))
    text += beam(
        "rod",
        length,
        circle(0.05 * length),
        f"{{ density = 1000.0, youngs_modulus = {youngs!r} }}",
        'elements = 3\neffects = ["bending_xy", "stiffening"]',
    )
    text += joint("pin", "revolute", "ground", "rod.root") + joint("elbow", "revolute", "rod.tip", "bob", "initial = { value = 0.4 }")
    return text + output("tip", "rod.tip", "position") + energies() + f"[render]\nspeed = {time!r}\n"


def scale_case(run, length, time):
    one, other = run(scaled(1.0, 1.0)), run(scaled(length, time))
    return max(abs(a - b / length) for c in ("tip.x", "tip.y") for a, b in zip(one[c], other[c]))


@case("a run of 1 us", "dimensionless motion against that of 1 s", 1e-5)
def microsecond(run):
    return scale_case(run, 1.0, 1e-6)


@case("a run of a year", "dimensionless motion against that of 1 s", 1e-5)
def year(run):
    return scale_case(run, 1.0, 365.25 * 86400)


@case("a mechanism of 1 um", "dimensionless motion against that of 1 m", 1e-5)
def micrometre(run):
    return scale_case(run, 1e-6, 1e-3)


@case("a mechanism of 1 km", "dimensionless motion against that of 1 m", 1e-5)
def kilometre(run):
    return scale_case(run, 1e3, 1e1)


@case("loop mechanism of 1 um in 1 us", "energy / largest kinetic energy", 1e-4)
def tiny_loop(run):
    s, T = 1e-6, 1e-6
    text = (
        simulation(1 * T, 100 / T, (0, -9.81 * s / T**2, 0))
        + rigid("coupler", s**3, slender(s**3, s), (s / 2, 0, 0), {"p": (s, 0, 0)})
        + bar("a", s / 2, s**3)
        + bar("b", s / 2, s**3)
        + joint("ga", "revolute", "ground", "a", "initial = { value = 1 }")
        + joint("gb", "revolute", "ground", "b", f"position = [{s!r}, 0, 0]")
        + joint("pa", "revolute", "a.end", "coupler")
        + joint("pb", "revolute", "b.end", "coupler.p")
        + energies()
    )
    return swing(run(text))


@case("everything 1e6 m from the origin", "motion against that at the origin, m", 1e-6)
def far_origin(run):
    def text(at):
        return (
            simulation(1.0, 100, down, 1e-8)
            + bar("upper", 1.0, 1.0)
            + beam("rod", 0.5, circle(0.02), steel, 'elements = 3\neffects = ["bending_xy"]')
            + joint("pin", "revolute", "ground", "upper", f"position = [{at!r}, {at!r}, {at!r}]")
            + joint("elbow", "revolute", "upper.end", "rod.root")
            + output("tip", "rod.tip", "position")
        )

    here, there = run(text(0.0)), run(text(1e6))
    return max(abs(a - b + 1e6) for c in "xyz" for a, b in zip(here[f"tip.{c}"], there[f"tip.{c}"]))


@case("loop 1e6 m from the origin (coordinates there are rounded to 1e-10 m)", "motion against that at the origin, m", 1e-6)
def far_loop(run):
    def text(at):
        return (
            simulation(1.0, 100, down, 1e-8)
            + rigid("coupler", 1.0, slender(1.0, 0.5), (0.25, 0, 0), {"p": (0.5, 0, 0)})
            + bar("a", 0.3, 1.0)
            + bar("b", 0.6, 1.0)
            + joint("ga", "revolute", "ground", "a", f"position = [{at!r}, 0, 0]\ninitial = {{ value = 1 }}")
            + joint("gb", "revolute", "ground", "b", f"position = [{at + 0.6!r}, 0, 0]")
            + joint("pa", "revolute", "a.end", "coupler")
            + joint("pb", "revolute", "b.end", "coupler.p")
            + output("tip", "coupler.p", "position")
        )

    here, there = run(text(0.0)), run(text(1e6))
    return max(abs(a - b + (1e6 if c == "x" else 0)) for c in "xyz" for a, b in zip(here[f"tip.{c}"], there[f"tip.{c}"]))


def chaotic(duration, tolerance):
    return (
        simulation(duration, 100, down, tolerance)
        + bar("upper", 1.0, 1.0)
        + bar("lower", 1.0, 1.0)
        + joint("shoulder", "revolute", "ground", "upper", "initial = { value = 1.5 }")
        + joint("elbow", "revolute", "upper.end", "lower", "initial = { value = 1.0 }")
        + output("end", "lower.end", "position")
        + energies()
    )


@case("chaotic double pendulum, 3 s", "tolerance 1e-8 against 1e-10, m", 1e-5)
def chaos_short(run):
    a, b = run(chaotic(3.0, 1e-8)), run(chaotic(3.0, 1e-10))
    return max(abs(x - y) for x, y in zip(a["end.x"], b["end.x"]))


@case("chaotic double pendulum, 500 s at 1e-8", "energy / largest kinetic energy", 1e-4)
def chaos_long(run):
    return swing(run(chaotic(500.0, 1e-8)))


# What is said of a result: a number that is off by more than what was asked (1 % unasked) needs a warning


def judged(run, text, *words):
    """History and summary of a run with its estimates and checks."""
    scene, csv = run.folder / "scene.toml", run.folder / "h.csv"
    scene.write_text(text)
    summary = json.loads(run.program_words("simulate", scene, "--csv", csv, "--json", *words).stdout)["simulation"]
    names, *rows = [line.split(",") for line in csv.read_text().splitlines()]
    return {name: [float(row[i]) for row in rows] for i, name in enumerate(names)}, summary


def silent(error, summary):
    return 0.0 if summary["warnings"] else error


def let_go(weight, more, output_of="position"):
    # Spring steel, 1 m x 20 mm x 2 mm, clamped, straight, let go; no tolerance: the default or the asked accuracy
    text = simulation(2.0, 200, (0, -weight, 0)).replace("tolerance = 1e-06\n", "")
    return (
        text
        + beam("strip", 1.0, '{ shape = "rectangle", width = 0.02, height = 0.002 }', steel, more)
        + joint("clamp", "weld", "ground", "strip.root")
        + output("tip", "strip.tip", output_of)
    )


# Heights of its tip every 0.2 s: 24 and 48 rigid links with torsion springs, extrapolated, by a program of its own
links = {
    20: [-0.40308, -0.33635, -0.00876, -0.45090, -0.25545, -0.04031, -0.48307, -0.17721, -0.09892, -0.49856],
    40: [-0.69328, -0.40015, -0.16158, -0.76074, -0.06785, -0.51195, -0.61311, -0.00477, -0.73895, -0.26384],
}


def off_links(h, weight):
    size = max(h["tip.y"]) - min(h["tip.y"])
    return max(abs(h["tip.y"][40 * (k + 1)] - y) for k, y in enumerate(links[weight])) / size


@case("cantilever let go turns by 73 degrees in its frame", "silent error against a chain of links / range", 0.01)
def let_go_told(run):
    h, summary = judged(run, let_go(40, "elements = 8"))
    return silent(off_links(h, 40), summary)


@case("the advice of that warning followed to the letter", "error against a chain of links / range", 0.01)
def let_go_advised(run):
    _, summary = judged(run, let_go(40, 'elements = 8\neffects = ["bending_xy", "stiffening"]'))
    volumes = re.search(r'model = "mixed" with volumes = (\d+)', " ".join(summary["warnings"]))[1]
    h, _ = judged(run, let_go(40, f'model = "mixed"\nvolumes = {volumes}'), "--no-error-estimate")
    return off_links(h, 40)


@case("the same with two volumes", "silent error against a chain of links / range", 0.01)
def let_go_two_volumes(run):
    h, summary = judged(run, let_go(40, 'model = "mixed"\nvolumes = 2\nelements = 4'))
    return silent(off_links(h, 40), summary)


@case("the same in eigenforms of one frame, half the weight", "silent error against a chain of links / range", 0.01)
def let_go_modes(run):
    h, summary = judged(run, let_go(20, 'model = "modal"\nmodes = { bending_xy = [1, 2, 3, 4] }'))
    return silent(off_links(h, 20), summary)


@case("accuracy 1e-2 asked of finite elements where one frame cannot keep it", "silent error against a chain of links / range", 0.01)
def let_go_accuracy(run):
    h, summary = judged(run, let_go(40, "elements = 8"), "--accuracy", "1e-2")
    return silent(off_links(h, 40), summary)


@case("accuracy 1e-2 asked of two volumes: the search takes more of them", "silent error against a chain of links / range", 0.01)
def volumes_accuracy(run):
    h, summary = judged(run, let_go(20, 'model = "mixed"\nvolumes = 2\nelements = 4'), "--accuracy", "1e-2")
    return silent(off_links(h, 20), summary) if summary["accuracy"]["space"] > 0 else math.inf


@case("forms clamped at both ends where the tip is free", "silent error of the tip's fall / its range", 0.01)
def clamped_ends(run):
    right, _ = judged(run, let_go(1, "elements = 8"), "--no-error-estimate")
    h, summary = judged(run, let_go(1, 'boundary = "clamped-clamped"'))
    return silent(max(abs(a - b) for a, b in zip(h["tip.y"], right["tip.y"])) / (max(right["tip.y"]) - min(right["tip.y"])), summary)


@case("eigenforms supported at both ends where the root is clamped", "silent error of the tip's fall / its range", 0.01)
def other_forms(run):
    right, _ = judged(run, let_go(1, "elements = 8"), "--no-error-estimate")
    h, summary = judged(run, let_go(1, 'model = "modal"\nboundary = "supported-supported"\nmodes = { bending_xy = [1, 2, 3] }'))
    return silent(distance(h, right, "tip.y"), summary)


@case("one kept mode under its weight, at 0.4 of the length", "static deflection against the exact one, relative", 1e-4)
def kept_weight(run):
    text = simulation(0.02, 100, down, more='start = "static"') + beam(
        "rod", 1.0, circle(0.02), steel, "keep_modes = 1\nframes = { place = 0.4 }"
    )
    h = run(text + joint("clamp", "weld", "ground", "rod.root") + output("place", "rod.place", "displacement"))
    area, inertia = math.pi * 1e-4, math.pi * 1e-8 / 4
    return abs(h["place.y"][0] / (-7800 * area * 9.81 * 0.16 * (6 - 1.6 + 0.16) / (24 * 2.1e11 * inertia)) - 1)


@case("accuracy 1e-3 asked of a beam of one element whose node the scene names", "silent error against 20 elements / range", 1e-3)
def named_nodes(run):
    def struck(elements):
        return (
            simulation(0.2, 1000).replace("tolerance = 1e-06\n", "")
            + beam("rod", 1.0, circle(0.01), steel, f'elements = {elements}\neffects = ["bending_xy"]')
            + joint("clamp", "weld", "ground", "rod.root")
            + force("force", "rod.tip", "t < 0.02 ? 2*sin(pi*t/0.02)^2 : 0", (0, 1, 0))
            + output("end", f"rod.node[{elements}]", "position")
        )

    right, _ = judged(run, struck(20), "--tolerance", "1e-9", "--no-error-estimate")
    h, summary = judged(run, struck(1), "--accuracy", "1e-3")
    return silent(distance(h, right, "end.y"), summary)


# Kernel map and pictures

tube = [(0.1 * i, 0.05 * math.cos(2 * math.pi * k / 12), 0.05 * math.sin(2 * math.pi * k / 12)) for i in range(11) for k in range(12)]
tube_faces = [(12 * i + k, 12 * i + (k + 1) % 12, 12 * i + 12 + (k + 1) % 12, 12 * i + 12 + k) for i in range(10) for k in range(12)]


def mapped(run, nodes, displacement):
    """Displacements of the tube's vertices for nodes and displacements."""
    folder = run.folder
    (folder / "m.obj").write_text(
        "".join(f"v {' '.join(map(repr, v))}\n" for v in tube) + "".join(f"f {' '.join(str(i + 1) for i in f)}\n" for f in tube_faces)
    )
    (folder / "n.csv").write_text("x,y,z,ux,uy,uz\n" + "".join(",".join(map(repr, (*x, *u))) + "\n" for x, u in zip(nodes, displacement)))
    run.program_words("deform", "--nodes", folder / "n.csv", "--mesh", folder / "m.obj", "-o", folder / "u.csv")
    return [[float(c) for c in line.split(",")] for line in (folder / "u.csv").read_text().splitlines()[1:]]


def bent(x):
    return (0.0, 0.01 * x[0] ** 2, 0.0)


def near_singular(run, nodes):
    moved = mapped(run, nodes, [bent(x) for x in nodes])
    assert all(math.isfinite(c) for u in moved for c in u), "a displacement is not finite"
    return max(math.dist(u, bent(x)) for x, u in zip(tube, moved)) / 0.01


@case("nodes in pairs 1e-9 m apart", "map of a bent tube against the exact one / deflection", 0.15)
def twin_nodes(run):
    return near_singular(run, [(0.1 * i + e, 0.05 * math.cos(i), 0.05 * math.sin(i)) for i in range(11) for e in (0, 1e-9)])


@case("nodes on a line but for 1e-7 m", "map of a bent tube against the exact one / deflection", 0.15)
def almost_line(run):
    return near_singular(run, [(0.1 * i, 1e-7 * math.sin(3 * i), 1e-7 * math.cos(5 * i)) for i in range(11)])


@case("nodes in a plane but for 1e-7 m", "map of a bent tube against the exact one / deflection", 0.15)
def almost_plane(run):
    return near_singular(run, [(0.1 * i, 0.05 * s, 1e-7 * math.sin(7 * i)) for i in range(11) for s in (-1, 1)])


@case("exaggeration 1e6", "pictures whole, numbers in them finite; size shown / (1e6 x deflection)", 2.0)
def exaggerated(run):
    scene = run.folder / "scene.toml"
    scene.write_text(
        simulation(0.2, 100, down)
        + beam("rod", 1.0, circle(0.02), steel, "elements = 4")
        + joint("foot", "weld", "ground", "rod.root")
        + output("tip", "rod.tip", "displacement")
    )
    run.program_words("run", scene, "-o", run.folder / "out", "--scales", "1,1000000", "--size", "160x90", "--no-video")
    deflection = max(abs(float(line.split(",")[2])) for line in (run.folder / "out" / "histories.csv").read_text().splitlines()[1:])
    reach = 0.0
    for picture in sorted((run.folder / "out" / "frames").iterdir()):
        data = picture.read_bytes()
        at = data.index(b"flexframe-numbers\0") + len(b"flexframe-numbers\0")
        words = data[at : data.index(b"IDAT", at)].split(b" colors")[0].split()
        ends = [float(w) for w in words[5:8]] + [float(w[:24]) for w in words[9:12]]
        assert all(math.isfinite(x) for x in ends), "a number is not finite"
        reach = max(reach, max(abs(x) for x in ends))
    return max(reach / (1e6 * deflection), 1e6 * deflection / reach)


import cases_contacts  # noqa: E402,F401  adds its cases
import cases_effects  # noqa: E402,F401
import cases_frames  # noqa: E402,F401
import cases_time  # noqa: E402,F401  adds its cases
