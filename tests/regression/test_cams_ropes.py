"""Cams, ropes, cables, points on curves, contact with profiles: the real program against closed formulas and own integrations."""
import math
import pathlib
import re

import numpy as np
from arrays import off
from arrays import simulate_and_say as simulate
from program import expect, finish, near, temporary_folder
from scene_text import joint
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

g = 9.81
turned_world = "rotation = [0.3, -0.5, 0.8]\n"


def own(rhs, start, times, **more):
    return solve_ivp(rhs, (0, times[-1]), start, t_eval=times, rtol=1e-11, atol=1e-13, **more).y


def simulation(duration, gravity="[0, -9.81, 0]", rate=100):
    return f"[simulation]\nduration = {duration}\noutput_rate = {rate}\ngravity = {gravity}\ntolerance = 1e-9\n"


def rigid(name, mass, inertia=0.01, more=""):
    return f'[[body]]\nname = "{name}"\nkind = "rigid"\nmass = {mass}\ninertia = [{inertia}, {inertia}, {inertia}]\n{more}\n'


def output(name, of=None, quantity="value", more=""):
    return f'[[output]]\nname = "{name}"\nof = "{of or name}"\nquantity = "{quantity}"\n{more}\n'


energy = output("E", "system", "energy")


def cams(folder):
    """A flywheel that lifts its follower: J phi'' + m y' (y'' + g) / phi' = 0, y = e (1 - cos phi)."""
    e, m, J, w0 = 0.02, 3.0, 0.05, 6.0
    times = np.arange(0, 2.001, 0.01)
    lift, slope, bend = (lambda p: e * (1 - np.cos(p))), (lambda p: e * np.sin(p)), (lambda p: e * np.cos(p))
    rhs = lambda t, y: [y[1], -m * slope(y[0]) * (bend(y[0]) * y[1] ** 2 + g) / (J + m * slope(y[0]) ** 2)]
    phi, w = own(rhs, [0, w0], times)
    acceleration = slope(phi) * np.array([rhs(0, [p, v])[1] for p, v in zip(phi, w)]) + bend(phi) * w**2
    angles = np.linspace(0, 2 * np.pi, 73)[:-1]
    table = ", ".join(f"[{a:.15g}, {lift(a):.15g}]" for a in angles)
    bodies = rigid("cam", 1, J) + rigid("follower", m)
    outs = output("shaft") + output("rail") + output("push", "cam and follower", "force") + energy
    for what, text, bound in (
        ("by an expression", f'"{e}*(1 - cos(angle))"', 1e-8),
        ("by a table", f'{{ table = [{table}], period = "360 deg" }}', 2e-7),
    ):
        coupling = f'[[coupling]]\nname = "cam and follower"\nkind = "cam"\njoints = ["shaft", "rail"]\nlift = {text}\n'
        for turn in ("", turned_world):
            down = "[0, -9.81, 0]"
            if turn:
                down = str(list(np.array([0, -g, 0]) @ Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix().T))
            joints = joint("shaft", "revolute", "ground", "cam", f"initial = {{ rate = {w0} }}\n{turn}")
            joints += joint("rail", "prismatic", "ground", "follower", f"axis = [0, 1, 0]\n{turn}")
            h = simulate(folder, simulation(2, down) + bodies + joints + coupling + outs)
            where = f"cam {what}{', turned world' if turn else ''}"
            off(h["shaft"], phi, 200 * bound, f"{where}: angle")
            off(h["rail"], lift(phi), 10 * bound, f"{where}: lift")
            off(h["push.2"], m * (acceleration + g), 3e5 * bound, f"{where}: force on the follower")
            off(h["E"], h["E"][0], 1e-6, f"{where}: energy")
    # Parent and child of the follower exchanged: it runs the other way along its axis.
    joints = joint("shaft", "revolute", "ground", "cam", f"initial = {{ rate = {w0} }}")
    base = rigid("base", 5) + joint("hold", "weld", "ground", "base")
    joints += base + joint("rail", "prismatic", "follower", "base", "axis = [0, -1, 0]")
    coupling = f'[[coupling]]\nname = "cam and follower"\nkind = "cam"\njoints = ["shaft", "rail"]\nlift = "{e}*(1 - cos(angle))"\n'
    h = simulate(folder, simulation(2) + bodies + joints + coupling + outs)
    off(h["rail"], lift(phi), 1e-7, "cam, parent and child of the follower exchanged")
    # Driven, a rocker as follower.
    driven = joint("shaft", "revolute", "ground", "cam", 'motion = "3*t"') + joint("rail", "revolute", "ground", "follower")
    h = simulate(folder, simulation(2) + bodies + driven + coupling + outs)
    off(h["rail"], lift(3 * h["t"]), 1e-10, "a driven cam with a rocker")
    # Beyond the end of a table without period the follower stands still: a warning says that the cam left its table.
    short = coupling.replace(f'"{e}*(1 - cos(angle))"', "{ table = [[0, 0], [1, 0.001], [2, 0.004], [3, 0.009]] }")
    says = simulate(folder, simulation(2) + bodies + driven + short + outs)["said"]
    expect("leaves the table of its lift" in says, f"a cam beyond its table: {says}")


