"""Couplings of joints, shapes with their inertia, parts that come more than once, outputs of sections and forces.

Truths in closed form and by scipy."""
import math

import numpy as np
from scipy.linalg import eigh

from scene import Scene, beam, force, joint, output, pick, rigid, sizes, simulation, weld
from truths.formulas import ode, restarted, rotate


def coupling(name, kind, lines):
    return f'[[coupling]]\nname = "{name}"\nkind = "{kind}"\n{lines}\n\n'


def wheel(name, J, at, more="", axis="[0, 0, 1]"):
    return rigid(name, 1.0, (J, J, J)) + joint(f"j_{name}", "revolute", "ground", name, f"axis = {axis}\nposition = {at}\n{more}")


def rubs(M):
    return f"friction = {{ coefficient = 1.0, normal_force = {M!r} }}"


def geared_wheels(r):
    """Two or three wheels in mesh, friction in their bearings, a torque that goes to and fro: stick and slip through the gears"""
    n = pick(r, 2, 3)
    J = [10 ** r.uniform(-2, 1) for _ in range(n)]
    z = [r.randint(12, 80) for _ in range(n)]
    inside = r.random() < 0.3
    ratio = [1.0]
    for i in range(1, n):
        ratio.append(ratio[-1] * z[i - 1] / z[i] * (1 if inside and i == 1 else -1))
    total = sum(j * q * q for j, q in zip(J, ratio))
    T, w = 10 ** r.uniform(-1, 2), 10 ** r.uniform(-1, 1)
    rub = [pick(r, 0.0, T * r.uniform(0.05, 0.3) / abs(q)) for q in ratio]
    R = sum(abs(q) * f for q, f in zip(ratio, rub))
    duration = 2 * math.pi / w * r.uniform(1, 3)
    text = simulation(duration, 200 / duration)
    for i in range(n):
        text += wheel(f"w{i}", J[i], [float(i), 0.0, 0.0], rubs(rub[i]) if rub[i] else "") + output(f"a{i}", f"j_w{i}", "value")
        if i:
            text += coupling(
                f"g{i}",
                "gear",
                f'joints = ["j_w{i - 1}", "j_w{i}"]\nteeth = [{z[i - 1]}, {z[i]}]' + ("\ninternal = true" if inside and i == 1 else ""),
            )
    text += force("torque", "w0", f"{T!r}*sin({w!r}*t)", (0, 0, 1))

    def truth(t):
        # As a block with dry friction, in the first wheel's angle.
        y, out, at = np.zeros(2), np.zeros((len(t), 2)), 0
        push = lambda s: T * math.sin(w * s)
        fine = 400
        dt = (t[1] - t[0]) / fine
        for i in range(len(t)):
            out[i] = y
            for k in range(fine if i + 1 < len(t) else 0):
                s = t[i] + (k + 0.5) * dt
                F = push(s)
                if y[1] == 0.0:
                    a = 0.0 if abs(F) <= R else (F - math.copysign(R, F)) / total
                else:
                    a = (F - math.copysign(R, y[1])) / total
                v = y[1] + a * dt
                if y[1] != 0.0 and v * y[1] < 0 and abs(F) <= R:
                    v = 0.0
                y = np.array([y[0] + 0.5 * (y[1] + v) * dt, v])
        return {f"a{i}": ratio[i] * out[:, :1] for i in range(n)}

    return Scene(text, truth, {}, f"{n} wheels, friction {R / T:.2g} of the torque")


