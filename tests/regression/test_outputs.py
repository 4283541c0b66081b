"""Outputs against closed formulas: section forces and stress, forces and lengths, angles, chords, power; units inside expressions."""
import json
import math
import pathlib
import tempfile

import h5py
import numpy as np
from program import expect, finish, history, near, run
from scene_text import body, force, ground, joint, output, rigid, section, simulation


def simulate(folder, text, name="s", *words):
    scene = folder / f"{name}.toml"
    scene.write_text(text)
    run("simulate", scene, "-o", folder / f"{name}.h5", "--csv", folder / f"{name}.csv", *words)
    return history(folder / f"{name}.csv")


L, B, H, RHO, E, G = 2.0, 0.04, 0.02, 7850.0, 210e9, 9.81
CANTILEVER = f"""[simulation]
duration = 0.01
gravity = [0, -{G}, 0]
start = "static"
[[body]]
name = "rod"
kind = "beam"
length = {L}
section = {{ shape = "rectangle", width = {B}, height = {H} }}
material = {{ density = {RHO}, youngs_modulus = {E} }}
MODEL
[[joint]]
name = "wall"
kind = "weld"
parent = "ground"
child = "rod"
ROTATION
[[force]]
name = "pull"
kind = "force"
on = "rod.tip"
direction = [1, 0, 0]
value = 1000
[[force]]
name = "twist"
kind = "torque"
on = "rod.tip"
direction = [1, 0, 0]
value = 3
"""


def sections(folder):
    """A clamped beam under its weight, a pull and a torque: N, V, M, T and stress at the root, at 0.37 and near the tip."""
    outputs = "".join(output(f"s{at}", "rod", "section_force", f"at = 0.{at}") for at in ("0", "37", "9"))
    outputs += output("top", "rod.root", "stress") + output("tip", "rod.tip", "position") + output("r", "wall", "reaction")
    outputs += "".join(output(f"turn{at}", f"rod.p{at}", "rotation") for at in ("0", "37", "9"))
    q = RHO * B * H * G
    for model, near_by in (("", 2e-3), ("elements = 20", 1e-3), ('model = "mixed"', 2e-3)):
        h = simulate(
            folder, CANTILEVER.replace("MODEL", model + "\nframes = { p0 = 0, p37 = 0.37, p9 = 0.9 }").replace("ROTATION", "") + outputs
        )
        sag = -h["tip.y"][0]
        for at in ("0", "37", "9"):
            rest = L * (1 - float("0." + at))
            # In the axes of the section, which the sag has turned.
            turn = h[f"turn{at}.z"][0]
            near(h[f"s{at}.N"][0], 1000 * math.cos(turn) - q * rest * math.sin(turn), 0.05, f"{model}: N at 0.{at}")
            near(h[f"s{at}.Vy"][0], -q * rest * math.cos(turn) - 1000 * math.sin(turn), 0.05, f"{model}: V at 0.{at}")
            # The pull straightens the beam: its arm is what the tip hangs below the section, at most the sag.
            moment = -q * rest**2 / 2
            near(h[f"s{at}.Mz"][0], moment, near_by * q * L**2 / 2 + 1000 * sag, f"{model}: M at 0.{at}")
            near(h[f"s{at}.T"][0], 3, 0.02, f"{model}: T at 0.{at}")
        near(h["s0.Mz"][0], h["r.mz"][0] * -1, 1e-5 * q * L**2, f"{model}: the root's moment is the wall's")
        bending = abs(h["s0.Mz"][0]) * (H / 2) / (B * H**3 / 12) + 1000 / (B * H)
        # Torsion at the middle of the long sides: T / (alpha b h^2), alpha = 0.246 for 2 : 1 (Timoshenko).
        shear = 3 / (0.246 * B * H**2)
        near(h["top"][0], math.hypot(bending, math.sqrt(3) * shear), 0.01 * bending, f"{model}: stress at the root")


def turned(folder):
    """The same in a world turned about x by 90 degrees: the other moment, and the beam as parent of a joint to what it carries."""
    text = CANTILEVER.replace("MODEL", "").replace("ROTATION", 'rotation = ["90 deg", 0, 0]').replace(f"[0, -{G}, 0]", f"[0, 0, -{G}]")
    h = simulate(folder, text + output("s", "rod", "section_force", "at = 0.37"))
    plain = simulate(folder, CANTILEVER.replace("MODEL", "").replace("ROTATION", "") + output("s", "rod", "section_force", "at = 0.37"))
    for column in ("N", "Vy", "T", "Mz"):
        near(h[f"s.{column}"][0], plain[f"s.{column}"][0], 1e-5 * max(1, abs(plain[f"s.{column}"][0])), f"turned world: {column}")


