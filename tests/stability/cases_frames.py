"""Hard cases of frames, columns and shafts: what holds them, forces along them, more than one beam. The truth is a closed formula of beam
theory; where shear is worth more than a tenth of the bound the formula holds it."""
import json
import math

from cases import case
from cases_effects import E, G, area, at_rest, off, promise, rho
from scenes import beam, circle, force, joint, output, rigid, simulation, steel


def inertia(d):
    return math.pi * d**4 / 64


def member(name, length, d, more=""):
    return beam(name, length, circle(d), steel, "elements = 6\n" + more)


def column(d, F, P, more="", resting=True):
    """A column along x, clamped at its foot, pressed by P and pushed sideways by F at its tip."""
    return (
        member("rod", 1.0, d, more)
        + joint("wall", "weld", "ground", "rod")
        + force("force", "rod.tip", F, (0, 1, 0))
        + force("force", "rod.tip", P, (-1, 0, 0))
        + output("tip", "rod.tip", "displacement")
    )


@case("a column pressed by six tenths of its buckling load and pushed sideways", promise, 0.01)
def pressed_column(run):
    d, F = 0.01, 0.02
    EI = E * inertia(d)
    k = math.sqrt(0.6) * math.pi / 2
    P = k * k * EI
    return off(at_rest(run, column(d, F, P))["tip.y"], F / (P * k) * (math.tan(k) - k))


@case("a wire pulled by fifty times its buckling load and pushed sideways", promise, 0.01)
def pulled_wire(run):
    d, F = 0.004, 0.02
    EI = E * inertia(d)
    k = math.sqrt(50) * math.pi / 2
    P = k * k * EI
    return off(at_rest(run, column(d, F, -P))["tip.y"], F / (P * k) * (k - math.tanh(k)))


@case(
    "stiffening left out by hand where a column is pressed by a tenth, a hundredth, a thousandth of its buckling load", "silent error", 0.01
)
def stiffening_by_hand(run):
    d, F = 0.02, 0.02
    EI, worst = E * inertia(d), 0.0
    for share in (1e-1, 1e-2, 1e-3):
        k = math.sqrt(share) * math.pi / 2
        P = k * k * EI
        for words in ('effects = ["bending_xy", "axial", "shear"]', 'without = ["stiffening"]'):
            # With the estimate of errors, to which the check of what the scene leaves out belongs.
            table = run.folder / "h.csv"
            text = simulation(0.002, 1000, more='start = "static"') + column(d, F, P, words)
            process, out, err = run.start(text, "simulate", "--csv", table, "--json")
            assert process.returncode == 0, err
            found = dict(zip(*(line.split(",") for line in table.read_text().splitlines()[:2])))
            # Relative to the deflection as a whole, which is P L / EA along the column too.
            x, y = float(found["tip.x"]), float(found["tip.y"])
            error = abs(y - F / (P * k) * (math.tan(k) - k)) / math.hypot(x, y)
            told = "stiffening of 'rod' is left out, but its influence" in " ".join(json.loads(out)["simulation"]["warnings"])
            assert not (told and error < 1e-3), f"{error:.1e} is told of as worth a warning"
            worst = max(worst, 0.0 if told else error)
    return worst


@case("frequency of a hinged bar pressed and pulled: w^2 = w1^2 (1 - P/Pcr)", "square of the frequency against theory / w1^2", 2e-3)
def loaded_frequency(run):
    d, worst = 0.01, 0.0
    EI, m = E * inertia(d), rho * area(d)
    w1 = math.pi**2 * math.sqrt(EI / m)
    for share in (0.9, 0.5, -2.0):
        text = (
            simulation(0.01, 1000, more='start = "static"')
            + member("rod", 1.0, d, 'effects = ["bending_xy", "axial", "stiffening"]')
            + joint("pin", "revolute", "ground", "rod")
            + joint("guide", "point-on-line", "ground", "rod.tip", "axis = [1, 0, 0]")
            + force("force", "rod.tip", share * math.pi**2 * EI, (-1, 0, 0))
        )
        lowest = min(mode["frequency"] for mode in run.check(text)["modes"])
        worst = max(worst, abs((2 * math.pi * lowest / w1) ** 2 - (1 - share)))
    return worst