def ropes(folder):
    """Atwood's machine, and the one whose lighter mass swings: (M + m) r'' = m r th'^2 + m g cos th - M g."""
    M, m = 3.0, 2.0
    rope = '[[coupling]]\nname = "rope"\nkind = "rope"\nthrough = %s\nlength = %.17g\n'
    ring = "[ground]\nframes = { left = [-0.4, 0, 0], right = [0.4, 0, 0] }\n"
    two = rigid("a", M) + rigid("b", m)
    joints = joint("down a", "prismatic", "ground", "a", "axis = [0, -1, 0]\nposition = [-0.4, 0, 0]\ninitial = { value = 1.5 }")
    joints += joint("down b", "prismatic", "ground", "b", "axis = [0, -1, 0]\nposition = [0.4, 0, 0]")
    outs = output("down a") + output("down b") + output("pull", "rope", "force") + energy
    h = simulate(
        folder, simulation(0.5) + ring + two + joints + rope % ('["a", "ground.left", "ground.right", "b"]', 1.5 + 0.8 + 1.5) + outs
    )
    fall = 0.5 * (M - m) / (M + m) * g * h["t"] ** 2
    off(h["down a"], 1.5 + fall, 1e-9, "Atwood's machine, way")
    off(h["pull"], 2 * M * m * g / (M + m), 1e-6, "Atwood's machine, pull")
    off(h["E"], h["E"][0], 1e-6, "Atwood's machine, energy")

    # The lighter mass swings, in the plane and turned out of it; it hangs on a free joint.
    r0, th0 = 1.2, 0.9
    times = np.arange(0, 2.001, 0.01)

    def rhs(t, y):
        r, v, th, w = y
        return [v, (m * r * w * w + m * g * math.cos(th) - M * g) / (M + m), w, (-2 * v * w - g * math.sin(th)) / r]

    r, v, th, w = own(rhs, [r0, 0, th0, 0], times)
    pull = M * (g - np.array([-rhs(0, y)[1] for y in zip(r, v, th, w)]))
    for axis in (np.array([1.0, 0, 0]), np.array([0.6, 0, 0.8])):
        at = np.array([0.4, 0, 0]) + r0 * (math.sin(th0) * axis + math.cos(th0) * np.array([0, -1, 0]))
        swinging = joint("down a", "prismatic", "ground", "a", "axis = [0, -1, 0]\nposition = [-0.4, 0, 0]\ninitial = { value = 1.5 }")
        swinging += joint("b flies", "free", "ground", "b", f"initial = {{ value = [{at[0]:.17g}, {at[1]:.17g}, {at[2]:.17g}, 0, 0, 0] }}")
        h = simulate(
            folder,
            simulation(2)
            + ring
            + two
            + swinging
            + rope % ('["a", "ground.left", "ground.right", "b"]', 1.5 + 0.8 + r0)
            + outs.replace(output("down b"), output("place", "b", "position")),
        )
        off(h["place.x"], 0.4 + axis[0] * r * np.sin(th), 1e-6, f"swinging Atwood's machine in the plane of {axis}, x")
        off(h["place.y"], -r * np.cos(th), 1e-6, f"swinging Atwood's machine in the plane of {axis}, y")
        off(h["pull"], pull, 1e-4, f"swinging Atwood's machine in the plane of {axis}, pull")
        off(h["E"], h["E"][0], 1e-6, f"swinging Atwood's machine in the plane of {axis}, energy")

    # A winch lifts a load in a block of two falls: half the rope's way, with half the pull.
    winch = "[ground]\nframes = { one = [-0.1, 2, 0], two = [0.1, 2, 0] }\n" + rigid(
        "load", 10, 0.01, "frames = { l = [-0.1, 0, 0], r = [0.1, 0, 0] }"
    )
    winch += rigid("drum", 1, 0.02) + joint("turn", "revolute", "ground", "drum", 'motion = "2*t^2"')
    winch += joint("up", "prismatic", "ground", "load", "axis = [0, 1, 0]")
    h = simulate(
        folder,
        simulation(1)
        + winch
        + rope % ('["ground.one", "load.l", "load.r", "ground.two"]', 4.2)
        + 'terms = [{ joint = "turn", factor = 0.1 }]\n'
        + output("up")
        + output("pull", "rope", "force")
        + output("torque", "turn", "reaction"),
    )
    off(h["up"], 0.05 * 2 * h["t"] ** 2, 1e-9, "a winch, way of the load")
    off(h["pull"], 10 * (g + 0.2) / 2, 1e-6, "a winch, pull")
    off(h["torque.mz"], 0.02 * 4 + 0.1 * h["pull"], 1e-6, "a winch, torque")
    # A rope cannot push.
    pushed = joint("down a", "prismatic", "ground", "a", "axis = [0, -1, 0]\nposition = [-0.4, 0, 0]\ninitial = { value = -1.5 }")
    says = simulate(folder, simulation(0.3) + ring + rigid("a", M) + pushed + rope % ('["a", "ground.left"]', 1.5) + output("down a"))[
        "said"
    ]
    expect("'rope' is pushed" in says, f"a rope that is pushed: {says}")
    # A mass that swings up past the top of its rope's circle is pushed there by m (g - L w^2), w by its energy.
    L, w0, m = 1.5, 2.7, 1.3
    top = m * (g - L * (w0**2 - 2 * g / L * (1 - math.cos(math.pi / 3))))
    start = f"value = [{-L * math.sin(math.pi / 3)!r}, {L * math.cos(math.pi / 3)!r}, 0]"
    rate = f"rate = [{L * w0 * math.cos(math.pi / 3)!r}, {L * w0 * math.sin(math.pi / 3)!r}, 0]"
    over = "[ground]\nframes = { hook = [0, 0, 0] }\n" + rigid("a", m)
    over += joint("free", "planar", "ground", "a", f"initial = {{ {start}, {rate} }}")
    over += rope % ('["a", "ground.hook"]', L)
    says = simulate(folder, simulation(1.2) + over + output("free"))["said"]
    told = re.search(r"'rope' is pushed.* with up to ([0-9.]+) N", says)
    expect(told is not None, f"a rope that is pushed in passing: {says}")
    near(float(told.group(1)) if told else 0.0, top, 1e-3 * top, "push of a rope in passing")


