"""Relatives of the other kinds, from 100 um to 50 m: welded frames, offset tip masses, belts of springs, steps of loads, spin and force out
of its plane, columns near buckling, modal coordinates, contacts between two samples, driven chains, long runs.

Truths by finite elements of numpy, ODEs of scipy, closed formulas."""
import math

import numpy as np
from kinds.rich import ALL, pair
from scene import Scene, beam, force, joint, output, pick, rigid, simulation, sizes, spring, weld
from truths.formulas import Linear, beam_matrices, bending_element, rod_matrices, rotate

SILICON = {"E": 1.6e11, "rho": 2330.0, "poisson": 0.22}


def sudden(r):
    """A clamped beam of any size, 100 um to 50 m, under a load that comes at once and in steps, many periods"""
    L, m, s = sizes(r, slender=(20, 60), shapes=("rectangle", "circle", "tube"))
    if r.random() < 0.4:  # what sizes are in microsystems and in cranes
        scale = pick(r, 10 ** r.uniform(-4, -3), 10 ** r.uniform(1, 1.7)) / L
        L *= scale
        m = SILICON if L < 0.01 else m
        s = dict(s, area=s["area"] * scale**2, iy=s["iy"] * scale**4, iz=s["iz"] * scale**4, j=s["j"] * scale**4)
        s["text"] = (
            f'{{ shape = "general", area = {s["area"]!r}, iy = {s["iy"]!r}, iz = {s["iz"]!r}, j = {s["j"]!r}, '
            f'shear_y = {s["shear_y"]!r}, shear_z = {s["shear_z"]!r} }}'
        )
    EI, rhoA, zeta = m["E"] * s["iz"], m["rho"] * s["area"], pick(r, 0.0, 0.005, 0.01, 0.05)
    w1 = 3.516 / L**2 * math.sqrt(EI / rhoA)
    F = 3 * EI / L**2 * 10 ** r.uniform(-4, -2.5)
    periods = r.uniform(3, 60)
    duration = periods * 2 * math.pi / w1
    at = [duration * r.uniform(0.1, 0.5), duration * r.uniform(0.5, 0.9)]
    level = [1.0, r.uniform(-1, 2), r.uniform(-1, 2)]
    steps = r.random() < 0.5
    value = f"t < {at[0]!r} ? {F!r} : t < {at[1]!r} ? {F * level[1]!r} : {F * level[2]!r}" if steps else F
    n = 20 * max(20, int(periods))
    text = (
        simulation(duration, n / duration)
        + beam("b", L, s["text"], m, f"damping = {{ ratio = {zeta} }}" if zeta else "")
        + weld("clamp", "ground", "b.root")
        + force("force", "b.tip", value, (0, 1, 0))
        + output("tip", "b.tip", "displacement")
    )

    def truth(t):
        G = m["E"] / (2 * (1 + m["poisson"]))
        M, K = beam_matrices(L, EI, rhoA, kGA=s["shear_y"] * G * s["area"], rhoI=m["rho"] * s["iz"], elements=16)
        f = np.zeros(len(K))
        f[-2] = 1.0
        modes = Linear(M, K, zeta)
        # Exact: steps of the load, one after the other.
        u = np.zeros((len(t), len(K)))
        parts = [(0.0, F)] + ([(at[0], F * (level[1] - 1)), (at[1], F * (level[2] - level[1]))] if steps else [])
        p, w = modes.modes.T @ f, modes.omega
        wd = w * math.sqrt(1 - zeta**2)
        for begin, size in parts:
            x = np.maximum(t - begin, 0.0)[:, None]
            q = p * size / w**2 * (1 - np.exp(-zeta * w * x) * (np.cos(wd * x) + zeta * w / wd * np.sin(wd * x)))
            u += q @ modes.modes.T
        v = u[:, -2]
        return {"tip": np.stack([0 * v, v, 0 * v], axis=1)}

    return Scene(text, truth, {}, f"{L:.2g} m, {periods:.0f} periods, damping {zeta}{', steps' if steps else ''}")