@case("two columns pressed alike under a beam that carries nothing: a closed loop of welds", promise, 0.01)
def pressed_columns(run):
    H, B, d, F = 2.0, 3.0, 0.05, 500.0
    up = f"rotation = [0, 0, {math.pi / 2!r}]"
    found = at_rest(
        run,
        member("left", H, d)
        + member("roof", B, d)
        + member("right", H, d)
        + joint("a", "weld", "ground", "left", up)
        + joint("b", "weld", "ground", "right", f"position = [{B}, 0, 0]\n{up}")
        + joint("c", "weld", "left.tip", "roof", f"rotation = [0, 0, {-math.pi / 2!r}]")
        + joint("d", "weld", "roof.tip", "right.tip", up)
        + force("force", "left.tip", F, (0, -1, 0))
        + force("force", "right.tip", F, (0, -1, 0))
        + output("left", "left.tip", "position")
        + output("right", "right.tip", "position"),
    )
    return max(off(H - found[side + ".y"], F * H / (E * area(d))) for side in ("left", "right"))


@case("a shaft held at one end under a small torque: flutter of no account is not called an unstable state", promise, 0.01)
def twisted_shaft(run):
    d, M = 0.02, 5.0
    found = at_rest(
        run,
        member("rod", 1.0, d)
        + joint("wall", "weld", "ground", "rod")
        + force("torque", "rod.tip", M, (1, 0, 0))
        + output("tip", "rod.tip", "rotation"),
    )
    assert not run.summary["simulation"]["warnings"], run.summary["simulation"]["warnings"]
    return off(found["tip.x"], M / (G * 2 * inertia(d)))


@case("a stiff blade hinged off the axis of its hub flaps at W sqrt(1 + 3 e / 2 L)", "frequency / theory - 1", 2e-3)
def flapping_blade(run):
    L, e, W = 1.0, 0.4, 10.0
    text = (
        simulation(0.01, 1000)
        + rigid("hub", 1.0, (0.1, 0.1, 0.1), frames={"rim": (e, 0, 0)})
        + member("blade", L, 0.05)
        + joint("shaft", "revolute", "ground", "hub", f'motion = "{W}*t"')
        + joint("hinge", "revolute", "hub.rim", "blade", "axis = [0, 1, 0]")
    )
    lowest = min(mode["frequency"] for mode in run.check(text)["modes"])
    return off(2 * math.pi * lowest, W * math.sqrt(1 + 1.5 * e / L))


@case("a beam on three supports under its own weight: the middle one carries five eighths", "reaction against 5/8 of the weight", 0.01)
def three_supports(run):
    d, g, L = 0.02, 9.81, 2.0
    found = at_rest(
        run,
        beam("rod", L, circle(d), steel, "elements = 8\nframes = { middle = 0.5 }")
        + joint("left", "revolute", "ground", "rod")
        + joint("middle", "point-on-line", "ground", "rod.middle", f"axis = [1, 0, 0]\nposition = [{L / 2}, 0, 0]")
        + joint("right", "point-on-line", "ground", "rod.tip", f"axis = [1, 0, 0]\nposition = [{L}, 0, 0]")
        + output("middle", "middle", "reaction"),
        (0, -g, 0),
    )
    return off(max(abs(found[f"middle.{c}"]) for c in "xyz"), 0.625 * rho * area(d) * L * g)


@case(
    "a clamped beam propped at its end, pushed at its middle: the prop carries five sixteenths",
    "reaction and deflection / theory - 1",
    0.01,
)
def propped_beam(run):
    d, F, L = 0.02, 30.0, 1.0
    found = at_rest(
        run,
        beam("rod", L, circle(d), steel, "elements = 8\nframes = { middle = 0.5 }")
        + joint("wall", "weld", "ground", "rod")
        + joint("prop", "point-on-line", "ground", "rod.tip", f"axis = [1, 0, 0]\nposition = [{L}, 0, 0]")
        + force("force", "rod.middle", F, (0, -1, 0))
        + output("prop", "prop", "reaction")
        + output("middle", "rod.middle", "position"),
    )
    deflection = 7 * F * L**3 / (768 * E * inertia(d))
    return max(off(max(abs(found[f"prop.{c}"]) for c in "xyz"), 5 / 16 * F), off(-found["middle.y"], deflection))


