"""Forces that depend on the state, through the real program, against scipy's integration of the same equations or a closed formula."""
import math

import numpy as np
from arrays import off, refused, simulate
from program import expect, near, run_parts
from scipy.integrate import solve_ivp

simulation = "[simulation]\nduration = %g\noutput_rate = 50\ngravity = %s\ntolerance = 1e-9\n"
ball = '[[body]]\nname = "ball"\nkind = "rigid"\nmass = 2\ninertia = [0.1, 0.1, 0.1]\n'
rail = '[[joint]]\nname = "rail"\nkind = "prismatic"\nparent = "ground"\nchild = "ball"\n%s\n'
place = '[[output]]\nname = "x"\nof = "rail"\nquantity = "value"\n[[output]]\nname = "v"\nof = "rail"\nquantity = "rate"\n'
push = '[[force]]\nname = "push"\nkind = "force"\non = "ball"\ndirection = [%s]\nvalue = "%s"\n'


def reference(rhs, start, times, events=()):
    """States at the times; events: functions at whose zeros the integration starts anew."""
    out, t, y = [], times[0], np.array(start, float)
    for e in events:
        e.terminal = True
    while True:
        ahead = times[times >= t - 1e-15] if not out else times[times > t]
        s = solve_ivp(rhs, (t, times[-1]), y, rtol=1e-11, atol=1e-13, dense_output=True, events=events or None)
        out += [s.sol(x) for x in ahead if x <= s.t[-1] + 1e-15]
        if s.status != 1:
            return np.array(out).T
        t, y = s.t[-1] + 1e-12, s.y[:, -1] + 1e-12 * np.array(rhs(s.t[-1], s.y[:, -1]))


def readings(folder):
    axis = "axis = [1, 0, 0]\ninitial = { value = 0.5, rate = 3 }"
    # Two-piece spring, quadratic damping and a drive, all by names of outputs.
    text = simulation % (4, "[0, 0, 0]") + ball + rail % axis + place
    h = simulate(folder, text + push % ("1, 0, 0", "-0.8*abs(v)*v - (x > 0 ? 40 : 90)*x + 5*sin(3*t)"))
    rhs = lambda t, y: [y[1], (-0.8 * abs(y[1]) * y[1] - (40 if y[0] > 0 else 90) * y[0] + 5 * math.sin(3 * t)) / 2]
    x, v = reference(rhs, [0.5, 3.0], h["t"], (lambda t, y: y[0], lambda t, y: y[1]))
    off(h["x"], x, 2e-7, "reading value and rate of a joint")
    off(h["v"], v, 1e-6, "reading value and rate of a joint, its rate")
    # The same along a turned axis, by positions and velocities of a frame in a turned world, the force seen from there.
    turned = "axis = [0, 0.6, 0.8]\nposition = [1, 2, 3]\ninitial = { value = 0.5, rate = 3 }"
    frames = "[ground]\nframes = { at = [1, 2, 3] }\n"
    seen = "".join(
        f'[[output]]\nname = "{n}"\nof = "ball"\nquantity = "{q}"\nrelative_to = "ground.at"\n'
        for n, q in (("p", "position"), ("u", "velocity"))
    )
    along = {"x": "(0.6*p.y + 0.8*p.z)", "v": "(0.6*u.y + 0.8*u.z)"}
    value = f"-0.8*abs({along['v']})*{along['v']} - ({along['x']} > 0 ? 40 : 90)*{along['x']} + 5*sin(3*t)"
    g = simulate(folder, frames + simulation % (4, "[0, 0, 0]") + ball + rail % turned + place + seen + push % ("0, 0.6, 0.8", value))
    off(g["x"], h["x"], 1e-7, "reading positions and velocities along a turned axis")
    # Parent and child exchanged: the joint hangs the other way round on a second body that is held.
    base = '[[body]]\nname = "base"\nkind = "rigid"\nmass = 1\n[[joint]]\nname = "hold"\nkind = "weld"\nparent = "ground"\nchild = "base"\n'
    swapped = (
        simulation % (4, "[0, 0, 0]")
        + base
        + ball
        + rail.replace('"ball"', '"base"').replace('"ground"', '"ball"') % "axis = [1, 0, 0]\ninitial = { value = -0.5, rate = -3 }"
        + place
    )
    s = simulate(folder, swapped + push % ("1, 0, 0", "0.8*abs(v)*v + (x < 0 ? 40 : 90)*x + 5*sin(3*t)"))
    off(-s["x"], h["x"], 2e-7, "parent and child exchanged")


