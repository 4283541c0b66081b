"""Scenes as a stranger writes them from the pages: friction by reactions, massless points, tables, statespace bodies, shaken beams."""
import math

import numpy as np
from kinds.rich import first_bending
from scene import Scene, beam, force, joint, output, pick, rigid, simulation, sizes, spring, weld
from scipy.interpolate import CubicSpline
from scipy.linalg import expm
from truths.formulas import Linear, beam_matrices, ode, piecewise


def still(t, **values):
    return {k: np.tile(np.asarray(v, float), (len(t), 1)) for k, v in values.items()}


def rubbing_pendulum(r):
    """A heavy pendulum whose pin rubs with its own reaction, its bearing of any radius; it comes to rest off its lowest place"""
    L, m = 10 ** r.uniform(-1.5, 1), 10 ** r.uniform(-1, 2)
    g = 9.81 * pick(r, 1.0, 1.0, 0.17)
    J = m * L * L * r.uniform(0.02, 0.5)  # about the centre of mass
    rho, mu = L * r.uniform(0.02, 0.2), r.uniform(0.05, 0.5)
    static = mu * pick(r, 1.0, r.uniform(1.0, 1.6))
    start, rate = r.uniform(-2.5, 2.5), pick(r, 0.0, r.uniform(-2, 2)) * math.sqrt(g / L)
    I, w = J + m * L * L, math.sqrt(g / L)

    def pin(a, v, acceleration):
        # Along the arm and across it; a counts from hanging down.
        return math.hypot(m * (L * v * v + g * math.cos(a)), m * (L * acceleration + g * math.sin(a)))

    def push(a, v, sign):
        # I a'' = -m g L sin a - sign rho mu N(a''), N from a'': a square equation; Newton from N at no friction.
        acceleration = -m * g * L * math.sin(a) / I
        for _ in range(60):
            f = I * acceleration + m * g * L * math.sin(a) + sign * rho * mu * pin(a, v, acceleration)
            n = max(pin(a, v, acceleration), 1e-300)
            slope = I + sign * rho * mu * m * L * m * (L * acceleration + g * math.sin(a)) / n
            step = f / slope
            acceleration -= step
            if abs(step) < 1e-14 * (g / L):
                break
        return acceleration

    holds = lambda a: abs(m * g * L * math.sin(a)) <= rho * static * m * g

    def f_of(mode):
        return (lambda t, y: [0.0, 0.0]) if mode == 0 else (lambda t, y: [y[1], push(y[0], y[1], mode)])

    def events_of(mode):
        if mode == 0:
            return []
        stops = lambda t, y: y[1]
        stops.direction = -mode
        return [(stops, lambda t, y: 0 if holds(y[0]) else -mode)]

    begin = int(np.sign(rate)) or (0 if holds(start) else -int(np.sign(math.sin(start))))
    duration = 2 * math.pi / w * r.uniform(1, 4)

    def truth(t):
        y = piecewise(f_of, events_of, [start, rate], begin, t, rtol=1e-10, atol=1e-12)
        return {"angle": y[:, :1]}

    text = (
        simulation(duration, 200 / duration, (0, -g, 0))
        + rigid("arm", m, (J, J, J), centre=(L, 0, 0))
        + joint(
            "pin",
            "revolute",
            "ground",
            "arm",
            f"rotation = [0, 0, {-math.pi / 2!r}]\ninitial = {{ value = {start!r}, rate = {rate!r} }}\n"
            f'friction = {{ coefficient = {mu!r}, static_coefficient = {static!r}, normal_force = "reaction", radius = {rho!r} }}',
        )
        + output("angle", "pin", "value")
    )
    return Scene(
        text, truth, {"angle": abs(start) + abs(rate) / w}, f"radius {rho / L:.2g} of the arm, mu {mu:.2g}, {static / mu:.2g} static"
    )


