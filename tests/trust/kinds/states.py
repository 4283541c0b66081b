"""What strangers meet sooner or later: several equilibria, snapping through, contacts above the floor, elastic bodies on stops, pulses in
motions, machines from micrometres to kilometres, very light beside very heavy, controllers of elastic bodies, SID bodies on attachments.

Truths in closed form, by scipy and by finite elements of numpy."""
import math

import numpy as np
from scipy.linalg import eigh, expm
from scipy.optimize import brentq

from scene import Scene, beam, force, joint, output, pick, rigid, simulation, sizes, spring, weld
from truths.space_frame import beam_element
from truths.formulas import beam_matrices, ode, restarted


def still(t, **values):
    return {name: np.tile(np.asarray(v, float), (len(t), 1)) for name, v in values.items()}


def downhill(slope, start, step):
    """The rest that a body comes to from `start` if it only ever goes down; slope: of the potential. None: it runs away."""
    way = -math.copysign(1.0, slope(start))
    x = start
    for _ in range(20000):
        if slope(x + way * step) * way > 0:
            return brentq(slope, x, x + way * step, xtol=1e-15)
        x += way * step
    return None


def several_rests(r):
    """A body that can rest in several places starts between them: an oblique spring, a weight on a torsion spring, magnets along a rail"""
    form = pick(r, "oblique", "weight", "rail")
    if form == "oblique":
        h, k = r.uniform(0.3, 2), 10 ** r.uniform(1, 5)
        rest = h * r.uniform(1.2, 2)
        F = k * h * r.uniform(-0.05, 0.05)
        x0 = rest * r.uniform(0.1, 0.7) * pick(r, 1, -1)
        slope = lambda x: k * (math.hypot(x, h) - rest) * x / math.hypot(x, h) - F
        text = (
            f"[ground]\nframes = {{ pin = [0, {-h!r}, 0] }}\n\n"
            + simulation(0.05, 200, start="static")
            + rigid("body", 1.0, (1, 1, 1))
            + joint("rail", "prismatic", "ground", "body", f"axis = [1, 0, 0]\ninitial = {{ guess = {x0!r} }}")
            + spring("body", "ground.pin", k, rest=rest)
            + force("force", "body", F, (1, 0, 0))
            + output("x", "rail", "value")
        )
        size, scale = rest, rest
    elif form == "weight":
        m, l, g = 10 ** r.uniform(-1, 1), r.uniform(0.2, 1), 9.81
        k = m * g * l * r.uniform(0.02, 0.5)
        x0 = r.uniform(-3, 3) * 3
        slope = lambda x: k * x + m * g * l * math.cos(x)
        text = (
            simulation(0.05, 200, (0, -g, 0), start="static")
            + rigid("arm", m, (m * l * l * 0.1,) * 3, centre=(l, 0, 0))
            + joint("rail", "revolute", "ground", "arm", f"spring = {{ stiffness = {k!r} }}\ninitial = {{ guess = {x0!r} }}")
            + output("x", "rail", "value")
        )
        size, scale = 1.0, 1.0
    else:
        A, w, k = 10 ** r.uniform(0, 3), r.uniform(2, 8), 0.0
        k = A * w * r.uniform(0.02, 0.3)
        x0 = r.uniform(-2, 2)
        slope = lambda x: k * x - A * math.sin(w * x)
        text = (
            simulation(0.05, 200, start="static")
            + rigid("body", 1.0, (1, 1, 1))
            + joint(
                "rail", "prismatic", "ground", "body", f"axis = [1, 0, 0]\nspring = {{ stiffness = {k!r} }}\ninitial = {{ guess = {x0!r} }}"
            )
            + force("force", "body", f"{A!r}*sin({w!r}*x)", (1, 0, 0))
            + output("x", "rail", "value")
        )
        size, scale = 1 / w, 1 / w
    if abs(slope(x0)) < 1e-3 * max(abs(slope(x0 + 0.1 * size)), abs(slope(x0 - 0.1 * size))):
        return None
    x = downhill(slope, x0, 1e-3 * size)
    return Scene(text, lambda t: still(t, x=(x,)), {"x": scale}, f"{form}, from {x0:.3g} to {x:.3g}")