def modal_q(r):
    """Coordinates of a beam of eigenforms under a load that comes at once"""
    L, m, s = sizes(r, slender=(20, 60), shapes=("rectangle", "circle"))
    EI, rhoA = m["E"] * s["iz"], m["rho"] * s["area"]
    count, zeta = r.randint(1, 3), pick(r, 0.0, 0.02)
    lam = np.array([1.8751040687, 4.6940911330, 7.8547574382])[:count]
    w = (lam / L) ** 2 * math.sqrt(EI / rhoA)
    F = 3 * EI / L**2 * 10 ** r.uniform(-4, -2.5)
    duration = r.uniform(1, 6) * 2 * math.pi / w[0]
    modes = ", ".join(str(k + 1) for k in range(count))
    text = (
        simulation(duration, 300 / duration)
        + beam(
            "b",
            L,
            s["text"],
            m,
            f'model = "modal"\nmodes = {{ bending_xy = [{modes}] }}' + (f"\ndamping = {{ ratio = {zeta} }}" if zeta else ""),
        )
        + weld("clamp", "ground", "b.root")
        + force("force", "b.tip", F, (0, 1, 0))
        + output("q", "b", "q")
        + output("qd", "b", "qd")
    )

    def truth(t):
        # Forms with int phi^2 dx = L: modal mass rhoA L, 2 at the tip.
        x, wd = t[:, None], w * math.sqrt(1 - zeta**2)
        e = np.exp(-zeta * w * x)
        q = 2 * F / (rhoA * L) / w**2 * (1 - e * (np.cos(wd * x) + zeta * w / wd * np.sin(wd * x)))
        return {"q": q, "qd": 2 * F / (rhoA * L) * e * np.sin(wd * x) / wd}

    scene = Scene(text, truth, {}, f"{count} forms, damping {zeta}")
    scene.sizes_only = True
    return scene


def dropped_rod(r):
    """A rod falls along its axis on a stop, in contact for less than a sample"""
    L, m, s = sizes(r, slender=(8, 40), shapes=("rectangle", "circle"))
    EA, rhoA = m["E"] * s["area"], m["rho"] * s["area"]
    h, g = L * 10 ** r.uniform(-3, -1.5), 9.81
    k = EA / L * 10 ** r.uniform(-1, 1)
    fall = math.sqrt(2 * h / g)
    duration = fall * r.uniform(1.3, 2.2)
    samples, rail = pick(r, 40, 100, 400), "axis = [1, 0, 0]"
    text = (
        simulation(duration, samples / duration, (-g, 0, 0))
        + joint(
            "guide",
            "prismatic",
            "ground",
            "rod.root",
            f"{rail}\ninitial = {{ value = {h!r} }}\nstop = {{ lower = 0.0, stiffness = {k!r} }}",
        )
        + beam("rod", L, s["text"], m)
        + output("x", "guide", "value")
        + output("tip", "rod.tip", "position")
    )

    def truth(t):
        n = 40
        M, K = rod_matrices(L, EA, rhoA, elements=n)
        # The root free too.
        step = L / n
        Mf, Kf = np.zeros((n + 1, n + 1)), np.zeros((n + 1, n + 1))
        Mf[1:, 1:], Kf[1:, 1:] = M, K
        Mf[:2, :2] += rhoA * step / 6 * np.array([[2, 1], [1, 0]])
        Kf[:2, :2] += EA / step * np.array([[1, -1], [-1, 0]])
        Kc = Kf.copy()
        Kc[0, 0] += k
        f = -g * Mf @ np.ones(n + 1)
        free, touch = Linear(Mf, Kf), Linear(Mf, Kc)
        w = {0: free.omega.copy(), 1: touch.omega}
        w[0][0] = 0.0  # its rigid motion
        forms = {0: free.modes, 1: touch.modes}

        def state(mode, q0, v0, x):
            out = []
            A = forms[mode]
            a, b, p = A.T @ Mf @ q0, A.T @ Mf @ v0, A.T @ f
            for i, om in enumerate(w[mode]):
                if om == 0.0:
                    out.append((a[i] + b[i] * x + p[i] * x * x / 2, b[i] + p[i] * x))
                else:
                    c, d = math.cos(om * x), math.sin(om * x)
                    e = p[i] / om**2
                    out.append((e + (a[i] - e) * c + b[i] / om * d, -(a[i] - e) * om * d + b[i] * c))
            q, v = A @ [o[0] for o in out], A @ [o[1] for o in out]
            return q, v

        begin, mode, q0, v0 = fall, 1, np.zeros(n + 1), np.full(n + 1, -g * fall)
        pieces = [(0.0, None), (begin, (mode, q0, v0))]
        # Contacts and flights one after the other: the root's sign on a fine grid, then bisection.
        fine = min(L / math.sqrt(m["E"] / m["rho"]), math.pi * math.sqrt(rhoA * L / k)) / 60
        now = begin
        while now < duration and len(pieces) < 400:
            x, last = fine, None
            while now + x < duration + fine:
                root = state(mode, q0, v0, x)[0][0]
                if (root > 0) == (mode == 1) and x > fine:
                    low, high = x - fine, x
                    for _ in range(60):
                        mid = (low + high) / 2
                        if (state(mode, q0, v0, mid)[0][0] > 0) == (mode == 1):
                            high = mid
                        else:
                            low = mid
                    last = high
                    break
                x += fine
            if last is None:
                break
            q0, v0 = state(mode, q0, v0, last)
            now += last
            mode = 1 - mode
            pieces.append((now, (mode, q0, v0)))
        root, tip = [], []
        for x in t:
            begin, piece = [p for p in pieces if p[0] <= x][-1]
            if piece is None:
                root.append(h - g * x * x / 2)
                tip.append(root[-1])
            else:
                q, _ = state(*piece, x - begin)
                root.append(q[0])
                tip.append(q[-1])
        root, tip = np.array(root), np.array(tip)
        return {"x": root[:, None], "tip": np.stack([L + tip, 0 * tip, 0 * tip], axis=1)}

    return Scene(text, truth, {}, f"stop {k * L / EA:.2g} of the rod, {samples} samples")