def sections_in_motion(folder):
    """A stubby rigid rod, swung about its hinge: the moment by the rod's own inertia and that of its sections. And
    a cantilever that vibrates: cut at its root it has what the clamp says, though its elements are long beside the second mode's waves."""
    a, at = 50.0, ("05", "5")
    rod = f"""[[body]]
name = "rod"
kind = "beam"
length = {L}
section = {{ shape = "rectangle", width = 0.1, height = 0.4 }}
material = {{ density = {RHO}, youngs_modulus = {E}, poisson = 0.3 }}
keep_modes = 0
effects = ["bending_xy", "shear"]
"""
    drive = joint("hinge", "revolute", "ground", "rod", motion=f"{a / 2}*t^2") + output("r", "hinge", "reaction")
    cuts = "".join(output(f"s{x}", "rod", "section_force", f"at = 0.{x}") for x in at)
    h = simulate(folder, simulation(0.01) + rod + drive + cuts, "swung")
    mass, turning = RHO * 0.1 * 0.4, RHO * 0.1 * 0.4**3 / 12
    for x in at:
        s = float(f"0.{x}") * L
        moment = -a * (mass * ((L**3 - s**3) / 3 - s * (L**2 - s**2) / 2) + turning * (L - s))
        near(h[f"s{x}.Mz"][0], moment, 1e-6 * a * mass * L**3 / 3, f"swung rod: M at 0.{x}")
    # A strip under a load that bends it through 0.25 rad: the lever from its middle is what lies between, shortened by the slopes.
    bent = CANTILEVER.replace("MODEL", "frames = { mid = 0.5 }").replace("ROTATION", "").replace(f"-{G}", "0")
    force_y = 0.5 * E * B * H**3 / 12 / L**2
    bent = bent.replace("direction = [1, 0, 0]", "direction = [0, 1, 0]", 1).replace("value = 1000", f"value = {force_y}")
    places = "".join(output(f"p{x}", f"rod.{x}", "position") for x in ("mid", "tip"))
    h = simulate(folder, bent + places + output("s", "rod", "section_force", "at = 0.5"), "bent")
    near(h["s.Mz"][0], force_y * (h["ptip.x"][0] - h["pmid.x"][0]), 1e-4 * force_y * L, "bent strip: M at its middle")
    free = CANTILEVER.replace("MODEL", 'effects = ["bending_xy"]').replace("ROTATION", "").replace('start = "static"', "")
    free = free.replace("duration = 0.01", "duration = 0.2\ntolerance = 1e-7").replace("value = 3", "value = 0").replace("1000", "0")
    h = simulate(folder, free + output("s", "rod", "section_force", "at = 0") + output("r", "wall", "reaction"), "vibrates")
    worst = max(abs(s + r) for s, r in zip(h["s.Mz"], h["r.mz"]))
    near(worst, 0.0, 4e-3 * (max(h["r.mz"]) - min(h["r.mz"])), "vibrating cantilever: the root's moment is the wall's")


SPRING = (
    simulation(2, output_rate=500, tolerance=1e-9, gravity=[0, -9.81, 0])
    + ground(top=[0, 1, 0])
    + rigid("m", mass=2, inertia=[0.01, 0.01, 0.01])
    + joint(
        "rail",
        "prismatic",
        "ground",
        "m",
        axis=[0, 1, 0],
        initial=dict(value=0.2, rate=0.5),
        spring=dict(stiffness=50, damping=1, rest=0.1),
        stop=dict(lower=-0.1, stiffness=1e4),
    )
    + force("spring-damper", "m", name="coil", from_="ground.top", stiffness=300, damping=4, rest=0.9)
    + force("force", "m", name="push", direction=[0, 1, 0], value="10*sin(2 Hz*2*pi*t)")
)


def forces(folder):
    outputs = "".join(output(f"coil_{q}", "coil", q) for q in ("length", "length_rate", "force", "power")) + "".join(
        output(f"rail_{q}", "rail", q) for q in ("spring_force", "stop_force", "value", "rate")
    )
    outputs += output("push", "push", "force") + output("push_power", "push", "power") + output("kinetic", "system", "kinetic")
    h = simulate(folder, SPRING + outputs)
    for i in range(0, len(h["t"]), 7):
        t, x, v = h["t"][i], h["rail_value"][i], h["rail_rate"][i]
        near(h["coil_length"][i], abs(1 - x), 1e-9, "length")
        near(h["coil_length_rate"][i], -v, 1e-8, "length_rate")
        pull = 300 * (1 - x - 0.9) - 4 * v
        near(h["coil_force"][i], pull, 1e-6, "force of the coil")
        near(h["coil_power"][i], pull * v, 1e-6, "power of the coil")
        near(h["rail_spring_force"][i], -50 * (x - 0.1) - v, 1e-6, "force of the joint's spring")
        near(h["rail_stop_force"][i], 1e4 * max(0.0, -0.1 - x), 1e-5, "force of the stop")
        near(h["push"][i], 10 * math.sin(4 * math.pi * t), 1e-9, "value of a force with units inside")
        near(h["push_power"][i], h["push"][i] * v, 1e-9, "its power")
    # Power of all forces is the rate of the kinetic energy (Simpson's rule over the samples).
    power = [
        a + b + v * (s + e - 2 * 9.81)
        for a, b, v, s, e in zip(*(h[k] for k in ("coil_power", "push_power", "rail_rate", "rail_spring_force", "rail_stop_force")))
    ]
    step = 1 / 500
    work = sum(step / 3 * (power[i] + 4 * power[i + 1] + power[i + 2]) for i in range(0, len(power) - 2, 2))
    last = (len(power) - 1) // 2 * 2
    near(work, h["kinetic"][last] - h["kinetic"][0], 2e-3, "work of all forces")


def friction(folder):
    """A block that slides to rest: Coulomb's force against its way, none left over once it rests."""
    h = simulate(
        folder,
        simulation(1)
        + rigid("m", mass=2)
        + joint("rail", "prismatic", "ground", "m", axis=[1, 0, 0], initial=dict(rate=1), friction=dict(coefficient=0.2, normal_force=20))
        + output("f", "rail", "friction_force")
        + output("v", "rail", "rate"),
    )
    near(h["f"][10], -4, 1e-9, "sliding friction")
    near(h["v"][-1], 0, 1e-12, "at rest")
    near(h["f"][-1], 0, 1e-9, "no force at rest")