def snapping(r):
    """A body between two oblique springs is pushed through flat, slowly or at once, damped: the snap and what comes after it"""
    m, a = 10 ** r.uniform(-2, 2), 10 ** r.uniform(-2, 0.5)
    h = a * r.uniform(0.1, 0.5)
    L = math.hypot(a, h)
    k = m * 10 ** r.uniform(2, 5)
    pull = lambda y: 2 * k * (L - math.hypot(a, y)) * y / math.hypot(a, y)
    limit = max(pull(h * s) for s in np.linspace(0, 1, 400))
    w = math.sqrt(2 * k / m) * h / L
    c = 2 * m * w * r.uniform(0.05, 0.4)
    top, T = limit * r.uniform(1.2, 2.5), 2 * math.pi / w * pick(r, 0.2, r.uniform(3, 10))
    duration = T * 1.2 + 2 * math.pi / w * 3
    text = (
        f"[ground]\nframes = {{ left = [{-a!r}, 0, 0], right = [{a!r}, 0, 0] }}\n\n"
        + simulation(duration, 300 / duration)
        + rigid("body", m, (m, m, m))
        + joint("guide", "prismatic", "ground", "body", f"axis = [0, 1, 0]\ninitial = {{ value = {h!r} }}\nspring = {{ damping = {c!r} }}")
        + spring("body", "ground.left", k, rest=L)
        + spring("body", "ground.right", k, rest=L)
        + force("force", "body", f"t < {T!r} ? {-top!r}*t/{T!r} : {-top!r}", (0, 1, 0))
        + output("y", "guide", "value")
    )

    def truth(t):
        f = lambda s, y: [y[1], (pull(y[0]) - c * y[1] - top * min(s / T, 1.0)) / m]
        y = restarted(f, [], [h, 0.0], t, stops=(T,), scale=a)
        return {"y": y[:, :1]}

    return Scene(text, truth, {}, f"height/half width {h / a:.2g}, up to {top / limit:.2g} of the limit within {T * w / 6.28:.2g} periods")


def above_the_floor(r):
    """A body begins above the floor, a static start lets it down on one, three or four feet; beside springs, linear or Hertz"""
    m, g = 10 ** r.uniform(-2, 2), 9.81
    n = pick(r, 1.0, 1.5)
    depth, gap, radius = 10 ** r.uniform(-6, -3), 10 ** r.uniform(-4, -0.5), pick(r, 0.01, 0.1)
    feet = pick(r, 1, 4)
    k = m * g / feet / depth**n
    law = f'shape = "sphere"\nradius = {radius!r}\nstiffness = {k!r}\nexponent = {n}\n'
    held = r.random() < 0.5
    ks = m * g / gap * r.uniform(0.1, 0.5) if feet == 1 and r.random() < 0.4 else 0.0
    places = [(0, 0)] if feet == 1 else [(1, 1), (1, -1), (-1, -1), (-1, 1)]
    z0 = radius + gap
    if feet == 1:
        way = joint(
            "way",
            "prismatic",
            "ground",
            "body",
            f"{'position' if held else 'initial'} = {f'[0, 0, {z0!r}]' if held else f'{{ guess = {z0!r} }}'}"
            + (f"\nspring = {{ stiffness = {ks!r}, rest = {0.0 if held else z0!r} }}" if ks else ""),
        )
    else:
        way = joint("way", "planar", "ground", "body", f"axis = [0, 1, 0]\ninitial = {{ guess = [0, {-z0!r}, 0] }}")
    text = (
        simulation(0.02, 1000, (0, 0, -g), start="static")
        + rigid("body", m, (m, m, m), {f"f{i}": (x, y, 0) for i, (x, y) in enumerate(places)})
        + way
    )
    for i in range(len(places)):
        text += f'[[force]]\nname = "c{i}"\nkind = "contact"\non = "body.f{i}"\n{law}\n'
    text += output("p", "body", "position")
    # Weight = contacts + spring, pressed by d from touching.
    press = lambda d: feet * k * max(d, 0.0) ** n + ks * (gap + d) - m * g
    d = brentq(press, -gap, 10 * depth + 1e-9)
    x = np.nan if feet == 4 else 0.0
    return Scene(
        text,
        lambda t: still(t, p=(x, 0, radius - d)),
        {"p": max(abs(d), 1e-3 * gap)},
        f"{feet} feet, {gap:.1e} m above, depth {d:.1e} m, exponent {n}{', spring' if ks else ''}",
    )


