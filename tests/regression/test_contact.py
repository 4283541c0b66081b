"""Contacts through the real program: closed formulas of rigid impacts, rolling and sliding, and scipy's integration of the same law."""
import math

import numpy as np
from arrays import off, refused, simulate, simulate_and_say
from program import expect, near, run_parts
from scene_text import output
from scipy.integrate import solve_ivp

simulation = "[simulation]\nduration = %g\noutput_rate = %g\ngravity = %s\ntolerance = 1e-8\n"
g = 9.81


def ball(name="ball", mass=2.0, radius=0.1, start="[0, 0, 0.5, 0, 0, 0]", rate=None):
    j = 0.4 * mass * radius**2
    more = f", rate = {rate}" if rate else ""
    return (
        f'[[body]]\nname = "{name}"\nkind = "rigid"\nmass = {mass}\ninertia = [{j!r}, {j!r}, {j!r}]\n'
        f'[[joint]]\nname = "{name} free"\nkind = "free"\nparent = "ground"\nchild = "{name}"\ninitial = {{ value = {start}{more} }}\n'
    )


def touch(on="ball", frm="ground", more="", shape="sphere", radius=0.1, stiffness=1e6):
    size = "" if shape == "point" else f"radius = {radius}\n"
    head = f'[[force]]\nname = "floor"\nkind = "contact"\non = "{on}"\nfrom = "{frm}"\n'
    return head + f'shape = "{shape}"\n{size}stiffness = {stiffness!r}\n{more}\n'


seen = (
    output("x", "ball", "position")
    + output("v", "ball", "velocity")
    + output("w", "ball", "angular_velocity")
    + output("E", "system", "energy")
)


flies = '[[joint]]\nname = "f"\nkind = "free"\nparent = "ground"\nchild = "ball"\ninitial = { value = [0, 0, %.17g, 0, 0, 0] }\n'


def bounces(folder):
    # Linear spring without loss: the motion by scipy, and the energy.
    text = simulation % (2, 100, "[0, 0, -9.81]") + ball() + seen
    h = simulate(folder, text + touch(stiffness=1e4))
    rhs = lambda t, y: [y[1], -g + 1e4 * max(0.0, 0.1 - y[0]) / 2]
    s = solve_ivp(rhs, (0, 2), [0.5, 0], rtol=1e-11, atol=1e-13, max_step=1e-3, t_eval=h["t"])
    off(h["x.z"], s.y[0], 2e-5, "a ball on a linear spring")
    off(h["E"], h["E"][0] + 0 * h["t"], 2e-5, "its energy")
    # Hertz, without loss.
    h = simulate(folder, text + touch(stiffness=1e6, more="exponent = 1.5"))
    rhs = lambda t, y: [y[1], -g + 1e6 * max(0.0, 0.1 - y[0]) ** 1.5 / 2]
    s = solve_ivp(rhs, (0, 2), [0.5, 0], rtol=1e-11, atol=1e-13, max_step=1e-3, t_eval=h["t"])
    off(h["x.z"], s.y[0], 5e-5, "a ball on Hertz's contact")
    # Restitution: the closed series of a rigid ball, peaks e^2n h. Weight acts during a blow of 3e-5 s too: some g 3e-5 s of the speed.
    for e in (0.9, 0.6, 0.3):
        for exponent, k in ((1.0, 2e10), (1.5, 1e13)):
            h = simulate(
                folder,
                simulation % (1.2, 10000, "[0, 0, -9.81]")
                + ball()
                + seen
                + touch(stiffness=k, more=f"restitution = {e}\nexponent = {exponent}"),
            )
            height = h["x.z"] - 0.1
            inside = [i for i in range(1, len(height) - 1) if height[i] > height[i - 1] and height[i] >= height[i + 1] and height[i] > 1e-3]
            for n, i in enumerate(inside, 1):
                near(
                    height[i],
                    0.4 * e ** (2 * n),
                    (2e-3 + 8 * g * 3e-5 / (2.8 * e**n)) * 0.4 * e ** (2 * n) + 1e-6,
                    f"peak {n} of a ball with restitution {e}, exponent {exponent}",
                )
            expect(len(inside) >= (2 if e > 0.5 else 1), f"a ball with restitution {e} has {len(inside)} peaks")
    # It comes to rest.
    h = simulate(folder, simulation % (4, 100, "[0, 0, -9.81]") + ball() + seen + touch(stiffness=1e6, more="restitution = 0.5"))
    near(h["x.z"][-1], 0.1 - 2 * g / 1e6, 1e-7, "a ball that has come to rest")
    expect(abs(h["v.z"][-1]) < 1e-5, f"a ball that has come to rest moves at {h['v.z'][-1]:.3g} m/s")