@case("a rod between two walls pulled at its middle", promise, 0.01)
def rod_between_walls(run):
    d, F, L = 0.01, 2e3, 1.0
    found = at_rest(
        run,
        beam("rod", L, circle(d), steel, "elements = 6\nframes = { middle = 0.5 }")
        + joint("left", "weld", "ground", "rod")
        + joint("right", "weld", "ground", "rod.tip", f"position = [{L}, 0, 0]")
        + force("force", "rod.middle", F, (1, 0, 0))
        + output("middle", "rod.middle", "position"),
    )
    return off(found["middle.x"] - L / 2, F * L / (4 * E * area(d)))


@case("a console bent by a right angle, loaded across its plane: one leg twists", promise, 0.01)
def bent_console(run):
    a, b, d, F = 1.0, 0.6, 0.03, 20.0
    found = at_rest(
        run,
        member("one", a, d)
        + member("two", b, d)
        + joint("wall", "weld", "ground", "one")
        + joint("knee", "weld", "one.tip", "two", f"rotation = [0, 0, {math.pi / 2!r}]")
        + force("force", "two.tip", F, (0, 0, 1))
        + output("end", "two.tip", "position"),
    )
    EI, GJ = E * inertia(d), G * 2 * inertia(d)
    shear = (a + b) / (6 / 7 * G * area(d))
    return off(found["end.z"], F * ((a**3 + b**3) / (3 * EI) + a * b * b / GJ + shear))


@case("a quarter of a ring of sixteen straight beams, clamped at one end and loaded at the other", promise, 0.01)
def quarter_ring(run):
    R, d, F, n = 1.0, 0.03, 10.0, 16
    step = math.pi / 2 / n
    chord = 2 * R * math.sin(step / 2)
    text = member("b0", chord, d) + joint("wall", "weld", "ground", "b0", f"rotation = [0, 0, {step / 2!r}]")
    for i in range(1, n):
        text += beam(f"b{i}", chord, circle(d), steel, "elements = 1")
        text += joint(f"j{i}", "weld", f"b{i - 1}.tip", f"b{i}", f"rotation = [0, 0, {step!r}]")
    text += force("force", f"b{n - 1}.tip", F, (1, 0, 0)) + output("end", f"b{n - 1}.tip", "position")
    found = at_rest(run, text)
    # Along the clamped tangent, from (R sin a, R (1 - cos a)) at a = pi/2: moment F R cos a, so int (F R cos a)^2 R da / (F EI)
    # (Castigliano).
    return off(found["end.x"] - R, F * math.pi * R**3 / (4 * E * inertia(d)))


@case("a console on a spring at its tip shares the load with it", promise, 0.01)
def sprung_console(run):
    d, F, k = 0.01, 5.0, 400.0
    spring = f'[[force]]\nkind = "spring-damper"\non = "rod.tip"\nfrom = "post"\nstiffness = {k}\nrest = 1.0\n'
    found = at_rest(
        run,
        member("rod", 1.0, d)
        + rigid("post", 1.0, (1, 1, 1))
        + joint("wall", "weld", "ground", "rod")
        + joint("ground", "weld", "ground", "post", "position = [1.0, -1.0, 0.0]")
        + force("force", "rod.tip", F, (0, -1, 0))
        + spring
        + output("tip", "rod.tip", "position"),
    )
    return off(-found["tip.y"], F / (3 * E * inertia(d) + k))


@case("a beam clamped at both ends sags by its weight", promise, 0.01)
def clamped_both_ends(run):
    d, g, L = 0.02, 9.81, 1.0
    found = at_rest(
        run,
        beam("rod", L, circle(d), steel, "elements = 8\nframes = { middle = 0.5 }")
        + joint("left", "weld", "ground", "rod")
        + joint("right", "weld", "ground", "rod.tip", f"position = [{L}, 0, 0]")
        + output("middle", "rod.middle", "position"),
        (0, -g, 0),
    )
    bend = rho * area(d) * g * L**4 / (384 * E * inertia(d))
    return off(-found["middle.y"], bend + rho * g * L**2 / (8 * 6 / 7 * G))