def planetary(r):
    """A planetary gear: sun driven by a torque, ring held or loaded, the arm carries the planets"""
    zs, zp = r.randint(12, 40), r.randint(12, 40)
    zr = zs + 2 * zp
    Js, Jp, Ja, Jr = (10 ** r.uniform(-2, 0) for _ in range(4))
    mp, d = r.uniform(0.1, 2), 0.1
    held = r.random() < 0.5
    Ts, Tr, Ta = r.uniform(-2, 2), r.uniform(-2, 2), r.uniform(-2, 2)
    c = r.uniform(0.01, 0.5)
    duration = r.uniform(0.5, 3)
    text = simulation(duration, 200 / duration) + wheel("sun", Js, [0.0] * 3) + wheel("arm", Ja, [0.0] * 3)
    text += rigid("planet", mp, (Jp, Jp, Jp)) + joint("j_planet", "revolute", "arm", "planet", f"position = [{d}, 0, 0]")
    text += coupling("inner", "gear", f'joints = ["j_sun", "j_planet"]\nteeth = [{zs}, {zp}]\ncarrier = "j_arm"')
    if held:
        # What the ring at rest does: arm and planet turn as the inside of it lets them.
        text += coupling("outer", "linear", f'terms = [{{ joint = "j_planet", factor = {zp} }}, {{ joint = "j_arm", factor = {zr} }}]')
    else:
        text += wheel("ring", Jr, [0.0] * 3) + coupling(
            "outer", "gear", f'joints = ["j_planet", "j_ring"]\nteeth = [{zp}, {zr}]\ninternal = true\ncarrier = "j_arm"'
        )
        text += force("torque", "ring", Tr, (0, 0, 1)) + output("r", "j_ring", "value")
    text += (
        force("torque", "sun", Ts, (0, 0, 1)) + output("s", "j_sun", "value") + output("a", "j_arm", "value") + output("v", "j_arm", "rate")
    )
    text += force("torque", "arm", f"{Ta!r} - {c!r}*v", (0, 0, 1))

    def truth(t):
        # Angles of sun s and arm a; planet seen from the arm: p = -zs/zp (s - a); ring: r = a + zp/zr p.
        P = np.array([-zs / zp, 1 + zs / zp])  # of the planet in the world
        Rr = np.array([-zs / zr, 1 + zs / zr])
        M = np.diag([Js, Ja + mp * d * d]) + Jp * np.outer(P, P) + (0 if held else Jr * np.outer(Rr, Rr))
        F = np.array([Ts, Ta]) + (0 if held else Tr * Rr)
        C = np.array([[0, 0], [0, c]])
        if held:
            S = np.array([(1 + zs / zr) * zr / zs, 1.0])  # (s, a) over a, the ring at rest
            m, f, cc = S @ M @ S, S @ F, S @ C @ S
            y = ode(lambda _, y: [y[1], (f - cc * y[1]) / m], [0, 0], t)
            return {"s": y[:, :1] * S[0], "a": y[:, :1], "v": y[:, 1:]}
        y = ode(lambda _, y: np.r_[y[2:], np.linalg.solve(M, F - C @ y[2:])], [0] * 4, t)
        return {"s": y[:, :1], "a": y[:, 1:2], "v": y[:, 3:], "r": y[:, :2] @ Rr[:, None]}

    return Scene(text, truth, {}, f"teeth {zs} {zp} {zr}, ring {'held' if held else 'free'}")


