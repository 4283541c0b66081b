"""Scenes at rest, or moved so slowly that statics is the truth: what each effect is worth under loads along, across and beside the axis."""
import math

import numpy as np
from scipy.integrate import solve_bvp, trapezoid
from scipy.optimize import brentq

from scene import Scene, beam, force, joint, output, pick, rigid, simulation, sizes, weld
from truths.formulas import frame_at_rest, of_rectangles, rotate


def still(times, **values):
    return {name: np.tile(np.asarray(v, float), (len(times), 1)) for name, v in values.items()}


def tension(r):
    """A rod hangs from a clamp under its weight and a load along it, or is pressed far below buckling."""
    L, m, s = sizes(r, slender=(8, 60))
    E, rho, A = m["E"], m["rho"], s["area"]
    critical = math.pi**2 * E * min(s["iy"], s["iz"]) / (4 * L * L)
    sign = pick(r, 1, 1, 1, -1)
    F = sign * (r.uniform(0.02, 0.2) * critical if sign < 0 else E * A * 10 ** r.uniform(-5, -3))
    g = 9.81 if r.random() < 0.5 and sign > 0 else 0.0
    tip = F * L / (E * A) + rho * g * L * L / (2 * E)
    text = (
        simulation(0.05, 200, (g, 0, 0), start="static")
        + beam("rod", L, s["text"], m)
        + weld("clamp", "ground", "rod.root")
        + force("force", "rod.tip", F, (1, 0, 0))
        + output("tip", "rod.tip", "displacement")
    )
    return Scene(
        text, lambda t: still(t, tip=(tip, 0, 0)), {"tip": abs(tip)}, f"{'pressed' if sign < 0 else 'pulled'} with {F:.3g} N, {g:g} m/s^2"
    )


def across(r):
    """A clamped beam, stubby or slender, under a force at its tip across the axis, in the plane or oblique, in any axes."""
    L, m, s = sizes(r, slender=(2.5, 40))
    G = m["E"] / (2 * (1 + m["poisson"]))
    a = pick(r, 0.0, math.pi / 2, r.uniform(0, math.pi))
    fy, fz = math.cos(a), math.sin(a)
    soft = L**3 / (3 * m["E"] * np.array([s["iz"], s["iy"]])) + L / (G * s["area"] * np.array([s["shear_y"], s["shear_z"]]))
    F = 1e-3 * L / np.linalg.norm(soft * (fy, fz)) * r.uniform(0.05, 3)
    tip = np.array([0, F * fy * soft[0], F * fz * soft[1]])
    turn = [r.uniform(-1, 1) for _ in range(3)]
    direction = rotate(turn) @ (0, fy, fz)
    text = (
        simulation(0.05, 200, start="static")
        + beam("arm", L, s["text"], m)
        + weld("clamp", "ground", "arm.root", f"rotation = {turn}")
        + force("force", "arm.tip", F, direction)
        + output("tip", "arm.tip", "displacement")
    )
    return Scene(
        text,
        lambda t: still(t, tip=tip),
        {"tip": np.linalg.norm(tip)},
        f"length/height {L / s['height']:.3g}, {math.degrees(a):.0f} degrees to y",
    )


def distributed(r):
    """A clamped beam under a load along its length."""
    L, m, s = sizes(r, slender=(3, 40))
    G = m["E"] / (2 * (1 + m["poisson"]))
    along = r.random() < 0.2
    if along:
        p = m["E"] * s["area"] / L * 10 ** r.uniform(-6, -4)
        tip = np.array([p * L * L / (2 * m["E"] * s["area"]), 0, 0])
    else:
        soft = L**4 / (8 * m["E"] * s["iz"]) + L * L / (2 * G * s["area"] * s["shear_y"])
        p = 1e-3 * L / soft * r.uniform(0.05, 3)
        tip = np.array([0, p * soft, 0])
    more = pick(r, "", "", "keep_modes = 3") if not along else ""
    text = (
        simulation(0.05, 200, start="static")
        + beam("arm", L, s["text"], m, more)
        + weld("clamp", "ground", "arm.root")
        + force("distributed", "arm", p, (1, 0, 0) if along else (0, 1, 0))
        + output("tip", "arm.tip", "displacement")
    )
    return Scene(
        text,
        lambda t: still(t, tip=tip),
        {"tip": np.linalg.norm(tip)},
        f"{'along' if along else 'across'}, length/height {L / s['height']:.3g} {more}",
    )


