"""Linkages of the textbooks assembled and run from guesses of two and three digits, compared with circles that meet (compass and ruler)."""
import math
import pathlib
import re

from program import expect, finish, history, near, run, source, temporary_folder
from scene_text import body, joint, output, rigid, simulation


def meet(a, ra, b, rb, side):
    """Where the circles of radius ra about a and rb about b meet; side 1: left of the way from a to b, -1: right of it."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    d = math.hypot(dx, dy)
    along = (ra * ra - rb * rb + d * d) / (2 * d)
    beside = side * math.sqrt(ra * ra - along * along)
    return (a[0] + (along * dx - beside * dy) / d, a[1] + (along * dy + beside * dx) / d)


def direction(a, b):
    return math.atan2(b[1] - a[1], b[0] - a[0])


class Scene:
    """Links in the plane z = 0, each with its frames; joints turn about z. Angles are rounded as a user would write them."""

    def __init__(self, duration=0.2, digits=2):
        self.text = f"[simulation]\nduration = {duration}\noutput_rate = 500\ntolerance = 1e-8\n"
        self.ground, self.bodies, self.joints, self.outputs = {}, "", "", ""
        self.digits = digits
        self.turn = {"ground": 0.0}

    def link(self, name, turn, **frames):
        self.turn[name] = turn
        places = ", ".join(f"{key} = [{x}, {y}, 0]" for key, (x, y) in frames.items())
        self.bodies += f'[[body]]\nname = "{name}"\nkind = "rigid"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\nframes = {{ {places} }}\n'

    def pin(self, parent, child, drive=None, guess=True):
        turn = self.turn[child.split(".")[0]] - self.turn[parent.split(".")[0]]
        turn = math.remainder(turn, 2 * math.pi)
        name = f"{parent}-{child}".replace(".", "_")
        self.joints += f'[[joint]]\nname = "{name}"\nkind = "revolute"\nparent = "{parent}"\nchild = "{child}"\n'
        if drive is not None:
            self.joints += f'motion = "{drive}"\n'
        elif guess:
            self.joints += f"initial = {{ guess = {round(turn, self.digits)} }}\n"

    def see(self, frame):
        self.outputs += f'[[output]]\nname = "{frame.replace(".", "_")}"\nof = "{frame}"\nquantity = "position"\n'

    def run(self, folder):
        frames = ", ".join(f"{key} = [{x}, {y}, 0]" for key, (x, y) in self.ground.items())
        scene = folder / "scene.toml"
        scene.write_text(f"{self.text}[ground]\nframes = {{ {frames} }}\n{self.bodies}{self.joints}{self.outputs}")
        run("simulate", scene, "-o", folder / "r.h5", "--csv", folder / "h.csv")
        return history(folder / "h.csv")


def started(folder, text):
    (folder / "scene.toml").write_text(text)
    run("simulate", folder / "scene.toml", "-o", folder / "r.h5", "--csv", folder / "h.csv")
    return history(folder / "h.csv")


def starts_straight(folder, model):
    """A four-bar from guesses of two digits, its crank turning at once: its beam is straight and turns as a rigid rod when it starts."""
    a, b, c, d, turn, rate = 0.1, 0.35, 0.25, 0.4, 0.8, 20.0
    pin = (a * math.cos(turn), a * math.sin(turn))
    end = meet(pin, b, (d, 0), c, 1)
    coupler, rocker = direction(pin, end), direction((d, 0), end)
    text = (
        simulation(0.002, output_rate=2000, tolerance=1e-8)
        + rigid("crank", mass=1, inertia=[0.1] * 3, frames={"end": [a, 0, 0]})
        + rigid("rocker", mass=1, inertia=[0.1] * 3, frames={"end": [c, 0, 0]})
        + body(
            "rod",
            "beam",
            length=b,
            section={"shape": "rectangle", "width": 0.01, "height": 0.01},
            material={"density": 7850, "youngs_modulus": 2.1e11},
            model=model,
        )
        + joint("drive", "revolute", "ground", "crank", motion=f"{turn} + {rate}*t")
        + joint("pin", "revolute", "crank.end", "rod.root", initial={"guess": round(coupler - turn, 2)})
        + joint("hinge", "revolute", "ground", "rocker", position=[d, 0, 0], initial={"guess": round(rocker, 2)})
        + joint("eye", "revolute", "rod.tip", "rocker.end", initial={"guess": round(rocker - coupler, 2)})
        + output("strain", "system", "strain")
        + output("kinetic", "system", "kinetic")
    )
    columns = started(folder, text)
    # The velocity of the rod's tip, along the rod as that of its root and across the rocker.
    root = (-rate * pin[1], rate * pin[0])
    u, across = (math.cos(coupler), math.sin(coupler)), (-math.sin(rocker), math.cos(rocker))
    speed = (root[0] * u[0] + root[1] * u[1]) / (across[0] * u[0] + across[1] * u[1])
    tip = (speed * across[0], speed * across[1])
    # m/6 (v1^2 + v1 v2 + v2^2) of an even rod.
    rod = 7850 * b * 0.01**2 / 6 * sum(p * p + p * q + q * q for p, q in zip(root, tip))
    whole = rod + 0.05 * rate**2 + 0.05 * (speed / c) ** 2
    near(columns["kinetic"][0], whole, 1e-3 * rod, f"kinetic energy at the start, {model}")
    near(columns["strain"][0], 0.0, 1e-9 * whole, f"strain energy at the start, {model}")


def compare(h, frame, place, bound, what):
    """place(t): where the frame is."""
    worst = 0.0
    for k, t in enumerate(h["t"]):
        x, y = place(t)
        worst = max(worst, math.hypot(h[frame + ".x"][k] - x, h[frame + ".y"][k] - y))
    near(worst, 0.0, bound, what)


def jansen(folder):
    # Theo Jansen's leg with his eleven numbers, cm to dm.
    m, j, b, k, c, e, d, f, g, h, i = (x / 10 for x in (15, 50, 41.5, 61.9, 39.3, 55.8, 40.1, 39.4, 36.7, 65.7, 49.0))
    o, z = (0.0, 0.0), (-3.8, -0.78)
    speed, start = 3.0, 1.1

    def points(t):
        a = start + speed * t
        crank = (m * math.cos(a), m * math.sin(a))
        upper = meet(z, b, crank, j, 1)
        top = meet(z, d, upper, e, 1)
        lower = meet(z, c, crank, k, -1)
        knee = meet(top, f, lower, g, -1)
        foot = meet(knee, h, lower, i, -1)
        return crank, upper, top, lower, knee, foot

    crank, upper, top, lower, knee, foot = points(0.0)
    s = Scene()
    s.ground = {"o": o, "z": z}

    def own(origin, along, point):
        """A point in the axes of a link from `origin` towards `along`."""
        turn = direction(origin, along)
        dx, dy = point[0] - origin[0], point[1] - origin[1]
        return (dx * math.cos(turn) + dy * math.sin(turn), -dx * math.sin(turn) + dy * math.cos(turn))

    s.link("crank", start, tip=(m, 0))
    s.link("j", direction(crank, upper), tip=(j, 0))
    s.link("shoulder", direction(z, upper), upper=(b, 0), top=own(z, upper, top))
    s.link("k", direction(crank, lower), tip=(k, 0))
    s.link("c", direction(z, lower), tip=(c, 0))
    s.link("f", direction(top, knee), tip=(f, 0))
    s.link("leg", direction(lower, knee), knee=(g, 0), foot=own(lower, knee, foot))
    s.pin("ground.o", "crank", drive=f"{start} + {speed}*t")
    s.pin("crank.tip", "j")
    s.pin("ground.z", "shoulder")
    s.pin("crank.tip", "k")
    s.pin("ground.z", "c")
    s.pin("shoulder.top", "f")
    s.pin("c.tip", "leg")
    s.pin("j.tip", "shoulder.upper", guess=False)
    s.pin("k.tip", "c.tip", guess=False)
    s.pin("f.tip", "leg.knee", guess=False)
    s.see("leg.foot")
    compare(s.run(folder), "leg_foot", lambda t: points(t)[5], 1e-6, "Jansen's leg, foot")


def watt(folder):
    # Watt's straight-line linkage: the middle of the coupler.
    a, b, c, span = 1.0, 0.6, 1.0, (2.0, 0.6)
    start, speed = 0.12, -0.8

    def points(t):
        p = (a * math.cos(start + speed * t), a * math.sin(start + speed * t))
        return p, meet(p, b, span, c, -1)

    p, q = points(0.0)
    s = Scene()
    s.ground = {"left": (0, 0), "right": span}
    s.link("left", start, tip=(a, 0))
    s.link("coupler", direction(p, q), tip=(b, 0), middle=(b / 2, 0))
    s.link("right", direction(span, q), tip=(c, 0))
    s.pin("ground.left", "left", drive=f"{start} + {speed}*t")
    s.pin("left.tip", "coupler")
    s.pin("ground.right", "right")
    s.pin("coupler.tip", "right.tip", guess=False)
    s.see("coupler.middle")

    def middle(t):
        p, q = points(t)
        return (p[0] + q[0]) / 2, (p[1] + q[1]) / 2

    compare(s.run(folder), "coupler_middle", middle, 1e-7, "Watt's linkage, middle of the coupler")


def stephenson(folder):
    # Stephenson III: a four-bar whose coupler point carries a dyad to the ground.
    crank, coupler, rocker, base = 0.4, 1.2, 0.9, (1.3, 0.0)
    point, dyad, swing, far = (0.5, 0.6), 1.4, 0.9, (1.6, 1.3)
    start, speed = 0.7, 4.0

    def points(t):
        a = start + speed * t
        p = (crank * math.cos(a), crank * math.sin(a))
        q = meet(p, coupler, base, rocker, 1)
        turn = direction(p, q)
        r = (p[0] + point[0] * math.cos(turn) - point[1] * math.sin(turn), p[1] + point[0] * math.sin(turn) + point[1] * math.cos(turn))
        return p, q, r, meet(r, dyad, far, swing, 1)

    p, q, r, u = points(0.0)
    s = Scene(duration=1.0)
    s.ground = {"a": (0, 0), "b": base, "c": far}
    s.link("crank", start, tip=(crank, 0))
    s.link("coupler", direction(p, q), tip=(coupler, 0), point=point)
    s.link("rocker", direction(base, q), tip=(rocker, 0))
    s.link("dyad", direction(r, u), tip=(dyad, 0))
    s.link("swing", direction(far, u), tip=(swing, 0))
    s.pin("ground.a", "crank", drive=f"{start} + {speed}*t")
    s.pin("crank.tip", "coupler")
    s.pin("ground.b", "rocker")
    s.pin("coupler.point", "dyad")
    s.pin("ground.c", "swing")
    s.pin("coupler.tip", "rocker.tip", guess=False)
    s.pin("dyad.tip", "swing.tip", guess=False)
    s.see("swing.tip")
    compare(s.run(folder), "swing_tip", lambda t: points(t)[3], 1e-6, "Stephenson's linkage, rocker of the dyad")


def quick_return(folder):
    # Whitworth: a slotted lever about the origin, driven by a crank whose centre lies above it. The block slides along the lever.
    crank, height, lever, speed, start = 0.2, 0.35, 0.8, 5.0, 0.4

    def angle(t):
        return math.atan2(height + crank * math.sin(start + speed * t), crank * math.cos(start + speed * t))

    s = Scene(duration=1.5)
    s.ground = {"lever": (0, 0), "crank": (0, height)}
    s.link("lever", angle(0.0), tip=(lever, 0))
    s.link("crank", start, tip=(crank, 0))
    s.link("block", angle(0.0))
    s.pin("ground.crank", "crank", drive=f"{start} + {speed}*t")
    s.pin("ground.lever", "lever")
    distance = math.hypot(crank * math.cos(start), height + crank * math.sin(start))
    s.joints += '[[joint]]\nname = "slot"\nkind = "prismatic"\nparent = "lever"\nchild = "block"\naxis = [1, 0, 0]\n'
    s.joints += f"initial = {{ guess = {round(distance, 2)} }}\n"
    s.pin("crank.tip", "block", guess=False)
    s.see("lever.tip")
    place = lambda t: (lever * math.cos(angle(t)), lever * math.sin(angle(t)))
    compare(s.run(folder), "lever_tip", place, 1e-6, "quick return, end of the lever")


def stewart(folder):
    # A platform on six legs, each on a universal joint, sliding out as a motion says, ending in a ball joint: the lengths that a pose asks
    # for give that pose. Straight up by 0.15 sin^2.
    base = [(math.cos(a), math.sin(a)) for a in (math.radians(x) for x in (10, 110, 130, 230, 250, 350))]
    top = [(0.6 * math.cos(a), 0.6 * math.sin(a)) for a in (math.radians(x) for x in (50, 70, 170, 190, 290, 310))]
    height, duration = 1.1, 0.3
    text = f"[simulation]\nduration = {duration}\noutput_rate = 200\ntolerance = 1e-9\n"
    frames = ", ".join(f"b{k} = [{x}, {y}, 0]" for k, (x, y) in enumerate(base))
    text += f"[ground]\nframes = {{ {frames} }}\n"
    frames = ", ".join(f"t{k} = [{x}, {y}, 0]" for k, (x, y) in enumerate(top))
    text += f'[[body]]\nname = "platform"\nkind = "rigid"\nmass = 20\ninertia = [1, 1, 2]\nframes = {{ {frames} }}\n'
    joints = '[[joint]]\nname = "pose"\nkind = "free"\nparent = "ground"\nchild = "platform"\n'
    joints += f"initial = {{ guess = [0, 0, {height}, 0, 0, 0] }}\n"
    for k in range(6):
        flat = (top[k][0] - base[k][0], top[k][1] - base[k][1])
        for part in ("lower", "upper"):
            text += f'[[body]]\nname = "{part}{k}"\nkind = "rigid"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\n'
        # The leg's z axis leans towards the platform's joint: first about x, then about the new y.
        length = math.sqrt(flat[0] ** 2 + flat[1] ** 2 + height**2)
        about_x = math.atan2(-flat[1], height)
        about_y = math.asin(flat[0] / length)
        joints += f'[[joint]]\nname = "foot{k}"\nkind = "universal"\nparent = "ground.b{k}"\nchild = "lower{k}"\naxis = [1, 0, 0]\n'
        joints += f"initial = {{ guess = [{round(about_x, 1)}, {round(about_y, 1)}] }}\n"
        motion = f"sqrt({flat[0] ** 2 + flat[1] ** 2!r} + ({height} + 0.15*sin(5*t)^2)^2)"
        joints += f'[[joint]]\nname = "slide{k}"\nkind = "prismatic"\nparent = "lower{k}"\nchild = "upper{k}"\nmotion = "{motion}"\n'
        joints += f'[[joint]]\nname = "ball{k}"\nkind = "spherical"\nparent = "upper{k}"\nchild = "platform.t{k}"\n'
    text += joints + '[[output]]\nname = "place"\nof = "platform"\nquantity = "position"\n'
    scene = folder / "stewart.toml"
    scene.write_text(text)
    run("simulate", scene, "-o", folder / "r.h5", "--csv", folder / "h.csv")
    h = history(folder / "h.csv")
    worst = max(
        math.sqrt(h["place.x"][k] ** 2 + h["place.y"][k] ** 2 + (h["place.z"][k] - height - 0.15 * math.sin(5 * t) ** 2) ** 2)
        for k, t in enumerate(h["t"])
    )
    near(worst, 0.0, 1e-6, "Stewart platform, its place")


def far_pins(folder):
    """Loops whose last joint has coordinates of its own and starts far from zero: a four-bar that rubs, links with any axes; a ball."""
    crank, coupler, rocker, base, turn = 0.3, 0.9, 0.8, 1.0, 1.2
    b = (crank * math.cos(turn), crank * math.sin(turn))
    c = meet(b, coupler, (base, 0.0), rocker, 1)
    rubbing = {"coefficient": 0.1, "normal_force": 1, "radius": 0.01}
    for first, second in ((0.0, 0.0), (1.0, -2.0), (-1.0, 1.9), (2.9, -0.1)):
        text = simulation(0.01, output_rate=100)
        axes = {"ground": 0.0, "crank": turn, "coupler": first, "rocker": second}
        for name, length, way in (
            ("crank", crank, turn),
            ("coupler", coupler, direction(b, c)),
            ("rocker", rocker, direction((base, 0.0), c)),
        ):
            end = [length * math.cos(way - axes[name]), length * math.sin(way - axes[name]), 0]
            text += rigid(name, mass=1, inertia=[0.1, 0.1, 0.1], frames={"end": end})
        for parent, child, x in (("ground", "crank", 0), ("crank.end", "coupler", 0), ("ground", "rocker", base)):
            start = axes[child] - axes[parent.split(".")[0]]
            text += joint(child, "revolute", parent, child, position=[x, 0, 0], friction=rubbing, initial={"value": start})
        text += joint("last", "revolute", "coupler.end", "rocker.end", friction=rubbing) + output("pin", "last", "value")
        near(started(folder, text)["pin"][0], math.remainder(second - first, 2 * math.pi), 1e-6, f"last pin, axes at {first}, {second}")
    # Angles that are left open lie within half a turn, whichever way round the search for them went.
    start = rigid("a", mass=1, inertia=[0.1, 0.1, 0.1], frames={"end": [-0.5, 0.6, 0]})
    for at in range(12):
        way = 0.5236 * at
        text = simulation(0.01, output_rate=100) + start
        text += rigid("b", mass=1, inertia=[0.1, 0.1, 0.1], frames={"end": [0.8 * math.cos(way), 0.8 * math.sin(way), 0]})
        text += rigid("c", mass=1, inertia=[0.1, 0.1, 0.1], frames={"end": [0.9, 0, 0]})
        text += joint("p", "revolute", "ground", "a", initial={"value": 1.6}) + joint("q", "revolute", "a.end", "b")
        text += joint("r", "revolute", "b.end", "c.end") + joint("s", "revolute", "ground", "c", position=[1, -0.2, 0])
        text += "".join(output(f"{name}v", name, "value") for name in "qrs")
        h = started(folder, text)
        expect(all(abs(h[f"{name}v"][0]) <= math.pi + 1e-9 for name in "qrs"), f"open angles, {way}: {[h[f'{n}v'][0] for n in 'qrs']}")
    # A body held by a hinge and a ball, which has a value; the ball's frame on the ground is turned by half a turn less 0.2 about x.
    text = (
        simulation(0.01, output_rate=100)
        + rigid("arm", mass=1, inertia=[0.1, 0.1, 0.1], frames={"end": [0.5, 0, 0]})
        + joint("hinge", "revolute", "ground", "arm", initial={"value": 0.0})
        + joint("ball", "spherical", "ground", "arm.end", position=[0.5, 0, 0], rotation=[math.pi - 0.2, 0, 0])
        + output("turn", "ball", "value")
    )
    near(started(folder, text)["turn.x"][0], 0.2 - math.pi, 1e-6, "a ball's turn")


def many_turns(folder):
    """A parallelogram that turns by 33 rad from sample to sample, its angles and rotation; wound springs on its pins, its motor."""
    speed, k, wound = 100.0, 0.7, 5.0
    spring = {"stiffness": k, "rest": wound}
    for rate, springs in ((3, {}), (3, {"spring": spring})):
        text = simulation(2, output_rate=rate)
        for name, end in (("crank", [1, 0, 0]), ("coupler", [0, 1, 0]), ("rocker", [1, 0, 0])):
            text += rigid(name, mass=1, inertia=[0.1, 0.1, 0.1], frames={"end": end})
        text += joint("a", "revolute", "ground", "crank", motion=f"{speed}*t")
        text += joint("b", "revolute", "crank.end", "coupler", **springs) + joint("c", "revolute", "coupler.end", "rocker.end", **springs)
        text += joint("d", "revolute", "ground", "rocker", position=[0, 1, 0], **springs)
        text += "".join(output(name, name, "value") for name in "abcd")
        text += output("turn", "rocker", "rotation") + output("motor", "a", "reaction")
        text += output("seen", "coupler", "rotation", relative_to="rocker")
        h = started(folder, text)
        for i, t in enumerate(h["t"]):
            angle = speed * t
            for name, sign in zip("abcd", (1, -1, 1, 1)):
                near(h[name][i], sign * angle, 1e-6 * max(angle, 1), f"{len(springs)} springs, t = {t:.3g}: angle of {name}")
            near(h["turn.z"][i], angle, 1e-6 * max(angle, 1), f"t = {t:.3g}: rotation of the rocker")
            near(h["seen.z"][i], -angle, 1e-6 * max(angle, 1), f"t = {t:.3g}: the coupler seen from the rocker")
            # Kinetic energy is constant: the motor works against the springs alone.
            if springs:
                near(h["motor.mz"][i], k * ((angle + wound) + 2 * (angle - wound)), 1e-4, f"t = {t:.3g}: the motor's moment")
    # Through a universal joint nothing counts them: told.
    text = simulation(0.2, output_rate=20)
    text += rigid("first", mass=1, inertia=[0.1, 0.1, 0.1]) + rigid("second", mass=1, inertia=[0.1, 0.1, 0.1])
    text += joint("drive", "revolute", "ground", "first", motion=f"{speed}*t")
    text += joint("cross", "universal", "first", "second", axis=[1, 0, 0], rotation=[0.5, 0, 0])
    text += joint("bearing", "revolute", "ground", "second", rotation=[0.5, 0, 0]) + output("out", "bearing", "value")
    (folder / "cross.toml").write_text(text)
    said = run("simulate", folder / "cross.toml", "--csv", folder / "h.csv").stdout
    expect("whole turns" in said, f"a shaft behind a universal joint, few samples: {said}")


def rubbing_slot(folder):
    """A block that slides down a slot, rubbed by what presses it across the slot."""
    slope, coefficient, g, mass = math.pi / 6, 0.5, 9.81, 2
    text = simulation(0.5, output_rate=20, gravity=[0, -g, 0]) + rigid("block", mass=mass, inertia=[0.1, 0.1, 0.1])
    friction = {"coefficient": coefficient, "normal_force": "reaction", "radius": 1e-6}
    text += joint("slot", "pin-slot", "ground", "block", rotation=[0, 0, -slope], friction=friction)
    text += output("way", "slot", "value") + output("rubs", "slot", "friction_force")
    (folder / "slot.toml").write_text(text)
    run("simulate", folder / "slot.toml", "--csv", folder / "h.csv", "--no-error-estimate")
    h = history(folder / "h.csv")
    way, rubs = (next(column for column in h if column.startswith(name)) for name in ("way", "rubs"))
    down = g * (math.sin(slope) - coefficient * math.cos(slope))
    for k, t in enumerate(h["t"]):
        near(h[way][k], 0.5 * down * t * t, 1e-6, f"slot, t = {t:.3g}: way")
        if k > 0:
            near(h[rubs][k], -coefficient * mass * g * math.cos(slope), 1e-6, f"slot, t = {t:.3g}: friction")


def sprung_loop(folder):
    """The guide of a slider-crank closes its loop and has a spring: its reaction contains that, as it would within a tree."""
    crank, rod, stiffness, rest, turn = 0.1, 0.3, 500.0, 0.5, 0.7
    lean = math.asin(crank * math.sin(turn) / rod)
    slide = crank * math.cos(turn) + rod * math.cos(lean)
    text = simulation(0.01, output_rate=200)
    text += rigid("crank", mass=1, inertia=[0.1, 0.1, 0.1], frames={"end": [crank, 0, 0]})
    text += rigid("rod", mass=1, inertia=[0.1, 0.1, 0.1], frames={"end": [rod, 0, 0]})
    text += rigid("piston", mass=1, inertia=[0.1, 0.1, 0.1])
    text += joint("guide", "prismatic", "ground", "piston", axis=[1, 0, 0], spring={"stiffness": stiffness, "rest": rest})
    text += joint("shaft", "revolute", "ground", "crank", motion=str(turn))
    rubbing = {"coefficient": 0.1, "normal_force": 0, "radius": 0.01}
    text += joint("wrist", "revolute", "rod.end", "piston", initial={"guess": lean}, friction=rubbing)
    text += joint("big end", "revolute", "crank.end", "rod", initial={"guess": -turn - lean}, friction=rubbing)
    for name in ("guide", "wrist", "shaft"):
        text += output(name, name, "reaction")
    (folder / "sprung.toml").write_text(text)
    run("simulate", folder / "sprung.toml", "--csv", folder / "h.csv", "--no-error-estimate")
    h = history(folder / "h.csv")
    push = stiffness * (rest - slide)
    near(h["guide.x"][0], push, 1e-6 * abs(push), "the guide's force along it, its spring")
    near(h["wrist.x"][0], -push, 1e-6 * abs(push), "the wrist holds against the spring")
    near(h["guide.y"][0], -h["wrist.y"][0], 1e-6 * abs(push), "the guide across it")
    near(h["shaft.x"][0], -push, 1e-6 * abs(push), "the shaft holds against the spring")


def rates_of_rounding(folder):
    """A slider-crank whose given rates are what a program made of zero starts from rest; rates that do contradict are refused."""
    crank, rod, turn = 0.1, 0.3, 0.7
    lean = math.asin(crank * math.sin(turn) / rod)
    for given, code in ((-2.7e-17, 0), (-2.7e-3, 2)):
        text = simulation(0.5, output_rate=20, gravity=[0, -9.81, 0])
        text += rigid("crank", mass=1, inertia=[0.1, 0.1, 0.1], frames={"end": [crank, 0, 0]})
        text += rigid("rod", mass=1, inertia=[0.1, 0.1, 0.1], frames={"end": [rod, 0, 0]})
        text += rigid("piston", mass=1, inertia=[0.1, 0.1, 0.1])
        text += joint("shaft", "revolute", "ground", "crank", initial={"value": turn, "rate": 1e-16})
        text += joint("big end", "revolute", "crank.end", "rod", initial={"value": -turn - lean, "rate": given})
        text += joint("guide", "prismatic", "ground", "piston", axis=[1, 0, 0], initial={"rate": 3e-16})
        text += joint("wrist", "revolute", "rod.end", "piston", initial={"rate": 0})
        (folder / "rates.toml").write_text(text)
        done = run("simulate", folder / "rates.toml", "--csv", folder / "h.csv", "--no-error-estimate", code=code)
        expect(("contradict the loop" in done.stderr) == (code == 2), f"rate {given}: {done.stderr}")


def thin_coupler(folder):
    """Crank and rocker about crossed axes with a thin rod between balls, which turns about itself without inertia: the rocker's angle by
    the cosine law in its plane, the crank's rate by the kinetic energy, a rod's that of m/6 at both ends and 2m/3 in the middle."""
    crank, rocker, base, rod, mass = 0.1, 0.4, (0.5, 0.05, 0.1), 0.55, 2.0

    def ends(turn):
        # The rocker's end is base + rocker (cos p, 0, sin p).
        a = (crank * math.cos(turn), crank * math.sin(turn), 0.0)
        d = [x - y for x, y in zip(a, base)]
        reach = (sum(x * x for x in d) + rocker**2 - rod**2) / (2 * rocker)
        p = math.atan2(d[2], d[0]) - math.acos(reach / math.hypot(d[0], d[2]))
        return p, a, (base[0] + rocker * math.cos(p), base[1], base[2] + rocker * math.sin(p))

    def energy_per_square(turn):
        h = 1e-4
        (p0, a0, b0), (p1, a1, b1) = ends(turn - h), ends(turn + h)
        square = lambda u, v: sum((x - y) ** 2 for x, y in zip(u, v)) / (4 * h * h)
        middle = square([(x + y) / 2 for x, y in zip(a0, b0)], [(x + y) / 2 for x, y in zip(a1, b1)])
        return 0.05 + 0.03 * ((p1 - p0) / (2 * h)) ** 2 + mass * (square(a0, a1) / 6 + square(b0, b1) / 6 + 2 * middle / 3)

    start, speed = 0.4, 7.0
    p, a, b = ends(start)
    # The rod's direction by the rotation vector about what is normal to it and x of the crank, which turns with it.
    d = [(y - x) / rod for x, y in zip(a, b)]
    d = [d[0] * math.cos(start) + d[1] * math.sin(start), d[1] * math.cos(start) - d[0] * math.sin(start), d[2]]
    turn = math.acos(d[0]) / math.hypot(d[1], d[2])
    for driven in (True, False):
        for about_itself in (0.0, 1e-15):
            text = simulation(1.2, output_rate=200, tolerance=1e-8)
            text += rigid("crank", mass=1, inertia=[0.05] * 3, frames={"pin": [crank, 0, 0]})
            text += rigid("rocker", mass=1, inertia=[0.03] * 3, frames={"pin": [rocker, 0, 0]})
            inertia = [about_itself, mass * rod**2 / 12, mass * rod**2 / 12]
            text += rigid("rod", mass=mass, inertia=inertia, centre_of_mass=[rod / 2, 0, 0], frames={"end": [rod, 0, 0]})
            drive = {"motion": f"{start} + {speed}*t"} if driven else {"initial": {"value": start, "rate": speed}}
            text += joint("crank", "revolute", "ground", "crank", **drive)
            text += joint("rocker", "revolute", "ground", "rocker", position=base, axis=[0, -1, 0], initial={"guess": round(p, 2)})
            text += joint("first", "spherical", "crank.pin", "rod", initial={"guess": [0, round(-d[2] * turn, 2), round(d[1] * turn, 2)]})
            text += joint("second", "spherical", "rocker.pin", "rod.end")
            text += output("at", "rocker.pin", "position") + output("turn", "crank", "value") + output("rate", "crank", "rate")
            h = started(folder, text)
            what = f"thin coupler, driven {driven}, {about_itself} kg m^2"
            constant, far, off = energy_per_square(start) * speed**2, 0.0, 0.0
            for k, turned in enumerate(h["turn"]):
                far = max(far, *(abs(h[f"at.{x}"][k] - place) for x, place in zip("xyz", ends(turned)[2])))
                off = max(off, abs(h["rate"][k] - (speed if driven else math.sqrt(constant / energy_per_square(turned)))))
            near(far, 0, 1e-8, f"{what}: place of the rocker's end, m")
            near(off, 0, 1e-5, f"{what}: rate of the crank, 1/s")
            expect(driven or max(h["turn"]) > 6, f"{what}: a full turn")


def spatial_loops(folder):
    """Elastic loops in space against straight beams of Euler and Bernoulli, joined at their ends (numpy, 32 elements each).

    At rest under forces nothing may move, and no run may try to resolve its rounding: that took more than ten minutes of a second. Section
    forces at a quarter of each rod. Where lengthening is off, `check` says what it takes from a vibration (17.819 Hz with it).
    """
    data = source / "tests/regression/data"
    out = pathlib.Path(folder) / "rest.csv"
    done = run("simulate", data / "loop_at_rest.toml", "--csv", out, "--max-steps", "20000")
    expect("WARNING" not in done.stdout + done.stderr, f"a loop at rest is warned of: {done.stdout}{done.stderr}")
    table = history(out)
    truth = {
        "S0": (-1.6774e-5, -1.0036e-5, -3.2819e-6, 7.3247e-8, 2.813e-7, -6.3389e-8),
        "S1": (-1.0923e-5, -1.1577e-5, 8.2114e-6, 0, 4.0986e-8, -2.0594e-7),
        "S2": (1.0615e-5, -1.7819e-7, -1.2651e-5, 0, -3.349e-8, 4.7172e-10),
    }
    for name, wanted in truth.items():
        for part, value in zip(("N", "Vy", "Vz", "T", "My", "Mz"), wanted):
            size = max(abs(v) for v in (wanted[:3] if part in ("N", "Vy", "Vz") else wanted[3:]))
            for row in (0, -1):
                near(table[f"{name}.{part}"][row], value, 8e-3 * size, f"loop at rest, {name}.{part}")
    text = run("check", data / "loop_lengthens.toml").stdout
    said = re.search(r"that of ([0-9.]+) Hz to ([0-9.]+) Hz: add \"axial\"", text)
    expect(said is not None, f"what lengthening takes from a frequency is not said: {text}")
    if said:
        near(float(said[2]), 17.8187, 2e-3 * 17.8187, "frequency with lengthening")


with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    for linkage in (jansen, watt, stephenson, quick_return, stewart, far_pins, many_turns, rubbing_slot, sprung_loop):
        linkage(folder)
    for linkage in (rates_of_rounding, thin_coupler):
        linkage(folder)
    spatial_loops(folder)
    for model in ("finite-element", "lumped", "mixed"):
        starts_straight(folder, model)
finish()