def times_inside(folder):
    """A short pulse of time beside a reading is not passed over; a controller's saturation switches where it should."""
    text = simulation % (2, "[0, 0, 0]") + ball + rail % "axis = [1, 0, 0]" + place
    h = simulate(folder, text + push % ("1, 0, 0", "(t > 1 && t < 1.0005 ? 2000 : 0) - 0.0001*v"))
    near(h["v"][-1], 2000 * 0.0005 / 2, 1e-3, "a pulse of half a millisecond")
    h = simulate(folder, text + push % ("1, 0, 0", "max(-3, min(3, 60*(0.4 - x) - 12*v))"))
    rhs = lambda t, y: [y[1], max(-3.0, min(3.0, 60 * (0.4 - y[0]) - 12 * y[1])) / 2]
    u = lambda t, y: 60 * (0.4 - y[0]) - 12 * y[1]
    x, _ = reference(rhs, [0.0, 0.0], h["t"], (lambda t, y: u(t, y) - 3, lambda t, y: u(t, y) + 3))
    off(h["x"], x, 1e-7, "a controller with limits")


def broken_powers(folder):
    """Powers and roots that have no number once their base has changed its sign: what is held of a step goes a little beyond that."""
    text = simulation % (1.5, "[0, 0, 0]") + ball + rail % "axis = [1, 0, 0]\ninitial = { value = 0.5 }" + place
    sign = lambda a: math.copysign(1.0, a)
    for value, law in (
        ("-20*sign(x)*abs(x)^1.5", lambda x, v: -20 * sign(x) * abs(x) ** 1.5),
        ("x > 0 ? -20*x^1.5 : 20*(-x)^1.5", lambda x, v: -20 * sign(x) * abs(x) ** 1.5),
        ("-40*x - 60*max(0, x)^1.5", lambda x, v: -40 * x - 60 * max(0.0, x) ** 1.5),
        ("-40*x - abs(v)^1.7*sign(v)", lambda x, v: -40 * x - sign(v) * abs(v) ** 1.7),
        ("-40*x - 3*sqrt(abs(v))*sign(v)", lambda x, v: -40 * x - 3 * sign(v) * math.sqrt(abs(v))),
        ("-10*asin(min(1, max(-1, 3*x)))", lambda x, v: -10 * math.asin(min(1.0, max(-1.0, 3 * x)))),
    ):
        h = simulate(folder, text + push % ("1, 0, 0", value))
        solved = solve_ivp(lambda t, y, law=law: [y[1], law(*y) / 2], (0, 1.5), [0.5, 0.0], rtol=1e-10, atol=1e-12, max_step=1e-3)
        off(h["x"], np.interp(h["t"], solved.t, solved.y[0]), 1e-5, value)


def between_bodies(folder):
    """An actuator between two free bodies by length and rate, and a spring whose rest moves: energy and momentum."""
    other = ball.replace('"ball"', '"other"').replace("mass = 2", "mass = 3")
    free = '[[joint]]\nname = "%s"\nkind = "free"\nparent = "ground"\nchild = "%s"\ninitial = { value = [%s, 0, 0, 0, 0, 0] }\n'
    between = '[[force]]\nname = "strut"\nkind = "spring-damper"\non = "ball"\nfrom = "other"\n'
    outs = '[[output]]\nname = "L"\nof = "ball"\nquantity = "distance"\nrelative_to = "other"\n'
    outs += '[[output]]\nname = "E"\nof = "system"\nquantity = "energy"\n'
    bodies = simulation % (3, "[0, 0, 0]") + ball + other + free % ("a", "ball", "0") + free % ("b", "other", "1.5")
    h = simulate(folder, bodies + between + 'value = "70*(length - 1)^3 + 20*(length - 1) + 0.3*abs(rate)*rate"\n' + outs)
    m = 2 * 3 / 5
    rhs = lambda t, y: [y[1], -(70 * (y[0] - 1) ** 3 + 20 * (y[0] - 1) + 0.3 * abs(y[1]) * y[1]) / m]
    L, _ = reference(rhs, [1.5, 0.0], h["t"], (lambda t, y: y[1],))
    off(h["L"], L, 1e-7, "a nonlinear strut between two bodies")
    h = simulate(folder, bodies + between + 'stiffness = 30\nrest = "1.2 + 0.2*sin(4*t)"\n' + outs)
    L, v = reference(lambda t, y: [y[1], -30 * (y[0] - 1.2 - 0.2 * math.sin(4 * t)) / m], [1.5, 0.0], h["t"])
    off(h["L"], L, 1e-7, "a spring whose rest moves")
    off(h["E"], 0.5 * m * v**2 + 15 * (L - 1.2 - 0.2 * np.sin(4 * h["t"])) ** 2, 1e-6, "energy of a spring whose rest moves")