def pressed_slide(r):
    """A slide that rubs with its own reaction is pushed obliquely, to and fro, on an incline; pressed by its own acceleration too"""
    m, g = 10 ** r.uniform(-1, 1.5), 9.81
    mu = r.uniform(0.05, 0.4)
    static = mu * pick(r, 1.0, 1.3)
    tilt = r.uniform(-0.3, 0.3)
    F, w = m * g * r.uniform(0.5, 3), 2 * math.pi * 10 ** r.uniform(-0.5, 1)
    a = r.uniform(-0.6, 0.6)  # of the force, from the way
    along = lambda t: F * math.cos(a) * math.sin(w * t) - m * g * math.sin(tilt)
    normal = lambda t: abs(F * math.sin(a) * math.sin(w * t) - m * g * math.cos(tilt))

    def f_of(mode):
        if mode == 0:
            return lambda t, y: [0.0, 0.0]
        return lambda t, y: [y[1], (along(t) - mode * mu * normal(t)) / m]

    def goes(t):
        """The way it is torn off at t, a little later too."""
        return 0 if abs(along(t)) <= static * normal(t) else int(np.sign(along(t)))

    def events_of(mode):
        if mode == 0:
            tears = lambda t, y: abs(along(t)) - static * normal(t)
            tears.direction = 1
            return [(tears, lambda t, y: int(np.sign(along(t))))]
        stops = lambda t, y: y[1]
        stops.direction = -mode
        return [(stops, lambda t, y: goes(t))]

    duration = 2 * math.pi / w * r.uniform(1.2, 3)

    def truth(t):
        y = piecewise(f_of, events_of, [0.0, 0.0], goes(0.0), t, rtol=1e-10, atol=1e-12, max_step=duration / 2000)
        return {"x": y[:, :1], "v": y[:, 1:]}

    c, s = math.cos(tilt), math.sin(tilt)
    text = (
        simulation(duration, 200 / duration, (0, -g, 0))
        + rigid("slide", m, (m, m, m))
        + joint(
            "rail",
            "prismatic",
            "ground",
            "slide",
            f"axis = [{c!r}, {s!r}, 0]\ninitial = {{ value = 0, rate = 0 }}\n"
            f'friction = {{ coefficient = {mu!r}, static_coefficient = {static!r}, normal_force = "reaction" }}',
        )
        + force("force", "slide", f"{F!r}*sin({w!r}*t)", (math.cos(tilt + a), math.sin(tilt + a), 0))
        + output("x", "rail", "value")
        + output("v", "rail", "rate")
    )
    return Scene(text, truth, {}, f"mu {mu:.2g}, force {F / m / g:.2g} of the weight at {math.degrees(a):.0f} degrees")


def maxwell(r):
    """A mass on a spring and a damper in series, a massless point between them; a spring beside them or not"""
    m, T = 10 ** r.uniform(-2, 2), 10 ** r.uniform(-2, 1)
    w = 2 * math.pi / T
    k1, k0 = m * w * w, pick(r, 0.0, m * w * w * r.uniform(0.1, 2))
    c = m * w * 10 ** r.uniform(-1.5, 1.5)
    x0 = 10 ** r.uniform(-4, 0)
    F = k1 * x0 * pick(r, 0.0, 0.5)
    # x of the mass, z of the point between damper (to the ground) and spring (to the mass): c z' = k1 (x - z).
    A = np.array([[0, 1, 0], [-(k0 + k1) / m, 0, k1 / m], [k1 / c, 0, -k1 / c]])
    duration = T * r.uniform(1, 5)

    def truth(t):
        rest = -np.linalg.solve(A, [0, F / m, 0]) if k0 else None
        y0 = np.array([x0, 0.0, 0.0])
        if rest is not None:
            y = np.array([rest + expm(A * s) @ (y0 - rest) for s in t])
        else:
            B = np.zeros((4, 4))
            B[:3, :3], B[1, 3] = A, F / m
            y = np.array([(expm(B * s) @ np.append(y0, 1.0))[:3] for s in t])
        return {"x": y[:, :1], "z": y[:, 2:]}

    d = 10 * x0  # the springs' own length, along the way
    text = (
        simulation(duration, 200 / duration)
        + rigid("mass", m, (m * d * d,) * 3)
        + rigid("point", 0.0, (0, 0, 0))
        + joint(
            "rail",
            "prismatic",
            "ground",
            "mass",
            f"axis = [1, 0, 0]\ninitial = {{ value = {x0!r}, rate = 0 }}" + (f"\nspring = {{ stiffness = {k0!r} }}" if k0 else ""),
        )
        + joint("between", "prismatic", "ground", "point", f"axis = [1, 0, 0]\nposition = [{-d!r}, 0, 0]\nspring = {{ damping = {c!r} }}")
        + spring("mass", "point", k1, rest=d)
        + (force("force", "mass", F, (1, 0, 0)) if F else "")
        + output("x", "rail", "value")
        + output("z", "between", "value")
    )
    return Scene(text, truth, {"x": x0, "z": x0}, f"c {c / (m * w):.2g}, k0 {k0 / k1:.2g}")