def holding_friction(folder):
    """What sticks is held by as much as pulls: by Newton, on a slide beside a spring, a hinge, a plane and the slider of a loop."""
    rubs = dict(coefficient=0.3, static_coefficient=0.5, normal_force=20)
    pull = """[[force]]
kind = "force"
on = "m"
direction = [1, 0, 0]
value = "3*t"
"""
    held = joint("rail", "prismatic", "ground", "m", axis=[1, 0, 0], initial=dict(value=0.1), friction=rubs, spring=dict(stiffness=40))
    h = simulate(folder, simulation(1) + rigid("m", mass=2) + held + pull + output("f", "rail", "friction_force"), "slide")
    for t, f in zip(h["t"], h["f"]):
        near(f, 40 * 0.1 - 3 * t, 1e-9, "a slide beside its spring")

    arm = rigid("m", mass=2, inertia=[1, 1, 1], centre_of_mass=[0.2, 0, 0])
    hinge = joint("pin", "revolute", "ground", "m", friction=dict(rubs, radius=0.6), initial=dict(value=0))
    h = simulate(folder, simulation(0.1, gravity=[0, -9.81, 0]) + arm + hinge + output("f", "pin", "friction_force"), "hinge")
    near(h["f"][-1], 2 * 9.81 * 0.2, 1e-9, "a hinge")

    plane = joint("flat", "planar", "ground", "m", friction=rubs)
    on_plane = rigid("m", mass=2, inertia=[1, 1, 1]) + plane + pull.replace("[1, 0, 0]", "[3, 4, 0]")
    h = simulate(folder, simulation(1) + on_plane + output("f", "flat", "friction_force"), "plane")
    near(h["f.1"][-1], -0.6 * 3, 1e-9, "a plane, x")
    near(h["f.2"][-1], -0.8 * 3, 1e-9, "a plane, y")

    # A crank of 0.3 m and a rod of 0.5 m at right angles to it, no masses but the crank's; its torque presses the slider.
    crank = rigid("crank", mass=1, inertia=[1, 1, 1], frames=dict(end=[0.3, 0, 0]))
    rod = rigid("rod", mass=0, frames=dict(end=[0.5, 0, 0]))
    angle = math.atan2(0.5, 0.3)
    loop = joint("shaft", "revolute", "ground", "crank", initial=dict(value=angle)) + joint("elbow", "revolute", "crank.end", "rod")
    loop += rigid("m", mass=1, inertia=[1, 1, 1]) + joint("wrist", "revolute", "rod.end", "m")
    loop += joint("rail", "prismatic", "ground", "m", axis=[1, 0, 0], initial=dict(value=math.hypot(0.3, 0.5)), friction=rubs)
    torque = """[[force]]
kind = "torque"
on = "crank"
direction = [0, 0, 1]
value = 1.5
"""
    h = simulate(folder, simulation(0.1) + crank + rod + loop + torque + output("f", "rail", "friction_force"), "loop")
    near(h["f"][-1], 1.5 / 0.3 * 0.5 / math.hypot(0.3, 0.5), 1e-9, "a slider in a loop")


def frames(folder):
    """Two cranks at different speeds: the angle between them; chord and tangent of a bent beam."""
    h = simulate(
        folder,
        simulation(1)
        + "".join(
            f"""[[body]]
name = "{name}"
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
[[joint]]
name = "j{name}"
kind = "revolute"
parent = "ground"
child = "{name}"
axis = [{axis}]
initial = {{ rate = {rate} }}
"""
            for name, axis, rate in (("a", "0, 0, 1", 1.0), ("b", "0, 0, 1", 3.0))
        )
        + output("angle", "a", "angle", 'relative_to = "b"'),
    )
    near(h["angle"][-1], 2.0, 1e-6, "angle between two cranks")
    text = CANTILEVER.replace("MODEL", "frames = { middle = 0.5 }").replace("ROTATION", "").replace("value = 1000", "value = 0")
    h = simulate(
        folder,
        text
        + output("plain", "rod.tip", "displacement")
        + output("chord", "rod.middle", "displacement", 'relative_to = ["root", "tip"]')
        + output("tangent", "rod.middle", "displacement", 'relative_to = "rod.tip"')
        + output("at_tip", "rod.tip", "displacement", 'relative_to = ["root", "tip"]'),
    )
    inertia, q = B * H**3 / 12, RHO * B * H * G
    tip, middle = q * L**4 / (8 * E * inertia), 17 * q * L**4 / (384 * E * inertia)
    slope = q * L**3 / (6 * E * inertia)
    near(-h["plain.y"][0], tip, 2e-3 * tip, "sag of the tip")
    near(h["at_tip.y"][0], 0, 1e-9, "the tip lies on its chord")
    near(h["chord.y"][0], tip / 2 - middle, 5e-3 * tip, "middle above the chord")
    near(h["tangent.y"][0], tip - middle - slope * L / 2, 5e-3 * tip, "middle seen from the tip's tangent")


def units(folder):
    text = (
        section("parameters", gap="5 mm + 1 cm")
        + simulation(0.001)
        + rigid("b", mass="1 kg + 500 g", inertia=[1, 1, 1])
        + joint(
            "j",
            "revolute",
            "ground",
            "b",
            position=["gap + (2 mm)", "sqrt((3 mm)^2 + (4 mm)^2)", "(1 + 1) mm * 2"],
            initial=dict(value="60 deg + 0.1"),
        )
        + output("p", "b", "position")
        + output("a", "j", "value")
    )
    h = simulate(folder, text)
    near(h["a"][0], math.pi / 3 + 0.1, 1e-12, "60 deg + 0.1")
    for column, wanted in (("p.x", 0.017), ("p.y", 0.005), ("p.z", 0.004)):
        near(h[column][0], wanted, 1e-15, column)
    scene = folder / "wrong.toml"
    for value, words in (
        ('"60 deg + 5 mm"', ("do not go together",)),
        ('"0.1 + 60 deg"', ("whole sum or to its last term", "(60 deg)")),
        ('"5 mm*2 + 1 cm"', ("does not fit",)),
        ('"sin(3 N)"', ("an angle",)),
        ('"2*(60 deg) deg"', ("has a unit already",)),
    ):
        scene.write_text(text.replace('"60 deg + 0.1"', value))
        message = run("check", scene, code=2).stderr
        for word in ("wrong.toml:", "'initial.value'", *words):
            expect(word in message, f"{value}: {word!r} is missing in {message!r}")