def rack_and_screw(r):
    """A motor drives a slide by a rack or a screw, with a spring, a load and friction on the slide"""
    J, m = 10 ** r.uniform(-3, 0), 10 ** r.uniform(-1, 2)
    screw = r.random() < 0.5
    q = 10 ** r.uniform(-3, -1) * pick(r, 1, -1)  # way per angle
    M = J + m * q * q
    w = 10 ** r.uniform(-0.5, 1)
    k = M * w * w / q**2
    c = 2 * 0.05 * M * w
    T = 10 ** r.uniform(-1, 1)
    load = T / abs(q) * r.uniform(-0.5, 0.5)
    bias = r.uniform(-1, 1)
    duration = 2 * math.pi / w * r.uniform(2, 5)
    lines = 'joints = ["j_motor", "slide"]\n' + (f"pitch = {q!r}" if screw else f"radius = {q!r}")
    text = (
        simulation(duration, 200 / duration)
        + wheel("motor", J, [0.0, 1.0, 0.0], f"initial = {{ value = {bias!r} }}\nspring = {{ stiffness = 0.0, damping = {c!r} }}")
        + rigid("table", m, (m, m, m))
        + joint("slide", "prismatic", "ground", "table", f"axis = [0, 1, 1]\nspring = {{ stiffness = {k!r} }}")
        + coupling("c", "screw" if screw else "rack", lines)
        + force("torque", "motor", f"{T!r}*sin({0.6 * w!r}*t)", (0, 0, 1))
        + force("force", "table", load * math.sqrt(2), (0, 1, 0))
        + output("x", "slide", "value")
        + output("a", "j_motor", "value")
    )

    def truth(t):
        f = lambda s, y: [y[1], (T * math.sin(0.6 * w * s) - c * y[1] - k * q * q * y[0] + q * load) / M]
        y = ode(f, [0.0, 0.0], t)
        return {"x": q * y[:, :1], "a": bias + y[:, :1]}

    return Scene(text, truth, {}, f"{'screw' if screw else 'rack'}, {q:.2g} m/rad, motor {J / M:.2g} of the inertia")


def axle(r):
    """A differential between two wheels with different loads, as a differential or as a linear condition of three joints"""
    J = [10 ** r.uniform(-1, 1) for _ in range(3)]
    ratio = pick(r, 1.0, r.uniform(0.2, 3))
    T = [r.uniform(-5, 5) for _ in range(2)]
    Tin = r.uniform(-5, 5)
    c = [r.uniform(0.01, 1) for _ in range(2)]
    duration = r.uniform(1, 5)
    text = simulation(duration, 200 / duration)
    for i, n in enumerate("lr"):
        text += wheel(n, J[i], [0.0, 0.0, float(i)], f"spring = {{ stiffness = 0.0, damping = {c[i]!r} }}") + force(
            "torque", n, T[i], (0, 0, 1)
        )
        text += output(n, f"j_{n}", "value")
    text += wheel("in", J[2], [0.0, 1.0, 0.0]) + output("in", "j_in", "value") + force("torque", "in", Tin, (0, 0, 1))
    if r.random() < 0.5:
        text += coupling("d", "differential", f'joints = ["j_l", "j_r", "j_in"]\nratio = {ratio!r}')
    else:
        text += coupling(
            "d",
            "linear",
            f'terms = [{{ joint = "j_l", factor = 0.5 }}, {{ joint = "j_r", factor = 0.5 }}, {{ joint = "j_in", factor = {-ratio!r} }}]',
        )

    def truth(t):
        C, F = np.diag(c), np.array(T)
        g = np.array([0.5, 0.5]) / ratio
        M = np.diag(J[:2]) + J[2] * np.outer(g, g)
        y = ode(lambda _, y: np.r_[y[2:], np.linalg.solve(M, F + Tin * g - C @ y[2:])], [0] * 4, t)
        return {"l": y[:, :1], "r": y[:, 1:2], "in": y[:, :2] @ g[:, None]}

    return Scene(text, truth, {}, f"ratio {ratio:.2g}")