def by_table(r):
    """A mass on a spring pushed by a force from a table of time, of its place, or moved by a table; periodic tables too"""
    m, T = 10 ** r.uniform(-2, 2), 10 ** r.uniform(-1.5, 1)
    w = 2 * math.pi / T
    k, c = m * w * w, m * w * r.uniform(0.02, 0.5)
    duration = T * r.uniform(1.5, 4)
    L = 10 ** r.uniform(-3, 0)
    n = r.randint(4, 9)
    kind = pick(r, "time", "periodic", "place", "motion")
    end = duration * 1.02 if kind in ("time", "motion") else duration / r.uniform(1.5, 6)
    x = np.linspace(0, end, n)
    x[1:-1] += [r.uniform(-0.25, 0.25) * end / (n - 1) for _ in range(n - 2)]
    y = np.array([r.uniform(-1, 1) for _ in range(n)])
    if kind == "periodic":
        y[-1] = y[0]
    if kind == "motion":
        y *= L
        s = CubicSpline(x, y)
        table = [[float(a), float(b)] for a, b in zip(x, y)]
        text = (
            simulation(duration, 200 / duration)
            + rigid("mass", m, (m, m, m))
            + joint("rail", "prismatic", "ground", "mass", f"axis = [1, 0, 0]\nmotion = {{ table = {table} }}")
            + output("x", "rail", "value")
            + output("v", "rail", "rate")
            + output("hold", "rail", "reaction")
        )

        def truth(t):
            return {
                "x": s(t)[:, None],
                "v": s(t, 1)[:, None],
                "hold": np.c_[m * s(t, 2), np.zeros((len(t), 2)), np.full((len(t), 3), np.nan)],
            }

        return Scene(text, truth, {}, f"{kind}, {n} points")
    if kind == "place":
        x = np.linspace(-1, 1, n) * L * 1.2
        y = y - np.linspace(0, 1, n)
    y = y * k * L
    s = CubicSpline(x, y, bc_type="periodic" if kind == "periodic" else "not-a-knot")
    value = {
        "time": s,
        "periodic": lambda t: s(np.mod(t, end)),
        "place": lambda q: s(np.clip(q, x[0], x[-1])),
    }[kind]
    load = (lambda t, q: value(q)) if kind == "place" else (lambda t, q: value(t))
    table = [[float(a), float(b)] for a, b in zip(x, y)]
    more = {"time": "", "periodic": f", period = {end!r}", "place": ', of = "rail"'}[kind]
    # A periodic table closes by itself: the last point may be there or not.
    if kind == "periodic" and r.random() < 0.5:
        table = table[:-1]
    x0 = pick(r, 0.0, 0.5 * L)
    text = (
        simulation(duration, 200 / duration)
        + rigid("mass", m, (m, m, m))
        + joint(
            "rail",
            "prismatic",
            "ground",
            "mass",
            f"axis = [1, 0, 0]\ninitial = {{ value = {x0!r} }}\nspring = {{ stiffness = {k!r}, damping = {c!r} }}",
        )
        + f'[[force]]\nkind = "force"\non = "mass"\ndirection = [1, 0, 0]\nvalue = {{ table = {table}{more} }}\n\n'
        + output("x", "rail", "value")
        + output("a", "mass", "acceleration")
    )

    def truth(t):
        f = lambda s_, z: [z[1], (load(s_, z[0]) - k * z[0] - c * z[1]) / m]
        z = ode(f, [x0, 0.0], t, rtol=1e-10, scale=L, max_step=duration / 400)
        a = np.array([f(s_, q)[1] for s_, q in zip(t, z)])
        return {"x": z[:, :1], "a": np.c_[a, np.zeros((len(t), 2))]}

    return Scene(text, truth, {}, f"{kind}, {n} points")