# A body and a beam under every kind of force.
EVERY_FORCE = (
    simulation(0.4, output_rate=1000, tolerance=1e-7)
    + ground(hook=[0, 1, 0])
    + rigid("m", mass=2, inertia=[0.1, 0.2, 0.3], frames=dict(a=[0.1, 0, 0]))
    + joint("m", "free", "ground", "m", initial=dict(value=[0.1, 0.05, 0.2, 0, 0, 0.1], rate=[1, 0.5, -0.3, 1, 2, 3]))
    + body(
        "bar",
        "beam",
        length=1,
        keep_modes=2,
        section=dict(shape="circle", diameter="10 mm"),
        material=dict(density=7850, youngs_modulus="210 GPa"),
    )
    + joint("wall", "weld", "ground", "bar", position=[3, 0, 0])
)
KINDS = {
    "world": 'kind = "force"\non = "m.a"\ndirection = [1, 0, 0]\nvalue = "3*sin(5*t)"',
    "follower": 'kind = "force"\non = "m.a"\nframe = "body"\ndirection = [0, 1, 0]\nvalue = 2',
    "torque": 'kind = "torque"\non = "m"\ndirection = [0, 1, 1]\nvalue = 0.5',
    "spring": 'kind = "spring-damper"\non = "m.a"\nfrom = "ground.hook"\nstiffness = 30\ndamping = 2\nrest = 0.5',
    "actuator": 'kind = "spring-damper"\non = "m"\nfrom = "ground.hook"\nvalue = "70*(length - 1)^3 + 0.3*abs(rate)*rate"',
    "rest": 'kind = "spring-damper"\non = "m"\nfrom = "ground.hook"\nstiffness = 20\nrest = "0.5 + 0.1*sin(3*t)"',
    "cable": 'kind = "cable"\non = "m.a"\nfrom = "ground.hook"\nstiffness = 40\ndamping = 1\nrest = 0.8',
    "bushing": 'kind = "bushing"\non = "m"\nstiffness = [20, 30, 40, 1, 2, 3]\ndamping = [0.1, 0.2, 0.3, 0.01, 0.02, 0.03]',
    "drag": 'kind = "drag"\non = "m"\nlinear = 0.2\nquadratic = 0.3\nwind = [1, 0, 0]',
    "floor": 'kind = "contact"\non = "m"\nshape = "sphere"\nradius = 0.1\nstiffness = 1e4\ndamping = 0.3\nfriction = { coefficient = 0.3 }',
    "line": 'kind = "distributed"\non = "bar"\ndirection = [0, 1, 0]\nvalue = "50*t"',
    "table": 'kind = "force"\non = "bar.tip"\ndirection = [0, 0, 1]\nvalue = { table = [[0, 0], [0.2, 10], [0.4, 0]] }',
}


def parts_of_the_energy(folder):
    """What is stored counts against its own range, however much turns beside it: its error and effects that alone give it are told."""
    wheels = "[simulation]\nduration = 40\noutput_rate = 300\n"
    for name, inertia in (("a", 1.0), ("b", 0.7)):
        wheels += f'[[body]]\nname = "{name}"\nkind = "rigid"\nmass = 1\ninertia = [{inertia}, {inertia}, {inertia}]\n'
    wheels += '[[joint]]\nname = "ja"\nkind = "revolute"\nparent = "ground"\nchild = "a"\ninitial = { rate = 300 }\n'
    wheels += '[[joint]]\nname = "jb"\nkind = "revolute"\nparent = "a"\nchild = "b"\nspring = { stiffness = 4000 }\n'
    wheels += "initial = { value = 0.02 }\n" + output("stored", "system", "potential")
    scene = folder / "wheels.toml"
    scene.write_text(wheels)
    told = json.loads(run("simulate", scene, "--csv", folder / "wheels.csv", "--json", cwd=folder).stdout)["simulation"]
    h = history(folder / "wheels.csv")
    w = math.sqrt(4000 * (1 + 1 / 0.7))
    true = [0.8 * math.cos(w * t) ** 2 for t in h["t"]]
    off = max(abs(a - b) for a, b in zip(h["stored"], true)) / 0.8
    estimate = told["error_estimate"]["relative"]
    expect(off / 5 < estimate < max(5 * off, 1e-5), f"a spring between turning wheels is {off} off, told {estimate}")
    arm = "[simulation]\nduration = 0.05\noutput_rate = 2000\n"
    arm += '[[body]]\nname = "hub"\nkind = "rigid"\nmass = 1\ninertia = [5, 5, 5]\n'
    arm += '[[body]]\nname = "arm"\nkind = "beam"\nlength = 0.5\nsection = { shape = "rectangle", width = 0.03, height = 0.05 }\n'
    arm += "material = { density = 7850, youngs_modulus = 2.1e11 }\n"
    arm += '[[joint]]\nname = "j"\nkind = "revolute"\nparent = "ground"\nchild = "hub"\ninitial = { rate = 60 }\n'
    arm += '[[joint]]\nname = "w"\nkind = "weld"\nparent = "hub"\nchild = "arm.root"\n' + output("strain", "system", "strain")
    arm += '[[force]]\nkind = "torque"\non = "hub"\ndirection = [0, 0, 1]\nvalue = "200*sin(40*t)"\n'
    scene.write_text(arm)
    told = json.loads(run("simulate", scene, "--csv", folder / "wheels.csv", "--json", cwd=folder).stdout)["simulation"]
    # Stretched at rest: int N^2 / (2 EA) dx, N = rho A w^2 (L^2 - x^2) / 2; let go from its own length it swings about that.
    still = 1 / 15 * (7850 * 0.0015 * 60**2) ** 2 * 0.5**5 / (2.1e11 * 0.0015)
    most = max(history(folder / "wheels.csv")["strain"])
    expect(2 * still < most < 5 * still, f"strain energy of a turning arm {most} J, at rest {still} J: {told['notes']}")


