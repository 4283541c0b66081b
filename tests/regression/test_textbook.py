"""The mechanisms of examples/mechanisms, written with three-digit numbers, against closed formulas or an own integration."""
import math
import pathlib

from program import examples, expect, finish, history, near, run, temporary_folder

sin, cos, pi, g = math.sin, math.cos, math.pi, 9.81
tested = set()


def simulate(folder, name):
    tested.add(name)
    done = run("simulate", examples / "mechanisms" / f"{name}.toml", "-o", folder / "r.h5", "--csv", folder / "h.csv")
    expect("WARNING" not in done.stdout.upper(), f"{name}: {done.stdout}")
    return history(folder / "h.csv")


def along(name, h, column, formula, tolerance, by="angle"):
    """Every sample of a column against a formula of another one."""
    worst = max(abs(x - formula(a)) for x, a in zip(h[column], h[by]))
    near(worst, 0.0, tolerance, f"{name}: {column} against its formula")


def runge_kutta(f, y, step, count):
    rows = [list(y)]
    for _ in range(count):
        a = f(y)
        b = f([v + step / 2 * k for v, k in zip(y, a)])
        c = f([v + step / 2 * k for v, k in zip(y, b)])
        d = f([v + step * k for v, k in zip(y, c)])
        y = [v + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4) for v, k1, k2, k3, k4 in zip(y, a, b, c, d)]
        rows.append(y)
    return rows


def period(times, values):
    """Twice the mean time between crossings of the mean of the extremes."""
    middle = (max(values) + min(values)) / 2
    crossings = [
        times[i] + (middle - values[i]) / (values[i + 1] - values[i]) * (times[i + 1] - times[i])
        for i in range(len(values) - 1)
        if (values[i] < middle) != (values[i + 1] < middle)
    ]
    return 2 * (crossings[-1] - crossings[0]) / (len(crossings) - 1)


def planar_linkages(folder):
    near_by = 1e-9
    h = simulate(folder, "slider_crank")
    along("slider_crank", h, "x", lambda a: 0.1 * cos(a) + math.sqrt(0.09 - (0.1 * sin(a)) ** 2), near_by)
    h = simulate(folder, "offset_slider_crank")
    along("offset_slider_crank", h, "x", lambda a: 0.08 * cos(a) + math.sqrt(0.25**2 - (0.08 * sin(a) - 0.03) ** 2), near_by)
    h = simulate(folder, "four_bar")

    def rocker(angle):
        x, y = 0.1 * cos(angle) - 0.4, 0.1 * sin(angle)
        d = math.hypot(x, y)
        return math.atan2(y, x) - math.acos((d * d + 0.2**2 - 0.35**2) / (2 * d * 0.2))

    along("four_bar", h, "rocker", lambda a: rocker(a) % (2 * pi), near_by)
    h = simulate(folder, "scotch_yoke")
    along("scotch_yoke", h, "x", lambda a: 0.1 * cos(a), near_by)
    h = simulate(folder, "quick_return")
    along("quick_return", h, "lever", lambda a: math.atan2(0.08 * sin(a), 0.2 + 0.08 * cos(a)), near_by)
    along("quick_return", h, "slide", lambda a: math.hypot(0.08 * sin(a), 0.2 + 0.08 * cos(a)), near_by)
    h = simulate(folder, "oscillating_cylinder")
    along("oscillating_cylinder", h, "length", lambda a: math.sqrt(0.01 + 0.09 + 2 * 0.03 * cos(a)), near_by)