def statespace_body(r):
    """A body given by matrices, welded to the ground, pushed at its ports, with a mass on one of them or a spring"""
    n, ports = r.randint(1, 4), r.randint(1, 2)
    T = 10 ** r.uniform(-2, 0.5)
    w0 = 2 * math.pi / T
    B = np.array([[r.gauss(0, 1) for _ in range(n)] for _ in range(n)])
    omega = w0**2 * (B @ B.T + 0.3 * np.eye(n))
    gamma = w0 * (r.uniform(0, 0.1) * np.eye(n) + r.uniform(0, 0.02) * omega / w0**2)
    m = 10 ** r.uniform(-1, 1)
    sigma = np.array([[r.gauss(0, 1) for _ in range(3 * ports)] for _ in range(n)]) / math.sqrt(m)
    k = m * w0**2 * pick(r, 0.0, r.uniform(0.2, 3))
    F = m * w0**2 * 1e-3 * 10 ** r.uniform(-1, 0)
    d = np.array([r.gauss(0, 1) for _ in range(3)])
    d /= np.linalg.norm(d)
    speed = w0 * r.uniform(0.2, 2)
    duration = T * r.uniform(2, 6)
    names = ["a", "b"][:ports]
    places = {"a": (0.5, 0.0, 0.0), "b": (0.0, 0.4, 0.1)}
    rows = lambda A: "[" + ", ".join(str([float(x) for x in row]) for row in A) + "]"
    points = ", ".join(f"{p} = {list(places[p])}" for p in names)
    # A bushing to the ground at port a, along x, y and z: stiffness k.
    bushing = f'[[force]]\nkind = "bushing"\non = "plant.a"\nfrom = "ground.a"\nstiffness = [{k!r}, {k!r}, {k!r}, 0, 0, 0]\n\n' if k else ""
    text = (
        simulation(duration, 200 / duration)
        + "[ground]\nframes = { a = [0.5, 0, 0] }\n\n"
        + f'[[body]]\nname = "plant"\nkind = "statespace"\nmass = 1.0\ninertia = [1, 1, 1]\nframes = {{ {points} }}\n'
        + f"ports = {names}\n".replace("'", '"')
        + f"omega = {rows(omega)}\ngamma = {rows(gamma / 2)}\nsigma = {rows(sigma)}\n\n"
        + weld("hold", "ground", "plant")
        + bushing
        + force("force", f"plant.{names[-1]}", f"{F!r}*sin({speed!r}*t)", d)
        + "".join(output(p, f"plant.{p}", "displacement") for p in names)
    )

    def truth(t):
        a = sigma[:, :3]
        K, C = omega + k * a @ a.T, gamma
        b = sigma[:, 3 * (ports - 1) :] @ d * F
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-K, -C]])
        f = lambda s, y: A @ y + np.r_[np.zeros(n), b * math.sin(speed * s)]
        y = ode(f, np.zeros(2 * n), t, rtol=1e-10, scale=1e-6)
        return {p: y[:, :n] @ sigma[:, 3 * i : 3 * i + 3] for i, p in enumerate(names)}

    return Scene(text, truth, {}, f"{n} states, {ports} ports, {'bushing' if k else 'free'}")


def shaken_base(r):
    """A clamped beam whose foot is shaken, along an oblique way, sudden or slow; its deflection seen from the foot and the foot's force"""
    L, m, s = sizes(r, slender=(20, 60), shapes=("rectangle", "circle", "tube"))
    rhoA, EI = m["rho"] * s["area"], m["E"] * s["iz"]
    w1 = first_bending(L, m, s)
    zeta = pick(r, 0.0, 0.01, 0.03)
    T = 2 * math.pi / w1
    push, duration = T * r.uniform(0.5, 3), T * r.uniform(3, 6)
    angle = r.uniform(0.3, 1.5)  # of the way, from the beam's axis
    A = 1e-3 * L * r.uniform(0.1, 1) / max(1.0, (T / push) ** 2)
    # A smooth step: s(t) with continuous acceleration.
    x = f"t/{push!r}"
    motion = f"t < {push!r} ? {A!r}*({x} - sin(2*pi*{x})/(2*pi)) : {A!r}"
    more = 'without = ["shear"]\n' + (f"damping = {{ ratio = {zeta} }}" if zeta else "")  # the truth has none
    more += pick(r, "", "", '\nmodel = "modal"\nmodes = { bending_xy = [1, 2, 3, 4], axial = [1] }')
    text = (
        simulation(duration, 250 / duration)
        + beam("mast", L, s["text"], m, more)
        + joint(
            "table",
            "prismatic",
            "ground",
            "mast.root",
            f'axis = [{math.cos(angle)!r}, {math.sin(angle)!r}, 0]\nmotion = "{motion}"',
        )
        + output("tip", "mast.tip", "displacement")
        + output("hold", "table", "reaction")
    )

    def truth(t):
        M, K = beam_matrices(L, EI, rhoA, 30)
        n = len(M)
        # Forces by the foot's acceleration; ratio of every mode.
        line = Linear(M, K, zeta)
        # Deflection v of the nodes moves with 1; the foot's own column is left out, so that the mass matrix of all nodes is needed.
        ones = np.zeros(n)
        ones[0::2] = 1.0
        h = L / 30
        f = -(M @ ones)
        f[0] -= rhoA * h * 9 / 70  # of the first element, from the foot's displacement
        f[1] -= -rhoA * h * h * 13 / 420
        acceleration = lambda s_: np.where(s_ < push, A * 2 * math.pi / push**2 * np.sin(2 * math.pi * s_ / push), 0.0)
        u = line.respond(f * math.sin(angle), acceleration, t, fine=20000)
        return {"tip": np.c_[np.full(len(t), np.nan), u[:, -2], np.zeros(len(t))]}

    return Scene(text, truth, {}, f"step in {push / T:.2g} periods, damping {zeta}{', modal' if 'modal' in more else ''}")