def rests(folder):
    for more in ("restitution = 0.5", "damping = 1", ""):
        h = simulate(folder, simulation % (1, 100, "[0, 0, -9.81]") + ball(start="[0, 0, 0.1, 0, 0, 0]") + seen + touch(more=more))
        off(h["x.z"], 0.1 + 0 * h["t"], 2.001 * 2 * g / 1e6, f"a ball that starts on the floor ({more})")
        off(h["x.x"], 0 * h["t"], 1e-12, "and stays there")


def rolls(folder):
    """A ball that slides without spin rolls after 2 v0 / (7 mu g), with 5/7 v0. In the turned world the plane is tilted."""
    mu, v0, r = 0.2, 3.0, 0.1
    deep = 2 * g / 1e6
    c, s = math.cos(0.7), math.sin(0.7)
    for what, gravity, start, rate, normal, along in (
        ("a ball", f"[0, 0, {-g}]", f"[0, 0, {r - deep!r}, 0, 0, 0]", f"[{v0}, 0, 0, 0, 0, 0]", "[0, 0, 1]", (1, 0, 0)),
        (
            "a ball in a turned world",
            f"[{-g * s!r}, 0, {-g * c!r}]",
            f"[{(r - deep) * s!r}, 0, {(r - deep) * c!r}, 0, 0, 0]",
            f"[0, {v0}, 0, 0, 0, 0]",
            f"[{s!r}, 0, {c!r}]",
            (0, 1, 0),
        ),
    ):
        text = simulation % (1, 100, gravity) + ball(start=start, rate=rate) + seen
        h = simulate(folder, text + touch(more=f"normal = {normal}\ndamping = 5\nfriction = {{ coefficient = {mu} }}"))
        t = h["t"]
        end = 2 * v0 / (7 * mu * g)
        v = np.where(t < end, v0 - mu * g * t, 5 / 7 * v0)
        x = np.where(t < end, v0 * t - 0.5 * mu * g * t**2, v0 * end - 0.5 * mu * g * end**2 + 5 / 7 * v0 * (t - end))
        off(sum(a * h["v." + k] for a, k in zip(along, "xyz")), v, 2e-4, f"{what} that slides, then rolls: speed")
        off(sum(a * h["x." + k] for a, k in zip(along, "xyz")), x, 2e-4, f"{what} that slides, then rolls: way")
    # On an incline a cylinder that rolls: 2/3 g sin a; as a disc and on both its ends.
    a = 0.3
    for width in (0.0, 0.4):
        body = '[[body]]\nname = "ball"\nkind = "rigid"\nmass = 2\ninertia = [0.02, 0.01, 0.02]\n'
        free = flies % (0.1 - 2 * g * math.cos(a) / (1 if width == 0 else 2) / 1e6)
        cylinder = touch(shape="cylinder", more=f"axis = [0, 1, 0]\nwidth = {width}\ndamping = 5\nfriction = {{ coefficient = 0.5 }}")
        h = simulate(folder, simulation % (1, 100, f"[{g * math.sin(a)!r}, 0, {-g * math.cos(a)!r}]") + body + free + cylinder + seen)
        off(h["x.x"], g * math.sin(a) / 3 * h["t"] ** 2, 2e-4, f"a cylinder of width {width} that rolls down an incline")


def inclines(folder):
    """A block on four points: below the angle of friction it stays, above it slides with g (sin a - mu cos a)."""
    corners = {"a": (0.1, 0.1), "b": (-0.1, 0.1), "c": (-0.1, -0.1), "d": (0.1, -0.1)}
    frames = ", ".join(f"{n} = [{x}, {y}, -0.05]" for n, (x, y) in corners.items())
    block = f'[[body]]\nname = "ball"\nkind = "rigid"\nmass = 4\ninertia = [0.02, 0.02, 0.03]\nframes = {{ {frames} }}\n'
    a = 0.4
    for mu, slides in ((0.6, False), (0.3, True)):
        deep = 4 * g * math.cos(a) / 4e6
        free = flies % (0.05 - deep)
        feet = "".join(
            touch(
                on=f"ball.{n}",
                shape="point",
                more=f"damping = 50\nfriction = {{ coefficient = {mu}, stiffness = 1e8, damping = 20000 }}",
            ).replace('"floor"', f'"foot {n}"')
            for n in corners
        )
        h = simulate(folder, simulation % (0.5, 100, f"[{g * math.sin(a)!r}, 0, {-g * math.cos(a)!r}]") + block + free + feet + seen)
        x = 0.5 * g * (math.sin(a) - mu * math.cos(a)) * h["t"] ** 2 if slides else 0 * h["t"]
        off(h["x.x"], x, 2e-4 if slides else 2e-5, f"a block on an incline, friction {mu}")
        if not slides:
            expect(abs(h["v.x"][-1]) < 1e-6, f"a block that sticks creeps at {h['v.x'][-1]:.3g} m/s")