def offset_tip(r):
    """A clamped beam with a body at its tip whose centre lies ahead of the tip, shaken by a short push"""
    L, m, s = sizes(r, slender=(15, 60), shapes=("rectangle", "circle", "tube"))
    EI, rhoA = m["E"] * s["iz"], m["rho"] * s["area"]
    mass, c = rhoA * L * 10 ** r.uniform(-1, 1), L * r.uniform(0, 0.4)
    J = mass * (L * r.uniform(0.02, 0.15)) ** 2
    G = m["E"] / (2 * (1 + m["poisson"]))

    def matrices():
        M, K = beam_matrices(L, EI, rhoA, kGA=s["shear_y"] * G * s["area"], rhoI=m["rho"] * s["iz"], elements=16)
        M[-2:, -2:] += mass * np.array([[1, c], [c, c * c]]) + np.array([[0, 0], [0, J]])
        return M, K

    w1 = Linear(*matrices()).omega[0]
    T = 2 * math.pi / w1
    F = 3 * EI / L**2 * 10 ** r.uniform(-4, -2.5)
    push = T * r.uniform(0.1, 1)
    duration = T * r.uniform(2, 8)
    text = (
        simulation(duration, 300 / duration)
        + beam("b", L, s["text"], m)
        + rigid("head", mass, (J, J, J), {"c": (c, 0, 0)}, centre=(c, 0, 0))
        + weld("clamp", "ground", "b.root")
        + weld("neck", "b.tip", "head")
        + force("force", "head.c", f"t < {push!r} ? {F!r}*sin(pi*t/{push!r})^2 : 0", (0, 1, 0))
        + output("tip", "b.tip", "displacement")
        + output("head", "head.c", "position")
    )

    def truth(t):
        M, K = matrices()
        f = np.zeros(len(K))
        f[-2:] = 1.0, c
        u = Linear(M, K).respond(f, lambda x: F * np.where(x < push, np.sin(np.pi * x / push) ** 2, 0.0), t)
        v, head = u[:, -2], u[:, -2] + c * u[:, -1]
        return {"tip": np.stack([0 * v, v, 0 * v], axis=1), "head": np.stack([L + c + 0 * v, head, 0 * v], axis=1)}

    return Scene(text, truth, {}, f"mass {mass / (rhoA * L):.2g} beams, centre {c / L:.2g} L ahead")