def energies_of_bodies(folder):
    """A rigid bar that hangs on a sprung hinge, and a beam of each model that hangs on it: these and the spring make up the sum."""
    k, mass = 3.0, 0.4
    kinds = ("energy", "kinetic", "strain", "potential")
    shape = dict(section=dict(shape="rectangle", width=0.01, height=0.01), material=dict(density=2700, youngs_modulus=2e9))
    for model in ({}, dict(model="mixed"), dict(model="lumped"), dict(effects=["bending_xy", "stiffening"]), None):
        text = simulation(0.4, output_rate=100, gravity=[0, -G, 0])
        text += rigid("bar", mass=mass, inertia=[0.01, 0.01, 0.01], centre_of_mass=[0.2, 0, 0], frames=dict(end=[0.5, 0, 0]))
        text += (
            body("beam", "beam", length=0.6, **shape, **model) if model is not None else rigid("beam", mass=0.2, inertia=[0.01, 0.02, 0.03])
        )
        text += joint("a", "revolute", "ground", "bar", spring=dict(stiffness=k)) + joint("b", "revolute", "bar.end", "beam")
        for of in ("system", "bar", "beam"):
            text += "".join(output(f"{of} {kind}", of, kind) for kind in kinds)
        text += output("angle", "a", "value") + output("rate", "a", "rate")
        h = simulate(folder, text, "energies", "--tolerance", "1e-8")
        parts = {kind: [a + b for a, b in zip(h[f"bar {kind}"], h[f"beam {kind}"])] for kind in kinds}
        most = max(map(abs, h["system kinetic"]))
        for i in range(0, len(h["t"]), 8):
            q, v = h["angle"][i], h["rate"][i]
            spring = k * q * q / 2
            wanted = dict(energy=parts["energy"][i] + spring, potential=parts["potential"][i] + spring)
            for kind in kinds:
                near(h[f"system {kind}"][i], wanted.get(kind, parts[kind][i]), 1e-9 * most, f"{kind} of the parts, {model}")
            near(h["bar kinetic"][i], (0.01 + mass * 0.2**2) * v * v / 2, 1e-7 * most, "the bar's kinetic energy")
            near(h["bar potential"][i], mass * G * 0.2 * math.sin(q), 1e-7 * most, "the bar's weight")
            expect(h["bar strain"][i] == 0 and (model is None) == (max(h["beam strain"]) == 0), f"strain energies, {model}")
    wrong = folder / "wrong.toml"
    for of in ("bar.end", "ground", "a"):
        wrong.write_text(text + output("e", of, "energy"))
        expect("must be \"system\" or a body's name for the quantity 'energy'" in run("check", wrong, code=2).stderr, f"energy of {of}")


def works_in_long_steps(folder):
    """A load that comes at once on a damped cantilever: the work supplied is force times deflection, also in steps over many turns."""
    F = 2.0
    text = simulation(0.3, output_rate=700, gravity=[0, 0, 0])
    text += body(
        "rod",
        "beam",
        "damping = { ratio = 0.02 }",
        length=0.5,
        section=dict(shape="circle", diameter=0.01),
        material=dict(density=2700, youngs_modulus=7e10),
        effects=["bending_xy", "stiffening"],
        keep_modes=6,
    )
    text += (
        joint("w", "weld", "ground", "rod")
        + force("force", "rod.tip", direction=[0, 1, 0], value=F)
        + output("p", "rod.tip", "displacement")
    )
    for words in (("--accuracy", "1e-2"), ("--method", "exponential", "--tolerance", "1e-6")):
        h = simulate(folder, text, "long", *words)
        with h5py.File(folder / "long.h5") as file:
            e = {name: file["energy"][name][:] for name in ("kinetic", "strain", "supplied", "dissipated")}
        most = max(e["supplied"])
        near(max(abs(e["supplied"] - F * np.array(h["p.y"]))), 0, 5e-3 * most, f"{words}: work supplied beside force times deflection")
        near(max(abs(e["kinetic"] + e["strain"] + e["dissipated"] - e["supplied"])), 0, 5e-3 * most, f"{words}: balance")
        expect(max(e["dissipated"]) > 0.1 * most, f"{words}: {max(e['dissipated'])} J dissipated of {most}")


def works(folder):
    """The work of every force is the integral of its power, and all of it is kinetic and strain energy."""
    text = EVERY_FORCE + output("kinetic", "system", "kinetic") + output("strain", "system", "strain")
    for name, words in KINDS.items():
        text += f'[[force]]\nname = "{name}"\n{words}\n' + output(f"W_{name}", name, "work") + output(f"P_{name}", name, "power")
    h = simulate(folder, text, "works")
    most = max(max(map(abs, h[f"W_{name}"])) for name in KINDS)
    for name in KINDS:
        done, power = h[f"W_{name}"], h[f"P_{name}"]
        expect(max(map(abs, done)) > 1e-3 * most, f"{name} does no work: {max(map(abs, done))}")
        summed = sum((a + b) / 2 * 1e-3 for a, b in zip(power, power[1:]))
        near(done[-1], summed, 2e-3 * most, f"work of {name} against its summed power")
    for i in range(0, len(h["t"]), 50):
        gained = h["kinetic"][i] - h["kinetic"][0] + h["strain"][i] - h["strain"][0]
        near(sum(h[f"W_{name}"][i] for name in KINDS), gained, 1e-4 * most, f"work of all forces at t = {h['t'][i]}")