def twist(r):
    """A force beside the axis of a clamped beam, at the end of a bracket: bending and twist."""
    L, m, s = sizes(r, slender=(6, 40), shapes=("rectangle", "rectangle", "circle", "tube", "box"))
    G = m["E"] / (2 * (1 + m["poisson"]))
    e = L * 10 ** r.uniform(-1.5, -0.2) * pick(r, 1, -1)
    bend = L**3 / (3 * m["E"] * s["iz"]) + L / (G * s["area"] * s["shear_y"])
    F = 1e-3 * L / bend * r.uniform(0.05, 2)
    # The bracket along z: a force along y at e turns the tip about x by -F e L / GJ, which moves the bracket's end by F e^2 L / GJ along y.
    end = np.array([0, F * bend + F * e * e * L / (G * s["j"]), 0])
    text = (
        simulation(0.05, 200, start="static")
        + beam("arm", L, s["text"], m)
        + weld("clamp", "ground", "arm.root")
        + rigid("bracket", 1e-3 * m["rho"] * s["area"] * L, (0, 0, 0), {"end": (0, 0, e)})
        + weld("hold", "arm.tip", "bracket")
        + force("force", "bracket.end", F, (0, 1, 0))
        + output("end", "bracket.end", "position")
        + output("tip", "arm.tip", "displacement")
    )
    small = np.array([0, F * bend, 0])
    return Scene(
        text,
        lambda t: still(t, end=np.array([L, 0, e]) + end, tip=small),
        {"end": abs(end[1]), "tip": abs(small[1])},
        f"{s['shape']}, offset {e / L:.2g} of the length, length/height {L / s['height']:.3g}",
    )


def angle_section(r):
    """An L section, whose principal axes are oblique, under a force along one leg."""
    L, m, _ = sizes(r, slender=(15, 15))
    h, w = L / r.uniform(15, 40), L / r.uniform(15, 40)
    t = min(h, w) * r.uniform(0.08, 0.2)
    # The corner at low y and low z; the leg along z lies beside the one along y.
    A, iy, iz, iyz, J = of_rectangles([(h / 2, t / 2, h, t), (t / 2, t + (w - t) / 2, t, w - t)])
    E = m["E"]
    a = pick(r, 0.0, math.pi / 2)
    load = np.array([math.cos(a), math.sin(a)])
    # Moments about both axes: E [iz iyz; iyz iy] [v''; w''] = (fy, fz)(L - x).
    soft = np.linalg.inv(E * np.array([[iz, iyz], [iyz, iy]])) * L**3 / 3
    F = 1e-3 * L / np.linalg.norm(soft @ load)
    tip = np.array([0, *(F * soft @ load)])
    given = r.random() < 0.5
    section = (
        f'{{ shape = "general", area = {A!r}, iy = {iy!r}, iz = {iz!r}, iyz = {iyz!r}, j = {J!r}, shear_y = 0.4, shear_z = 0.4 }}'
        if given
        else f'{{ shape = "l", height = {h!r}, width = {w!r}, thickness = {t!r} }}'
    )
    text = (
        simulation(0.05, 200, start="static")
        + beam("angle", L, section, m)
        + weld("clamp", "ground", "angle.root")
        + force("force", "angle.tip", F, (0, *load))
        + output("tip", "angle.tip", "displacement")
    )
    # Signs of y and z in the section's own drawing may be mirrored; the components' sizes are not.
    return Scene(
        text,
        lambda times: still(times, tip=tip),
        {"tip": np.linalg.norm(tip)},
        f"{'numbers' if given else 'shape l'}, force along {'yz'[int(a > 1)]}",
        sizes_only=not given,
    )