def shaken_frame(r):
    """A portal of three welded beams is pushed sideways at once; the truth by plane finite elements"""
    H, m, s = sizes(r, slender=(12, 40), shapes=("rectangle", "circle", "tube"))
    W = H * r.uniform(0.5, 1.5)
    E, A, I, rho = m["E"], s["area"], s["iz"], m["rho"]
    G = E / (2 * (1 + m["poisson"]))
    n = 6
    nodes = (
        [(0, H * i / n) for i in range(n + 1)] + [(W * i / n, H) for i in range(1, n + 1)] + [(W, H - H * i / n) for i in range(1, n + 1)]
    )
    F = 3 * E * I / H**2 * 10 ** r.uniform(-4, -2.7)

    def matrices():
        size = 3 * len(nodes)
        M, K = np.zeros((size, size)), np.zeros((size, size))
        for a in range(len(nodes) - 1):
            d = np.subtract(nodes[a + 1], nodes[a])
            h = np.hypot(*d)
            c, sn = d / h
            k, mm = np.zeros((6, 6)), np.zeros((6, 6))
            k[np.ix_((0, 3), (0, 3))] = E * A / h * np.array([[1, -1], [-1, 1]])
            mm[np.ix_((0, 3), (0, 3))] = rho * A * h / 6 * np.array([[2, 1], [1, 2]])
            across = np.ix_((1, 2, 4, 5), (1, 2, 4, 5))
            mm[across], k[across] = bending_element(h, E * I, rho * A, s["shear_y"] * G * A, rho * I)
            T = np.kron(np.eye(2), np.array([[c, sn, 0], [-sn, c, 0], [0, 0, 1]]))
            i = slice(3 * a, 3 * a + 6)
            M[i, i] += T.T @ mm @ T
            K[i, i] += T.T @ k @ T
        return M[3:-3, 3:-3], K[3:-3, 3:-3]

    T = 2 * math.pi / Linear(*matrices()).omega[0]
    rise, duration = T * r.uniform(0.3, 2), T * r.uniform(2, 5)
    up, right = math.pi / 2, -math.pi / 2
    text = (
        simulation(duration, 300 / duration)
        + beam("left", H, s["text"], m)
        + beam("top", W, s["text"], m)
        + beam("right", H, s["text"], m)
        + weld("a", "ground", "left.root", f"rotation = [0, 0, {up!r}]")
        + weld("b", "left.tip", "top.root", f"rotation = [0, 0, {right!r}]")
        + weld("c", "top.tip", "right.root", f"rotation = [0, 0, {right!r}]")
        + weld("d", "ground", "right.tip", f"position = [{W!r}, 0, 0]\nrotation = [0, 0, {right!r}]")
        + force("force", "left.tip", f"t < {rise!r} ? {F!r}*sin(pi*t/{2 * rise!r})^2 : {F!r}", (1, 0, 0))
        + output("corner", "left.tip", "position")
        + output("other", "top.tip", "position")
    )

    def truth(t):
        M, K = matrices()
        f = np.zeros(len(K))
        f[3 * (n - 1)] = 1.0
        u = Linear(M, K).respond(f, lambda x: F * np.where(x < rise, np.sin(np.pi * x / (2 * rise)) ** 2, 1.0), t)
        at = lambda node: u[:, 3 * (node - 1) : 3 * (node - 1) + 2]
        place = lambda node: np.hstack([np.array(nodes[node]) + at(node), np.zeros((len(t), 1))])
        return {"corner": place(n), "other": place(2 * n)}

    return Scene(text, truth, {}, f"width/height {W / H:.2g}, {duration / T:.1f} periods")