# The same scene by plain numbers and by texts with units, wherever a number has one.
MACHINE = """[parameters]
half = "HALF"
[simulation]
duration = 1
output_rate = 50
[[body]]
name = "crank"
kind = "rigid"
mass = 1
inertia = [1, 1, 1]
[[joint]]
name = "shaft"
kind = "revolute"
parent = "ground"
child = "crank"
motion = { table = TURN }
[[body]]
name = "follower"
kind = "rigid"
mass = 1
[[joint]]
name = "rail"
kind = "prismatic"
parent = "ground"
child = "follower"
[[coupling]]
name = "cam"
kind = "cam"
joints = ["shaft", "rail"]
lift = { table = LIFT, period = PERIOD }
value = OFFSET
[[body]]
name = "block"
kind = "rigid"
mass = 2
inertia = [0.1, 0.1, 0.1]
[[joint]]
name = "block"
kind = "free"
parent = "ground"
child = "block"
initial = { value = [0.01, 0, 0, 0, 0, 0.1] }
[[force]]
name = "mount"
kind = "bushing"
on = "block"
stiffness = STIFFNESS
damping = DAMPING
[[force]]
name = "gas"
kind = "force"
on = "block"
direction = [0, 1, 0]
value = { table = GAS, of = "shaft", period = PERIOD }
[[force]]
name = "push"
kind = "force"
on = "block"
direction = [1, 0, 0]
value = { table = PUSH }
[render]
camera = { window = WINDOW, fov = FOV }
"""
PLAIN = {
    "HALF": "0.5",
    "TURN": f"[[0, 0], [0.5, {math.pi / 2!r}], [0.75, {math.pi!r}], [1, {2 * math.pi!r}]]",
    "LIFT": f"[[0, 0], [{math.pi / 2!r}, 0.01], [{math.pi!r}, 0.02], [{1.5 * math.pi!r}, 0.01]]",
    "PERIOD": repr(2 * math.pi),
    "OFFSET": "0.005",
    "STIFFNESS": "[2000, 3000, 4000, 10, 20, 30]",
    "DAMPING": "[1, 2, 3, 0.1, 0.2, 0.3]",
    "GAS": f"[[0, 0], [{math.pi / 2!r}, 10], [{math.pi!r}, 20]]",
    "PUSH": "[[0, 0], [0.5, 2000], [1, 0]]",
    "WINDOW": "[0, 0.5]",
    "FOV": "30",
}
WITH_UNITS = {
    "HALF": "500 ms",
    "TURN": '[["0 s", "0 deg"], ["half", "90 deg"], ["750 ms", "180 deg"], [1, "1 rev"]]',
    "LIFT": '[[0, 0], ["90 deg", "10 mm"], ["180 deg", "2 cm"], ["270 deg", "10 mm"]]',
    "PERIOD": '"360 deg"',
    "OFFSET": '"5 mm"',
    "STIFFNESS": '["2 N/mm", "3 N/mm", "4 kN/m", "10 N m/rad", 20, "30 N m/rad"]',
    "DAMPING": '["1 N s/m", 2, 3, "0.1 N m s/rad", 0.2, 0.3]',
    "GAS": '[["0 deg", 0], ["90 deg", "0.01 kN"], ["180 deg", "20 N"]]',
    "PUSH": '"[[0, 0], [half, 2 kN], [2*half, 0]]"',
    "WINDOW": '[0, "half"]'.replace("half", "500 ms"),
    "FOV": '"30 deg"',
}


def units_everywhere(folder):
    seen = output("turn", "shaft", "value") + output("lift", "rail", "value") + output("p", "block", "position")
    seen += output("push", "push", "force") + output("gas", "gas", "force") + output("moment", "mount", "force")

    def made(words):
        text = MACHINE
        for key, value in words.items():
            text = text.replace(key, value)
        return text + seen

    plain, united = (simulate(folder, made(words), name) for name, words in (("plain", PLAIN), ("united", WITH_UNITS)))
    told = [run("check", folder / f"{name}.toml").stdout.replace(name, "") for name in ("plain", "united")]
    expect(told[0] == told[1], f"check tells another thing with units: {told[1]}")
    expect(max(plain["push"]) > 1999 and max(plain["gas"]) > 19 and max(plain["lift"]) > 0.01, "the plain scene does nothing")
    for column, values in plain.items():
        off = max(abs(a - b) for a, b in zip(values, united[column]))
        near(off, 0, 1e-12 * max(1, *map(abs, values)), f"with units: {column}")
    scene = folder / "wrong.toml"
    for key, value, words in (
        ("TURN", '[[0, "5 mm"], [1, 2]]', ("'motion.table'", "entry 2", "does not fit")),
        ("LIFT", '[["1 s", 0], [1, 0.1], [2, 0.1]]', ("'lift.table'", "entry 1", "does not fit")),
        ("GAS", '[[0, 0], [1, "5 N m"]]', ("'value.table'", "entry 2", "does not fit")),
        ("STIFFNESS", '["2 N m/rad", 0, 0, 0, 0, 0]', ("'stiffness'", "entry 1", "does not fit")),
        ("OFFSET", '"3 deg"', ("'value'", "does not fit")),
    ):
        scene.write_text(made(PLAIN | {key: value}))
        message = run("check", scene, code=2).stderr
        for word in ("wrong.toml:", *words):
            expect(word in message, f"{key} = {value}: {word!r} is missing in {message!r}")


