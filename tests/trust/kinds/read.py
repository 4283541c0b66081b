"""Forces that read outputs, and blocks: drag, switches, feedback, narrow bumps on the way, actuators; controllers and filters.

Truths by scipy."""
import math

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import eigh

from scene import Scene, beam, force, joint, output, pick, rigid, simulation, weld
from truths.formulas import beam_matrices, ode, restarted


def block(name, kind, lines):
    return f'[[block]]\nname = "{name}"\nkind = "{kind}"\n{lines}\n\n'


def cart(m, v0=0.0, x0=0.0, more=""):
    return rigid("cart", m, (m, m, m)) + joint(
        "rail", "prismatic", "ground", "cart", f"axis = [1, 0, 0]\ninitial = {{ value = {x0!r}, rate = {v0!r} }}\n{more}"
    )


READ = output("place", "rail", "value") + output("speed", "rail", "rate")


def dragged(r):
    """A body flies through wind with linear and quadratic drag"""
    m, g = 10 ** r.uniform(-3, 1), 9.81
    v = [r.uniform(-20, 20) for _ in range(3)]
    wind = [r.uniform(-10, 10) for _ in range(3)]
    fall = 10 ** r.uniform(0.3, 1.5)  # its speed where drag carries the weight
    share = pick(r, 0.0, 1.0, r.random())
    linear, quadratic = share * m * g / fall, (1 - share) * m * g / fall**2
    duration = r.uniform(0.5, 4) * fall / g
    text = (
        simulation(duration, 200 / duration, (0, 0, -g))
        + rigid("b", m, (m, m, m))
        + joint("flight", "free", "ground", "b", f"initial = {{ rate = {v + [0.0, 0.0, 0.0]} }}")
        + f'[[force]]\nname = "air"\nkind = "drag"\non = "b"\nwind = {wind}\n'
        + (f"linear = {linear!r}\n" if linear else "")
        + (f"quadratic = {quadratic!r}\n" if quadratic else "")
        + output("p", "b", "position")
        + output("power", "air", "power")
    )

    def push(u):
        w = np.asarray(u) - wind
        return -(linear + quadratic * np.linalg.norm(w)) * w

    def truth(t):
        y = ode(lambda _, y: np.r_[y[3:], push(y[3:]) / m + [0, 0, -g]], [0, 0, 0, *v], t)
        return {"p": y[:, :3], "power": np.array([[push(u) @ u] for u in y[:, 3:]])}

    return Scene(text, truth, {}, f"falls at {fall:.2g} m/s, linear share {share:.2g}")


def bang_bang(r):
    """A body goes to and fro between forces that switch by its place, beside a spring or not"""
    m, F = 10 ** r.uniform(-1, 2), 10 ** r.uniform(0, 3)
    x0 = 10 ** r.uniform(-2, 1)
    k = pick(r, 0.0, F / x0 * r.uniform(0.1, 2))
    gap = pick(r, 0.0, r.uniform(0.1, 0.8)) * x0
    T = math.sqrt(2 * m * x0 / F)
    duration = T * r.uniform(4, 20)
    value = f"place > {gap!r} ? -{F!r} : place < -{gap!r} ? {F!r} : 0" if gap else f"place > 0 ? -{F!r} : {F!r}"
    text = simulation(duration, 300 / duration) + cart(m, 0.0, x0) + READ + force("force", "cart", f"{value} ", (1, 0, 0))
    if k:
        text += f'[[force]]\nkind = "force"\non = "cart"\ndirection = [1, 0, 0]\nvalue = "-{k!r}*place"\n'

    def truth(t):
        f = lambda _, y: [y[1], (-(F if y[0] > gap else -F if y[0] < -gap else 0.0) - k * y[0]) / m]
        y = restarted(f, [lambda _, y: y[0] - gap, lambda _, y: y[0] + gap], [x0, 0.0], t)
        return {"place": y[:, :1], "speed": y[:, 1:]}

    return Scene(text, truth, {}, f"dead zone {gap / x0:.2g}, spring {k:.2g}")