def stops_on_inclines(folder):
    """Friction that could hold little more than what pulls down: a block that slid stays where it stops, a ball rolls on without slip."""
    mu, v, k, mass = 0.3, 0.05, 1e5, 2.0
    corners = {"a": (0.1, 0.1), "b": (-0.1, 0.1), "c": (-0.1, -0.1), "d": (0.1, -0.1)}
    frames = ", ".join(f"{n} = [{x}, {y}, -0.05]" for n, (x, y) in corners.items())
    block = f'[[body]]\nname = "ball"\nkind = "rigid"\nmass = {mass}\ninertia = [0.01, 0.01, 0.01]\nframes = {{ {frames} }}\n'
    rub = "damping = %s\nfriction = { coefficient = %s }"
    for used in (0.75, 0.994):
        a = math.atan(used * mu)
        slows = g * (mu * math.cos(a) - math.sin(a))
        feet = "".join(
            touch(on=f"ball.{n}", shape="point", stiffness=k, more=rub % (30, mu)).replace('"floor"', f'"foot {n}"') for n in corners
        )
        free = (flies % (0.05 - mass * g * math.cos(a) / k / 4)).replace(" }", f", rate = [{v}, 0, 0, 0, 0, 0] }}")
        text = simulation % (v / slows + 1, 100, f"[{g * math.sin(a)!r}, 0, {-g * math.cos(a)!r}]")
        h = simulate(folder, text.replace("tolerance = 1e-8\n", "") + block + free + feet + seen)
        # Springs of 1e5 N/m under 6 N.
        near(h["x.x"][-1], v * v / 2 / slows, 3e-5, f"a block stops where friction needs {used} of what it has")
        near(h["x.x"][-1] - h["x.x"][-50], 0, 1e-7, f"and stays ({used})")
    # Rolling needs 2/7 of the slope.
    need, mu = 0.8, 0.2
    a = math.atan(need * 3.5 * mu)
    text = simulation % (2, 100, f"[{g * math.sin(a)!r}, 0, {-g * math.cos(a)!r}]")
    start = f"[0, 0, {0.1 - mass * g * math.cos(a) / k!r}, 0, 0, 0]"
    h = simulate(folder, text + ball(start=start, rate="[1, 0, 0, 0, 0, 0]") + seen + touch(stiffness=k, more=rub % (1, mu)))
    slides = g * (math.sin(a) - mu * math.cos(a))
    spins = mu * g * math.cos(a) / (0.4 * 0.1)
    t1 = 1 / (0.1 * spins - slides)
    t = h["t"]
    true = np.where(t < t1, 1 + slides * t, 1 + slides * t1 + 5 / 7 * g * math.sin(a) * (t - t1))
    off(h["v.x"], true, 1e-3, "a ball that slid rolls down")
    near(h["w.y"][-1] * 0.1, h["v.x"][-1], 2e-5, "and does not slip")
    # A method that follows what is fast does not get past the end of the slide, and its refusal names those that do.
    free = '[[joint]]\nname = "f"\nkind = "planar"\nparent = "ground"\nchild = "ball"\ninitial = { rate = [0.05, 0.001, 0.01] }\n'
    free += 'friction = { coefficient = 0.3, normal_force = "reaction", radius = 0.1 }\n'
    a = math.atan(0.994 * 0.3)
    text = simulation % (4, 100, f"[{g * math.sin(a)!r}, 0, {-g * math.cos(a)!r}]") + block + free + seen
    says = simulate(folder, text.replace("tolerance = 1e-8\n", 'method = "adams"\n'), code=1)
    expect("dirk and bdf step over what is fast" in says, f"a refusal that names other methods: {says}")
    simulate(folder, text)