def elastic_on_stop(r):
    """A slide carries a beam across its way and falls on a stop: the beam swings on, the slide bounces"""
    L, m, s = sizes(r, slender=(15, 50), shapes=("rectangle", "circle"))
    EI, rhoA = m["E"] * s["iz"], m["rho"] * s["area"]
    mass = rhoA * L * 10 ** r.uniform(-0.5, 0.7)
    w1 = 3.516 / L**2 * math.sqrt(EI / rhoA)
    k = (mass + rhoA * L) * (w1 * 10 ** r.uniform(-0.5, 0.6)) ** 2
    v0 = SMALL_SPEED * L * w1 * r.uniform(0.2, 1)
    gap = v0 / w1 * r.uniform(0.2, 2)
    T = 2 * math.pi / w1
    duration = gap / v0 + T * r.uniform(1, 2.5)
    text = (
        simulation(duration, 300 / duration)
        + rigid("slide", mass, (mass * L * L,) * 3)
        + beam("arm", L, s["text"], m)
        + joint(
            "guide",
            "prismatic",
            "ground",
            "slide",
            f"axis = [0, 1, 0]\ninitial = {{ value = {gap!r}, rate = {-v0!r} }}\nstop = {{ lower = 0.0, stiffness = {k!r} }}",
        )
        + weld("hold", "slide", "arm.root")
        + output("x", "guide", "value")
        + output("tip", "arm.tip", "position")
    )

    def truth(t):
        n = 10
        G = m["E"] / (2 * (1 + m["poisson"]))
        M, K = beam_matrices(L, EI, rhoA, kGA=s["shear_y"] * G * s["area"], rhoI=m["rho"] * s["iz"], elements=n)
        # The root moves by x: every node with it.
        one = np.zeros(2 * n)
        one[0::2] = 1.0
        full = np.zeros((2 * n + 1,) * 2)
        full[1:, 1:] = M
        full[0, 1:] = full[1:, 0] = M @ one
        full[0, 0] = mass + rhoA * L
        full[0, 1:] += root_coupling(L, s, m, n)
        full[1:, 0] = full[0, 1:]
        stiff = np.zeros_like(full)
        stiff[1:, 1:] = K
        pressed = stiff.copy()
        pressed[0, 0] += k
        modes = [eigh(S, full) for S in (stiff, pressed)]
        state_q, state_v = np.zeros(2 * n + 1), np.zeros(2 * n + 1)
        state_q[0], state_v[0] = gap, -v0
        now, mode, out = 0.0, 0, []
        fine = T / 400 / max(1.0, math.sqrt(k / (mass + rhoA * L)) / w1)
        pieces = []

        def at(mode, q, v, x):
            w2, A = modes[mode]
            w = np.sqrt(np.maximum(w2, 0.0))
            a, b = A.T @ full @ q, A.T @ full @ v
            still_ones = w < 1e-6 * w[-1] if mode == 0 else w < 0
            safe = np.where(still_ones, 1.0, w)
            qq = np.where(still_ones, a + b * x, a * np.cos(w * x) + b / safe * np.sin(w * x))
            vv = np.where(still_ones, b, -a * w * np.sin(w * x) + b * np.cos(w * x))
            return A @ qq, A @ vv

        while now < duration and len(pieces) < 400:
            pieces.append((now, mode, state_q, state_v))
            x, hit = fine, None
            while now + x < duration + fine:
                if (at(mode, state_q, state_v, x)[0][0] < 0) != (mode == 1) and x > 1.5 * fine:
                    low, high = x - fine, x
                    for _ in range(60):
                        mid = 0.5 * (low + high)
                        if (at(mode, state_q, state_v, mid)[0][0] < 0) != (mode == 1):
                            high = mid
                        else:
                            low = mid
                    hit = high
                    break
                x += fine
            if hit is None:
                break
            state_q, state_v = at(mode, state_q, state_v, hit)
            now, mode = now + hit, 1 - mode
        for s_ in t:
            begin, md, q, v = [p for p in pieces if p[0] <= s_][-1]
            out.append(at(md, q, v, s_ - begin)[0])
        out = np.array(out)
        tip = out[:, 0] + out[:, -2]
        return {"x": out[:, :1], "tip": np.stack([np.full(len(t), L), tip, 0 * tip], axis=1)}

    return Scene(
        text, truth, {}, f"slide {mass / (rhoA * L):.2g} beams, stop {math.sqrt(k / (mass + rhoA * L)) / w1:.2g} of the first frequency"
    )


SMALL_SPEED = 1e-3


def root_coupling(L, s, m, n):
    """Inertia between the root's motion and the free nodes' that the mass matrix of the held beam leaves out: the first element's."""
    _, M = beam_element(L / n, m, s)
    # Of the first element: rows of the far node (v, turn about z) against the near node's v and turn, the latter held.
    out = np.zeros(2 * n)
    out[0], out[1] = M[7, 1], M[11, 1]
    return out