def narrow_bump(r):
    """A body coasts over a bump of force that is narrow on its way: a bell, a bell of speed, high powers"""
    m, v = 10 ** r.uniform(-1, 1), 10 ** r.uniform(-1, 1)
    way = 10 ** r.uniform(-1, 1)
    at, w = way * r.uniform(0.2, 0.8), way * 10 ** r.uniform(-5, -1.5)
    dv = v * r.uniform(0.05, 0.4) * pick(r, 1, -1)
    # m v dv = F w sqrt(pi) for a small change.
    F = (m * ((v + dv) ** 2 - v * v) / 2) / (w * math.sqrt(math.pi))
    lump = pick(r, "bell", "drawn", "peak")
    if lump == "bell":
        value, act = f"{F!r}*exp(-((place - {at!r})/{w!r})^2)", lambda x, u: F * math.exp(-(((x - at) / w) ** 2))
    elif lump == "drawn":
        # It works against the motion in proportion to speed: no energy in rest.
        c = abs(F) / v
        value, act = f"-{c!r}*speed*exp(-((place - {at!r})/{w!r})^2)", lambda x, u: -c * u * math.exp(-(((x - at) / w) ** 2))
    else:
        value, act = f"{F!r}/(1 + ((place - {at!r})/{w!r})^4)", lambda x, u: F / (1 + ((x - at) / w) ** 4)
    duration = way / v
    text = simulation(duration, 200 / duration) + cart(m, v) + READ + force("force", "cart", value, (1, 0, 0))

    def truth(t):
        f = lambda _, y: [y[1], act(*y) / m]
        stops = [(at + s * w) / v for s in (-60, -12, -6)]
        kinks = [lambda _, y, s=s: y[0] - at - s * w for s in (-6, -3, -1.5, 0, 1.5, 3, 6)]
        y = restarted(f, kinks, [0.0, v], t, scale=min(way, v), stops=stops)
        return {"place": y[:, :1], "speed": y[:, 1:]}

    return Scene(text, truth, {}, f"{lump}, {w / way:.1e} of the way, speed {dv / v:+.2g}")


def passing_trigger(r):
    """A body rests while another, driven, passes: its place, speed or distance gives the first a short push"""
    m, w = 10 ** r.uniform(-1, 1), 10 ** r.uniform(0, 2)
    L = 10 ** r.uniform(-1, 0.5)
    width = 10 ** r.uniform(-4, -1)  # share of the circle
    k = m * (w * r.uniform(0.1, 3)) ** 2
    F = k * L
    angle = r.uniform(0.5, 5.5)
    turns = r.uniform(1.2, 4)
    duration = 2 * math.pi / w * turns
    how = pick(r, "window", "bell", "time")
    cx, cy = L * math.cos(angle), L * math.sin(angle)
    lag = 0.0
    if how == "window":
        value = f"near < {L * width!r} ? {F!r} : 0"
    elif how == "bell":
        value = f"{F!r}*exp(-(near/{L * width!r})^2)"
    else:
        lag = duration * r.uniform(0.2, 0.8)
        value = f"{F!r}*(1 + tip.x/{L!r})*exp(-((t - {lag!r})/{width / w!r})^2)"
    text = (
        simulation(duration, 300 / duration)
        + cart(m, more=f"spring = {{ stiffness = {k!r} }}")
        + rigid("arm", 1.0, (1, 1, 1), {"tip": (L, 0, 0)})
        + joint("shaft", "revolute", "ground", "arm", f'motion = "{w!r}*t"')
        + f"[ground]\nframes = {{ eye = [{cx!r}, {cy!r}, 0] }}\n"
        + READ
        + output("tip", "arm.tip", "position")
        + output("near", "arm.tip", "distance").replace("quantity", 'relative_to = "ground.eye"\nquantity')
        + force("force", "cart", value, (1, 0, 0))
    )

    def near(t):
        return 2 * L * abs(math.sin((w * t - angle) / 2))

    def act(t):
        if how == "window":
            return F if near(t) < L * width else 0.0
        if how == "bell":
            return F * math.exp(-((near(t) / (L * width)) ** 2))
        return F * (1 + math.cos(w * t)) * math.exp(-(((t - lag) * w / width) ** 2))

    def truth(t):
        if how == "time":
            stops = [lag + s * width / w for s in (-6, -2, 0, 2, 6)]
        else:
            tops = [(angle + 2 * math.pi * i) / w for i in range(6)]
            half = 2 * math.asin(width / 2) / w
            stops = [s + f * half for s in tops for f in ((-1, 1) if how == "window" else (-6, -2, 0, 2, 6))]
        f = lambda s, y: [y[1], (-k * y[0] + act(s)) / m]
        y = restarted(f, [], [0.0, 0.0], t, stops=stops, scale=1e-6)
        return {"place": y[:, :1], "speed": y[:, 1:]}

    return Scene(text, truth, {}, f"{how}, {width:.1e} of a turn")