def balls(folder):
    """Two balls meet in flight: momentum, and the share e of their speed along the line that joins them."""
    e = 0.7
    text = simulation % (0.4, 1000, "[0, 0, 0]") + ball(mass=2, start="[0, 0, 0, 0, 0, 0]", rate="[4, 0, 0, 0, 0, 0]")
    text += ball("other", 1, 0.1, "[1, 0.1, 0, 0, 0, 0]", "[-1, 0, 0, 0, 0, 0]") + seen + output("u", "other", "velocity")
    pair = f'against = "sphere"\nfrom_radius = 0.1\nrestitution = {e}'
    n = -np.array([math.sqrt(0.04 - 0.01), 0.1, 0]) / 0.2  # from the other to the ball
    v, u = np.array([4.0, 0, 0]), np.array([-1.0, 0, 0])
    p = (1 + e) * (2 / 3) * -(v - u) @ n
    for on, frm in (("ball", "other"), ("other", "ball")):
        h = simulate(folder, text + touch(on=on, frm=frm, stiffness=1e10, more=pair))
        got = np.array([h["v." + k][-1] for k in "xyz"]), np.array([h["u." + k][-1] for k in "xyz"])
        off(got[0], v + p / 2 * n, 2e-3, f"speed of a ball after it met another ({on} on {frm})")
        off(got[1], u - p * n, 2e-3, f"speed of the other ({on} on {frm})")
        off(2 * got[0] + got[1], 2 * v + u, 1e-6, "momentum of two balls")


def too_soft(folder):
    """Two balls of 0.1 m and 2 kg that meet at 3 m/s: by the energy of the blow they are pressed in by v sqrt(m / 2k), and warned of before
    that reaches the distance of their centres, 0.2 m, where they would come out at the other side."""
    for k, deep in ((1e5, 0.0095), (1e3, 0.0949), (2.6e2, 0.186), (1e2, 0.3)):
        near(3 * math.sqrt(1 / k), deep, 0.001, "how deep by the energy")
        text = simulation % (0.3, 500, "[0, 0, 0]") + ball("a", start="[0, 0, 0, 0, 0, 0]", rate="[1.5, 0, 0, 0, 0, 0]")
        text += ball("ball", start="[0.21, 0, 0, 0, 0, 0]", rate="[-1.5, 0, 0, 0, 0, 0]")
        text += touch(frm="a", more='against = "sphere"\nfrom_radius = 0.1', stiffness=k) + seen
        said = simulate_and_say(folder, text)["said"]
        expect(("come out at the other side" in said) == (deep > 0.15), f"stiffness {k}, {deep} m deep: {said}")


def rods(folder):
    """A rod that a rail brings down on a ball that is held touches it with its side, an edge or a flat end."""
    rail = (
        '[[joint]]\nname = "rail"\nkind = "prismatic"\nparent = "ground"\nchild = "ball"\nposition = [0, %s, 0]\n'
        "initial = { value = 0.2 }\n"
    )
    rod = '[[body]]\nname = "ball"\nkind = "rigid"\nmass = 2\ninertia = [0.1, 0.1, 0.1]\n'
    for axis, beside, height, what in (
        ("[0, 1, 0]", 0.0, 0.15, "side"),
        ("[0, 1, 0]", 0.04, 0.15, "side, out of its middle"),
        ("[0, 1, 0]", 0.09, 0.05 + math.sqrt(0.1**2 - 0.04**2), "edge"),
        ("[0, 0, 1]", 0.03, 0.05 + math.sqrt(0.1**2), "flat end"),
        ("[0, 0, 1]", 0.06, 0.05 + math.sqrt(0.1**2 - 0.01**2), "edge of its flat end"),
    ):
        more = f'axis = {axis}\nwidth = 0.1\nagainst = "sphere"\nfrom_radius = 0.1\nrestitution = 0.1'
        contact = touch(shape="cylinder", radius=0.05, stiffness=1e8, more=more)
        h = simulate(folder, simulation % (0.8, 100, "[0, 0, -9.81]") + rod + rail % beside + contact + seen)
        near(h["x.z"][-1], height, 2e-6, f"a rod that rests on a ball with its {what}")