def near_buckling(r):
    """A clamped column pressed by 50 to 97 % of its critical load and pushed sideways, at rest; the closed formula"""
    L, m, s = sizes(r, slender=(30, 80), shapes=("rectangle", "circle", "tube"))
    EI = m["E"] * s["iz"]
    share = r.uniform(0.5, 0.97)
    P = share * math.pi**2 * EI / (4 * L * L)
    if m["E"] * s["iy"] < 1.05 * EI * share:
        return None  # it would buckle the other way
    # Small: the deflection grows by 1/(1 - share).
    F = 3 * EI / L**2 * 10 ** r.uniform(-5, -3.5) * (1 - share)
    text = (
        simulation(0.01, 200, start="static")
        + beam("column", L, s["text"], m)
        + weld("foot", "ground", "column.root")
        + force("force", "column.tip", P, (-1, 0, 0))
        + force("force", "column.tip", F, (0, 1, 0))
        + output("tip", "column.tip", "displacement")
    )
    k = math.sqrt(P / EI)
    G = m["E"] / (2 * (1 + m["poisson"]))
    v = F / P * (math.tan(k * L) / k - L)
    # Haringx: shear softens the column, P/kGA small.
    v_shear = v * (1 + P / (s["shear_y"] * G * s["area"])) if share < 0.8 else v
    truth = lambda t: {"tip": np.tile([-P * L / (m["E"] * s["area"]), v_shear, 0.0], (len(t), 1))}
    scene = Scene(text, truth, {"tip": abs(v)}, f"P/Pcr {share:.2f}, slenderness {L / s['height']:.0f}")
    if P / (s["shear_y"] * G * s["area"]) / (1 - share) > 3e-3:
        return None
    return scene


def belt(r):
    """Bodies on a rail joined by springs and dampers, to a belt that closes over the ground; long runs"""
    n = r.randint(2, 6)
    m = [10 ** r.uniform(-1, 1) for _ in range(n)]
    k = [10 ** r.uniform(2, 4) for _ in range(n + 1)]
    c = [pick(r, 0.0, 10 ** r.uniform(-2, 0.5)) for _ in range(n + 1)]
    gap = 1.0
    v0 = [r.uniform(-1, 1) for _ in range(n)]
    M = np.diag(m)
    K, C = np.zeros((n, n)), np.zeros((n, n))
    for i in range(n + 1):
        for X, x in ((K, k), (C, c)):
            for a in (i - 1, i):
                for b in (i - 1, i):
                    if 0 <= a < n and 0 <= b < n:
                        X[a, b] += x[i] * (1 if a == b else -1)
    w = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real)
    v0 = [0.2 * v * w.min() * gap for v in v0]
    periods = 10 ** r.uniform(0.5, 2.3)
    duration = periods * 2 * math.pi / w.max()
    samples = int(min(4000, max(200, 10 * periods)))
    text = simulation(duration, samples / duration) + weld("fixed", "ground", "wall")
    text += rigid("wall", 1.0, (1, 1, 1), {"end": (gap * (n + 1), 0, 0)})
    rail = "axis = [1, 0, 0]"
    for i in range(n):
        text += rigid(f"b{i}", m[i], (m[i],) * 3)
        text += joint(f"j{i}", "prismatic", "ground", f"b{i}", f"{rail}\ninitial = {{ value = {gap * (i + 1)!r}, rate = {v0[i]!r} }}")
    for i in range(n + 1):
        text += spring(f"b{i}" if i < n else "wall.end", f"b{i - 1}" if i else "ground", k[i], c[i], gap)
    for i in (0, n - 1):
        text += output(f"x{i}", f"j{i}", "value")

    def truth(t):
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
        values, vectors = np.linalg.eig(A)
        amplitude = np.linalg.solve(vectors, np.r_[np.zeros(n), v0].astype(complex))
        y = (np.exp(np.outer(t, values)) * amplitude) @ vectors.T
        return {f"x{i}": gap * (i + 1) + y[:, i : i + 1].real for i in (0, n - 1)}

    return Scene(text, truth, {}, f"{n} bodies, {periods:.0f} periods of the fastest")