def cables(folder):
    """A jump on a cable, straight and over a pulley: m y'' = m g - k max(0, l - l0) - d l'."""
    m, k, d, l0 = 2.0, 400.0, 3.0, 1.0
    times = np.arange(0, 3.001, 0.01)

    def force(y, damped):
        return k * (y[0] - l0) + damped * y[1] if y[0] > l0 else 0.0

    for damped in (0.0, d):
        rhs = lambda t, y: [y[1], g - max(0.0, force(y, damped)) / m]
        way, rate = own(rhs, [0.5, 0], times, max_step=1e-3)
        for over in (False, True):
            cable = (
                f'[[force]]\nname = "cable"\nkind = "cable"\non = "jumper"\nstiffness = {k}\nrest = {l0 + 0.7 * over}\ndamping = {damped}\n'
            )
            cable += 'from = "ground.hook"\nthrough = ["ground.pulley"]\n' if over else 'from = "ground.pulley"\nthrough = []\n'
            text = "[ground]\nframes = { hook = [0.7, 0, 0], pulley = [0, 0, 0] }\n" + rigid("jumper", m)
            text += joint("fall", "prismatic", "ground", "jumper", "axis = [0, -1, 0]\ninitial = { value = 0.5 }")
            outs = output("fall") + output("pull", "cable", "force") + output("length", "cable", "length") + energy
            outs += output("work", "cable", "work")
            h = simulate(folder, simulation(3) + text + cable + outs)
            what = f"a jump on a cable{' over a pulley' if over else ''}, damping {damped}"
            off(h["fall"], way, 2e-6, f"{what}, way")
            off(h["pull"], [max(0.0, force(y, damped)) for y in zip(way, rate)], 2e-3, f"{what}, pull")
            off(h["length"], way + 0.7 * over, 2e-6, f"{what}, length")
            if damped == 0.0:
                off(h["E"], h["E"][0], 1e-6, f"{what}, energy")
            # What the cable does is what motion and weight gain.
            off(h["work"], 0.5 * m * rate**2 - m * g * (way - 0.5), 2e-5, f"{what}, work of the cable")