def times_with_units(folder):
    # What is multiplied by t is multiplied by the time: not a product of units with the tonne; also where a spring's rest moves.
    arm = rigid("m", mass=2, inertia=[1, 1, 1])
    for words, value in (
        ("90 deg*t", math.pi / 2),
        ("t*90 deg", math.pi / 2),
        ("2*45 deg*t^2", math.pi / 2),
        ("30 deg + 60 deg*t", math.pi / 2),
        ("90 deg/s*t", math.pi / 2),
        ("0.1 + t*60 deg", None),
    ):
        text = simulation(1) + arm + joint("pin", "revolute", "ground", "m", motion=words) + output("turn", "pin", "value")
        if value is None:
            (folder / "refused.toml").write_text(text)
            expect("'motion'" in run("check", folder / "refused.toml", code=2).stderr, f"{words} is refused")
        else:
            near(simulate(folder, text, "turns")["turn"][-1], value, 1e-12, words)
    rail = joint("rail", "prismatic", "ground", "m", axis=[1, 0, 0], initial=dict(value=0.05))
    for words, at_end in (("50 mm + 1 cm*sin(2 Hz*2*pi*t)", 0.05), ("50 mm + 1 cm*t", 0.06), ("5 cm", 0.05)):
        coil = force("spring-damper", "m", name="coil", stiffness=300, damping=4, rest=words)
        seen = output("force", "coil", "force") + output("length", "coil", "length") + output("rate", "coil", "length_rate")
        h = simulate(folder, simulation(1) + arm + rail + coil + seen, "rests")
        near(h["force"][-1], 300 * (h["length"][-1] - at_end) + 4 * h["rate"][-1], 1e-9, f"rest = {words}")
    push = force("force", "m", direction=[1, 0, 0], value="2 kN*t + 3 N*x") + output("x", "rail", "value") + output("v", "rail", "rate")
    h = simulate(folder, simulation(1) + arm + rail.replace("0.05", "0") + push, "pushes")
    a = math.sqrt(1.5)
    near(h["x"][-1], 1000 * (math.sinh(a) / a - 1) / 1.5, 1e-3, "a force of time and place")


def errors(folder):
    scene = folder / "wrong.toml"
    base = CANTILEVER.replace("MODEL", "").replace("ROTATION", "")

    def wrong(text, *words):
        scene.write_text(base + text)
        message = run("check", scene, code=2).stderr
        for word in ("wrong.toml:", *words):
            expect(word in message, f"{text!r}: {word!r} is missing in {message!r}")

    wrong(output("o", "rod", "section_force"), "key 'at' is missing")
    wrong(output("o", "rod", "section_force", "at = 2"), "'at'", "from 0 to 1")
    wrong(output("o", "rodd", "stress", "at = 0.5"), "a place of a beam", "did you mean 'rod'")
    wrong(output("o", "rod.tip", "position", "at = 0.5"), "belongs to the quantities section_force and stress")
    wrong(output("o", "pul", "force"), "a force with a 'name'", "did you mean 'pull'")
    wrong(output("o", "pull", "length"), "spring-dampers have")
    wrong(output("o", "wall", "spring_force"), "has no 'spring'")
    wrong(output("o", "rod.tip", "displacement", 'relative_to = ["root", "root"]'), "no chord")
    wrong(output("o", "rod.tip", "displacement", 'relative_to = ["a", "b", "c"]'), "one frame", "two")


# A crank on a shaft, turned by a table of its angle.
TABLE = (
    simulation(0.5)
    + rigid("crank", mass=1, inertia=[1, 1, 1], frames=dict(spot=[1, 0, 0]))
    + joint("shaft", "revolute", "ground", "crank", initial=dict(rate=4))
    + force("torque", "crank", name="gas", direction=[0, 0, 1], value=dict(table=[[0, 5], [1, 7], [2, 4], [3, 6], [4, 5]], of="shaft"))
)


def tables(folder):
    h = simulate(folder, TABLE + output("M", "gas", "force") + output("P", "gas", "power") + output("v", "shaft", "rate"), "table")
    near(h["M"][0], 5.0, 1e-9, "a table's force at the start")
    for moment, power, rate in zip(h["M"], h["P"], h["v"]):
        near(power, moment * rate, 1e-9 * abs(power), "a table's power")


def friction_at_the_start(folder):
    # From rest it slides the way it is pushed: friction acts against that from the first sample on.
    for push in (3.0, -3.0):
        rubs = "friction = { coefficient = 0.5, normal_force = 2 }"
        text = TABLE.replace("initial = { rate = 4 }", rubs).replace(
            '{ table = [[0, 5], [1, 7], [2, 4], [3, 6], [4, 5]], of = "shaft" }', str(push)
        )
        h = simulate(folder, text + output("F", "shaft", "friction_force") + output("a", "crank.spot", "acceleration"), "rubs")
        near(h["F"][0], -math.copysign(1.0, push), 1e-12, "friction at the start")
        near(h["a.y"][0], push - math.copysign(1.0, push), 1e-9, "acceleration at the start")