@case(
    "a cantilever with a mass at its tip, a thousandth to a thousand times its own",
    "first frequency / root of the frequency equation - 1",
    2e-3,
)
def tip_mass(run):
    d, worst = 0.01, 0.0
    EI, m = E * inertia(d), rho * area(d)
    for ratio in (1e-3, 1.0, 1e3):

        def equation(k):
            c, s, C, S = math.cos(k), math.sin(k), math.cosh(k), math.sinh(k)
            return 1 + c * C + ratio * k * (c * S - s * C)

        low, high = 1e-3, 1.9
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if equation(middle) > 0 else (low, middle)
        text = (
            simulation(0.01, 1000)
            + member("rod", 1.0, d, 'effects = ["bending_xy", "bending_xz"]')
            + rigid("load", ratio * m, (0, 0, 0))
            + joint("wall", "weld", "ground", "rod")
            + joint("end", "weld", "rod.tip", "load")
        )
        lowest = min(mode["frequency"] for mode in run.check(text)["modes"])
        worst = max(worst, off(2 * math.pi * lowest, low * low * math.sqrt(EI / m)))
    return worst


@case("a beam on stiff springs between its even nodes, pushed between two of them", "silent error of the deflection there, relative", 0.01)
def springs_between_nodes(run):
    d, n, L, h = 0.08, 6, 1.0, 0.5
    EI, kGA = E * inertia(d), 6 / 7 * G * area(d)
    k = 1e4 * EI / L**3
    text = f"[ground]\nframes = {{ {', '.join(f'g{i} = [{L * i / n}, {-h}, 0]' for i in range(1, n + 1))} }}\n"
    text += member("rail", L, d, "frames = { " + ", ".join(f"p{i} = {i / (2 * n)!r}" for i in range(1, 2 * n)) + " }")
    text = text.replace("elements = 6", "elements = 10") + joint("end", "weld", "ground", "rail.root")
    for i in range(1, n + 1):
        on = "tip" if i == n else f"p{2 * i}"
        text += f'[[force]]\nkind = "spring-damper"\non = "rail.{on}"\nfrom = "ground.g{i}"\nstiffness = {k}\nrest = {h}\n\n'
    text += force("force", "rail.p5", 100.0, (0, -1, 0)) + output("p", "rail.p5", "position")
    return off(at_rest(run, text)["p.y"], -100.0 * compliance(n, 5, L, EI, kGA, k))


def compliance(n, at, L, EI, kGA, k):
    """Deflection per force at node `at` of 2 n exact Timoshenko elements on n springs, clamped at one end: by elimination, no libraries."""
    h, size = L / (2 * n), 4 * n
    phi = 12 * EI / (kGA * h * h)
    c = EI / (h**3 * (1 + phi))
    e = [
        [12 * c, 6 * h * c, -12 * c, 6 * h * c],
        [6 * h * c, (4 + phi) * h * h * c, -6 * h * c, (2 - phi) * h * h * c],
        [-12 * c, -6 * h * c, 12 * c, -6 * h * c],
        [6 * h * c, (2 - phi) * h * h * c, -6 * h * c, (4 + phi) * h * h * c],
    ]
    K = [[0.0] * (size + 3) for _ in range(size + 2)]
    for a in range(2 * n):
        for i in range(4):
            for j in range(4):
                K[2 * a + i][2 * a + j] += e[i][j]
    for i in range(1, n + 1):
        K[4 * i][4 * i] += k
    K = [row[2:] for row in K[2:]]  # the clamp
    K[2 * (at - 1)][-1] = 1.0
    for i in range(size):
        for j in range(i + 1, size):
            f = K[j][i] / K[i][i]
            if f:
                K[j] = [x - f * y for x, y in zip(K[j], K[i])]
    u = [0.0] * size
    for i in reversed(range(size)):
        u[i] = (K[i][-1] - sum(K[i][j] * u[j] for j in range(i + 1, size))) / K[i][i]
    return u[2 * (at - 1)]