def curves(folder):
    """Beads on wires: the circle is a pendulum, the cycloid swings in 4 pi sqrt(R/g) whatever the amplitude."""
    R = 0.5
    times = np.arange(0, 3.001, 0.01)
    th, w = own(lambda t, y: [y[1], -g / R * math.sin(y[0])], [1.3, 0], times)
    circle = f'curve = {{ x = "{R}*sin(u)", y = "-{R}*cos(u)", to = "2*pi", closed = true }}\n'
    bead = rigid("bead", 0.3, 0)
    outs = output("wire") + output("place", "bead", "position") + output("reaction", "wire", "reaction") + energy
    h = simulate(
        folder,
        simulation(3) + bead + joint("wire", "point-on-curve", "ground", "bead", circle + f"initial = {{ value = {R * 1.3} }}") + outs,
    )
    off(h["wire"], R * th, 1e-6, "a bead on a circle, way")
    off(h["place.x"], R * np.sin(th), 1e-6, "a bead on a circle, x")
    radial = 0.3 * (R * w**2 + g * np.cos(th))
    off(np.hypot(h["reaction.x"], h["reaction.y"]), np.abs(radial), 1e-4, "a bead on a circle, reaction")
    off(h["E"], h["E"][0], 1e-7, "a bead on a circle, energy")
    # The same wire carried round by a turning body, gravity off: a bead at rest on the turning hoop keeps its speed in the world.
    cycloid = f'curve = {{ x = "{R}*(u + sin(u))", y = "-{R}*(1 + cos(u))", from = "-pi", to = "pi" }}\n'
    for start in (0.1, 1.5):
        # Way along the cycloid from its lowest point: 4 R sin(u/2); it is half as long again as that from its end.
        h = simulate(
            folder,
            simulation(3)
            + bead
            + joint("wire", "point-on-curve", "ground", "bead", cycloid + f"initial = {{ value = {4 * R + start} }}")
            + output("wire"),
        )
        off(h["wire"] - 4 * R, start * np.cos(np.sqrt(g / (4 * R)) * h["t"]), 2e-5, f"a bead on a cycloid, amplitude {start}")
    # Down a helix of 3 and of 95 turns: the same constant acceleration, however long the wire is.
    c = 0.5 / (2 * math.pi)
    for turns in (20, 600):
        wire = f'curve = {{ x = "{R}*cos(u)", y = "-{c}*u", z = "{R}*sin(u)", to = {turns} }}\ninitial = {{ value = 0.01 }}'
        h = simulate(folder, simulation(2) + bead + joint("wire", "point-on-curve", "ground", "bead", wire) + output("wire"))
        off(h["wire"], 0.01 + 0.5 * g * c / math.hypot(R, c) * h["t"] ** 2, 1e-5, f"a bead on a helix, u to {turns}")
    # A pin of a rod in a circular slot moves as on a crank: the four-bar with the slot's radius as its rocker.
    rod = rigid("crank", 1, 0.01, "frames = { end = [0.1, 0, 0] }") + rigid("rod", 1, 0.02, "frames = { end = [0.4, 0, 0] }")
    bar = joint("shaft", "revolute", "ground", "crank", 'motion = "4*t"') + joint(
        "pin", "revolute", "crank.end", "rod", "initial = { guess = 1.0 }"
    )
    slot = 'curve = { x = "0.3*cos(u)", y = "0.3*sin(u)", to = "2*pi", closed = true }\nposition = [0.35, 0, 0]\n'
    slotted = bar + joint("slot", "point-on-curve", "ground", "rod.end", slot)
    rocker = rigid("rocker", 1e-9, 1e-9, "frames = { end = [0.3, 0, 0] }")
    pinned = bar + rocker + joint("pivot", "revolute", "ground", "rocker", "position = [0.35, 0, 0]\ninitial = { guess = 1.5 }")
    pinned += joint("link", "revolute", "rod.end", "rocker.end")
    outs = output("pin") + output("torque", "shaft", "reaction")
    a = simulate(folder, simulation(2) + rod + slotted + outs)
    b = simulate(folder, simulation(2) + rod + pinned + outs)
    off(a["pin"], b["pin"], 1e-6, "a pin in a circular slot, angle of the rod")
    off(a["torque.mz"], b["torque.mz"], 1e-4, "a pin in a circular slot, torque of the crank")
    # Beyond the end of an open wire: a warning.
    says = simulate(
        folder,
        simulation(1)
        + bead
        + joint(
            "wire",
            "point-on-curve",
            "ground",
            "bead",
            "curve = { points = [[0, 0], [0.3, -0.1], [0.6, -0.4]] }\ninitial = { value = 0.01 }",
        )
        + output("wire"),
    )["said"]
    expect("runs beyond the end of its curve" in says, f"a bead beyond its wire: {says}")