def flapping(r):
    """A beam turns steadily about an axis across it and is pushed out of its plane; the truth with centrifugal stiffness"""
    L, m, s = sizes(r, slender=(20, 60), shapes=("rectangle", "circle", "tube"))
    EI, rhoA = m["E"] * s["iy"], m["rho"] * s["area"]
    G = m["E"] / (2 * (1 + m["poisson"]))
    w1 = 3.516 / L**2 * math.sqrt(EI / rhoA)
    spin = w1 * 10 ** r.uniform(-0.7, 0.5)
    hub = L * pick(r, 0.0, r.uniform(0.05, 0.5))
    F = 3 * EI / L**2 * 10 ** r.uniform(-4, -3)
    elements = 20

    def matrices():
        M, K = beam_matrices(L, EI, rhoA, kGA=s["shear_z"] * G * s["area"], rhoI=0.0, elements=elements)
        h = L / elements
        g = np.zeros((2 * elements + 2,) * 2)
        x, w = np.polynomial.legendre.leggauss(5)
        for e in range(elements):
            for xi, wi in zip((x + 1) / 2, w / 2 * h):
                at = (e + xi) * h
                N = rhoA * spin**2 * ((L * L - at * at) / 2 + hub * (L - at))
                d = np.array([6 * (xi**2 - xi) / h, 1 - 4 * xi + 3 * xi**2, 6 * (xi - xi**2) / h, 3 * xi**2 - 2 * xi])
                i = slice(2 * e, 2 * e + 4)
                g[i, i] += wi * N * np.outer(d, d)
        return M, K + g[2:, 2:]

    T = 2 * math.pi / Linear(*matrices()).omega[0]
    rise, duration = T * r.uniform(0.5, 2), T * r.uniform(2, 5)
    text = (
        simulation(duration, 300 / duration, start="static")
        + rigid("hub", 1.0, (1, 1, 1), {"rim": (hub, 0, 0)})
        + beam("blade", L, s["text"], m)
        + joint("shaft", "revolute", "ground", "hub", f'motion = "{spin!r}*t"')
        + weld("root", "hub.rim", "blade.root")
        + force("force", "blade.tip", f"t < {rise!r} ? {F!r}*sin(pi*t/{2 * rise!r})^2 : {F!r}", (0, 0, 1))
        + output("flap", "blade.tip", "displacement")
    )

    def truth(t):
        M, K = matrices()
        f = np.zeros(len(K))
        f[-2] = 1.0
        v = Linear(M, K).respond(f, lambda x: F * np.where(x < rise, np.sin(np.pi * x / (2 * rise)) ** 2, 1.0), t)[:, -2]
        return {"flap": np.stack([np.full_like(v, np.nan), np.full_like(v, np.nan), v], axis=1)}

    return Scene(text, truth, {}, f"spin/first frequency {spin / w1:.2g}, hub {hub / L:.2g} L")


def driven_chain(r):
    """A spatial chain of rigid bodies, every joint driven; places, and moments of the motors by Newton and Euler in numpy"""
    n = r.randint(2, 4)
    L = [10 ** r.uniform(-1, 0.5) for _ in range(n)]
    m = [10 ** r.uniform(-1, 1.5) for _ in range(n)]
    w = [10 ** r.uniform(-0.5, 1) for _ in range(n)]
    A = [r.uniform(0.1, 1.2) for _ in range(n)]
    axes = [np.array([r.uniform(-1, 1) for _ in range(3)]) for _ in range(n)]
    axes = [a / np.linalg.norm(a) for a in axes]
    g = np.array([0, 0, -9.81])
    duration = 2 * math.pi / min(w) * r.uniform(0.5, 1.5)
    text = simulation(duration, 300 / duration, tuple(g))
    for i in range(n):
        J = m[i] * L[i] ** 2 / 12
        text += rigid(f"b{i}", m[i], (J / 20, J, J), {"end": (L[i], 0, 0)}, centre=(L[i] / 2, 0, 0))
        text += joint(
            f"j{i}",
            "revolute",
            f"b{i - 1}.end" if i else "ground",
            f"b{i}",
            f'axis = {[float(a) for a in axes[i]]}\nmotion = "{A[i]!r}*sin({w[i]!r}*t)"',
        )
    text += output("end", f"b{n - 1}.end", "position") + output("F", "j0", "reaction")

    def pose(t):
        R, p, out = np.eye(3), np.zeros(3), []
        for i in range(n):
            R = R @ rotate(axes[i] * A[i] * math.sin(w[i] * t))
            out.append((R, p + R @ [L[i] / 2, 0, 0], p + R @ [L[i], 0, 0]))
            p = out[-1][2]
        return out

    def truth(t):
        h = 1e-3 / max(w)
        end, load = [], []
        for x in t:
            # Momentum and its moment about the origin, differentiated over places by eighth-order differences.
            def momentum(at):
                P, H = np.zeros(3), np.zeros(3)
                weights = ((1, 4 / 5), (2, -1 / 5), (3, 4 / 105), (4, -1 / 280))
                here = pose(at)
                for i in range(n):
                    J = m[i] * L[i] ** 2 / 12 * np.diag([1 / 20, 1, 1])
                    v, dR = np.zeros(3), np.zeros((3, 3))
                    for k, c in weights:
                        a, b = fine(at + k * h), fine(at - k * h)
                        v += c * (a[i][1] - b[i][1]) / h
                        dR += c * (a[i][0] - b[i][0]) / h
                    R = here[i][0]
                    W = dR @ R.T
                    omega = np.array([W[2, 1] - W[1, 2], W[0, 2] - W[2, 0], W[1, 0] - W[0, 1]]) / 2
                    P += m[i] * v
                    H += m[i] * np.cross(here[i][1], v) + R @ J @ R.T @ omega
                return P, H

            fine = pose
            end.append(pose(x)[-1][2])
            dP, dH = np.zeros(3), np.zeros(3)
            H = 20 * h
            for k, c in ((1, 4 / 5), (2, -1 / 5), (3, 4 / 105), (4, -1 / 280)):
                a, b = momentum(x + k * H), momentum(x - k * H)
                dP += c * (a[0] - b[0]) / H
                dH += c * (a[1] - b[1]) / H
            weight = sum(m) * g
            turning = sum(np.cross(pose(x)[i][1], m[i] * g) for i in range(n))
            load.append(np.r_[dP - weight, dH - turning])
        return {"end": np.array(end), "F": np.array(load)}

    return Scene(text, truth, {}, f"{n} bodies")