def twitching_drive(r):
    """A drive that rests, but for a short smooth twitch, shakes a mass on a spring; or a torque does that twitches"""
    m, k = 10 ** r.uniform(-2, 2), 10 ** r.uniform(1, 5)
    w = math.sqrt(k / m)
    T = 2 * math.pi / w
    duration = T * r.uniform(3, 30)
    at, width = duration * r.uniform(0.2, 0.8), T * 10 ** r.uniform(-3, -0.5)
    bell = f"exp(-((t - {at!r})/{width!r})^2)"
    g = lambda t: math.exp(-(((t - at) / width) ** 2))
    form = pick(r, "slide", "turn", "torque")
    stops = [at + i * width for i in range(-7, 8)]
    if form == "torque":
        A = 10 ** r.uniform(-2, 2)
        text = (
            simulation(duration, 300 / duration)
            + rigid("wheel", 1.0, (m, m, m))
            + joint("shaft", "revolute", "ground", "wheel", f"spring = {{ stiffness = {k!r} }}")
            + force("torque", "wheel", f"{A!r}*{bell}", (0, 0, 1))
            + output("x", "shaft", "value")
        )

        def truth(t):
            f = lambda s, y: [y[1], (A * g(s) - k * y[0]) / m]
            y = restarted(f, [], [0.0, 0.0], t, stops=stops, scale=A * width / m / w)
            return {"x": y[:, :1]}

    else:
        A = 10 ** r.uniform(-4, -1)
        kind = "prismatic" if form == "slide" else "revolute"
        axis = "axis = [1, 0, 0]\n" if form == "slide" else ""
        text = (
            simulation(duration, 300 / duration)
            + rigid("drive", 1.0, (1, 1, 1))
            + rigid("bob", m, (m, m, m))
            + joint("motor", kind, "ground", "drive", f'{axis}motion = "{A!r}*{bell}"')
            + joint("spring", kind, "drive", "bob", f"{axis}spring = {{ stiffness = {k!r} }}")
            + output("x", "spring", "value")
        )

        def truth(t):
            # Relative to the drive: x'' + w^2 x = -drive''.
            dd = lambda s: A * g(s) * (4 * (s - at) ** 2 / width**2 - 2) / width**2
            y = restarted(lambda s, y: [y[1], -dd(s) - w * w * y[0]], [], [0.0, 0.0], t, stops=stops, scale=A * w * width)
            return {"x": y[:, :1]}

    # Between two samples the twitch itself may pass unseen; what it leaves is what counts.
    return Scene(text, truth, {}, f"{form}, width {width / T:.1e} periods of {duration / T:.0f}")


def in_any_unit(r):
    """A body on a spring, free in the plane, drawn in micrometres, millimetres or kilometres, with units in the scene"""
    unit, size = pick(r, ("um", 1e-6), ("mm", 1e-3), ("km", 1e3))
    a = r.uniform(5, 50)
    mass_unit, mass_size = {"um": ("1e-9 g", 1e-12), "mm": ("g", 1e-3), "km": ("t", 1e3)}[unit]
    m = r.uniform(1, 20)
    w = 10 ** r.uniform(-1, 1) * {"um": 1e3, "mm": 10.0, "km": 0.05}[unit]
    k = m * mass_size * w * w
    stretch, q0 = a * r.uniform(0.9, 1.1), r.uniform(-0.5, 0.5)
    g = w * w * a * size * r.uniform(0.01, 0.3)
    c = 2 * m * mass_size * w * pick(r, 0.0, 0.02)
    duration = 2 * math.pi / w * r.uniform(2, 5)
    mass_text = f'"{m * 1e-9!r} g"' if unit == "um" else f'"{m!r} {mass_unit}"'
    x0, y0 = a * size * math.sin(q0), -a * size * math.cos(q0)
    text = (
        f"[simulation]\nduration = {duration!r}\noutput_rate = {200 / duration!r}\ngravity = [0, {-g!r}, 0]\n\n"
        f'[ground]\nframes = {{ pin = [0, "{a / 2!r} {unit}", 0] }}\n\n'
        f'[[body]]\nname = "bob"\nkind = "rigid"\nmass = {mass_text}\ninertia = {[m * mass_size * size**2] * 3}\n\n'
        + joint("way", "planar", "ground", "bob", f'position = ["{a * math.sin(q0)!r} {unit}", "{-a * math.cos(q0)!r} {unit}", 0]')
        + f'[[force]]\nkind = "spring-damper"\non = "bob"\nfrom = "ground.pin"\nstiffness = {k!r}\ndamping = {c!r}\n'
        f'rest = "{stretch * 1.5!r} {unit}"\n\n' + output("p", "bob", "position")
    )

    def truth(t):
        # In units of the drawing.
        def f(_, y):
            d = np.array([y[0], y[1] - a / 2])
            L = np.linalg.norm(d)
            F = k * (L - 1.5 * stretch) + c * (d @ y[2:]) / L
            acc = -F * d / L / (m * mass_size) + [0, -g / size]
            return np.r_[y[2:], acc]

        y = ode(f, [x0 / size, y0 / size, 0, 0], t, scale=a)
        return {"p": size * np.stack([y[:, 0], y[:, 1], 0 * t], axis=1)}

    return Scene(text, truth, {}, f"{a:.3g} {unit}, {w:.2g} rad/s")


