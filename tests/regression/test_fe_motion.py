"""Bodies reduced from decks of beams in motion and under loads: closed forms say what is right."""
import json
import math
import re

from program import *

E, NU, RHO = 2.1e11, 0.3, 7850.0


def beam_deck(length, count, section, n1="0., 1., 0.", density=RHO, more="", nu=NU, anchor=True):
    """A beam along x from node 1 to node count + 1. anchor: a mass at the first, where scenes hold it, keeps the mean axes there."""
    nodes = "".join(f"{i + 1}, {length * i / count:.9g}\n" for i in range(count + 1))
    elements = "".join(f"{i + 1}, {i + 1}, {i + 2}\n" for i in range(count))
    if anchor:
        more += "*ELEMENT, TYPE=MASS, ELSET=HELD\n700, 1\n*MASS, ELSET=HELD\n50.\n"
        more += "*ELEMENT, TYPE=ROTARYI, ELSET=HELD2\n701, 1\n*ROTARY INERTIA, ELSET=HELD2\n10., 10., 10., 0., 0., 0.\n"
    return (
        f"*NODE\n{nodes}*ELEMENT, TYPE=B31, ELSET=BEAM\n{elements}*MATERIAL, NAME=M\n*ELASTIC\n{E}, {nu}\n*DENSITY\n{density}\n"
        f"*BEAM SECTION, ELSET=BEAM, MATERIAL=M, SECTION={section}\n{n1}\n{more}"
    )


def roots(f, low, high, steps=4000):
    """Zeros of f between low and high, by bisection."""
    out, step = [], (high - low) / steps
    for i in range(steps):
        a, b = low + i * step, low + (i + 1) * step
        if f(a) * f(b) > 0:
            continue
        for _ in range(60):
            middle = 0.5 * (a + b)
            a, b = (a, middle) if f(a) * f(middle) <= 0 else (middle, b)
        out.append(a)
    return out