def stopped_four_bar(r):
    """An elastic four-bar, driven by a torque, whose rocker runs against a stop"""
    L, m, s = sizes(r, slender=(15, 40), shapes=("rectangle", "circle"))
    a, b, d = L * 0.35, L * 0.8, L
    rod = m["rho"] * s["area"] * L
    w1 = math.pi**2 / L**2 * math.sqrt(m["E"] * s["iz"] / (m["rho"] * s["area"]))
    p0 = 1.2
    ax, ay = a * math.cos(p0), a * math.sin(p0)
    D = math.hypot(d - ax, ay)
    th = math.atan2(-ay, d - ax) + math.acos((L * L + D * D - b * b) / (2 * L * D))
    ps = math.atan2(ay + L * math.sin(th), ax + L * math.cos(th) - d)
    J, load = rod * a * a * r.uniform(1, 5), rod * r.uniform(0.3, 2)
    T = 2 * math.pi / w1 * r.uniform(10, 30)
    torque = 0.6 * (J + load * a * a) / T**2 * 4
    k = load * b * b * (w1 * r.uniform(0.1, 0.5)) ** 2

    def make(more):
        return (
            simulation(1.5 * T, 300 / T)
            + rigid("crank", rod, (J, J, J), {"end": (a, 0, 0)})
            + beam("coupler", L, s["text"], m, more + "\nframes = { mid = 0.5 }")
            + rigid("rocker", load, (load * b * b / 12,) * 3, {"end": (b, 0, 0)}, centre=(b / 2, 0, 0))
            + joint("shaft", "revolute", "ground", "crank", f"initial = {{ value = {p0!r} }}")
            + joint("pin", "revolute", "crank.end", "coupler.root", f"rotation = [0, 0, {th - p0!r}]")
            + joint(
                "hinge",
                "revolute",
                "ground",
                "rocker",
                f"position = [{d!r}, 0, 0]\nrotation = [0, 0, {ps!r}]\n"
                f"stop = {{ lower = -0.1, upper = 0.1, stiffness = {k!r}, damping = {0.1 * k / w1!r} }}",
            )
            + joint("top", "revolute", "rocker.end", "coupler.tip", f"rotation = [0, 0, {th - ps!r}]")
            + force("torque", "crank", torque, (0, 0, 1))
            + output("q", "hinge", "value")
            + output("mid", "coupler.mid", "displacement")
        )

    return pair(make, f"stop {math.sqrt(k / (load * b * b)) / w1:.2g} of the first frequency", rich=ALL.format(12))


KINDS = [sudden, modal_q, dropped_rod, offset_tip, shaken_frame, near_buckling, belt, flapping, driven_chain, stopped_four_bar]