def exchanged(folder):
    """A tray that falls on a ball that is held: the plane on the moving body."""
    tray = '[[body]]\nname = "ball"\nkind = "rigid"\nmass = 2\ninertia = [0.1, 0.1, 0.1]\n'
    rail = '[[joint]]\nname = "rail"\nkind = "prismatic"\nparent = "ground"\nchild = "ball"\ninitial = { value = 0.5 }\n'
    held = '[[body]]\nname = "post"\nkind = "rigid"\nmass = 1\n[[joint]]\nname = "hold"\nkind = "weld"\nparent = "ground"\nchild = "post"\n'
    h = simulate(
        folder,
        simulation % (1, 100, "[0, 0, -9.81]")
        + tray
        + rail
        + held
        + seen
        + touch(on="post", frm="ball", stiffness=1e4, more="normal = [0, 0, -1]"),
    )
    rhs = lambda t, y: [y[1], -g + 1e4 * max(0.0, 0.1 - y[0]) / 2]
    s = solve_ivp(rhs, (0, 1), [0.5, 0], rtol=1e-11, atol=1e-13, max_step=1e-3, t_eval=h["t"])
    off(h["x.z"], s.y[0], 2e-5, "a plane that falls on a ball")


def elastic_rods_strike(folder):
    """Two rods of Z = EA/c that meet by their ends: the spring k between them passes waves on, F = Z v/2 (1 - exp(-2 k t/Z)), and the far
    end of the one that strikes goes on with v exp(-2 k (t - L/c)/Z). Rigid it was 0.14 v off, and no influence of its stretching was
    told."""
    E, density, d, v, gap = 2e11, 7800.0, 0.01, 1.0, 1e-3
    A, c = math.pi * d * d / 4, math.sqrt(E / density)
    k = 0.3 * E * A
    duration = gap / v + 2.9 / c
    text = f"[simulation]\nduration = {duration!r}\noutput_rate = {200 / duration!r}\ngravity = [0, 0, 0]\n"
    for name, initial in (("a", f"value = {-1 - gap}, rate = {v}"), ("b", "value = 0.0")):
        text += f'[[body]]\nname = "{name}"\nkind = "beam"\nlength = 1.0\nelements = 30\n'
        text += f'section = {{ shape = "circle", diameter = {d} }}\nmaterial = {{ density = {density}, youngs_modulus = {E} }}\n'
        text += f'[[joint]]\nname = "rail {name}"\nkind = "prismatic"\nparent = "ground"\nchild = "{name}.root"\naxis = [1, 0, 0]\n'
        text += f"initial = {{ {initial} }}\n"
    text += touch(on="a.tip", frm="b.root", shape="point", stiffness=k, more="normal = [-1, 0, 0]") + output("far", "a.root", "velocity")
    h = simulate_and_say(folder, text)
    t = np.asarray(h["t"]) - gap / v - 1 / c
    wave = np.where(t > 0, v * np.exp(-0.6 * t * c), v)
    off(h["far.x"], wave, 3e-2, "far end of a rod that strikes another")
    expect("where bodies strike" in h["said"], f"a rod that strikes another: {h['said']}")


def nothing_is_passed(folder):
    # A ball that would be past its partner by the end of a step falls 20 m on a ball of 0.2 m: it comes back.
    text = "[simulation]\nduration = 4\noutput_rate = 10\ngravity = [0, 0, -9.81]\n" + ball() + output("x", "rail", "value")
    text = text[: text.index("[[joint]]")] + text[text.index("[[output]]") :]
    text += '[[joint]]\nname = "rail"\nkind = "prismatic"\nparent = "ground"\nchild = "ball"\ninitial = { value = 20 }\n'
    h = simulate(folder, text + touch(more='against = "sphere"\nfrom_radius = 0.1'))
    t = math.sqrt(2 * 19.8 / g)
    off(h["x"][h["t"] > t + 0.05], 0.2 + (9.81 * t * (h["t"] - t) - g / 2 * (h["t"] - t) ** 2)[h["t"] > t + 0.05], 0.1, "back from a ball")
    # An arm that turns evenly brushes a plate at rest once a turn, 1e-5 m deep; the plate swings on its spring after that.
    w, dip, k, k0 = 20.0, 1e-5, 1e5, 50.0
    text = "[simulation]\nduration = 0.9\noutput_rate = 100\n" + output("x", "slide", "value")
    for name in ("arm", "plate"):
        text += f'[[body]]\nname = "{name}"\nkind = "rigid"\nmass = 1\ninertia = [1, 1, 1]\nframes = {{ tip = [0, 1, 0] }}\n'
    text += f'[[joint]]\nname = "shaft"\nkind = "revolute"\nparent = "ground"\nchild = "arm"\nmotion = "{w}*t"\n'
    text += '[[joint]]\nname = "slide"\nkind = "prismatic"\nparent = "ground"\nchild = "plate"\naxis = [1, 0, 0]\n'
    text += f"position = [{1 - dip!r}, 0, 0]\nspring = {{ stiffness = {k0} }}\n"
    h = simulate(folder, text + touch(on="arm.tip", frm="plate", shape="point", stiffness=k, more="normal = [-1, 0, 0]"))
    depth = lambda t, y: -math.sin(w * t) - (1 - dip + y[0])
    rhs = lambda t, y: [y[1], -k0 * y[0] + k * max(0.0, depth(t, y))]
    s = solve_ivp(rhs, (0, 0.9), [0, 0], rtol=1e-10, atol=1e-14, max_step=1e-5, t_eval=h["t"])
    off(h["x"] / np.ptp(s.y[0]), s.y[0] / np.ptp(s.y[0]), 1e-3, "a plate that is brushed")