def balanced_pole(r):
    """A pole is balanced on a cart by feedback of four readings, its force limited"""
    M, m, L, g = r.uniform(0.5, 3), r.uniform(0.1, 1), r.uniform(0.2, 1), 9.81
    J = m * L * L / 12
    a0 = r.uniform(-0.25, 0.25)
    F0 = (M + m) * g * r.uniform(0.4, 2)
    # Poles of the linear plant by Ackermann's formula.
    l = L / 2
    mass = np.array([[M + m, m * l], [m * l, J + m * l * l]])
    A = np.zeros((4, 4))
    A[0, 2] = A[1, 3] = 1
    A[2:, :2] = np.linalg.solve(mass, np.array([[0, 0], [0, m * g * l]]))
    B = np.r_[0, 0, np.linalg.solve(mass, [1, 0])]
    w = math.sqrt(g / L) * r.uniform(0.8, 1.5)
    poly = np.poly([-w, -1.2 * w, -1.5 * w, -2 * w])
    ctrl = np.stack([np.linalg.matrix_power(A, i) @ B for i in range(4)], axis=1)
    phi = sum(c * np.linalg.matrix_power(A, 4 - i) for i, c in enumerate(poly))
    K = np.linalg.solve(ctrl.T, np.r_[0, 0, 0, 1]) @ phi
    u = f"-({K[0]!r}*place + {K[1]!r}*tilt + {K[2]!r}*speed + {K[3]!r}*turning)"
    # tilt is counted clockwise from the upright pole: the joint's axis is -z.
    duration = r.uniform(1, 6)
    text = (
        simulation(duration, 200 / duration, (0, -g, 0))
        + cart(M)
        + rigid("pole", m, (J / 20, J, J), {"end": (0, L, 0)}, centre=(0, L / 2, 0))
        + joint("hinge", "revolute", "cart", "pole", f"axis = [0, 0, -1]\ninitial = {{ value = {a0!r} }}")
        + READ
        + output("tilt", "hinge", "value")
        + output("turning", "hinge", "rate")
        + force("force", "cart", f"max(-{F0!r}, min({F0!r}, {u}))", (1, 0, 0))
    )

    def act(y):
        return max(-F0, min(F0, -K @ y))

    def truth(t):
        def f(_, y):
            c, s = math.cos(y[1]), math.sin(y[1])
            A = np.array([[M + m, m * l * c], [m * l * c, J + m * l * l]])
            b = [act(y) + m * l * y[3] ** 2 * s, m * g * l * s]
            return np.r_[y[2:], np.linalg.solve(A, b)]

        y = restarted(f, [lambda _, y: K @ y - F0, lambda _, y: K @ y + F0], [0, a0, 0, 0], t)
        return {"place": y[:, :1], "tilt": y[:, 1:2]}

    scene = Scene(text, truth, {}, f"{a0:.2f} rad, limit {F0:.2g} N")
    return scene if abs(truth(np.linspace(0, duration, 50))["tilt"]).max() < 1.2 else None