def rolled_strip(r):
    """A clamped strip bent by a moment at its end to a share of a circle, at rest; finite elements, or straight volumes as advised"""
    L, m, s = sizes(r, slender=(60, 200), shapes=("rectangle",))
    EI = m["E"] * s["iz"]
    angle = r.uniform(0.02, 5.0)
    M = angle * EI / L
    more = pick(r, "", 'model = "mixed"', 'model = "mixed"\nvolumes = 10', 'model = "mixed"\nvolumes = 20')
    text = (
        simulation(0.01, 200, start="static")
        + beam("strip", L, s["text"], m, more)
        + weld("wall", "ground", "strip.root")
        + force("torque", "strip.tip", M, (0, 0, 1))
        + output("tip", "strip.tip", "position")
    )
    tip = [L * math.sin(angle) / angle, L * (1 - math.cos(angle)) / angle, 0.0]
    scale = math.hypot(tip[0] - L, tip[1])
    return Scene(
        text,
        lambda t: still(t, tip=tip),
        {"tip": scale},
        f"bent by {math.degrees(angle):.0f} degrees, {more or 'default'}".replace("\n", ", "),
    )


def curved_console(r):
    """A console whose axis is an arc of a circle, in its plane and across it, slender; the truth by Castigliano's integrals"""
    _, m, s = sizes(r, slender=(10, 20), shapes=("circle", "rectangle"))
    h = s["height"]
    angle, R = r.uniform(0.5, 3.0), h * r.uniform(20, 60)
    E, G = m["E"], m["E"] / (2 * (1 + m["poisson"]))
    EIz, EIy, GJ = E * s["iz"], E * s["iy"], G * s["j"]
    across = r.random() < 0.5
    phi, wts = np.polynomial.legendre.leggauss(60)
    phi, wts = (phi + 1) / 2 * angle, wts / 2 * angle
    end = np.array([R * math.sin(angle), R * (1 - math.cos(angle))])
    x, y = R * np.sin(phi), R * (1 - np.cos(phi))
    if across:
        # Load along z: bending about the radial direction and torsion about the tangent.
        dx, dy = end[0] - x, end[1] - y
        t = np.array([np.cos(phi), np.sin(phi)])
        torque, bend = dx * t[1] - dy * t[0], dx * t[0] + dy * t[1]
        u = float((wts * R * (bend**2 / EIy + torque**2 / GJ)).sum())
        F = 3e-3 * R * angle * r.uniform(0.1, 1) / u
        truth = [float(end[0]), float(end[1]), u * F]
        d, scale = (0, 0, 1), u * F
    else:
        a = r.uniform(0, 2 * math.pi)
        d = (math.cos(a), math.sin(a), 0)
        # Moments, pulls and transverse forces of unit forces along x and y; a small load bends as straight arcs do.
        moments = np.array([-(end[1] - y), end[0] - x])
        pulls, cuts = np.array([np.cos(phi), np.sin(phi)]), np.array([-np.sin(phi), np.cos(phi)])
        c = [0.0, 0.0]
        for f, k in ((moments, EIz), (pulls, E * s["area"]), (cuts, s["shear_y"] * G * s["area"])):
            c += (f * (d[0] * f[0] + d[1] * f[1]) * wts * R / k).sum(axis=1)
        F = 1e-3 * EIz / (R * angle) ** 2 * r.uniform(0.1, 1)
        truth = [float(end[0] + c[0] * F), float(end[1] + c[1] * F), 0.0]
        scale = math.hypot(*c) * F
    axis = f'axis = {{ x = "{R!r}*sin(u)", y = "{R!r}*(1 - cos(u))", to = {angle!r} }}'
    more = pick(r, "", "volumes = 20", "volumes = 40")
    text = (
        simulation(0.01, 200, start="static")
        + beam("hook", 1.0, s["text"], m, axis + "\n" + more).replace("length = 1.0\n", "")
        + weld("wall", "ground", "hook.root")
        + force("force", "hook.tip", F, d)
        + output("tip", "hook.tip", "position")
    )
    return Scene(
        text,
        lambda t: still(t, tip=truth),
        {"tip": scale},
        f"{'across' if across else 'in'} its plane, {math.degrees(angle):.0f} degrees, {more}",
    )