def profiles(folder):
    """An eccentric disc under a roller, slow and so fast that the roller lifts off; own integration with the circle's exact distance."""
    e, R, roller, m, k = 0.02, 0.06, 0.015, 0.8, 2e5
    disc = f'curve = {{ x = "{e} + {R}*cos(u)", y = "{R}*sin(u)", to = "2*pi", closed = true }}\n'
    for speed, lifts in ((6.0, False), (35.0, True)):
        times = np.arange(0, 0.501, 0.005)

        def depth(t, y):
            x0, y0 = e * math.cos(speed * t), e * math.sin(speed * t)
            apart = math.hypot(x0, y - y0)
            return R + roller - apart, (y - y0) / apart

        def rhs(t, y):
            d, up = depth(t, y[0])
            return [y[1], -g + k * max(0.0, d) * up / m]

        start = math.sqrt((R + roller) ** 2 - e**2)
        way, rate = own(rhs, [start, e * speed], times, max_step=1e-4)
        gap = -min(depth(t, y)[0] for t, y in zip(times, way))
        expect((gap > 1e-4) == lifts, f"the roller at {speed} rad/s: a gap of {gap}")
        text = rigid("cam", 1) + rigid("follower", m) + joint("shaft", "revolute", "ground", "cam", f'motion = "{speed}*t"')
        text += joint(
            "rail", "prismatic", "ground", "follower", f"axis = [0, 1, 0]\ninitial = {{ value = {start:.17g}, rate = {e * speed} }}"
        )
        text += f'[[force]]\nname = "touch"\nkind = "contact"\non = "follower"\nfrom = "cam"\nshape = "sphere"\nradius = {roller}\n'
        text += f'against = "curve"\n{disc}stiffness = {k}\n'
        h = simulate(folder, simulation(0.5, rate=200) + text + output("rail") + output("force", "touch", "force"))
        off(h["rail"], way, 2e-6 if not lifts else 2e-5, f"a roller on an eccentric disc at {speed} rad/s")
        expect(not lifts or np.min(h["force"]) == 0.0, "a roller that has lifted off is not pressed")