def truss(r):
    """Two bars hinged to ground and to each other, a load at the apex: shallow to steep."""
    L, m, s = sizes(r, slender=(15, 60), shapes=("rectangle", "circle", "tube"))
    E, A = m["E"], s["area"]
    angle = r.uniform(0.12, 1.2)
    a, h = L * math.cos(angle), L * math.sin(angle)
    # Share of what snaps it through, and of buckling of the bars.
    snap = 2 * E * A * math.sin(angle) * (1 - math.cos(angle)) * 0.38
    buckle = math.pi**2 * E * min(s["iy"], s["iz"]) / L**2 * 2 * math.sin(angle)
    P = min(r.uniform(0.02, 0.3) * snap, r.uniform(0.05, 0.3) * buckle) * pick(r, 1, 1, -1)
    y = h
    for _ in range(60):  # Newton on 2 EA (L - l) / L * y / l = P
        length = math.hypot(a, y)
        f = 2 * E * A * (L - length) / L * y / length - P
        slope = 2 * E * A * ((L - length) / L * a * a / length**3 - y * y / (L * length * length))
        y -= f / slope
    text = (
        simulation(0.05, 200, start="static")
        + beam("left", L, s["text"], m)
        + beam("right", L, s["text"], m)
        + joint("a", "revolute", "ground", "left.root", f"position = [{-a!r}, 0, 0]\nrotation = [0, 0, {angle!r}]")
        + joint("b", "revolute", "ground", "right.root", f"position = [{a!r}, 0, 0]\nrotation = [0, 0, {math.pi - angle!r}]")
        + joint("apex", "revolute", "left.tip", "right.tip", f"rotation = [0, 0, {math.pi - 2 * angle!r}]")
        + force("force", "left.tip", P, (0, -1, 0))
        + output("apex", "left.tip", "position")
    )
    return Scene(
        text,
        lambda t: still(t, apex=(0, y, 0)),
        {"apex": abs(h - y)},
        f"{math.degrees(angle):.0f} degrees, load {P / snap:.2g} of the snapping one",
    )


def torsion_rod(r):
    """A torque along a rod: twist, in closed form, seen at the end of an arm across it."""
    L, m, s = sizes(r, slender=(5, 40), shapes=("circle", "tube", "rectangle", "box"))
    G = m["E"] / (2 * (1 + m["poisson"]))
    angle = 10 ** r.uniform(-4, -1.3)
    M = angle * G * s["j"] / L
    text = (
        simulation(0.05, 200, start="static")
        + beam("shaft", L, s["text"], m)
        + weld("clamp", "ground", "shaft.root")
        + force("torque", "shaft.tip", M, (1, 0, 0))
        + output("turn", "shaft.tip", "rotation")
    )
    return Scene(text, lambda t: still(t, turn=(angle, 0, 0)), {"turn": angle}, f"{s['shape']}, {angle:.2g} rad")