def geared_shafts(r):
    """Two elastic shafts joined by gears twist under a torque that is switched on"""
    L, E, rho, nu = r.uniform(0.3, 1), 2.1e11, 7850.0, 0.3
    d = [L / r.uniform(15, 40) for _ in range(2)]
    G = E / (2 * (1 + nu))
    Ip = [math.pi * x**4 / 32 for x in d]
    z = [r.randint(15, 60), r.randint(15, 60)]
    i = -z[0] / z[1]
    k = [G * p / L for p in Ip]
    J = [rho * p * L * r.uniform(5, 50) for p in Ip]  # discs far above the shafts'
    T = k[0] * 10 ** r.uniform(-4, -3)
    mat = {"E": E, "rho": rho, "poisson": nu}
    w = math.sqrt(k[0] / J[0])
    duration = 2 * math.pi / w * r.uniform(1, 3)
    x = "axis = [1, 0, 0]"
    text = simulation(duration, 300 / duration)
    for n in range(2):
        text += beam(f"s{n}", L, f'{{ shape = "circle", diameter = {d[n]!r} }}', mat)
    # Disc 0 - shaft 0 - gear 0 | gear 1 - shaft 1 - wall.
    text += rigid("disc", 1.0, (J[0],) * 3) + rigid("gear0", 1.0, (J[1],) * 3) + rigid("gear1", 1.0, (J[1],) * 3)
    text += joint("b0", "revolute", "ground", "disc", x) + weld("w0", "disc", "s0.root") + weld("w1", "s0.tip", "gear0")
    text += joint("b1", "revolute", "ground", "gear1", f"{x}\nposition = [{L!r}, 0.3, 0]") + weld("w2", "gear1", "s1.root")
    text += weld("w3", "ground", "s1.tip", f"position = [{2 * L!r}, 0.3, 0]")
    text += joint("b2", "revolute", "ground", "gear0", f"{x}\nposition = [{L!r}, 0, 0]")
    text += coupling("g", "gear", f'joints = ["b2", "b1"]\nteeth = [{z[0]}, {z[1]}]')
    text += force("torque", "disc", T, (1, 0, 0)) + output("a", "b0", "value") + output("b", "b1", "value")

    def truth(t):
        n = 30
        h = L / n
        size = 2 * n + 2
        M, K = np.zeros((size, size)), np.zeros((size, size))
        for s in range(2):
            for e in range(n):
                a = s * (n + 1) + e
                M[a : a + 2, a : a + 2] += rho * Ip[s] * h / 6 * np.array([[2, 1], [1, 2]])
                K[a : a + 2, a : a + 2] += G * Ip[s] / h * np.array([[1, -1], [-1, 1]])
        M[0, 0] += J[0]
        M[n, n] += J[1]
        M[n + 1, n + 1] += J[1]
        # Gear 1 follows gear 0; the wall holds the last.
        B = np.delete(np.eye(size), [n + 1, size - 1], axis=1)
        B[n + 1, n] = i
        squares, phi = eigh(B.T @ K @ B, B.T @ M @ B)
        om = np.sqrt(squares)
        p = phi.T @ (B.T @ (np.eye(size)[0] * T))
        q = (p / squares) * (1 - np.cos(np.outer(t, om)))
        u = q @ phi.T @ B.T
        return {"a": u[:, :1], "b": u[:, n + 1 : n + 2]}

    return Scene(text, truth, {}, f"teeth {z[0]} {z[1]}, disc {J[0] / (rho * Ip[0] * L):.2g} shafts")