def actuator(r):
    """A body on an actuator whose force follows its length and rate by a law, and on one whose rest length moves"""
    m = 10 ** r.uniform(-1, 1)
    w = 10 ** r.uniform(0, 1.5)
    k = m * w * w
    L0 = r.uniform(0.5, 2)
    x0 = L0 * r.uniform(0.7, 1.4)
    cubic, c2 = k / L0**2 * r.uniform(0, 5), m / L0 * r.uniform(0, 1)
    A, wa = L0 * r.uniform(0.05, 0.3), w * r.uniform(0.2, 2)
    kb = k * r.uniform(0.1, 1)
    duration = 2 * math.pi / w * r.uniform(3, 10)
    text = (
        simulation(duration, 300 / duration)
        + cart(m, 0.0, x0)
        + READ
        + f'[[force]]\nname = "a"\nkind = "spring-damper"\non = "cart"\nstiffness = {k!r}\nrest = {L0!r}\n'
        + f'value = "{cubic!r}*(length - {L0!r})^3 + {c2!r}*abs(rate)*rate"\n\n'
        + f'[[force]]\nname = "b"\nkind = "spring-damper"\non = "cart"\nfrom = "ground.back"\nstiffness = {kb!r}\n'
        + f'rest = "{3 * L0!r} + {A!r}*sin({wa!r}*t)"\n\n'
        + f"[ground]\nframes = {{ back = [{-2 * L0!r}, 0, 0] }}\n"
        + output("pull", "a", "force")
        + output("long", "b", "length")
    )
    pull = lambda x, v: k * (x - L0) + cubic * (x - L0) ** 3 + c2 * abs(v) * v

    def truth(t):
        f = lambda s, y: [y[1], -(pull(*y) + kb * (y[0] + 2 * L0 - 3 * L0 - A * math.sin(wa * s))) / m]
        y = restarted(f, [lambda _, y: y[1]], [x0, 0.0], t)
        return {"place": y[:, :1], "pull": np.array([[pull(*z)] for z in y]), "long": y[:, :1] + 2 * L0}

    return Scene(text, truth, {}, f"cubic {cubic * L0**2 / k:.2g}, moved at {wa / w:.2g} of its frequency")


def relaxation(r):
    """Self-excited and stiffening oscillators whose forces read place and speed: van der Pol, Duffing, Rayleigh"""
    m, w = 10 ** r.uniform(-1, 1), 10 ** r.uniform(-1, 2)
    a = 10 ** r.uniform(-3, 0)
    mu = 10 ** r.uniform(-1, 1)
    kind = pick(r, "van der Pol", "Duffing", "Rayleigh")
    x0 = a * r.uniform(0.1, 3)
    duration = 2 * math.pi / w * r.uniform(2, 8)
    c = mu * m * w
    value = {
        "van der Pol": f"{c!r}*(1 - (place/{a!r})^2)*speed - {m * w * w!r}*place",
        "Duffing": f"-{m * w * w!r}*(place + place^3/{a * a!r}) - {0.02 * c!r}*speed",
        "Rayleigh": f"{c!r}*(1 - (speed/{a * w!r})^2)*speed - {m * w * w!r}*place",
    }[kind]
    text = simulation(duration, 400 / duration) + cart(m, 0.0, x0) + READ + force("force", "cart", value, (1, 0, 0))

    def truth(t):
        def f(_, y):
            x, v = y
            F = {
                "van der Pol": c * (1 - (x / a) ** 2) * v - m * w * w * x,
                "Duffing": -m * w * w * (x + x**3 / a**2) - 0.02 * c * v,
                "Rayleigh": c * (1 - (v / (a * w)) ** 2) * v - m * w * w * x,
            }[kind]
            return [v, F / m]

        y = ode(f, [x0, 0.0], t, atol=np.array([1e-12 * a, 1e-12 * a * w]))
        return {"place": y[:, :1], "speed": y[:, 1:]}

    return Scene(text, truth, {}, f"{kind}, {mu:.2g}")