def scotch_yoke(r):
    """A pin on a crank runs in the slot of a yoke, free or driven by a torque; spring and dry friction on the yoke's guide, any order"""
    a, mass = 10 ** r.uniform(-2, 0), 10 ** r.uniform(-1, 1)
    J = mass * a * a * 10 ** r.uniform(-0.5, 1)
    w = 2 * math.pi * 10 ** r.uniform(-0.3, 1)
    k = mass * w * w * pick(r, 0.0, r.uniform(0.01, 0.2))
    rub = mass * w * w * a * pick(r, 0.0, r.uniform(0.005, 0.03))
    M = J * w * w * pick(r, 0.0, r.uniform(-0.03, 0.05))
    q0 = r.uniform(0.1, 1.4)
    duration = 2 * math.pi / w * r.uniform(1.3, 3)

    # x = a cos q; (J + m a^2 sin^2) q'' + m a^2 sin cos q'^2 = M + k a^2 sin cos - rub sign(x') dx/dq
    def f_of(sign):
        def f(t, y):
            q, v = y
            s, c = math.sin(q), math.cos(q)
            return [v, (M + k * a * a * s * c + sign * rub * a * s - mass * a * a * s * c * v * v) / (J + mass * a * a * s * s)]

        return f

    def events_of(sign):
        turns = lambda t, y: math.sin(y[0])  # x' = -a sin(q) q' changes its sign
        turns.direction = -1 if sign < 0 else 1
        turns.terminal = True
        return [(turns, lambda t, y: -sign)]

    def truth(t):
        # The sign of x' is that of -sin q while q' > 0.
        y = piecewise(f_of, events_of, [q0, w], -1, t, rtol=1e-10, atol=1e-12)
        if (y[:, 1] < 0.1 * w).any():
            return {"x": np.full((len(t), 1), np.nan), "q": np.full((len(t), 1), np.nan)}  # comes to rest: another matter
        return {"x": a * np.cos(y[:, :1]), "q": y[:, :1]}

    parts = [
        joint("shaft", "revolute", "ground", "crank", f"initial = {{ value = {q0!r}, rate = {w!r} }}"),
        joint(
            "guide",
            "prismatic",
            "ground",
            "yoke",
            "axis = [1, 0, 0]"
            + (f"\nspring = {{ stiffness = {k!r} }}" if k else "")
            + (f"\nfriction = {{ coefficient = 1.0, normal_force = {rub!r} }}" if rub else ""),
        ),
        pick(
            r,
            joint("slot", "point-on-line", "yoke", "crank.pin", "axis = [0, 1, 0]"),
            joint("slot", "point-on-plane", "yoke", "crank.pin", "axis = [1, 0, 0]"),
        ),
    ]
    r.shuffle(parts)
    text = (
        simulation(duration, 200 / duration)
        + rigid("crank", 1.0, (J, J, J), {"pin": (a, 0, 0)})
        + rigid("yoke", mass, (J, J, J))
        + "".join(parts)
        + (force("torque", "crank", M, (0, 0, 1)) if M else "")
        + output("x", "guide", "value")
        + output("q", "shaft", "value")
    )
    return Scene(text, truth, {}, f"friction {rub / (mass * w * w * a):.2g}, spring {k / (mass * w * w):.2g}")


KINDS = [
    rubbing_pendulum,
    pressed_slide,
    maxwell,
    by_table,
    statespace_body,
    shaken_base,
    rolled_strip,
    curved_console,
    scotch_yoke,
]