def shaped_pendulum(r):
    """A body of solids, placed and turned, with their density: swings on a hinge along any axis, its inertia from the shapes"""
    density = 10 ** r.uniform(2.5, 4)
    solids, lines = [], []
    for _ in range(r.randint(1, 4)):
        own = pick(r, density, 10 ** r.uniform(2.5, 4))
        p = np.array([r.uniform(-0.5, 0.5) for _ in range(3)])
        v = np.array([r.uniform(-2, 2) for _ in range(3)])
        kind = pick(r, "box", "cylinder", "tube", "sphere", "disc", "plate", "capsule")
        a, b, c = (r.uniform(0.05, 0.4) for _ in range(3))
        if kind == "box":
            V, I = a * b * c, np.diag([b * b + c * c, a * a + c * c, a * a + b * b]) / 12
            keys = f'shape = "box", size = [{a!r}, {b!r}, {c!r}]'
        elif kind == "plate":
            V, I = a * b * c / 10, np.diag([b * b + c * c / 100, a * a + c * c / 100, a * a + b * b]) / 12
            keys = f'shape = "plate", size = [{a!r}, {b!r}], thickness = {c / 10!r}'
        elif kind in ("cylinder", "tube", "disc"):
            i = 0.0 if kind == "cylinder" else a * r.uniform(0.2, 0.9)
            V, x = math.pi * (a * a - i * i) * b, (3 * (a * a + i * i) + b * b) / 12
            I = np.diag([x, x, (a * a + i * i) / 2])
            keys = f'shape = "{"disc" if kind == "disc" else "cylinder"}", radius = {a!r}, inner_radius = {i!r}, ' + (
                f"thickness = {b!r}" if kind == "disc" else f"length = {b!r}"
            )
        elif kind == "sphere":
            V, I = 4 / 3 * math.pi * a**3, np.eye(3) * 0.4 * a * a
            keys = f'shape = "sphere", radius = {a!r}'
        else:
            Vc, Vs = math.pi * a * a * b, 4 / 3 * math.pi * a**3
            V = Vc + Vs
            x = Vc * (3 * a * a + b * b) / 12 + Vs * (0.4 * a * a + b * b / 4 + 3 * a * b / 8)
            I = np.diag([x, x, Vc * a * a / 2 + Vs * 0.4 * a * a]) / V
            keys = f'shape = "capsule", radius = {a!r}, length = {b!r}'
        if r.random() < 0.4:
            axis, angle = np.array([r.uniform(-1, 1) for _ in range(3)]), r.uniform(-170, 170)
            R = rotate(axis / np.linalg.norm(axis) * math.radians(angle))
            turned = f'{{ axis = {[float(x) for x in axis]}, angle = "{angle!r} deg" }}'
        else:
            R, turned = rotate(v), f"{[float(x) for x in v]}"
        solids.append((own * V, p, R @ (own * V * I) @ R.T))
        place = f'["{p[0] * 1000!r} mm", {p[1]!r}, "{p[2] * 100!r} cm"]'
        lines.append(f"{{ {keys}, position = {place}, rotation = {turned}" + (f", density = {own!r}" if own != density else "") + " }")
    m = sum(s[0] for s in solids)
    centre = sum(s[0] * s[1] for s in solids) / m
    I = sum(s[2] + s[0] * ((s[1] - centre) @ (s[1] - centre) * np.eye(3) - np.outer(s[1] - centre, s[1] - centre)) for s in solids)
    axis = np.array([r.uniform(-1, 1) for _ in range(3)])
    axis /= np.linalg.norm(axis)
    g = np.array([r.uniform(-1, 1) for _ in range(3)]) * 9.81
    J = axis @ I @ axis + m * (centre @ centre - (axis @ centre) ** 2)
    rate = r.uniform(-3, 3)
    duration = r.uniform(1, 4)
    text = (
        simulation(duration, 200 / duration, g)
        + f'[[body]]\nname = "b"\nkind = "rigid"\ndensity = "{density / 1000!r} t/m^3"\nshapes = [\n  '
        + ",\n  ".join(lines)
        + "\n]\n\n"
        + joint("hinge", "revolute", "ground", "b", f"axis = {[float(a) for a in axis]}\ninitial = {{ rate = {rate!r} }}")
        + output("a", "hinge", "value")
        + output("energy", "system", "kinetic")
    )

    def truth(t):
        def f(_, y):
            return [y[1], axis @ np.cross(rotate(axis * y[0]) @ centre, m * g) / J]

        y = ode(f, [0.0, rate], t)
        return {"a": y[:, :1], "energy": 0.5 * J * y[:, 1:] ** 2}

    return Scene(text, truth, {}, f"{len(lines)} solids")