def drags(folder):
    fall = simulation % (3, "[0, 0, -9.81]") + ball + rail % "axis = [0, 0, 1]" + place
    drag = '[[force]]\nname = "air"\nkind = "drag"\non = "ball"\n%s\n'
    h = simulate(folder, fall + drag % "quadratic = 0.5")
    end = math.sqrt(2 * 9.81 / 0.5)
    off(h["v"], -end * np.tanh(9.81 / end * h["t"]), 1e-6, "a fall with quadratic drag")
    h = simulate(folder, fall + drag % "linear = 4")
    off(h["v"], -9.81 * 2 / 4 * (1 - np.exp(-2 * h["t"])), 1e-6, "a fall with linear drag")
    free = simulation % (2, "[0, 0, 0]") + ball + '[[output]]\nname = "u"\nof = "ball"\nquantity = "velocity"\n'
    h = simulate(folder, free + drag % "quadratic = 0.8\nwind = [3, 4, 0]")
    speed = 5 - 5 / (1 + 0.8 * 5 / 2 * h["t"])
    off(h["u.x"], 0.6 * speed, 1e-6, "a body that the wind takes along, x")
    off(h["u.y"], 0.8 * speed, 1e-6, "a body that the wind takes along, y")


def rest_is_no_switch(folder):
    """A direction in which nothing moves but rounding switches nothing; a sliding switch is refused with a sentence."""
    text = simulation % (2, "[0, -9.81, 0]") + ball.replace("mass = 2", "mass = 2\ncentre_of_mass = [0.3, 0, 0]")
    pin = '[[joint]]\nname = "pin"\nkind = "revolute"\nparent = "ground"\nchild = "ball"\naxis = [0, 0, 1]\nrotation = [0.3, 0.4, 0]\n'
    out = '[[output]]\nname = "u"\nof = "ball"\nquantity = "velocity"\n'
    h = simulate(folder, text + pin + out + push % ("0, 0, 1", "-3*abs(u.z)*u.z - 2*abs(u.x)*u.x"))
    expect(len(h["t"]) == 101, "a drag of components that rest")
    text = simulation % (2, "[0, 0, 0]") + ball + rail % "axis = [1, 0, 0]\ninitial = { rate = 1 }" + place
    says = simulate(folder, text + push % ("1, 0, 0", "-3*sign(v)"), code=1)
    expect("force 'push' switches endlessly" in says, f"a sharp friction: {says}")


def groups(folder):
    part = (
        '[[group]]\nname = "cart"\nparameters = { k = 1 }\n[[group.body]]\nname = "ball"\nkind = "rigid"\nmass = 2\n'
        '[[group.joint]]\nname = "rail"\nkind = "prismatic"\nparent = "ground"\nchild = "ball"\n'
        "axis = [1, 0, 0]\ninitial = { value = 0.1 }\n"
        '[[group.output]]\nname = "x"\nof = "rail"\nquantity = "value"\n'
        '[[group.force]]\nname = "push"\nkind = "force"\non = "ball"\ndirection = [1, 0, 0]\nvalue = "-8*k*x"\n'
    )
    text = simulation % (2, "[0, 0, 0]") + part
    text += '[[instance]]\ngroup = "cart"\nname = "a"\n[[instance]]\ngroup = "cart"\nname = "b"\nparameters = { k = 4 }\n'
    h = simulate(folder, text)
    off(h["a:x"], 0.1 * np.cos(2 * h["t"]), 1e-7, "a group whose force reads its own output")
    off(h["b:x"], 0.1 * np.cos(4 * h["t"]), 1e-7, "another copy")