def curves(folder):
    h = simulate(folder, "trammel")
    worst = max(abs((x / 0.25) ** 2 + (y / 0.15) ** 2 - 1) for x, y in zip(h["pen.x"], h["pen.y"]))
    near(worst, 0, 1e-8, "trammel: the ellipse of the half axes 250 and 150 mm")
    h = simulate(folder, "chebyshev")
    # Its middle by the two circles about the ends of the crossed bars.
    for i in range(0, len(h["t"]), 20):
        x, y = 0.5 * cos(h["angle"][i]), 0.5 * sin(h["angle"][i])
        dx, dy = 0.4 - x, -y
        d = math.hypot(dx, dy)
        along_d = (d * d + 0.2**2 - 0.5**2) / (2 * d)
        off = math.sqrt(0.2**2 - along_d**2)
        ends = [(x + (along_d * dx - s * off * dy) / d, y + (along_d * dy + s * off * dx) / d) for s in (1, -1)]
        best = min(math.hypot((x + e[0]) / 2 - h["middle.x"][i], (y + e[1]) / 2 - h["middle.y"][i]) for e in ends)
        near(best, 0, 1e-8, "chebyshev: middle of the coupler")
    near(max(abs(y - 0.4) for y in h["middle.y"]), 0, 0.004, "chebyshev: how straight")
    h = simulate(folder, "peaucellier")
    # |OP| |OC| = L^2 - s^2 and P on a circle of radius r through O: C on the line x = (L^2 - s^2) / (2 r).
    near(max(abs(x - (0.5**2 - 0.2**2) / (2 * 0.19)) for x in h["c.x"]), 0, 1e-8, "peaucellier: the straight line")
    expect(max(h["c.y"]) - min(h["c.y"]) > 0.3, "peaucellier moves")
    h = simulate(folder, "pantograph")
    near(
        max(math.hypot(2 * a - b, 2 * c - d) for a, b, c, d in zip(h["near.x"], h["far.x"], h["near.y"], h["far.y"])),
        0,
        1e-8,
        "pantograph: twice as far",
    )
    h = simulate(folder, "scissor_lift")
    along("scissor_lift", h, "table.y", lambda x: math.sqrt(0.64 - x * x), 1e-8, "foot")
    h = simulate(folder, "cardan")
    worst = max(abs(sin(o) * cos(pi / 6) * cos(i) - cos(o) * sin(i)) for o, i in zip(h["out.2"], h["in"]))
    alternative = max(abs(sin(o) * cos(i) - cos(pi / 6) * cos(o) * sin(i)) for o, i in zip(h["out.2"], h["in"]))
    near(min(worst, alternative), 0, 1e-8, "cardan: tan(out) = tan(in) / cos(30 deg), or its inverse by the fork that leads")
    near(abs(h["out.2"][-1] - h["out.2"][0]), 2 * pi, 1e-6, "cardan: a turn for a turn")


def swings(folder):
    h = simulate(folder, "pendulum")
    # Moment of inertia of the box about the pin, with the width of the bar.
    exact = 2 * pi * math.sqrt((0.25 / 3 + 0.02**2 / 12) / (g * 0.25))
    near(period(h["t"], h["angle"]), exact * (1 + math.radians(1) ** 2 / 16), 2e-4 * exact, "pendulum: period")
    h = simulate(folder, "double_pendulum")

    def rates(y):
        a, b, u, v = y  # absolute angles from the vertical; l = 0.5, equal masses
        d, l = a - b, 0.5
        # 2 a'' + cos d b'' = -sin d v^2 - 2 g/l sin a,  cos d a'' + b'' = sin d u^2 - g/l sin b
        p, q = -sin(d) * v * v - 2 * g / l * sin(a), sin(d) * u * u - g / l * sin(b)
        det = 2 - cos(d) ** 2
        return [u, v, (p - cos(d) * q) / det, (2 * q - cos(d) * p) / det]

    rows = runge_kutta(rates, [pi / 2, pi / 2, 0, 0], 1e-3, 1000)
    i = h["t"].index(1.0)
    near(h["upper"][i], rows[1000][0], 1e-5, "double_pendulum: upper angle after 1 s")
    near(h["upper"][i] + h["lower"][i], rows[1000][1], 1e-5, "double_pendulum: lower angle after 1 s")
    h = simulate(folder, "conical_pendulum")
    w = math.sqrt(g / (0.5 * cos(pi / 6)))
    for i in range(0, len(h["t"]), 50):
        near(h["bob.x"][i], 0.25 * cos(w * h["t"][i]), 2e-4, "conical_pendulum: x")
        near(h["bob.y"][i], 0.25 * sin(w * h["t"][i]), 2e-4, "conical_pendulum: y")
    h = simulate(folder, "top")
    a, J3, J1, m, s, spin = math.radians(20), 0.004, 0.002 + 0.0225, 1, 0.15, 100
    b = J3 * spin
    W = (b - math.sqrt(b * b - 4 * (J1 - J3) * cos(a) * m * g * s)) / (2 * (J1 - J3) * cos(a))
    for i in range(0, len(h["t"]), 25):
        near(h["tip.z"][i], 0.3 * cos(a), 1e-6, "top: height of the tip")
        near(h["tip.x"][i], 0.3 * sin(a) * sin(W * h["t"][i]), 1e-5, "top: precession")
    h = simulate(folder, "governor")
    w = 70 * pi / 30
    for side in ("left", "right"):
        near(cos(h[side][0]), g / (w * w * 0.3), 1e-6, f"governor: {side} arm")
        near(h[side][-1], h[side][0], 1e-6, f"governor: {side} arm stays")
    h = simulate(folder, "cart_pendulum")
    w = math.sqrt(g / 0.4 * (1 + 1 / 3))
    near(period(h["t"], h["angle"]), 2 * pi / w, 2e-4, "cart_pendulum: period")