def spun_blade(r):
    """A flat blade on a hub that turns evenly, pitched and twisted by a torque at its tip, at rest in its frame; effects free or listed"""
    L, m, s = sizes(r, slender=(6, 30), shapes=("rectangle",))
    G, A, iy, iz = m["E"] / (2 * (1 + m["poisson"])), s["area"], s["iy"], s["iz"]
    rates = math.sqrt(G * s["j"] / (m["rho"] * (iy + iz))) * math.pi / (2 * L)  # of its first torsion
    w = min(rates * 10 ** r.uniform(-1, 0), 0.2 * math.sqrt(m["E"] / m["rho"]) / L)  # 2 % of strain at most
    angle, pitch = 10 ** r.uniform(-3, -1), pick(r, 0.0, r.uniform(-1, 1))
    M = angle * G * s["j"] / L
    bends = ["bending_xy", "bending_xz"]
    listed = pick(r, ["torsion"], [*bends, "torsion"], ["torsion", "stiffening"], [*bends, "torsion", "stiffening"])
    listed = listed + pick(r, [], ["shear"], ["shear", "axial"], ["axial"]) if len(listed) == 4 else listed
    more = pick(r, "", f"effects = {listed}".replace("'", '"'), pick(r, 'model = "lumped"\nelements = 20', 'model = "mixed"'))

    def moments(x, y):
        stiffness = G * s["j"] + 0.5 * m["rho"] * w * w * (L * L - x * x) * (iy + iz)
        return np.vstack([y[1] / stiffness, m["rho"] * (iz - iy) * w * w * np.sin(y[0] + pitch) * np.cos(y[0] + pitch)])

    found = solve_bvp(moments, lambda a, b: [a[0], b[1] - M], np.linspace(0, L, 60), np.zeros((2, 60)), tol=1e-9)
    turn = float(found.y[0, -1])
    text = (
        simulation(0.01 / w, 200 * w, start="static")
        + beam("blade", L, s["text"].replace(" }", f", angle = {pitch!r} }}"), m, more)
        + joint("hub", "revolute", "ground", "blade.root", f'axis = [0, 0, 1]\nmotion = "{w!r}*t"')
        + force("torque", "blade.tip", M, (1, 0, 0), 'frame = "body"')
        + output("turn", "blade.tip", "rotation").replace("quantity", 'relative_to = "blade.root"\nquantity')
    )
    words = (
        f"{w / rates:.2g} of its torsion's rate, pitch {pitch:.2g}, {turn:.2g} rad, {turn / angle:.2g} of that at rest, {more or 'auto'}"
    )
    return Scene(text, lambda t: still(t, turn=(turn, 0, 0)), {"turn": abs(turn)}, words)


def elastica(r):
    """A clamped strip under a dead load across it, from small to large deflection; the truth by integrating the elastica."""
    L, m, s = sizes(r, slender=(80, 300), shapes=("rectangle",))
    load = 10 ** r.uniform(-1, 0.8)
    EI = m["E"] * s["iz"]
    F = load * EI / L**2
    # theta'' = -load cos(theta), theta(0) = 0, theta'(1) = 0.
    done = solve_bvp(
        lambda x, y: np.array([y[1], -load * np.cos(y[0])]),
        lambda a, b: np.array([a[0], b[1]]),
        np.linspace(0, 1, 200),
        np.zeros((2, 200)),
        tol=1e-10,
        max_nodes=100000,
    )
    x = np.linspace(0, 1, 20001)
    theta = done.sol(x)[0]
    tip = L * np.array([trapezoid(np.cos(theta), x), trapezoid(np.sin(theta), x), 0])
    more = pick(r, "", "", 'model = "mixed"')
    text = (
        simulation(0.05, 200, start="static")
        + beam("strip", L, s["text"], m, more)
        + weld("clamp", "ground", "strip.root")
        + force("force", "strip.tip", F, (0, 1, 0))
        + output("tip", "strip.tip", "position")
    )
    return Scene(text, lambda t: still(t, tip=tip), {"tip": np.linalg.norm(tip - (L, 0, 0))}, f"P L^2/EI = {load:.2g} {more}")


def springs_at_rest(r):
    """A body on springs, or a chain of lumped beams, hangs to rest; the truth from the balance of forces."""
    L, m, s = sizes(r, slender=(20, 60), shapes=("rectangle",))
    elements = 20
    # A lumped clamped beam: k = EI/l in the middle of every element; deflection under its own weight in small angles, added up.
    k, l = m["E"] * s["iz"] / (L / elements), L / elements
    w = m["rho"] * s["area"] * 9.81 * l
    scale = r.uniform(0.05, 1.0)
    g = 9.81 * scale * 1e-3 * L / (m["rho"] * s["area"] * 9.81 * L**4 / (8 * m["E"] * s["iz"]))
    w *= g / 9.81
    tip = 0.0
    for e in range(elements):
        x = (e + 0.5) * l
        # Beyond the joint: half an element and all that follow.
        moment = w / 2 * (0.25 * l) + sum(w * ((f + 0.5) * l - x) for f in range(e + 1, elements))
        tip += moment / k * (L - x)
    text = (
        simulation(0.05, 200, (0, -g, 0), start="static")
        + beam("chain", L, s["text"], m, f'model = "lumped"\nelements = {elements}')
        + weld("clamp", "ground", "chain.root")
        + output("tip", "chain.tip", "position")
    )
    return Scene(text, lambda t: still(t, tip=(L, -tip, 0)), {"tip": tip}, f"lumped, tip {tip / L:.2g} of the length")


