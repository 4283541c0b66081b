"""What outputs tell beside places and forces: energies, power and work, lengths and rates, displacements from chosen frames, blocks."""
import math

import numpy as np
from scene import MATERIALS, Scene, beam, force, joint, output, pick, rigid, section_of, simulation, weld
from truths.formulas import Linear, beam_matrices, bending_element, ode


def swinging_spring(r):
    """A body swings on a spring and damper under a force to and fro; length, rate, pull, power, work and the energies"""
    m, L = 10 ** r.uniform(-1, 1), 10 ** r.uniform(-1, 1)
    g = 9.81
    w = math.sqrt(g / L)
    k, c, preload = m * w * w * 10 ** r.uniform(1, 2), m * w * r.uniform(0, 0.3), m * g * r.uniform(-0.5, 0.5)
    F, wf = m * g * r.uniform(0.05, 0.5), w * r.uniform(0.3, 4)
    a, height = r.uniform(-2, 2), L * r.uniform(-1, 2)
    start = np.array([L * math.sin(a), height - L * math.cos(a)])
    drag = m / L * pick(r, 0.0, r.uniform(0, 0.3))
    kj = m * w * w * pick(r, 0.0, r.uniform(0, 1))  # of the joint's own springs
    duration = 2 * math.pi / w * r.uniform(0.5, 2)
    spring_of_joint = f"\nspring = {{ stiffness = {kj!r} }}" if kj else ""
    text = (
        simulation(duration, 400 / duration, (0, -g, 0))
        + f"[ground]\nframes = {{ nail = [0, {height!r}, 0] }}\n\n"
        + rigid("bob", m, [m * L * L] * 3)
        + joint("plane", "planar", "ground", "bob", f"initial = {{ value = [{start[0]!r}, {start[1]!r}, 0] }}{spring_of_joint}")
        + f'[[force]]\nname = "s"\nkind = "spring-damper"\non = "bob"\nfrom = "ground.nail"\nstiffness = {k!r}\ndamping = {c!r}\n'
        + f"rest = {L!r}\npreload = {preload!r}\n\n"
        + force("force", "bob", f"{F!r}*cos({wf!r}*t)", (1, 0, 0), 'name = "shaker"')
        + (f'[[force]]\nname = "air"\nkind = "drag"\non = "bob"\nquadratic = {drag!r}\n\n' if drag else "")
        + output("place", "bob", "position")
        + "".join(output(n, "s", q) for n, q in (("long", "length"), ("faster", "length_rate"), ("pull", "force")))
        + "".join(output(f"{q}_{n}", n, q) for n in ("s", "shaker") for q in ("power", "work"))
        + "".join(output(q, "system", q) for q in ("energy", "kinetic", "potential", "strain"))
        + output("of_bob", "bob", "velocity")
    )
    nail = np.array([0, height])

    def line(y):
        d = y[:2] - nail
        n = np.linalg.norm(d)
        return d / n, n, d @ y[2:4] / n

    pull = lambda length, rate: k * (length - L) + c * rate + preload

    def f(t, y):
        e, length, rate = line(y)
        p, v = pull(length, rate), y[2:4]
        f0 = F * math.cos(wf * t)
        a = (-p * e + [f0, 0] - kj * y[:2] - drag * np.linalg.norm(v) * v) / m - [0, g]
        return np.concatenate([v, a, [-p * rate, f0 * v[0]]])

    def truth(t):
        y = ode(f, np.concatenate([start, np.zeros(4)]), t)
        at = [line(z) for z in y]
        length, rate = np.array([z[1] for z in at]), np.array([z[2] for z in at])
        p, f0 = pull(length, rate), F * np.cos(wf * t)
        kinetic = m / 2 * (y[:, 2:4] ** 2).sum(1)
        d = length - L
        potential = m * g * y[:, 1] + k / 2 * d**2 + preload * d + kj / 2 * (y[:, :2] ** 2).sum(1)
        none = 0 * t
        values = {
            "long": length,
            "faster": rate,
            "pull": p,
            "power_s": -p * rate,
            "work_s": y[:, 4],
            "power_shaker": f0 * y[:, 2],
            "work_shaker": y[:, 5],
            "energy": kinetic + potential,
            "kinetic": kinetic,
            "potential": potential,
            "strain": none,
        }
        return {n: v[:, None] for n, v in values.items()} | {
            "place": np.stack([y[:, 0], y[:, 1], none], 1),
            "of_bob": np.stack([y[:, 2], y[:, 3], none], 1),
        }

    whole = m * g * L
    return Scene(text, truth, {"strain": whole}, f"{k / m / w / w:.2g} m g / L, from {math.degrees(a):.0f} degrees")