def damped_by_feedback(r):
    """A clamped beam whose tip's speed is fed back as a force there, and a pulse shakes it"""
    L, E, rho = 10 ** r.uniform(-1, 0.5), 7e10, 2700.0
    h = L / r.uniform(30, 80)
    A, I = h * h, h**4 / 12
    w1 = 3.516 / L**2 * math.sqrt(E * I / (rho * A))
    F = 3 * E * I / L**2 * 10 ** r.uniform(-4, -3)
    c = 2 * 0.25 * rho * A * L * w1 * r.uniform(0.0, 0.3)
    T = 2 * math.pi / w1 * r.uniform(0.2, 1)
    duration = 2 * math.pi / w1 * r.uniform(3, 10)
    text = (
        simulation(duration, 400 / duration)
        + beam("b", L, f'{{ shape = "rectangle", height = {h!r}, width = {h!r} }}', {"E": E, "rho": rho, "poisson": 0.33})
        + weld("clamp", "ground", "b.root")
        + output("v", "b.tip", "velocity")
        + output("tip", "b.tip", "displacement")
        + force("force", "b.tip", f"(t < {T!r} ? {F!r}*sin(pi*t/{T!r})^2 : 0) - {c!r}*v.y", (0, 1, 0))
    )

    def truth(t):
        M, K = beam_matrices(L, E * I, rho * A, elements=10, rhoI=rho * I, kGA=5 / 6 * A * E / 2.66)
        squares, modes = eigh(K, M)
        squares, phi = squares[:6], modes[-2, :6]
        f = lambda s, y: np.r_[y[6:], -squares * y[:6] + phi * ((F * math.sin(math.pi * s / T) ** 2 if s < T else 0.0) - c * (phi @ y[6:]))]
        y = restarted(f, [], np.zeros(12), t, scale=F / (3 * E * I / L**3), stops=[T], rtol=1e-9)
        v = y[:, :6] @ phi
        return {"tip": np.stack([0 * v, v, 0 * v], axis=1)}

    return Scene(text, truth, {}, f"damping {c / (2 * 0.25 * rho * A * L * w1):.2g}, pulse {T * w1 / 6.28:.2g} periods")


def gas_force(r):
    """A crank turned by a table of its angle, against a torque that reads its speed"""
    J = 10 ** r.uniform(-2, 1)
    n = r.randint(6, 15)
    period = 2 * math.pi * pick(r, 1, 2)
    x = sorted(r.uniform(0.02, 0.98) * period for _ in range(n))
    x = [0.0, *[v for i, v in enumerate(x) if i == 0 or v - x[i - 1] > 0.02], period]
    y = [r.uniform(-1, 3) for _ in x]
    y[-1] = y[0]
    T = 10 ** r.uniform(0, 2)
    y = [T * v for v in y]
    w0 = math.sqrt(T / J) * r.uniform(3, 8)
    c = T / w0 * r.uniform(0.1, 0.8)
    duration = 2 * math.pi / w0 * r.uniform(2, 6)
    table = ", ".join(f"[{a!r}, {b!r}]" for a, b in zip(x, y))
    text = (
        simulation(duration, 300 / duration)
        + rigid("crank", 1.0, (J, J, J))
        + joint("shaft", "revolute", "ground", "crank", f"initial = {{ rate = {w0!r} }}")
        + output("turn", "shaft", "value")
        + output("speed", "shaft", "rate")
        + f'[[force]]\nname = "gas"\nkind = "torque"\non = "crank"\ndirection = [0, 0, 1]\n'
        + f'value = {{ table = [{table}], of = "shaft", period = {period!r} }}\n\n'
        + force("torque", "crank", f"-{c!r}*speed", (0, 0, 1))
        + output("M", "gas", "force")
    )

    def truth(t):
        spline = CubicSpline(x, y, bc_type="periodic")
        f = lambda _, z: [z[1], (float(spline(z[0] % period)) - c * z[1]) / J]
        z = ode(f, [0.0, w0], t)
        return {"turn": z[:, :1], "speed": z[:, 1:], "M": spline(z[:, :1] % period)}

    return Scene(text, truth, {}, f"{len(x)} points, {period / 6.283:.0f} turns a period")