def combined_outputs(folder):
    text = rigid("a", 2) + rigid("b", 3)
    text += joint("x", "prismatic", "ground", "a", "axis = [1, 0, 0]\ninitial = { rate = 1 }")
    text += joint("y", "prismatic", "ground", "b", "axis = [1, 0, 0]\ninitial = { value = 0.3 }")
    text += '[[force]]\nname = "push"\nkind = "force"\non = "a"\ndirection = [1, 0, 0]\nvalue = "3*cos(2*t)"\n'
    text += '[[block]]\nname = "lag"\nkind = "transfer-function"\ninput = "x"\nnumerator = [1]\ndenominator = [0.5, 1]\n'
    text += output("x") + output("y") + output("rate", "x", "rate") + output("lagging", "lag", "output") + output("done", "push", "work")
    text += '[[output]]\nname = "apart"\nexpression = "x - y"\nunit = "m"\n'
    text += '[[output]]\nname = "square"\nexpression = "apart^2 + 0*t + 2*rate"\ndescription = "made up"\n'
    h = simulate(folder, simulation(2) + text)
    t = h["t"]
    v = 1 + 0.75 * np.sin(2 * t)
    x = t + 0.375 * (1 - np.cos(2 * t))
    off(h["apart"], h["x"] - h["y"], 0, "an expression of outputs")
    off(h["square"], h["apart"] ** 2 + 2 * h["rate"], 1e-15, "an expression of an expression")
    off(h["done"], v**2 - 1, 1e-7, "work of a force")
    y = own(lambda s, z: [(s + 0.375 * (1 - math.cos(2 * s)) - z[0]) / 0.5], [0], t)[0]
    off(h["x"], x, 1e-8, "way")
    off(h["lagging"], y, 1e-7, "output of a block")
    # Blocks in groups: each copy has its own.
    group = '[[group]]\nname = "cart"\nparameters = { k = 1.0 }\n'
    for table in (
        rigid("a", 2),
        joint("x", "prismatic", "ground", "a", "axis = [1, 0, 0]\ninitial = { value = 0.5 }"),
        output("place", "x"),
    ):
        group += table.replace("[[", "[[group.")
    group += '[[group.block]]\nname = "pd"\nkind = "transfer-function"\ninput = "place"\nnumerator = ["-2*k"]\ndenominator = [1]\n'
    group += '[[group.force]]\nkind = "force"\non = "a"\ndirection = [1, 0, 0]\nvalue = "pd"\n'
    text = group + '[[instance]]\ngroup = "cart"\nname = "c"\ncount = 2\nparameters = { k = "i" }\n' + output("made", "c2:pd", "output")
    h = simulate(folder, simulation(2) + text)
    for i in (1, 2):
        off(h[f"c{i}:place"], 0.5 * np.cos(math.sqrt(i) * h["t"]), 1e-7, f"a block in a group, copy {i}")
    off(h["made"], -4 * h["c2:place"], 1e-12, "output of a block in a group")