def springs(folder):
    h = simulate(folder, "oscillator")
    d, w0 = 8 / 4, math.sqrt(400)
    v = math.sqrt(w0 * w0 - d * d)
    for i in range(0, len(h["t"]), 25):
        t = h["t"][i]
        near(h["x"][i], 0.05 * math.exp(-d * t) * (cos(v * t) + d / v * sin(v * t)), 2e-6, "oscillator: x")
    h = simulate(folder, "two_masses")
    for i in range(0, len(h["t"]), 40):
        t = h["t"][i]
        a, b = 0.025 * cos(10 * t), 0.025 * cos(math.sqrt(300) * t)
        near(h["left"][i], a + b, 1e-5, "two_masses: left")
        near(h["right"][i], a - b, 1e-5, "two_masses: right")
    h = simulate(folder, "quarter_car")

    def road(t):
        return 0.0 if t < 0.2 else 0.05 if t > 0.3 else 0.05 * (0.5 - 0.5 * cos(10 * pi * (t - 0.2)))

    def rates(y):
        t, w, b, u, v = y
        strut = 20e3 * (b - w) + 1500 * (v - u)
        return [1, u, v, (180e3 * (road(t) - w) + strut) / 40, -strut / 300]

    rows = runge_kutta(rates, [0, 0, 0, 0, 0], 1e-4, 20000)
    for i in range(0, len(h["t"]), 40):
        row = rows[round(h["t"][i] / 1e-4)]
        near(h["wheel"][i], row[1], 1e-5, "quarter_car: wheel")
        near(h["body"][i], row[2], 1e-5, "quarter_car: body")