def pid_law(r, m, w):
    return m * w * w * r.uniform(0.5, 2), m * w**3 * pick(r, 0.0, r.uniform(0.02, 0.3)), m * w * r.uniform(0.3, 2)


def controlled(r):
    """A PID controller brings a body to a place that jumps or moves: continuous, its derivative filtered or by rate"""
    m, w = 10 ** r.uniform(-1, 2), 10 ** r.uniform(-1, 2)
    P, I, D = pid_law(r, m, w)
    tau = pick(r, None, 0.05 / w, 0.5 / w)
    goal = 10 ** r.uniform(-2, 1)
    duration = 2 * math.pi / w * r.uniform(2, 6)
    at = pick(r, 0.0, duration * r.uniform(0.1, 0.4))
    load = P * goal * r.uniform(-0.3, 0.3)
    start = pick(r, 0.0, goal * w**-1 * r.uniform(-1, 1)) if I else 0.0
    aim = f"(t < {at!r} ? 0 : {goal!r})" if at else f"{goal!r}"
    law = f'input = "{aim} - place"\nproportional = {P!r}\nderivative = {D!r}\n' + (f"integral = {I!r}\n" if I else "")
    law += f"filter = {tau!r}\n" if tau else 'rate = "-speed"\n'
    text = (
        simulation(duration, 300 / duration)
        + cart(m)
        + READ
        + block("control", "pid", law)
        + force("force", "cart", "control", (1, 0, 0))
        + force("force", "cart", load, (1, 0, 0))
    )

    def truth(t):
        def f(s, y):
            e = (goal if s >= at else 0.0) - y[0]
            d = (e - y[3]) / tau if tau else -y[1]
            return [y[1], (P * e + I * y[2] + D * d + load) / m, e, d if tau else 0.0]

        y = restarted(f, [], [0.0, 0.0, 0.0, 0.0], t, stops=[at])
        return {"place": y[:, :1], "speed": y[:, 1:2]}

    return Scene(text, truth, {}, f"integral {I:.2g}, filter {tau}, jump at {at:.2g}")


def sampled_control(r):
    """A sampled PID or state-space controller on a body, its output held, with a limit"""
    m, w = 10 ** r.uniform(-1, 2), 10 ** r.uniform(-1, 2)
    P, I, D = pid_law(r, m, w)
    T = r.uniform(0.02, 0.3) / w
    goal = 10 ** r.uniform(-2, 1)
    n = r.randint(20, 80)
    duration = n * T * r.uniform(0.999, 1.05)
    limit = pick(r, None, P * goal * r.uniform(0.3, 1))
    discrete = r.random() < 0.5
    if discrete:
        law = f'input = ["{goal!r} - place", "-speed"]\nA = [[1]]\nB = [[{T!r}, 0]]\n'
        law += f"C = [[{I!r}]]\nD = [[{P!r}, {D!r}]]\ndiscrete = true\nsample = {T!r}\n"
    else:
        law = f'input = "{goal!r} - place"\nrate = "-speed"\nproportional = {P!r}\nderivative = {D!r}\nsample = {T!r}\n' + (
            f"integral = {I!r}\n" if I else ""
        )
    value = f"max(-{limit!r}, min({limit!r}, control))" if limit else "control"
    text = (
        simulation(duration, 400 / duration)
        + cart(m)
        + READ
        + block("control", "state-space" if discrete else "pid", law)
        + force("force", "cart", value, (1, 0, 0))
    )

    def truth(t):
        x, v, s = 0.0, 0.0, 0.0
        out = np.zeros((len(t), 2))
        k = 0
        while k * T <= t[-1]:
            e = goal - x
            u = P * e + I * s - D * v
            s += T * e
            u = max(-limit, min(limit, u)) if limit else u
            here = (t >= k * T - 1e-12 * duration) & (t < (k + 1) * T)
            d = t[here] - k * T
            out[here] = np.stack([x + v * d + u / m * d * d / 2, v + u / m * d], axis=1)
            x, v, k = x + v * T + u / m * T * T / 2, v + u / m * T, k + 1
        return {"place": out[:, :1], "speed": out[:, 1:]}

    return Scene(text, truth, {}, f"{'discrete' if discrete else 'pid'}, {T * w:.2g} of 1/w, limit {limit}")