def wrong_words(folder):
    text = simulation % (1, "[0, 0, 0]") + ball + rail % "axis = [1, 0, 0]" + place
    bad = '[[output]]\nname = "%s"\nof = "%s"\nquantity = "%s"\n'
    extra = (
        bad % ("a", "ball", "acceleration")
        + bad % ("r", "rail", "reaction")
        + bad % ("o", "ball", "rotation")
        + bad % ("w", "system", "energy")
    )
    refused(
        folder,
        lambda value: text + extra + push % ("1, 0, 0", value),
        (
            ("-3*y", ("scene.toml:", "[[force]] 'push': key 'value'", "'y' is unknown")),
            ("-3*a.x", ("reads the output 'a.x'", "algebraic loop", "positions or velocities")),
            ("-3*r.x", ("reads the output 'r.x'", "a reaction")),
            ("-3*o.z", ("jumps after half a turn",)),
            ("-3*w", ("no position, velocity, distance or joint coordinate",)),
        ),
    )
    says = simulate(folder, text + '[[force]]\nname = "air"\nkind = "drag"\non = "ball"\n', code=2)
    expect("needs 'linear'" in says, f"drag without numbers: {says}")


def narrow(folder):
    # Bells over a place and over the distance to something that passes, far narrower than a step: the impulse, at the default tolerance.
    bell = math.sqrt(math.pi)
    loose = simulation.replace("tolerance = 1e-9\n", "")
    text = loose % (2, "[0, 0, 0]") + ball + rail % "axis = [1, 0, 0]\ninitial = { rate = 1 }" + place
    for width in (1e-2, 1e-4):
        h = simulate(folder, text + push % ("1, 0, 0", f"{0.5 / (width * bell)!r}*exp(-((x - 1.234)/{width})^2)"))
        near(h["v"][-1], math.sqrt(1 + 0.5), 1e-4, f"a bump of {width} m on the way")
    text = loose % (2, "[0, 0, 0]") + ball + rail % "axis = [1, 0, 0]" + place
    text += '[ground]\nframes = { eye = [0, 2, 0] }\n[[body]]\nname = "arm"\nkind = "rigid"\nmass = 1\ninertia = [1, 1, 1]\n'
    text += 'frames = { tip = [2, 0, 0] }\n[[joint]]\nname = "shaft"\nkind = "revolute"\nparent = "ground"\nchild = "arm"\nmotion = "5*t"\n'
    text += '[[output]]\nname = "near"\nof = "arm.tip"\nquantity = "distance"\nrelative_to = "ground.eye"\n'
    first, second = math.pi / 10, math.pi / 10 + 2 * math.pi / 5
    for width in (0.1, 1e-3):
        # The tip passes at 10 m/s: both passings push for 2 kg m/s together.
        h = simulate(folder, text + push % ("1, 0, 0", f"{10 / (width * bell)!r}*exp(-(near/{width})^2)"))
        near(h["v"][-1], 1.0, 2e-3, f"what passes is seen within {width} m")
        gate = 2 * math.asin(width / 4) / 5
        h = simulate(folder, text + push % ("1, 0, 0", f"near < {width} ? {1 / (2 * gate)!r} : 0"))
        wanted = np.clip((h["t"] - first + gate) / (2 * gate), 0, 1) + np.clip((h["t"] - second + gate) / (2 * gate), 0, 1)
        off(h["v"], 0.5 * wanted, 1e-5, f"a gate of {width} m")
    # A pulse of time on the way into a block.
    h = simulate(
        folder,
        loose % (2, "[0, 0, 0]")
        + ball
        + rail % "axis = [1, 0, 0]"
        + place
        + '[[block]]\nname = "lag"\nkind = "transfer-function"\nnumerator = [1]\ndenominator = [1, 1]\n'
        + f'input = "{1 / (1e-4 * bell)!r}*exp(-((t - 0.7)/1e-4)^2)"\n'
        + push % ("1, 0, 0", "2*lag"),
    )
    off(h["v"], np.where(h["t"] > 0.7, 1 - np.exp(-(h["t"] - 0.7)), 0)[:], 1e-3, "a pulse into a block")


run_parts(readings, times_inside, broken_powers, between_bodies, drags, rest_is_no_switch, groups, narrow, wrong_words)