def orbit(r):
    """A satellite on its way round a planet: a force that reads the place, sizes of 1e7 m, no joint but a free one"""
    mu = 3.986e14 * 10 ** r.uniform(-1, 1)
    radius, e = 10 ** r.uniform(6.8, 7.8), r.uniform(0.0, 0.6)
    # From the near point of the ellipse.
    v = math.sqrt(mu * (1 + e) / radius)
    a = radius / (1 - e)
    n = math.sqrt(mu / a**3)
    duration = 2 * math.pi / n * r.uniform(0.5, 2)
    m = 10 ** r.uniform(0, 4)
    law = "(p.x^2 + p.y^2)^1.5"
    text = (
        simulation(duration, 200 / duration)
        + rigid("satellite", m, (m, m, m))
        + joint(
            "flight", "free", "ground", "satellite", f"initial = {{ value = [{radius!r}, 0, 0, 0, 0, 0], rate = [0, {v!r}, 0, 0, 0, 0] }}"
        )
        + force("force", "satellite", f"{-mu * m!r}*p.x/{law}", (1, 0, 0))
        + force("force", "satellite", f"{-mu * m!r}*p.y/{law}", (0, 1, 0))
        + output("p", "satellite", "position")
    )

    def truth(t):
        E = np.array([brentq(lambda x, s=s: x - e * math.sin(x) - n * s, n * s - 1, n * s + 1, xtol=1e-14) for s in t])
        return {"p": np.stack([a * (np.cos(E) - e), a * math.sqrt(1 - e * e) * np.sin(E), 0 * t], axis=1)}

    return Scene(text, truth, {}, f"from {radius:.2g} m, eccentricity {e:.2g}, {duration * n / 6.283:.2g} turns")


def light_and_heavy(r):
    """Two to four bodies of very different masses in a row of springs and dampers, or hung on one another; a long row of periods"""
    n = r.randint(2, 4)
    masses = [10 ** r.uniform(-5, 4) for _ in range(n)]
    k = [10 ** r.uniform(1, 6) for _ in range(n)]
    M = np.diag(masses)
    K = np.zeros((n, n))
    K[0, 0] = k[0]
    for i in range(1, n):
        K[i - 1 : i + 1, i - 1 : i + 1] += k[i] * np.array([[1, -1], [-1, 1]])
    w2, A = eigh(K, M)
    slow, fast = math.sqrt(w2[0]), math.sqrt(w2[-1])
    if fast / slow > 3e3:
        return None
    duration = 2 * math.pi / slow * r.uniform(1, 4)
    x0 = [r.uniform(-1, 1) * 10 ** r.uniform(-3, 0) for _ in range(n)]
    text, before = simulation(duration, 400 / duration), "ground"
    for i in range(n):
        value = x0[i] - (x0[i - 1] if i else 0.0)
        text += rigid(f"b{i}", masses[i], (masses[i],) * 3)
        text += joint(
            f"j{i}",
            "prismatic",
            before,
            f"b{i}",
            f"axis = [1, 0, 0]\ninitial = {{ value = {value!r} }}\nspring = {{ stiffness = {k[i]!r} }}",
        )
        text += output(f"x{i}", f"b{i}", "position")
        before = f"b{i}"

    def truth(t):
        q = (A.T @ M @ np.array(x0))[None, :] * np.cos(np.sqrt(w2)[None, :] * t[:, None])
        x = q @ A.T
        return {f"x{i}": np.stack([x[:, i], 0 * t, 0 * t], axis=1) for i in range(n)}

    return Scene(text, truth, {}, f"masses {', '.join(f'{x:.1e}' for x in masses)} kg, frequencies apart by {fast / slow:.2g}")