def slides_to_rest(folder):
    # The only thing that moves comes to rest: its last speed is nothing against what it was.
    m, k, mu, v = 0.4, 2000.0, 0.7, 1.4
    text = simulation % (0.3, 100, "[0, -9.81, 0]") + f'[[body]]\nname = "ball"\nkind = "rigid"\nmass = {m}\ninertia = [1, 1, 1]\n'
    text += '[[joint]]\nname = "flight"\nkind = "planar"\nparent = "ground"\nchild = "ball"\n'
    text += f"initial = {{ value = [0, {-m * g / k!r}, 0], rate = [{v}, 0, 0] }}\n" + output("x", "ball", "position")
    rub = f"normal = [0, 1, 0]\nfriction = {{ coefficient = {mu}, stiffness = 1000, damping = 10 }}"
    h = simulate(folder, text + touch(shape="point", stiffness=k, more=rub))
    t = np.minimum(h["t"], v / (mu * g))
    off(h["x.x"], v * t - mu * g / 2 * t**2, 1e-8, "slides until it rests")


def sticks_by_any_method(folder):
    # A box lands askew, slides, sticks and rocks. Runge-Kutta methods repeat the step that ends at an event, which left what comes to rest
    # 1e-5 m/s: more than rest, so that it never stuck (0.43 of the range of a coordinate off, told 1e-5).
    text = simulation % (0.5, 400, "[0, -9.81, 0]")
    text += '[[body]]\nname = "box"\nkind = "rigid"\nmass = 0.7\ninertia = [0.04, 0.04, 0.04]\n'
    text += "frames = { left = [-0.3, -0.25, 0], right = [0.3, -0.25, 0] }\n"
    text += '[[joint]]\nname = "flight"\nkind = "planar"\nparent = "ground"\nchild = "box"\n'
    text += "initial = { value = [0, 0.33, 0.2], rate = [0.9, 0, 0] }\n"
    for foot in ("left", "right"):
        text += f'[[force]]\nname = "{foot}"\nkind = "contact"\non = "box.{foot}"\nshape = "point"\nnormal = [0, 1, 0]\n'
        text += "stiffness = 2600\ndamping = 0.5\nfriction = { coefficient = 0.55, stiffness = 1700, damping = 8 }\n"
    text += output("p", "box", "position") + output("turn", "flight", "value")
    true = simulate(folder, text, "--method", "adams")
    for method in ("dirk", "erk", "bdf"):
        h = simulate_and_say(folder, text, "--method", method, "--tolerance", "1e-6")
        for column in ("p.x", "p.y", "turn.3"):
            off(h[column], true[column], 1e-3 * np.ptp(true[column]), f"{column} of a box that lands, by {method}")
        expect("sticks" in h["said"], f"nothing sticks by {method}")