with temporary_folder() as name:
    folder = pathlib.Path(name)

    def reduce(text, *words):
        (folder / "deck.inp").write_text(text)
        return json.loads(run("reduce", folder / "deck.inp", "-o", folder / "body.sid", "--quiet", "--json", *words).stdout)

    def frequencies(scene):
        """Hz of the small motions about the scene's start."""
        (folder / "scene.toml").write_text('[simulation]\nduration = 0.01\noutput_rate = 100\nstart = "static"\n' + scene)
        modes = json.loads(run("check", folder / "scene.toml", "--json").stdout)["modes"]
        return [m["frequency"] for m in modes if m["kind"] == "vibration"]

    BODY = '[[body]]\nname = "b"\nkind = "modal"\nfile = "body.sid"\n'
    HUB = '[[body]]\nname = "hub"\nkind = "rigid"\nmass = 1\ninertia = [1, 1, 1]\n'

    def spun(axis, rate):
        return (
            f'{HUB}{BODY}[[joint]]\nname = "turns"\nkind = "revolute"\nparent = "ground"\nchild = "hub"\n'
            f'axis = {axis}\nmotion = "{rate}*t"\n'
            '[[joint]]\nname = "held"\nkind = "weld"\nparent = "hub"\nchild = "b.root"\n'
        )

    # A disc on a light overhung shaft that spins about its axis (the textbooks' rotor): mass and stiffness in the inertial frame,
    # det(K - w^2 M + w Omega G) = 0; seen from the shaft every frequency is less by Omega. Tolerance: the shaft's own mass, 0.7 g of 5 kg.
    length, diameter, mass, across, about = 0.4, 0.02, 5.0, 0.03, 0.055
    disc = f"*ELEMENT, TYPE=MASS, ELSET=DISC\n100, 9\n*MASS, ELSET=DISC\n{mass}\n*ELEMENT, TYPE=ROTARYI, ELSET=TURNING\n101, 9\n"
    disc += f"*ROTARY INERTIA, ELSET=TURNING\n{about}, {across}, {across}, 0., 0., 0.\n"
    shaft = beam_deck(length, 8, f"PIPE\n{diameter / 2}, {diameter / 2 * 0.999999}", density=5, more=disc)
    reduce(shaft, "--interface", "root=1", "--interface", "tip=9", "--modes", 4, "--nodes", 4)
    ei, ga = E * math.pi * diameter**4 / 64, 0.886 * E / 2 / (1 + NU) * math.pi * diameter**2 / 4
    # Compliance at the end, force and moment: with shear.
    a, b, c = length**3 / (3 * ei) + length / ga, length**2 / (2 * ei), length / ei
    det = a * c - b * b
    k11, k12, k22 = c / det, -b / det, a / det
    for rate in (0, 150, 500):
        w = roots(lambda w: (k11 - mass * w * w) * (k22 - across * w * w + about * rate * w) - k12 * k12, -2000, 2000)
        wanted = sorted(abs(x - rate) / 2 / math.pi for x in w)
        got = frequencies(spun([1, 0, 0], rate))
        for f in wanted:
            near(min(got, key=lambda g: abs(g - f)), f, 1e-3 * f, f"disc on a shaft at {rate} rad/s")

    # A body on a rigid arm at the end of a light strip under its weight: the tension's exact beam column, w = A cosh + B sinh + ..., gives
    # the compliance of the body's place and turn under a force and a moment there.
    length, width, thick, arm, mass, inertia, gravity = 0.5, 0.03, 0.002, 0.1, 0.5, 1e-3, 120.0
    more = f"*NODE\n900, {length + arm}, 0., 0.\n*MPC\nBEAM, 900, 21\n"
    more += f"*ELEMENT, TYPE=MASS, ELSET=M1\n800, 900\n*MASS, ELSET=M1\n{mass}\n"
    more += f"*ELEMENT, TYPE=ROTARYI, ELSET=R1\n801, 900\n*ROTARY INERTIA, ELSET=R1\n{inertia}, {inertia}, {inertia}, 0., 0., 0.\n"
    strip = beam_deck(length, 20, f"RECT\n{width}, {thick}", density=5, more=more)
    reduce(strip, "--interface", "root=1", "--interface", "tip=21", "--modes", 6, "--nodes", 4)
    weld = '[[joint]]\nname = "held"\nkind = "weld"\nparent = "ground"\nchild = "b.root"\n'
    got = frequencies(f"gravity = [{gravity}, 0, 0]\n" + BODY + weld)
    ei, tension = E * width * thick**3 / 12, mass * gravity
    k = math.sqrt(tension / ei)
    big, small = math.cosh(k * length) + arm * k * math.sinh(k * length), math.sinh(k * length) + arm * k * math.cosh(k * length)

    def moved(force, moment):
        a, b = (moment + force * small / k) / tension / big, -force / (tension * k)
        place = (force * (length + arm) + moment) / tension - a
        return place, k * (a * math.sinh(k * length) + b * math.cosh(k * length)) + force / tension

    (a, b), (_, c) = moved(1, 0), moved(0, 1)
    det = a * c - b * b
    # mass inertia w^4 - (mass k22 + inertia k11) w^2 + det K = 0
    p, q = (mass * a + inertia * c) / det, 1 / det
    for sign in (1, -1):
        wanted = math.sqrt((p - sign * math.sqrt(p * p - 4 * mass * inertia * q)) / (2 * mass * inertia)) / 2 / math.pi
        near(min(got, key=lambda g: abs(g - wanted)), wanted, 2e-3 * wanted, "hanging body on an arm")

    # A file without second order that spins: told where it matters, unless the scene says so itself.
    reduce(beam_deck(0.4, 8, "RECT\n0.05, 0.003"), "--interface", "root=1", "--modes", 2, "--nodes", 3, "--no-stiffening")
    without = 'without = ["stiffening"]\n'
    asked = ("--accuracy", "0.01", "--fresh")
    for rate, more, words, told in ((200, "", (), True), (200, "", asked, True), (5, "", (), False), (200, without, (), False)):
        scene = spun([0, 0, 1], rate).replace(BODY, BODY + more)
        scene += '[[output]]\nname = "place"\nof = "b.node[9]"\nquantity = "position"\n' if words else ""
        (folder / "spun.toml").write_text(f"[simulation]\nduration = 0.02\noutput_rate = 500\n{scene}")
        said = run("simulate", folder / "spun.toml", "-q", "-o", folder / "spun.h5", *words).stderr
        expect(("has no geometric stiffening" in said) == told, f"stiffening that a file lacks at {rate} rad/s {more}: {said}")

    # A file with stiffening, but without the first order of Oe.
    reduce(beam_deck(0.4, 8, "RECT\n0.05, 0.003"), "--interface", "root=1", "--modes", 2, "--nodes", 3)
    head, rest = re.split(r"\n\s*Oe\s*\n", (folder / "body.sid").read_text(), maxsplit=1)
    block, rest = re.split(r"\n\s*end Oe\s*\n", rest, maxsplit=1)
    kept = [line for line in block.splitlines() if not line.strip().startswith("m1")]
    expect(len(kept) < len(block.splitlines()), "the file has no first order of Oe to take away")
    (folder / "body.sid").write_text("\n".join([head, "Oe", *kept, "end Oe", rest]))
    for rate, more, told in ((200, "", True), (200, without, True), (5, "", False)):
        scene = spun([0, 0, 1], rate).replace(BODY, BODY + more)
        (folder / "spun.toml").write_text(f"[simulation]\nduration = 0.02\noutput_rate = 500\n{scene}")
        said = run("simulate", folder / "spun.toml", "-q", "-o", folder / "spun.h5").stderr
        expect(("(Oe.M1)" in said) == told, f"centrifugal forces that a file lacks at {rate} rad/s {more}: {said}")

    # A narrow cantilever pushed across its stiff way, held in the deck or welded at its end in the scene: the lowest frequency of
    # EI w'' ^2 + 2 P (L - x) w'' theta + GJ theta'^2 (Ritz, ten powers of x); beyond Prandtl's load it tips over.
    length, width, thick = 1.0, 0.05, 0.002
    free = beam_deck(length, 20, f"RECT\n{width}, {thick}", nu=0.0, anchor=False)
    shear, twist = E / 2, width * thick**3 / 3 * (1 - 0.63 * thick / width)
    load = 4.013 * math.sqrt(E * width * thick**3 / 12 * shear * twist) / length**2
    for how, text, words, weld, near_tipping in (
        ("welded", free, ("--interface", "root=1"), "b.root", 0.02),
        ("held", free + "*BOUNDARY\n1, 1, 6\n", (), "b", 0.01),
    ):
        reduce(text, *words, "--interface", "tip=21", "--modes", 14, "--nodes", 4)
        held = f'[[joint]]\nname = "held"\nkind = "weld"\nparent = "ground"\nchild = "{weld}"\n'
        pushed = '[[force]]\nkind = "force"\non = "b.tip"\ndirection = [0, 1, 0]\nvalue = {}\n'
        for share, wanted in ((0.0, 1.671), (0.5, 1.5185), (0.9, 0.8768)):
            got = min(frequencies(BODY + held + pushed.format(share * load)))
            near(
                got, wanted, (near_tipping if share == 0.9 else 2e-3) * wanted, f"{how}, pushed with {share} of the load that tips it over"
            )

    # A moment at its end, about each axis: the same strip as a beam of volumes, which turn with what they carry, in two of its frequencies.
    reduce(free, "--interface", "root=1", "--interface", "tip=21", "--modes", 14, "--nodes", 4)
    volumes = (
        f'[[body]]\nname = "b"\nkind = "beam"\nlength = {length}\nmodel = "mixed"\nvolumes = 16\n'
        f'section = {{ shape = "rectangle", width = {thick}, height = {width} }}\n'
        f"material = {{ density = {RHO}, youngs_modulus = {E}, poisson = 0 }}\n"
        'effects = ["bending_xy", "bending_xz", "torsion", "stiffening", "shear"]\n'
    )
    ei = E * width * thick**3 / 12
    for axis, moment in (
        ("[0, 0, 1]", 0.4 * math.pi * math.sqrt(ei * shear * twist) / length),
        ("[1, 0, 0]", 0.1 * shear * twist / length),
    ):
        turned = f'[[joint]]\nname = "held"\nkind = "weld"\nparent = "ground"\nchild = "b.root"\n'
        turned += f'[[force]]\nkind = "torque"\non = "b.tip"\ndirection = {axis}\nvalue = {moment}\n'
        for got, wanted in zip(frequencies(BODY + turned)[:2], frequencies(volumes + turned)[:2]):
            near(got, wanted, 1e-3 * wanted, f"a moment about {axis}")

finish()