def steered_beam(r):
    """An elastic arm on a motor held by a controller that reads the motor's angle and the tip: continuous or sampled; small angles"""
    L, m, s = sizes(r, slender=(20, 60), shapes=("rectangle", "circle", "tube"))
    EI, rhoA = m["E"] * s["iz"], m["rho"] * s["area"]
    w1 = 3.516 / L**2 * math.sqrt(EI / rhoA)
    J = rhoA * L**3 * 10 ** r.uniform(-1.0, 0.5)
    total = J + rhoA * L**3 / 3
    wc = w1 * r.uniform(0.1, 0.6)
    P, D = total * wc * wc, 2 * r.uniform(0.3, 0.9) * total * wc
    goal = 1e-3 * r.uniform(0.2, 1)
    sample = 2 * math.pi / w1 * r.uniform(0.02, 0.1) if r.random() < 0.5 else 0.0
    duration = 2 * math.pi / wc * r.uniform(1, 2)
    text = (
        simulation(duration, 300 / duration)
        + rigid("hub", 1.0, (J, J, J))
        + beam("arm", L, s["text"], m)
        + joint("motor", "revolute", "ground", "hub")
        + weld("hold", "hub", "arm.root")
        + output("angle", "motor", "value")
        + output("rate", "motor", "rate")
        + output("tip", "arm.tip", "position")
        + f'[[block]]\nname = "u"\nkind = "state-space"\ninput = ["{goal!r} - angle", "rate"]\nD = [[{P!r}, {-D!r}]]\n'
        + (f"sample = {sample!r}\n\n" if sample else "\n")
        + force("torque", "hub", "u", (0, 0, 1))
    )

    def truth(t):
        n = 12
        k, mm = beam_element(L / n, m, s)
        pick_ = np.ix_((1, 5, 7, 11), (1, 5, 7, 11))
        size = 2 * (n + 1)
        K, M = np.zeros((size, size)), np.zeros((size, size))
        for e in range(n):
            i = slice(2 * e, 2 * e + 4)
            K[i, i] += k[pick_]
            M[i, i] += mm[pick_]
        M[1, 1] += J
        K, M = K[1:, 1:], M[1:, 1:]  # the root turns, it does not move
        w2, A = eigh(K, M)
        A = A[:, :10]
        w2 = np.maximum(w2[:10], 0)
        w2[0] = 0.0
        b, place = A.T[:, 0], A[-2]
        F = np.zeros((20, 20))
        F[:10, 10:] = np.eye(10)
        F[10:, :10] = -np.diag(w2)
        B = np.r_[np.zeros(10), b]
        C = np.r_[b, np.zeros(10)]
        V = np.r_[np.zeros(10), b]
        x = np.zeros(20)
        out = np.zeros((len(t), 20))
        if not sample:
            closed = F - np.outer(B, P * C + D * V)
            full = np.zeros((21, 21))
            full[:20, :20], full[:20, 20] = closed, B * P * goal
            step = expm(full * (t[1] - t[0]))
            z = np.r_[x, 1.0]
            for i in range(len(t)):
                out[i] = z[:20]
                z = step @ z
        else:
            full = np.zeros((21, 21))
            full[:20, :20], full[:20, 20] = F, B
            held = expm(full * sample)
            now, at, u = 0.0, 0, 0.0
            while at < len(t):
                u = P * (goal - C @ x) - D * (V @ x)
                while at < len(t) and t[at] < now + sample * (1 - 1e-12):
                    part = expm(full * (t[at] - now))
                    out[at] = part[:20, :20] @ x + part[:20, 20] * u
                    at += 1
                x = held[:20, :20] @ x + held[:20, 20] * u
                now += sample
        tip = out[:, :10] @ place
        return {
            "angle": (out[:, :10] @ b)[:, None],
            "tip": np.stack([np.full(len(t), L), tip, 0 * t], axis=1),
        }

    return Scene(
        text,
        truth,
        {},
        f"hub {J / (rhoA * L**3 / 3):.2g} of the arm, {'sampled' if sample else 'continuous'}, {wc / w1:.2g} of its frequency",
    )


KINDS = [
    several_rests,
    snapping,
    above_the_floor,
    elastic_on_stop,
    twitching_drive,
    in_any_unit,
    orbit,
    light_and_heavy,
    steered_beam,
]