def rolls_in_a_hollow(folder):
    # A ball on a stiff round road, hollow and humped, hardly damped: what presses it swings, and falls while the friction's spring draws
    # back. It rolls as one without play, (R -+ r) angle'' = -+ g sin(angle) / 1.4, about which that spring swings by 0.04 of 4.7 rad/s in
    # the hollow, 0.07 of 17 rad/s on the hump. Friction never drives it: it was at 165 rad/s after a second.
    r = 0.1
    hollow, hump = '{ x = "cos(u)", y = "sin(u)", from = "-pi", to = 0 }', '{ x = "-cos(u)", y = "sin(u)", to = "pi" }'
    for side, road, start in ((-1, hollow, 0.5), (1, hump, 0.1)):
        arm = 1 + side * r
        place = [arm * math.sin(start), side * arm * math.cos(start), 0]
        flat = f'[[joint]]\nname = "p"\nkind = "planar"\nparent = "ground"\nchild = "ball"\ninitial = {{ value = {place} }}\n'
        rolling = f'against = "curve"\ncurve = {road}\ndamping = 0.1\nfriction = {{ coefficient = 0.9 }}'
        ball_in_plane = ball(radius=r)[: ball(radius=r).index("[[joint]]")]
        text = "[simulation]\nduration = 1\noutput_rate = 200\ngravity = [0, -9.81, 0]\n" + ball_in_plane + flat + seen
        # In loose steps the ball leaves the hump slowly and along its bend: it was told to touch and to leave again without end.
        for stiffness, words in ((1e6, []), (1e7, []), (1e7, ["--tolerance", "5e-5"])):
            h = simulate(folder, text + touch(stiffness=stiffness, radius=r, more=rolling), *words)
            y = solve_ivp(lambda t, y: [y[1], side * g * math.sin(y[0]) / (arm * 1.4)], (0, 1), [start, 0], t_eval=h["t"], rtol=1e-10).y
            off(h["x.x"], arm * np.sin(y[0]), 1e-3, f"a ball that rolls on a road, {stiffness:g} N/m")
            off(h["w.z"], -arm / r * y[1], 0.1, "how fast it turns")
            expect(max(h["E"]) <= h["E"][0] + 1e-6, f"friction drives a ball: {max(h['E']) - h['E'][0]:.3g} J")


def wrong_words(folder):
    text = simulation % (1, 100, "[0, 0, 0]") + ball()
    refused(
        folder,
        lambda more: text + f'[[force]]\nname = "floor"\nkind = "contact"\non = "ball"\n{more}\n',
        (
            (
                'shape = "cube"\nstiffness = 1',
                (
                    "scene.toml:",
                    "[[force]] 'floor': key 'shape'",
                ),
            ),
            ('shape = "sphere"\nstiffness = 1', ("key 'radius'",)),
            ('shape = "point"\nstiffness = 1\ndamping = 1\nrestitution = 0.5', ("excludes 'restitution'",)),
            ('shape = "point"\nstiffness = 1\nfrom_radius = 2', ("this is against a plane",)),
            ('shape = "point"\nstiffness = 1\nexponent = 1.5\nfriction = { coefficient = 0.1 }', ("key 'friction.stiffness'",)),
            ('shape = "point"\nstiffness = 1\nfrom = "ball"', ("is on the same body as 'on'",)),
            ('shape = "curve"\nstiffness = 1', ("key 'curve' is missing",)),
            ('shape = "curve"\nstiffness = 1\nagainst = "sphere"\nfrom_radius = 1', ("key 'against'", "plane")),
            ('shape = "curve"\nstiffness = 1\ncurve = { points = [[0, 0], [1, 0], [2, 1]] }', ("must be closed",)),
            (
                'shape = "curve"\nstiffness = 1\ncurve = { x = "(2 + cos(3*u))*cos(u)", y = "(2 + cos(3*u))*sin(u)", '
                'to = "2*pi", closed = true }',
                ("must be round outwards",),
            ),
        ),
    )