def propeller(r):
    """Blades as instances of a group, placed round a hub that is turned: the hub's spin-up and the force in a root"""
    n, L = r.randint(2, 5), r.uniform(0.2, 2)
    m, e = r.uniform(0.2, 3), r.uniform(0.05, 0.3)
    J, T = r.uniform(0.1, 2), r.uniform(1, 20)
    k = r.uniform(0.0, 1)
    duration = r.uniform(0.5, 2)
    text = (
        simulation(duration, 200 / duration)
        + f'[parameters]\nblades = {n}\nspan = "{L * 1000!r} mm"\n\n'
        + rigid("hub", 1.0, (J, J, J))
        + joint("shaft", "revolute", "ground", "hub", f"spring = {{ stiffness = 0.0, damping = {k!r} }}")
        + f'[[group]]\nname = "blade"\nparameters = {{ hub = "hub", m = {m!r} }}\n'
        + f'[[group.body]]\nname = "rod"\nkind = "rigid"\nmass = "m"\n'
        + 'inertia = [0, "m*span^2/12", "m*span^2/12"]\ncentre_of_mass = ["span/2", 0, 0]\n'
        + f'[[group.joint]]\nname = "root"\nkind = "weld"\nparent = "{{hub}}"\nchild = "rod"\nposition = [{e!r}, 0, 0]\n\n'
        + '[[instance]]\ngroup = "blade"\nname = "b"\ncount = '
        + f"{n}"
        + '\nrotation = "[0, 0, 2*pi/blades*i]"\n\n'
        + force("torque", "hub", f"{T / 1000!r} kJ/rad*sin({1 / duration!r} Hz*2*pi*t)".replace(" kJ/rad", "*1000"), (0, 0, 1))
        + output("a", "shaft", "value")
        + output("F", "b1:root", "reaction").replace("quantity", 'frame = "child"\nquantity')
    )

    def truth(t):
        total = J + n * m * (L * L / 12 + (e + L / 2) ** 2)
        f = lambda s, y: [y[1], (T * math.sin(2 * math.pi * s / duration) - k * y[1]) / total]
        y = ode(f, [0.0, 0.0], t)
        acc = np.array([f(s, z)[1] for s, z in zip(t, y)])
        reach = e + L / 2
        N, V = -m * reach * y[:, 1] ** 2, m * reach * acc
        M = m * L * L / 12 * acc + V * L / 2
        return {"a": y[:, :1], "F": np.stack([N, V, 0 * t, 0 * t, 0 * t, M], axis=1)}

    return Scene(text, truth, {}, f"{n} blades")


def sections_at_rest(r):
    """Forces and stress in sections of a clamped beam at rest, its load at the tip in any direction with a torque, and its weight"""
    L, m, s = sizes(r, slender=(15, 40), shapes=("rectangle", "circle", "tube"))
    at = [r.uniform(0.02, 0.95) for _ in range(2)]
    small = 1e-4 * m["E"] * min(s["iy"], s["iz"]) / L**2
    F = np.array([r.uniform(-1, 1) * small for _ in range(3)])
    T = r.uniform(-1, 1) * small * L * 0.3
    g = np.array([r.uniform(-1, 1) for _ in range(3)]) * small / (m["rho"] * s["area"] * L)
    text = (
        simulation(0.01, 100, g, start="static")
        + beam("b", L, s["text"], m, 'effects = ["axial", "bending_xy", "bending_xz", "torsion"]')
        + weld("clamp", "ground", "b.root")
        + force("force", "b.tip", float(np.linalg.norm(F)), F)
        + force("torque", "b.tip", T, (1, 0, 0))
    )
    for i, x in enumerate(at):
        text += output(f"s{i}", "b", "section_force").replace("quantity", f"at = {x!r}\nquantity")
    round_one = s["shape"] in ("circle", "tube")
    if round_one:
        text += output("stress", "b", "stress").replace("quantity", f"at = {at[0]!r}\nquantity")

    def truth(t):
        out = {}
        for i, x in enumerate(at):
            w = m["rho"] * s["area"] * g
            rest = L * (1 - x)
            Q = F + w * rest
            M = np.cross([rest, 0, 0], F) + np.cross([rest / 2, 0, 0], w * rest) + [T, 0, 0]
            out[f"s{i}"] = np.tile(np.r_[Q, M], (len(t), 1))
            if i == 0 and round_one:
                R, I = s["height"] / 2, s["iz"]
                inner2 = R * R - s["area"] / math.pi  # 0 of a circle
                # On both rims: N/A + M r / I, torsion, and the shear force's by Saint-Venant (largest across the force).
                nu, best = m["poisson"], 0.0
                for near, far in ((R * R, inner2), (inner2, R * R)):
                    flank = ((1 + 2 * nu) * near + (3 + 2 * nu) * far) / (4 * (1 + nu) * I)
                    r0 = math.sqrt(max(near, 0.0))
                    for a in np.linspace(0, 2 * math.pi, 721) if near > 1e-6 * R * R else []:
                        y, z = r0 * math.cos(a), r0 * math.sin(a)
                        sigma = Q[0] / s["area"] + M[1] * z / s["iy"] - M[2] * y / I
                        tau = M[0] * r0 / s["j"] + flank * (Q[2] * math.cos(a) - Q[1] * math.sin(a))
                        best = max(best, math.hypot(sigma, math.sqrt(3) * tau))
                out["stress"] = np.full((len(t), 1), best)
        return out

    def size(b):
        return float(np.linalg.norm(b[0]))

    return Scene(text, truth, {"s0": size, "s1": size, "stress": size}, f"{s['shape']} at {at[0]:.2f}, {at[1]:.2f}")