def heads(folder):
    simulate(folder, SPRING + output("v", "rail", "rate", 'description = "how fast the mass goes"'), "d")
    run("export", folder / "d.h5", "--to", "csv", "--head", "-o", folder / "head.csv")
    lines = (folder / "head.csv").read_text().splitlines()
    expect(lines[0] == "# t [s]: time" and lines[1] == "# v [m/s]: how fast the mass goes" and lines[2] == "t,v", f"head: {lines[:3]}")
    expect((folder / "d.csv").read_text().splitlines()[0] == "t,v", "the histories' first line stays the names")

    # As attributes of the values in the results file: a column each, many and long ones too.
    many = "".join(output(f"v{i}", "rail", "value", f'description = "{"a long word " * 40}{i}"') for i in range(200))
    simulate(folder, SPRING + output("v", "rail", "rate", 'description = "how fast the mass goes"') + many, "d")
    with h5py.File(folder / "d.h5") as file:
        values = file["outputs/values"]
        columns, units, descriptions = ([x.decode() for x in values.attrs[k]] for k in ("columns", "units", "descriptions"))
        expect(values.shape[1] == len(columns) == len(units) == len(descriptions) == 201, f"attributes of {len(columns)} columns")
        v = columns.index("v")
        expect((units[v], descriptions[v]) == ("m/s", "how fast the mass goes"), f"attributes: {units[v]}, {descriptions[v]}")
        expect(units[columns.index("v7")] == "m" and descriptions[columns.index("v7")].endswith(" 7"), "attributes of v7")
        expect([x.decode() for x in file["outputs/units"]] == units, "units as a dataset and as an attribute")
        named = []
        file.visititems(lambda name, x: named.append(name) if isinstance(x, h5py.Dataset) and x.dtype.kind == "f" else None)
        expect(all("meaning" in file[name].attrs for name in named), "numbers without a meaning")
    run("export", folder / "d.h5", "--to", "csv", "-o", folder / "many.csv")
    expect((folder / "many.csv").read_text().splitlines()[0].count(",v") == 201, "a results file with large attributes is read")


def workless(folder):
    """A force on the point that a joint holds feeds the body with nothing but rounding, whose error nobody asks for."""
    text = (
        simulation(0.5, output_rate=20, gravity=[-7.3, -1.8, -6.2])
        + rigid("bob", mass=0.7, inertia=[0.02, 0.021, 0.019], centre_of_mass=[-0.1, 0.11, 0.18], frames={"hook": [0.27, 0.003, -0.08]})
        + joint("knuckle", "universal", "ground", "bob.hook", axis=[1, 1, 0], initial={"value": [-0.64, -0.23], "rate": [1, -0.4]})
        + force("force", "bob.hook", name="press", direction=[-1.4, -0.3, 0.6], frame="body", value="3.4*cos(3.2*t + 0.2)")
        + output("power", "press", "power")
        + output("turn", "knuckle", "value")
    )
    (folder / "w.toml").write_text(text)
    said = run("simulate", folder / "w.toml", "--csv", folder / "w.csv").stdout
    expect("WARNING" not in said and " taken: " not in said, f"a force that does no work: {said}")
    near(max(map(abs, history(folder / "w.csv")["power"])), 0, 1e-14, "power of a force that does no work")


def coordinate_forces(folder):
    """Forces of springs and friction on a ball's coordinates are in the axes of its rate, the parent's; a driven joint has none."""
    k, c, mu, press, radius, v = 4.0, 0.6, 0.3, 5.0, 0.1, 0.4
    text = (
        simulation(0.5, output_rate=50, gravity=[0, 0, -G], tolerance=1e-8)
        + rigid("bob", mass=1, inertia=[0.02, 0.03, 0.04], frames={"top": [0.1, 0.2, 0.4]})
        + rigid("cart", mass=1)
        + joint(
            *("ball", "spherical", "ground", "bob.top"),
            rotation=[0.3, -0.2, 0.5],
            initial={"value": [0.4, 0.9, -0.7], "rate": [1, -2, 3]},
            spring={"stiffness": k, "damping": c},
            friction={"coefficient": mu, "normal_force": press, "radius": radius, "regularised": v},
        )
        + joint(
            *("rail", "prismatic", "ground", "cart"),
            motion="0.1 + t^2",
            spring={"stiffness": 7},
            stop={"upper": 0.2, "stiffness": 1000},
            friction={"coefficient": 0.1, "normal_force": 1},
        )
        + "".join(output(q, "ball", q) for q in ("value", "rate", "spring_force", "friction_force"))
        + "".join(output(f"rail_{q}", "rail", f"{q}_force") for q in ("spring", "stop", "friction"))
    )
    h = simulate(folder, text, "coordinates")
    for n in (0, 7, 25):
        rate = [h[f"rate.{x}"][n] for x in "xyz"]
        speed = math.hypot(*rate)
        for x, w in zip("xyz", rate):
            near(h[f"spring_force.{x}"][n], -k * h[f"value.{x}"][n] - c * w, 1e-9, f"sample {n}: the ball's spring, {x}")
            rub = -mu * press * radius * math.tanh(speed / v) * w / speed
            near(h[f"friction_force.{x}"][n], rub, 1e-9, f"sample {n}: the ball's friction, {x}")
    expect(not any(h["rail_spring"] + h["rail_stop"] + h["rail_friction"]), "a driven joint's spring, stop and friction have no effect")


def zero_displacements(folder):
    """The displacement of the frame from which it is measured is zero: said of the whole body's, not of its tip's."""
    text = CANTILEVER.replace("MODEL", "").replace("ROTATION", "")
    text += output("root", "rod", "displacement") + output("end", "rod.tip", "displacement")
    (folder / "zero.toml").write_text(text)
    said = run("simulate", folder / "zero.toml", "--csv", folder / "zero.csv").stdout
    h = history(folder / "zero.csv")
    expect(not any(h["root.y"]) and any(h["end.y"]), "the root moves from itself, or the tip does not")
    expect("root is zero all along: it is the displacement of 'root'" in said, f"nothing said of a zero output: {said}")
    expect("end is zero" not in said, f"said of the tip: {said}")


with tempfile.TemporaryDirectory() as name:
    here = pathlib.Path(name)
    for test in (
        sections,
        turned,
        sections_in_motion,
        forces,
        friction,
        holding_friction,
        tables,
        friction_at_the_start,
        frames,
        units,
        units_everywhere,
        times_with_units,
        parts_of_the_energy,
        energies_of_bodies,
        works_in_long_steps,
        works,
        coordinate_forces,
        workless,
        zero_displacements,
        errors,
        heads,
    ):
        print(f"-- {test.__name__}", flush=True)
        test(here)
finish()