def cradle(folder):
    """Balls in a row that touch, with restitution: what is pushed on while it touches counts by its largest speed. Runge and Kutta."""
    k, e, n, m = 1e9, 0.8, 3, 1.0
    low, high = 0.0, 1 / e
    for _ in range(100):
        c = 0.5 * (low + high)
        low, high = (c, high) if (1 + e) * c - math.log((1 + c) / (1 - c * e)) > 0 else (low, c)

    def force(y, fastest):
        depth, rate = y[: n - 1] - y[1:n], y[n : 2 * n - 1] - y[n + 1 :]
        fastest = np.where(depth > 0, np.maximum(fastest, rate), 0.0)
        share = c * rate / np.where(fastest > 0, fastest, 1.0)
        return np.where(depth > 0, k * np.maximum(depth, 0) ** 1.5 * np.maximum(1 + share, 0), 0.0), fastest

    def rhs(y, fastest):
        F = force(y, fastest)[0]
        return np.concatenate([y[n:], (np.append(0, F) - np.append(F, 0)) / m])

    y, fastest, h = np.array([0.0] * n + [1.0] + [0.0] * (n - 1)), np.zeros(n - 1), 2e-7
    for _ in range(8000):
        fastest = force(y, fastest)[1]
        a = rhs(y, fastest)
        b = rhs(y + h / 2 * a, fastest)
        d = rhs(y + h / 2 * b, fastest)
        y = y + h / 6 * (a + 2 * b + 2 * d + rhs(y + h * d, fastest))
    text = "".join(
        f'[[body]]\nname = "b{i}"\nkind = "rigid"\nmass = {m}\n'
        f'[[joint]]\nname = "rail{i}"\nkind = "prismatic"\nparent = "ground"\nchild = "b{i}"\naxis = [1, 0, 0]\n'
        f"initial = {{ value = {0.1 * i!r}, rate = {1.0 if i == 0 else 0.0} }}\n" + output(f"v{i}", f"rail{i}", "rate")
        for i in range(n)
    )
    for i in range(n - 1):
        text += (
            f'[[force]]\nkind = "contact"\non = "b{i}"\nfrom = "b{i + 1}"\nshape = "sphere"\nradius = 0.05\nagainst = "sphere"\n'
            f"from_radius = 0.05\nstiffness = {k}\nexponent = 1.5\nrestitution = {e}\n"
        )
    for gravity in ("[0, 0, 0]", "[0, 0, -9.81]"):
        h = simulate(folder, simulation % (1.6e-3, 1e5, gravity) + text)
        for i in range(n):
            near(h[f"v{i}"][-1], y[n + i], 1e-3, f"speed of ball {i} of a cradle, gravity {gravity}")


def drives(folder):
    """One wheel drives another by friction, 13 turns: they roll without slip, whichever of them the contact counts from."""
    a, b, torque, seconds = 0.05, 0.1, 2.0, 1.0
    k = 1e5
    body = "".join(
        f'[[body]]\nname = "{name}"\nkind = "rigid"\nmass = 2\ninertia = [1, 1, {inertia}]\n'
        f'[[joint]]\nname = "hinge {name}"\nkind = "revolute"\nparent = "{place}"\nchild = "{name}"\n'
        + output(name, f"hinge {name}", "rate")
        for name, inertia, place in (("A", 0.0025, "ground"), ("B", 0.04, "ground.beside"))
    )
    body += f"[ground]\nframes = {{ beside = [{a + b - 1e-3!r}, 0, 0] }}\n"
    body += f'[[force]]\nkind = "torque"\non = "A"\ndirection = [0, 0, 1]\nvalue = {torque}\n'
    rub = f"stiffness = {k}\nfriction = {{ coefficient = 0.8 }}\n"
    head = '[[force]]\nname = "rub"\nkind = "contact"\non = "%s"\nfrom = "%s"\nradius = %r\n'
    outline = '"%r*cos(u)", y = "%r*sin(u)", to = "2*pi", closed = true }\n' % (a, a)
    for what, contact in (
        ("spheres", head % ("B", "A", b) + f'shape = "sphere"\nagainst = "sphere"\nfrom_radius = {a}\n'),
        ("spheres, the other way", head % ("A", "B", a) + f'shape = "sphere"\nagainst = "sphere"\nfrom_radius = {b}\n'),
        ("a cylinder on a sphere", head % ("B", "A", b) + f'shape = "cylinder"\nwidth = 0.02\nagainst = "sphere"\nfrom_radius = {a}\n'),
        ("a cylinder on an outline", head % ("B", "A", b) + 'shape = "cylinder"\nagainst = "curve"\ncurve = { x = ' + outline),
    ):
        h = simulate(folder, simulation % (seconds, 200, "[0, 0, 0]") + body + contact + rub)
        # It touches on the surface of `on`; the other is pressed in by a millimetre.
        on = b if 'on = "B"' in contact else a
        arms = (a + b - 1e-3 - on, on) if on == b else (on, a + b - 1e-3 - on)
        turn = torque / (0.0025 + 0.04 * (arms[0] / arms[1]) ** 2) * h["t"]
        late = h["t"] > 0.75  # the spring that holds what sticks has come to rest
        off(h["A"][late], turn[late], 1e-3, f"{what}: the wheel that drives")
        off(h["B"][late], -turn[late] * arms[0] / arms[1], 1e-3, f"{what}: the wheel that is driven")


run_parts(
    bounces,
    rests,
    rolls,
    inclines,
    stops_on_inclines,
    balls,
    too_soft,
    rods,
    exchanged,
    elastic_rods_strike,
    nothing_is_passed,
    slides_to_rest,
    sticks_by_any_method,
    rolls_in_a_hollow,
    cradle,
    drives,
    wrong_words,
)