def forces_of_joints(r):
    """What springs, stops and friction of joints give as outputs, and a force's power"""
    m, k = 10 ** r.uniform(-1, 1), 10 ** r.uniform(1, 4)
    w = math.sqrt(k / m)
    c = 2 * m * w * r.uniform(0, 0.1)
    N, mu = r.uniform(0, 1) * 0.05 * k, 0.5
    x0 = r.uniform(0.3, 1)
    stop, ks = -x0 * r.uniform(0.2, 0.6), k * r.uniform(5, 50)
    pre = r.uniform(-0.05, 0.05) * k
    P = 0.1 * k
    duration = 2 * math.pi / w * r.uniform(0.6, 0.9)
    text = (
        simulation(duration, 200 / duration)
        + rigid("b", m, (m, m, m))
        + joint(
            "rail",
            "prismatic",
            "ground",
            "b",
            f"axis = [0, 0, 1]\ninitial = {{ value = {x0!r} }}\nspring = {{ stiffness = {k!r}, damping = {c!r}, preload = {pre!r} }}\n"
            f"stop = {{ lower = {stop!r}, stiffness = {ks!r} }}\n" + f"friction = {{ coefficient = {mu}, normal_force = {N!r} }}",
        )
        + force("force", "b", f"{P!r}*cos({w!r}*t)", (0, 0, 1), 'name = "push"')
        + output("x", "rail", "value")
        + output("power", "push", "power")
    )
    for q in ("spring_force", "stop_force", "friction_force"):
        text += output(q, "rail", q)

    def truth(t):
        R = mu * N
        spring = lambda x, v: -k * x - c * v - pre
        halt = lambda x: ks * max(0.0, stop - x)

        def f(s, y):
            return [y[1], (spring(*y) + halt(y[0]) - R * math.copysign(1, y[1] if y[1] else -1.0) + P * math.cos(w * s)) / m]

        y = restarted(f, [lambda _, y: y[0] - stop, lambda s, y: y[1] if s > 1e-3 / w else -1.0], [x0, 0.0], t)
        v = y[:, 1]
        out = {
            "x": y[:, :1],
            "power": (P * np.cos(w * t) * v)[:, None],
            "spring_force": spring(y[:, 0], v)[:, None],
            "stop_force": np.array([[halt(x)] for x in y[:, 0]]),
        }
        sign = -np.sign(v)
        sign[0] = np.nan
        out["friction_force"] = (R * sign)[:, None]
        out["friction_force"][0] = R
        return out

    return Scene(text, truth, {}, f"friction {mu * N / k:.2g}, stop {ks / k:.2g} springs")


KINDS = [geared_wheels, planetary, rack_and_screw, axle, geared_shafts, shaped_pendulum, propeller, sections_at_rest, forces_of_joints]