def wrong_words(folder):
    text = (
        simulation(1) + rigid("a", 1) + rigid("b", 1) + joint("one", "revolute", "ground", "a") + joint("two", "prismatic", "ground", "b")
    )
    for more, words in (
        ('[[coupling]]\nname = "c"\nkind = "cam"\njoints = ["one", "two"]', ("key 'lift'", "scene.toml:")),
        ('[[coupling]]\nname = "c"\nkind = "cam"\njoints = ["one", "two"]\nlift = "0.1*abs(angle)"', ("key 'lift'", "corners")),
        ('[[coupling]]\nname = "c"\nkind = "cam"\njoints = ["one", "two"]\nlift = "0.1*t"', ("not of t",)),
        ('[[coupling]]\nname = "c"\nkind = "cam"\njoints = ["one", "two"]\nlift = "0.1*way"', ("key 'lift'", "expression of angle")),
        ('[[coupling]]\nname = "c"\nkind = "cam"\njoints = ["one", "two"]\nlift = "0.1"', ("does not depend on angle",)),
        ('[[coupling]]\nname = "c"\nkind = "cam"\njoints = ["one", "two"]\nlift = { table = [[0, 1], [0, 2]] }', ("key 'lift.table'",)),
        ('[[coupling]]\nname = "c"\nkind = "rope"\nlength = 1\nthrough = ["a"]', ("key 'through'", "at least 2 frames")),
        ('[[coupling]]\nname = "c"\nkind = "rope"\nlength = 1\nthrough = ["a", "bb"]', ("key 'through'", "'bb'")),
        ('[[coupling]]\nname = "c"\nkind = "rope"\nthrough = ["a", "b"]', ("key 'length'",)),
        ('[[force]]\nkind = "cable"\non = "a"\nstiffness = 1', ("key 'rest'", "greater than 0")),
        ('[[force]]\nkind = "cable"\non = "a"\nrest = 1', ("key 'stiffness'",)),
        ('[[force]]\nkind = "cable"\non = "a"\nrest = 1\nstiffness = 1\npreload = 3', ("key 'preload' is unknown",)),
        (joint("c", "point-on-curve", "ground", "b"), ("key 'curve'",)),
        (joint("c", "point-on-curve", "ground", "b", "curve = { points = [[0, 0]] }"), ("key 'curve'", "2 points or more")),
        (joint("c", "point-on-curve", "ground", "b", "curve = { points = [[0, 0], [0, 0]] }"), ("points 1 and 2 are one",)),
        (joint("c", "point-on-curve", "ground", "b", 'curve = { x = "u", y = "u", closed = true }'), ("key 'curve.closed'", "m apart")),
        (joint("c", "weld", "ground", "b", "curve = { points = [[0, 0], [1, 0]] }"), ("belongs to joints of kind 'point-on-curve'",)),
        (
            '[[force]]\nkind = "contact"\non = "a"\nshape = "sphere"\nradius = 1\nagainst = "curve"\nstiffness = 1\n'
            "curve = { points = [[1, 0], [0.2, 0.2], [0, 1], [-0.2, 0.2], [-1, 0], [-0.2, -0.2], [0, -1], [0.2, -0.2]], closed = true }",
            ("key 'radius'", "hollow"),
        ),
        ('[[output]]\nname = "o"\nexpression = "nothing + 1"', ("output 'o'", "'nothing'")),
        ('[[output]]\nname = "o"\nexpression = 3', ("key 'expression'",)),
        ('[[output]]\nname = "o"\nexpression = "1"\nquantity = "value"', ("key 'quantity' is unknown",)),
        ('[[output]]\nname = "o"\nof = "pd"\nquantity = "output"', ("must be a block",)),
        ('[[output]]\nname = "o"\nof = "one"\nquantity = "work"', ("must be a force with a 'name'",)),
    ):
        says = simulate(folder, text + more + "\n", code=2)
        for word in words:
            expect(word in says, f"{more!r}: '{word}' is not in: {says}")


with temporary_folder() as folder:
    for part in (cams, ropes, cables, curves, profiles, combined_outputs, wrong_words):
        part(pathlib.Path(folder))
finish()