def shown_from(r):
    """A beam at rest under a load, clamped or on two bearings: displacements from joints, chord, frames or mean axes"""
    L = 10 ** r.uniform(-1, 1)
    s, m = section_of(r, "rectangle", L / r.uniform(40, 80)), pick(r, *MATERIALS)
    EI, h = m["E"] * s["iz"], 60
    clamped = r.random() < 0.6
    place = 1.0 if clamped and r.random() < 0.5 else pick(r, 0.25, 0.5, 0.75)
    u0 = 1e-3 * L
    F = u0 * (3 if clamped else 48) * EI / L**3 * pick(r, 1, -1)
    shown = pick(r, '"joints"', '"frame"', '"mean"', '["root", "tip"]', '["tip"]', '["third", "tip"]', '["root"]')
    angle, motion = r.uniform(-3, 3), r.random() < 0.3
    # Small deflection: deflections and slopes of 60 elements in the beam's own axes; the bearings or the clamp stay.
    n, l = 2 * (h + 1), L / h
    K = np.zeros((n, n))
    for e in range(h):
        i = slice(2 * e, 2 * e + 4)
        K[i, i] += bending_element(l, EI)[1]
    f = np.zeros(n)
    at = round(place * h)
    f[2 * at] = F
    free = list(range(2, n)) if clamped else [i for i in range(n) if i not in (0, n - 2)]
    u = np.zeros(n)
    u[free] = np.linalg.solve(K[np.ix_(free, free)], f[free])
    y, slope, x = u[::2], u[1::2], np.linspace(0, L, h + 1)
    ends = {"root": 0, "tip": h, "third": h // 3}
    if shown == '"mean"':
        # Mean of u and of x cross u over the mass; cubic within elements: four points of Gauss.
        xi, wg = np.polynomial.legendre.leggauss(4)
        xi, wg = (xi + 1) / 2, wg / 2
        N = np.array([1 - 3 * xi**2 + 2 * xi**3, l * (xi - 2 * xi**2 + xi**3), 3 * xi**2 - 2 * xi**3, l * (xi**3 - xi**2)])
        v = np.array([u[2 * e : 2 * e + 4] @ N for e in range(h)]).ravel()
        X, W = np.array([(e + xi) * l for e in range(h)]).ravel(), np.tile(wg, h) * l
        A = np.array([[W.sum(), (W * X).sum()], [(W * X).sum(), (W * X * X).sum()]])
        b, a = np.linalg.solve(A, [(W * v).sum(), (W * X * v).sum()])
    elif shown.startswith("[") and "," in shown:
        i, j = (ends[n] for n in shown.strip("[]").replace('"', "").split(", "))
        a = (y[j] - y[i]) / (x[j] - x[i])
        b = y[i] - a * x[i]
    elif shown.startswith("["):
        i = ends[shown.strip('[]"')]
        a, b = slope[i], y[i] - slope[i] * x[i]
    elif shown == '"frame"' and not clamped:
        return None  # how the elastic coordinates are counted is the model's choice
    else:
        a, b = 0.0, 0.0
    want = y - a * x - b
    turned = f"rotation = [0, 0, {angle!r}]"
    if clamped and motion:
        hold = joint("clamp", "revolute", "ground", "bar.root", f'{turned}\nmotion = "{r.uniform(-3, 3)!r}"')
    elif clamped:
        hold = weld("clamp", "ground", "bar.root", turned)
    else:
        c, d = math.cos(angle), math.sin(angle)
        hold = joint("a", "revolute", "ground", "bar.root", f"{turned}") + joint(
            "b", "point-on-line", "ground", "bar.tip", f"axis = {[c, d, 0.0]}"
        )
    # What is shown from itself does not move.
    places = {"tip": 1, "third": 1 / 3, "middle": 0.5, "load": place}
    places = {n: p for n, p in places.items() if abs(np.interp(p * L, x, want)) > 1e-6 * u0}
    more = f"shown = {shown}\nelements = 12\nframes = {{ third = {1 / 3!r}, load = {place!r}, middle = 0.5 }}"
    text = (
        simulation(0.001, 2000, (0, 0, 0), start="static")
        + beam("bar", L, s["text"], m, more)
        + hold
        + force("force", "bar.load", F, (0, 1, 0), 'frame = "body"')
        + "".join(output(f"u_{n}", f"bar.{n}", "displacement") for n in places)
        + output("chord", "bar.middle", "displacement", 'relative_to = ["root", "tip"]')
    )

    def truth(t):
        read = lambda v: np.tile([0, v, 0], (len(t), 1))
        out = {f"u_{n}": read(np.interp(p * L, x, want)) for n, p in places.items()}
        out["chord"] = read(y[h // 2] - (y[0] + y[h]) / 2)
        return out

    scales = {f"u_{n}": u0 for n in places} | {"chord": u0}
    return Scene(text, truth, scales, f"{'clamped' if clamped else 'on bearings'}, shown from {shown}")


def outputs_of_blocks(r):
    """What a filter of any order, a state space with two outputs and a sampled gain say of inputs that wave, jump or grow"""
    w = 10 ** r.uniform(-1, 3)
    order = r.randrange(1, 5)
    poles = []
    while len(poles) < order:
        if order - len(poles) > 1 and r.random() < 0.5:
            z, f = r.uniform(0.05, 0.9), w * r.uniform(0.3, 3)
            poles += [complex(-z * f, f * math.sqrt(1 - z * z)), complex(-z * f, -f * math.sqrt(1 - z * z))]
        else:
            poles.append(-w * r.uniform(0.3, 3))
    den = np.poly(poles).real
    num = np.array([r.uniform(-1, 1) * abs(den[-1]) / w**i for i in range(r.randrange(1, order + 2))][::-1])
    A = np.array([[-r.uniform(0.1, 2), r.uniform(-2, 2)], [r.uniform(-2, 2), -r.uniform(0.1, 2)]]) * w
    if np.linalg.eigvals(A).real.max() > 0:
        return None
    B, C, D = (np.array([[r.uniform(-1, 1) for _ in range(2)] for _ in range(2)]) * q for q in (w, 1.0, pick(r, 0.0, 1.0)))
    x0 = [r.uniform(-1, 1) for _ in range(2)]
    duration = 2 * math.pi / w * r.uniform(1, 5)
    A1, w1, t1 = r.uniform(0.2, 2), w * r.uniform(0.2, 3), duration * r.uniform(0.1, 0.8)
    first, second = lambda t: A1 * np.sin(w1 * t), lambda t: np.where(t > t1, 1.0, 0.0) + t / duration
    texts = f"{A1!r}*sin({w1!r}*t)", f"(t > {t1!r} ? 1 : 0) + t/{duration!r}"
    sample, gain = duration / r.randrange(5, 40), r.uniform(-3, 3)
    matrix = lambda M: str([[float(v) for v in row] for row in M])
    listed = lambda v: str([float(x) for x in v])
    text = (
        simulation(duration, 300 / duration)
        + rigid("b", 1.0, (1, 1, 1))
        + joint("j", "prismatic", "ground", "b", "")
        + f'[[block]]\nname = "filter"\nkind = "transfer-function"\ninput = "{texts[0]} + {texts[1]}"\n'
        + f"numerator = {listed(num)}\ndenominator = {listed(den)}\n\n"
        + f'[[block]]\nname = "two"\nkind = "state-space"\ninput = ["{texts[0]}", "{texts[1]}"]\n'
        + f"A = {matrix(A)}\nB = {matrix(B)}\nC = {matrix(C)}\nD = {matrix(D)}\ninitial = {listed(x0)}\n\n"
        + f'[[block]]\nname = "held"\nkind = "state-space"\ninput = "{texts[0]}"\nD = [[{gain!r}]]\nsample = {sample!r}\n\n'
        + "".join(output(f"of_{n}", n, "output") for n in ("filter", "two", "held"))
    )

    def response(a, b, c, d, u, x, t):
        """Piece by piece, so that no step passes over the jump."""
        t1_ = [t[t <= t1], t[t > t1]]
        f = lambda s, y: a @ y + b @ u(s)
        y1 = ode(f, x, np.concatenate([t1_[0], [t1]]), atol=1e-13)
        later = lambda s: u(max(s, t1 * (1 + 1e-14)))
        y2 = ode(lambda s, y: a @ y + b @ later(s), y1[-1], np.concatenate([[t1], t1_[1]]), atol=1e-13)
        y = np.concatenate([y1[:-1], y2[1:]])
        return y @ c.T + np.array([u(s) for s in t]) @ d.T

    def truth(t):
        n = len(den) - 1
        padded = np.concatenate([np.zeros(n + 1 - len(num)), num]) / den[0]
        a = np.zeros((n, n))
        a[0] = -den[1:] / den[0]
        a[1:, :-1] += np.eye(n - 1)
        b = np.zeros((n, 1))
        b[0] = 1
        c = (padded[1:] - padded[0] * den[1:] / den[0])[None, :]
        sum_of = lambda s: np.array([float(first(s) + second(s))])
        both = lambda s: np.array([float(first(s)), float(second(s))])
        k = np.maximum(np.ceil(t / sample - 1e-9) - 1, 0)  # what jumps is told as it was before
        return {
            "of_filter": response(a, b, c, np.array([[padded[0]]]), sum_of, np.zeros(n), t),
            "of_two": response(A, B, C, D, both, np.array(x0), t),
            "of_held": gain * first(k * sample)[:, None],
        }

    return Scene(text, truth, {}, f"order {order}, {len(num) - 1} zeros, {duration / sample:.2g} samples")


def discs_on_beam(r):
    """A clamped beam whose section says more rotary inertia than its area has, pushed at its tip at once"""
    L, m = 10 ** r.uniform(-1, 1), pick(r, *MATERIALS)
    height = L / r.uniform(15, 40)
    s = section_of(r, "rectangle", height)
    more = r.uniform(2, 60)
    A, iz, k = s["area"], s["iz"], 5 / 6
    G = m["E"] / (2 * (1 + m["poisson"]))
    section = (
        f'{{ shape = "general", area = {A!r}, iy = {s["iy"]!r}, iz = {iz!r}, j = {s["j"]!r}, shear_y = {k!r}, shear_z = {k!r}, '
        f"rotary_iz = {more * iz!r} }}"
    )
    system = Linear(*beam_matrices(L, m["E"] * iz, m["rho"] * A, 24, k * G * A, m["rho"] * iz * more))
    F = 1e-3 * L * 3 * m["E"] * iz / L**3
    w1 = 3.516 * math.sqrt(m["E"] * iz / (m["rho"] * A)) / L**2
    duration = 2 * math.pi / w1 * r.uniform(1, 3)
    text = (
        simulation(duration, 100 / duration)
        + beam("bar", L, section, m)
        + weld("clamp", "ground", "bar.root")
        + force("force", "bar.tip", F, (0, 1, 0))
        + output("tip", "bar.tip", "displacement")
    )

    def truth(t):
        f = np.zeros(48)
        f[-2] = 1.0
        u = system.respond(f, lambda s: F + 0 * s, t)[:, -2]
        return {"tip": np.stack([0 * t, u, 0 * t], 1)}

    return Scene(text, truth, {}, f"length/height {L / height:.2g}, rotary inertia {more:.2g} times")


KINDS = [swinging_spring, shown_from, outputs_of_blocks, discs_on_beam]