def filtered(r):
    """A transfer function of any order between a given signal, with short pulses too, and the force on a body"""
    m, w = 10 ** r.uniform(-1, 2), 10 ** r.uniform(-1, 3)
    poles = []
    for _ in range(r.randint(1, 3)):
        a = w * r.uniform(0.3, 2)
        poles += [-a] if r.random() < 0.5 else [complex(-a * r.uniform(0.05, 0.9), a), None]
    poles = [p for q in poles if q is not None for p in ([q, q.conjugate()] if isinstance(q, complex) else [q])]
    den = np.real(np.poly(poles))
    degree = r.randint(0, len(den) - 1)
    num = np.array([r.uniform(-1, 1) * w ** (len(den) - 1 - i) for i in range(degree, -1, -1)])
    duration = 6.28 / w * r.uniform(2, 5)
    what = pick(r, "step", "sine", "pulse", "bell")
    at = duration * r.uniform(0.1, 0.5)
    width = duration * 10 ** r.uniform(-4, -2)
    signal = {
        "step": f"t < {at!r} ? 0 : 1",
        "sine": f"sin({w * 0.7!r}*t)",
        "pulse": f"t > {at!r} && t < {at + width!r} ? {1 / (w * width)!r} : 0",
        "bell": f"{1 / (w * width)!r}*exp(-((t - {at!r})/{width!r})^2)",
    }[what]
    value = {
        "step": lambda t: 0.0 if t < at else 1.0,
        "sine": lambda t: math.sin(w * 0.7 * t),
        "pulse": lambda t: 1 / (w * width) if at < t < at + width else 0.0,
        "bell": lambda t: math.exp(-(((t - at) / width) ** 2)) / (w * width),
    }[what]
    text = (
        simulation(duration, 300 / duration)
        + cart(m)
        + READ
        + block(
            "f", "transfer-function", f'input = "{signal}"\nnumerator = {[float(c) for c in num]}\ndenominator = {[float(c) for c in den]}'
        )
        + force("force", "cart", f"{m * w!r}*f", (1, 0, 0))
    )

    def truth(t):
        n = len(den) - 1
        A = np.zeros((n, n))
        A[:-1, 1:] = np.eye(n - 1)
        A[-1] = -den[:0:-1]
        full = np.r_[np.zeros(n + 1 - len(num)), num][::-1]
        Dd = full[n]
        C = full[:n] - Dd * den[:0:-1]
        # Scaled: states of a controllable form grow with powers of the frequency.
        S = np.diag(w ** -np.arange(n, dtype=float))
        A, C, B = S @ A @ np.linalg.inv(S), C @ np.linalg.inv(S), S @ np.r_[np.zeros(n - 1), 1.0]

        def f(s, y):
            u = value(s)
            return np.r_[y[1], w * (C @ y[2:] + Dd * u), A @ y[2:] + B * u]

        stops = {"step": [at], "sine": [], "pulse": [at, at + width], "bell": [at + s * width for s in (-6, -3, -1, 0, 1, 3, 6)]}[what]
        y = restarted(f, [], np.zeros(n + 2), t, stops=stops, scale=1e-3)
        return {"place": y[:, :1], "speed": y[:, 1:2]}

    return Scene(text, truth, {}, f"order {len(den) - 1}, numerator {degree}, {what}")


KINDS = [
    dragged,
    bang_bang,
    narrow_bump,
    passing_trigger,
    balanced_pole,
    actuator,
    relaxation,
    damped_by_feedback,
    gas_force,
    controlled,
    sampled_control,
    filtered,
]