def forces(folder):
    h = simulate(folder, "inclined_block")
    a = g * (0.5 - 0.2 * cos(pi / 6))
    near(h["way"][-1], a / 2, 1e-5, "inclined_block: way after 1 s")
    h = simulate(folder, "screw_jack")
    m = 7850 * pi * (0.1**2 - 0.02**2) * 0.02
    J = m / 2 * (0.1**2 + 0.02**2)
    box = 7850 * 0.19 * 0.015 * 0.025
    M, J = m + box, J + box / 12 * (0.19**2 + 0.015**2)
    near(h["place.z"][-1], -0.5 * M * g / (M + J / 0.01**2), 1e-8, "screw_jack: fall")
    h = simulate(folder, "robot_arm")
    l1, l2, m1, m2 = 0.4, 0.3, 4, 2
    for i in range(0, len(h["t"]), 50):
        t = h["t"][i]
        q1, v1, a1 = 0.8 * sin(2 * t), 1.6 * cos(2 * t), -3.2 * sin(2 * t)
        q2, v2, a2 = -1 + 0.6 * cos(3 * t), -1.8 * sin(3 * t), -5.4 * cos(3 * t)
        near(h["q2"][i], q2, 1e-12, "robot_arm: elbow")
        I1, I2, c, r1, r2 = m1 * l1**2 / 12, m2 * l2**2 / 12, cos(q2), l1 / 2, l2 / 2
        h12 = I2 + m2 * (r2**2 + l1 * r2 * c)
        h11 = I1 + m1 * r1**2 + I2 + m2 * (l1**2 + r2**2 + 2 * l1 * r2 * c)
        k = m2 * l1 * r2 * sin(q2)
        t2 = h12 * a1 + (I2 + m2 * r2**2) * a2 + k * v1**2 + m2 * g * r2 * cos(q1 + q2)
        t1 = h11 * a1 + h12 * a2 - k * (2 * v1 * v2 + v2**2) + (m1 * r1 + m2 * l1) * g * cos(q1) + m2 * g * r2 * cos(q1 + q2)
        near(h["shoulder.mz"][i], t1, 1e-6, "robot_arm: torque of the shoulder")
        near(h["elbow.mz"][i], t2, 1e-6, "robot_arm: torque of the elbow")


def beams(folder):
    E, rho, b, height = 210e9, 7850, 0.04, 0.01
    I, q = b * height**3 / 12, rho * b * height
    h = simulate(folder, "cantilever")
    f1 = 1.8751041**2 / (2 * pi) * math.sqrt(E * I / q)
    near(period(h["t"], h["tip.y"]), 1 / f1, 0.02 / f1, "cantilever: period")
    # Let go from its straight shape it sags to twice the static deflection and comes back.
    near(min(h["tip.y"]), -2 * q * g / (8 * E * I), 0.1 * q * g / (8 * E * I), "cantilever: lowest point")
    h = simulate(folder, "beam_column")
    I, q, L, P = b * 0.02**3 / 12, rho * b * 0.02 * g, 2.0, 5000.0
    u = math.sqrt(P * L * L / (4 * E * I))
    # Timoshenko, Strength of Materials: beam-column under uniform load with a pull.
    sag = 5 * q * L**4 / (384 * E * I) * (1 / math.cosh(u) - 1 + u * u / 2) / (5 / 24 * u**4)
    near(-h["middle.y"][0], sag, 5e-3 * sag, "beam_column: sag")
    moment = q * L * L / 8 * 2 * (math.cosh(u) - 1) / (u * u * math.cosh(u))
    near(abs(h["section.Mz"][0]), moment, 0.01 * moment, "beam_column: moment in the middle")
    near(h["section.N"][0], P, 1e-3 * P, "beam_column: pull in the middle")