def pendulum_on_spring(r):
    """A rigid arm on a hinge with a torsion spring, at rest under its weight: the static start finds the angle."""
    m, c, k = r.uniform(0.5, 5), r.uniform(0.1, 1), 10 ** r.uniform(-0.5, 3)
    J = m * c * c * 0.1
    angle = brentq(lambda a: k * a + m * 9.81 * c * math.cos(a), -3.0, 0.0)
    text = (
        simulation(0.05, 200, (0, -9.81, 0), start="static")
        + rigid("arm", m, (J, J, J), {"end": (2 * c, 0, 0)}, centre=(c, 0, 0))
        + joint("hinge", "revolute", "ground", "arm", f"spring = {{ stiffness = {k!r} }}")
        + output("angle", "hinge", "value")
        + output("end", "arm.end", "position")
    )
    return Scene(
        text,
        lambda t: still(t, angle=(angle,), end=(2 * c * math.cos(angle), 2 * c * math.sin(angle), 0)),
        {"angle": abs(angle), "end": 2 * c * abs(angle)},
        f"{math.degrees(angle):.0f} degrees",
    )


def portal(r):
    """A portal frame of welded beams, clamped or hinged at its feet, under a load to the side or from above: a closed loop."""
    _, m, s = sizes(r, slender=(10, 10), shapes=("rectangle", "circle"))
    H = s["height"] * r.uniform(6, 40)
    B = H * r.uniform(0.6, 2)
    G = m["E"] / (2 * (1 + m["poisson"]))
    EA, EI, kGA = m["E"] * s["area"], m["E"] * s["iz"], G * s["area"] * s["shear_y"]
    hinged = r.random() < 0.4
    load = pick(r, (1.0, 0.0), (0.0, -1.0), (0.6, -0.8))
    feet = (1, 1, 0) if hinged else (1, 1, 1)
    unit = frame_at_rest(
        [(0, 0), (0, H), (B, H), (B, 0)],
        [(0, 1, EA, EI, kGA), (1, 2, EA, EI, kGA), (3, 2, EA, EI, kGA)],
        {0: feet, 3: feet},
        {1: (*load, 0)},
    )
    # Far below buckling, where forces along the columns change their stiffness: the truth is that of small displacements.
    F = min(3e-4 * H / np.hypot(*unit[1, :2]), 5e-4 * math.pi**2 * EI / H**2)
    move = [F * unit[1, :2], F * unit[2, :2]]
    foot = "revolute" if hinged else "weld"
    up = f"rotation = [0, 0, {math.pi / 2!r}]"
    text = (
        simulation(0.05, 200, start="static")
        + beam("left", H, s["text"], m)
        + beam("lintel", B, s["text"], m)
        + beam("right", H, s["text"], m)
        + joint("a", foot, "ground", "left.root", up)
        + joint("b", foot, "ground", "right.root", f"position = [{B!r}, 0, 0]\n{up}")
        + weld("c", "left.tip", "lintel.root", f"rotation = [0, 0, {-math.pi / 2!r}]")
        + weld("d", "lintel.tip", "right.tip", up)
        + force("force", "left.tip", F, (*load, 0))
        + output("left", "left.tip", "position")
        + output("right", "right.tip", "position")
    )
    size = float(max(np.hypot(*v) for v in move))
    return Scene(
        text,
        lambda t: still(t, left=(move[0][0], H + move[0][1], 0), right=(B + move[1][0], H + move[1][1], 0)),
        {"left": size, "right": size},
        f"{'hinged' if hinged else 'clamped'}, height {H / s['height']:.2g} sections, load {load}",
    )


KINDS = [
    tension,
    across,
    distributed,
    twist,
    angle_section,
    truss,
    torsion_rod,
    spun_blade,
    elastica,
    springs_at_rest,
    pendulum_on_spring,
    portal,
]