def cams_and_ropes(folder):
    h = simulate(folder, "cam")
    along("cam", h, "rise", lambda a: 0.015 * (1 - cos(a)), 1e-9)
    along("cam", h, "force.2", lambda a: 0.5 * (g + 0.015 * 144 * cos(a)) + 2000 * (0.015 * (1 - cos(a)) + 0.02), 1e-5)

    # M and m on a rope: (M + m) r'' = m r th'^2 + m g cos th - M g.
    h = simulate(folder, "swinging_atwood")

    def swing(y):
        r, v, th, w = y
        return [v, (2 * r * w * w + 2 * g * cos(th) - 3 * g) / 5, w, (-2 * v * w - g * sin(th)) / r]

    own = runge_kutta(swing, [1.2, 0, math.radians(50), 0], 0.0005, 8000)[::10]
    for i in range(0, len(h["t"]), 20):
        near(h["ball.x"][i], own[i][0] * sin(own[i][2]), 2e-4, "swinging_atwood: x of the ball")
        near(h["pull"][i], 3 * (g + swing(own[i])[1]), 1e-2, "swinging_atwood: pull of the rope")

    h = simulate(folder, "tautochrone")
    for i, t in enumerate(h["t"]):
        for k in (1, 2, 3):
            wanted = 1 + (0.25 * k - 1) * cos(math.sqrt(g) * t)
            expect(abs(h[f"b{k}:way"][i] - wanted) < 2e-4, f"tautochrone: bead {k} at {t}: {h[f'b{k}:way'][i]}, wanted {wanted}")

    h = simulate(folder, "eccentric")
    e, R, roller, w = 0.02, 0.06, 0.015, 30

    def fall(y):
        # time, height, rate
        apart = math.hypot(e * cos(w * y[0]), y[1] - e * sin(w * y[0]))
        push = 1e5 * max(0.0, R + roller - apart) * (y[1] - e * sin(w * y[0])) / apart
        return [1, y[2], push / 0.8 - g]

    own = runge_kutta(fall, [0, math.sqrt((R + roller) ** 2 - e * e), w * e], 1e-5, 60000)[::200]
    near(max(abs(a - b[1]) for a, b in zip(h["height"], own)), 0, 2e-4, "eccentric: height of the roller")
    expect(min(h["force"]) == 0.0, "eccentric: the roller lifts off")

    h = simulate(folder, "bungee")
    weight = 75 * g
    near(max(h["depth"]), 20 + (weight + math.sqrt(weight**2 + 2 * weight * 100 * 20)) / 100, 5e-3, "bungee: deepest point")
    near(max(h["pull"]), weight + math.sqrt(weight**2 + 2 * weight * 100 * 20), 0.5, "bungee: largest pull")
    near(min(h["balance"]), 0, 5.0, "bungee: work of rope and weight, least")

    h = simulate(folder, "planetary_gear")
    along("planetary_gear", h, "output", lambda a: a * 24 / 84, 1e-9, "input")
    rho, thick = 7850, 0.02
    sun, planet = (pi * r**2 * thick * rho for r in (0.06, 0.045))
    # All inertia seen from the sun; the planet turns by -24/18 (w - arm) + arm = -(60/18) arm + arm.
    arm = 24 / 84
    inertia = sun * 0.06**2 / 2 + planet * (0.105 * arm) ** 2 + planet * 0.045**2 / 2 * (arm * (1 - 60 / 18)) ** 2
    link = h["motor.mz"][-1] - 30 * arm - 2 * inertia
    expect(0 < link < 0.05 * 30 * arm, f"planetary_gear: torque of the motor, of which the arm's inertia makes {link}")


def changing_beams(folder):
    E = 210e9
    h = simulate(folder, "quarter_ring")
    I, R, P = 0.03 * 0.015**3 / 12, 0.5, 20
    near(h["tip.x"][0] - R, pi * P * R**3 / (4 * E * I), 4e-3 * P * R**3 / (E * I), "quarter_ring: along the load")
    near(h["cut.N"][0], P * cos(pi / 4), 2e-3 * P, "quarter_ring: normal force in the middle")
    h = simulate(folder, "tapered_cantilever")
    L, P, n = 1.2, 50, 2000
    x = [(i + 0.5) * L / n for i in range(n)]
    wanted = sum(P * (L - s) ** 2 / (E * 0.04 * (0.04 - 0.02 * s / L) ** 3 / 12) * L / n for s in x)
    near(-h["tip.y"][0], wanted, 6e-3 * wanted, "tapered_cantilever: deflection")
    near(h["stress"][0], 6 * P * L / 2 / (0.04 * 0.03**2), 1e-3 * 6 * P * L / 2 / (0.04 * 0.03**2), "tapered_cantilever: stress")


with temporary_folder() as name:
    here = pathlib.Path(name)
    for test in (planar_linkages, curves, swings, springs, forces, beams, cams_and_ropes, changing_beams):
        print(f"-- {test.__name__}", flush=True)
        test(here)
    scenes = {path.stem for path in (examples / "mechanisms").glob("*.toml")}
    expect(scenes == tested, f"scenes without a test: {sorted(scenes - tested)}")
    expect(len(scenes) >= 24, f"{len(scenes)} scenes")
finish()
