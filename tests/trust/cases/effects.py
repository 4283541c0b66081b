"""What a scene calls for: stretching, shear, twist, oblique bending, large rotation, at default settings."""
import math

import numpy as np
from cases.case import case
from cases.common import E, G, RHO, SIZE, STEEL, after_a_step, circle, still
from scene import Scene, beam, force, joint, output, rigid, simulation, weld
from scipy.integrate import solve_ivp
from truths.formulas import Linear, beam_matrices, frame_at_rest, of_rectangles, rod_matrices, torsion_rectangle


def static(more=""):
    return simulation(0.01, 100, start="static") + more


def at_rest(text, what, more_scales=(), **values):
    return Scene(static() + text, still(**values), {k: SIZE for k in values}, what)


@case("a rod pulled along its axis, at rest and in time, 10 N to 1 MN", "stability auto_tension, auto_spread_pull; trust rod_pulled")
def pulled_rod():
    for d, load in ((0.01, 1e4), (0.05, 1e6), (0.001, 10.0), (0.02, -1e3)):
        s, A, _ = circle(d)
        body = beam("rod", 1.0, s, STEEL) + weld("wall", "ground", "rod") + output("tip", "rod.tip", "displacement")
        yield at_rest(body + force("force", "rod.tip", load, (1, 0, 0)), f"{load} N, {d} m thick", tip=[load / (E * A), 0, 0])
        if load < 0:
            continue
        M, K = rod_matrices(1.0, E * A, RHO * A)
        for w in (10.0, 3000.0):
            respond = lambda t, M=M, K=K, w=w, F=load: Linear(M, K).respond(
                np.eye(len(M))[-1] * F, lambda s: (1 - np.cos(w * s)) / 2, t, fine=4000
            )[:, -1]
            yield Scene(
                simulation(6 / w, 20 * w) + body + force("force", "rod.tip", f"{load}*(1 - cos({w}*t))/2", (1, 0, 0)),
                lambda t, f=respond: {"tip": np.c_[f(t), 0 * t, 0 * t]},
                {},
                f"{load} (1 - cos {w} t)/2 N, {d} m thick",
            )


@case("a hoist: a load on an elastic rod, lifted by a motor at its top", "trust hoist")
def hoist():
    for mass, d, lift, T in ((1000.0, 0.02, 2.0, 1.0), (10.0, 0.002, 0.5, 0.5), (1e5, 0.1, 1.0, 2.0)):
        s, A, _ = circle(d)
        L = 5.0
        M, K = rod_matrices(L, E * A, RHO * A, tip_mass=mass)
        # z = lift (t/T - sin(2 pi t/T)/2 pi): relative to the hook the load is under -m (g + a).
        acceleration = lambda t, lift=lift, T=T: lift * 2 * math.pi / T**2 * np.sin(2 * math.pi * t / T)

        def truth(t, M=M, K=K, a=acceleration, lift=lift, T=T):
            ones = np.ones(len(M))
            u = Linear(M, K).respond(M @ ones, lambda s: 9.81 + a(s), t, equilibrium=True, fine=4000)[:, -1]  # downwards
            z = lift * (t / T - np.sin(2 * math.pi * t / T) / (2 * math.pi))
            return {"load": np.c_[0 * t, z - L - u, 0 * t], "stretch": u[:, None]}

        yield Scene(
            simulation(T, 200 / T, (0, -9.81, 0), start="static")
            + rigid("hook", 1.0, (1, 1, 1))
            + beam("rope", L, s, STEEL)
            + rigid("load", mass, (1, 1, 1))
            + joint("drive", "prismatic", "ground", "hook", f'axis = [0, 1, 0]\nmotion = "{lift}*(t/{T} - sin(2*pi*t/{T})/(2*pi))"')
            + weld("top", "hook", "rope", "rotation = [0, 0, -1.5707963267948966]")
            + weld("eye", "rope.tip", "load")
            + output("load", "load", "position")
            + '[[output]]\nname = "long"\nof = "rope.tip"\nquantity = "distance"\nrelative_to = "rope.root"\n\n'
            + f'[[output]]\nname = "stretch"\nexpression = "long - {L}"\n\n',
            truth,
            {},
            f"{mass} kg on {d} m",
        )


def bars(half, rise, d, load, ends, elements=None, push=None):
    length, a = math.hypot(half, rise), math.atan2(rise, half)
    s = circle(d)[0]
    more = f"elements = {elements}" if elements else ""
    return (
        beam("a", length, s, STEEL, more)
        + beam("b", length, s, STEEL, more)
        + joint("left", ends, "ground", "a", f"rotation = [0, 0, {a!r}]")
        + joint("right", ends, "ground", "b", f"position = [{2 * half!r}, 0, 0]\nrotation = [0, 0, {math.pi - a!r}]")
        + joint("crown", "weld" if ends == "weld" else "revolute", "a.tip", "b.tip", f"rotation = [0, 0, {math.pi - 2 * a!r}]")
        + force("force", "a.tip", load, push or (0, -1, 0))
        + output("crown", "a.tip", "position")
    )


def pinned_truss(half, rise, d, load):
    """Height of the crown of two bars that stay straight, by bisection of the exact equation."""
    A, length = circle(d)[1], math.hypot(half, rise)
    low, high = 0.0, rise
    for _ in range(200):
        y = (low + high) / 2
        now = math.hypot(half, y)
        carried = 2 * E * A * (length - now) / length * y / now
        low, high = (low, y) if carried < load else (y, high)
    return y


@case("a truss of two bars under a load", "stability auto_arch, auto_tripod; trust truss")
def truss():
    for half, rise, d, load in ((1.0, 1.0, 0.02, 1e4), (1.0, 0.3, 0.02, 5e3), (10.0, 5.0, 0.2, 1e5), (0.1, 0.1, 0.001, 4.0)):
        y = pinned_truss(half, rise, d, load)
        # Measured against the sag: position less the start.
        text = bars(half, rise, d, load, "revolute")
        yield Scene(static() + text, still(crown=[half, y, 0]), {"crown": rise - y}, f"half {half}, rise {rise}")


@case("a shallow arch, hinged or clamped at its ends, pushed at its crown", "stability auto_arch; trust shallow_arch")
def shallow_arch():
    half, d = 0.5, 0.01
    s, A, I = circle(d)
    for rise, share in ((0.02, 0.3), (0.05, 0.1), (0.02, 0.05)):
        load = share * 2 * E * A * (rise / half) ** 3 / (3 * math.sqrt(3))  # share of von Mises' limit
        y = pinned_truss(half, rise, d, load)
        yield Scene(
            static() + bars(half, rise, d, load, "revolute"), still(crown=[half, y, 0]), {"crown": rise - y}, f"hinged, rise {rise}"
        )
    for rise, load in ((0.02, 5.0), (0.05, 50.0)):
        nodes = [(0, 0), (half, rise), (2 * half, 0)]
        member = (E * A, E * I, 6 / 7 * G * A)
        y = frame_at_rest(nodes, [(0, 1, *member), (1, 2, *member)], {0: (1, 1, 1), 2: (1, 1, 1)}, {1: (0, -load, 0)})[1, 1]
        yield Scene(
            static() + bars(half, rise, d, load, "weld"), still(crown=[half, rise + y, 0]), {"crown": abs(y)}, f"clamped, rise {rise}"
        )


def l_section(h, w, t):
    A, iy, iz, iyz, j = of_rectangles([(0.0, t / 2 - w / 2, h, t), (t / 2 - h / 2, t / 2, t, w - t)])
    return f'{{ shape = "l", width = {w!r}, height = {h!r}, thickness = {t!r} }}', A, iy, iz, iyz, j


@case("an L section under a load across its leg, at its tip or offset from its axis", "stability auto_oblique; trust angle_section")
def angle():
    for h, w, t, L in ((0.05, 0.05, 0.005, 1.0), (0.1, 0.05, 0.008, 3.0)):
        text, A, iy, iz, iyz, j = l_section(h, w, t)
        F = 100.0
        for offset in (0.0, 0.1):
            # v'' and w'' from M: [iz iyz; iyz iy] (v'', w'') = (F (L - x), 0) / E.
            v, u = np.linalg.solve([[iz, iyz], [iyz, iy]], [F, 0.0]) * L**3 / (3 * E)
            turn = -F * offset * L / (G * j)
            body = beam("rod", L, text, STEEL) + weld("wall", "ground", "rod") + output("tip", "rod.tip", "displacement")
            if offset:
                body += rigid("arm", 1e-3, (1e-6,) * 3, {"end": (0, 0, offset)}) + weld("bracket", "rod.tip", "arm")
                body += output("twist", "rod.tip", "rotation")
                turned = still(tip=[np.nan, v, u], twist=[turn, np.nan, np.nan])
                yield Scene(
                    static() + body + force("force", "arm.end", F, (0, 1, 0)),
                    turned,
                    {"tip": SIZE, "twist": SIZE},
                    f"L {h}, offset",
                )
            else:
                yield Scene(
                    static() + body + force("force", "rod.tip", F, (0, 1, 0)),
                    still(tip=[np.nan, v, u]),
                    {"tip": SIZE},
                    f"L {h} at the axis",
                )


@case("a force beside the axis twists the beam", "stability auto_hook, auto_twist; trust offset_force")
def offset_load():
    for b, h, L, arm in ((0.02, 0.04, 1.0, 0.1), (0.05, 0.05, 2.0, 0.5), (0.004, 0.03, 0.5, 0.02)):
        A, iz, j, F = b * h, b * h**3 / 12, torsion_rectangle(b, h), 20.0
        for sign in (1, -1):
            yield Scene(
                static()
                + beam("rod", L, f'{{ shape = "rectangle", width = {b}, height = {h} }}', STEEL)
                + rigid("arm", 1e-3, (1e-6,) * 3, {"end": (0, 0, sign * arm)})
                + weld("wall", "ground", "rod")
                + weld("bracket", "rod.tip", "arm")
                + force("force", "arm.end", F, (0, -1, 0))
                + output("end", "arm.end", "position")
                + output("tip", "rod.tip", "displacement"),
                still(
                    end=[np.nan, -F * L**3 / (3 * E * iz) - F * arm * arm * L / (G * j) - F * L / (5 / 6 * G * A), np.nan],
                    tip=[np.nan, -F * L**3 / (3 * E * iz) - F * L / (5 / 6 * G * A), np.nan],
                ),
                {"end": SIZE, "tip": SIZE},
                f"{b} x {h}, {sign * arm} m beside",
                claim=0.01,
            )


@case("a swinging beam with a payload beside the plane: bending out of plane and twist", "trust payload_beside; stability auto_hook")
def payload():
    # Clamped, the payload falls on it: linear vibration in y coupled with twist by the offset; small deflections.
    for d, L, m, off in ((0.02, 1.0, 0.5, 0.1), (0.05, 2.0, 20.0, 0.3)):
        s, A, I = circle(d)
        n = 20
        Mb, Kb = beam_matrices(L, E * I, RHO * A, n, 6 / 7 * G * A, RHO * I)
        Mt, Kt = rod_matrices(L, G * 2 * I, RHO * 2 * I, n)
        N = len(Mb) + len(Mt)
        M, K = np.zeros((N, N)), np.zeros((N, N))
        M[: len(Mb), : len(Mb)], M[len(Mb) :, len(Mb) :] = Mb, Mt
        K[: len(Mb), : len(Mb)], K[len(Mb) :, len(Mb) :] = Kb, Kt
        # A point mass at (L, 0, off) moves in y by v - off theta.
        c = np.zeros(N)
        c[len(Mb) - 2], c[-1] = 1.0, -off
        M += m * np.outer(c, c)
        weight = np.zeros(N)
        weight[: len(Mb)] = -9.81 * (Mb @ np.tile([1.0, 0.0], n))
        weight += -9.81 * m * c

        def truth(t, M=M, K=K, f=weight, nb=len(Mb)):
            u = after_a_step(M, K, f, t)
            return {"tip": np.c_[np.nan * t, u[:, nb - 2], np.nan * t], "twist": np.c_[u[:, -1], 0 * t, u[:, nb - 1]]}

        yield Scene(
            simulation(0.2, 1000, (0, -9.81, 0))
            + beam("rod", L, s, STEEL)
            + rigid("load", m, (0, 0, 0), centre=(0, 0, off))
            + weld("wall", "ground", "rod")
            + weld("grip", "rod.tip", "load")
            + output("tip", "rod.tip", "displacement")
            + output("twist", "rod.tip", "rotation"),
            truth,
            {},
            f"{m} kg {off} m beside",
        )


@case("a stubby beam: shear, length over height 2 to 20", "stability stubby, auto_console_3 to _15; trust across")
def stubby():
    for ratio in (2.0, 3.0, 5.0, 10.0, 20.0):
        h = 0.1
        L, b, F = ratio * h, 0.05, 1e3
        A, iz = b * h, b * h**3 / 12
        s = f'{{ shape = "rectangle", width = {b}, height = {h} }}'
        y = F * L**3 / (3 * E * iz) + F * L / (5 / 6 * G * A)
        body = beam("rod", L, s, STEEL) + weld("wall", "ground", "rod") + output("tip", "rod.tip", "displacement")
        yield at_rest(body + force("force", "rod.tip", F, (0, 1, 0)), f"length/height {ratio}, at rest", tip=[0, y, 0])
        M, K = beam_matrices(L, E * iz, RHO * A, 20, 5 / 6 * G * A, RHO * iz)
        f = np.zeros(len(M))
        f[-2] = F
        w1 = Linear(M, K).omega[0]
        yield Scene(
            simulation(4 * 2 * math.pi / w1, 100 * w1 / (2 * math.pi)) + body + force("force", "rod.tip", F, (0, 1, 0)),
            lambda t, M=M, K=K, f=f: {"tip": np.c_[0 * t, after_a_step(M, K, f, t)[:, -2], 0 * t]},
            {},
            f"length/height {ratio}, let go",
        )


@case("forces alone are read, which shear shifts: the prop of a stubby beam, rigid or a spring, at rest and in time; shear by hand or auto")
def shifted_forces():
    L, h, w = 0.12, 0.04, 0.02
    A, I, F, k = h * w, w * h**3 / 12, 1000.0, 4e7
    section = f'{{ shape = "rectangle", height = {h}, width = {w} }}'
    shear = 5 / 6 * G * A
    gives = L**3 / (3 * E * I) + L / shear
    # The prop's place moves as far by a force in the middle as the middle by one at the prop.
    prop = F * (5 * L**3 / (48 * E * I) + L / (2 * shear)) / gives
    spring = -F * gives / (gives + 1 / k)
    for chosen in ("", 'effects = ["bending_xy"]', 'effects = ["bending_xy", "shear"]'):
        body = beam("console", L, section, STEEL, chosen + "\nframes = { middle = 0.5 }") + weld("clamp", "ground", "console.root")
        held = (
            rigid("shoe", 0.01, (1e-6,) * 3)
            + joint("rail", "prismatic", "ground", "shoe", f"axis = [1, 0, 0]\nposition = [{L}, 0, 0]")
            + joint("pin", "revolute", "console.tip", "shoe")
            + output("R", "pin", "reaction")
        )
        sprung = (
            f"[ground]\nframes = {{ post = [{L}, -0.1, 0] }}\n\n"
            + '[[force]]\nname = "spring"\nkind = "spring-damper"\non = "console.tip"\nfrom = "ground.post"\n'
            + f"stiffness = {k!r}\nrest = 0.1\n\n"
            + output("S", "spring", "force")
        )
        slowly = f"{F!r} * (t < 0.05 ? (1 - cos(pi*t/0.05))/2 : 1)"
        for moves in (False, True):
            head, load = (simulation(0.06, 2000), slowly) if moves else (static(), F)
            words = f"{'slowly loaded' if moves else 'at rest'}, {chosen or 'auto'}"

            def share(t, moves=moves):
                return (np.where(t < 0.05, (1 - np.cos(np.pi * t / 0.05)) / 2, 1.0) if moves else np.ones(len(t)))[:, None]

            yield Scene(
                head + body + held + force("force", "console.middle", load, (0, -1, 0)),
                lambda t, share=share: {"R": share(t) * np.array([[np.nan, prop, np.nan, np.nan, np.nan, np.nan]])},
                {"R": prop},
                f"prop, {words}",
                sizes_only=True,
            )
            yield Scene(
                head + body + sprung + force("force", "console.tip", load, (0, -1, 0)),
                lambda t, share=share: {"S": share(t) * spring},
                {"S": abs(spring)},
                f"spring, {words}",
            )


@case('effects = ["auto", "axial"] is taken', "stability (advice), unit sim_scene")
def auto_and_axial():
    s, A, _ = circle(0.01)
    for words in ('effects = ["auto", "axial"]', 'effects = ["auto", "axial", "shear"]', 'effects = "auto"'):
        yield at_rest(
            beam("rod", 1.0, s, STEEL, words)
            + weld("wall", "ground", "rod")
            + force("force", "rod.tip", 1e4, (1, 0, 0))
            + output("tip", "rod.tip", "displacement"),
            words,
            tip=[1e4 / (E * A), 0, 0],
        )


def chain(L, EI, rhoA, g, t, n=60):
    """Cantilever let go from straight: n rigid links on rotation springs, absolute angles; tip (x, y). Converges with n^-2."""
    h = L / n
    m, k = rhoA * h, EI / h
    # link i from joint i; first spring half a link from the clamp: k0 = 2 k.
    ks = np.full(n, k)
    ks[0] = 2 * k
    weight = np.array([m * (n - i - 0.5) for i in range(n)])  # mass beyond joint, with half of the link's
    I = np.full((n, n), 0.0)
    for i in range(n):
        for j in range(n):
            I[i, j] = m * h * h * (n - 1 - max(i, j) + (0.5 if i != j else 1 / 3))

    def f(_, y):
        a, v = y[:n], y[n:]
        d = a[:, None] - a[None, :]
        M = I * np.cos(d)
        moment = np.diff(a, prepend=0.0) * ks
        q = -moment + np.append(moment[1:], 0.0) - weight * g * h * np.cos(a) - (I * np.sin(d)) @ (v * v)
        return np.r_[v, np.linalg.solve(M, q)]

    done = solve_ivp(f, (0, t[-1]), np.zeros(2 * n), t_eval=t, rtol=1e-7, atol=1e-9, method="Radau" if n > 200 else "DOP853")
    a = done.y[:n]
    return np.c_[h * np.cos(a).sum(0), h * np.sin(a).sum(0)]


@case("a cantilever let go under 40 m/s^2, 8 elements; the accuracy asked for; mixed volumes", "stability let_go_*, volumes_accuracy")
def let_go():
    L, d = 1.0, 0.01
    m = {"E": 1e9, "rho": 2000.0, "poisson": 0.3}
    s, A, I = circle(d)
    memory = {}

    def truth(t):
        key = len(t)
        if key not in memory:
            a, b = (chain(L, m["E"] * I, m["rho"] * A, 40.0, t, n) for n in (20, 40))
            memory[key] = (4 * b - a) / 3  # Richardson
        return {"tip": np.c_[memory[key], 0 * t]}

    for what, words, claim in (
        ("elements = 8", (), 0.01),
        ("", (), 0.01),
        ("elements = 8", ("--accuracy", "1e-3"), 1e-3),
        ("elements = 8", ("--accuracy", "1e-2"), 1e-2),
        ('model = "mixed"', ("--accuracy", "1e-2"), 1e-2),
        ('model = "mixed"', ("--accuracy", "1e-3"), 1e-3),
        ('model = "mixed"', (), 0.01),
        ('model = "mixed"\nvolumes = 2', (), 0.01),
        ('model = "lumped"', (), 0.01),
    ):
        yield Scene(
            simulation(1.0, 100, (0, -40, 0))
            + beam("rod", L, s, m, what)
            + weld("wall", "ground", "rod")
            + output("tip", "rod.tip", "position"),
            truth,
            {},
            f"{what} {' '.join(words)}",
            words,
            claim=claim,
        )


@case("a shaft twisted by a torque that comes at once: a triangular wave", "stability struck_shaft")
def struck_shaft():
    d, T = 0.05, 100.0
    s, _, I = circle(d)
    c, most = math.sqrt(G / RHO), 2 * T / (G * 2 * I)
    for length, periods, elements in ((1.0, 0.5, 10), (1.0, 6.0, 10), (0.2, 3.0, 10), (1.0, 3.0, 60)):
        period = 4 * length / c

        def truth(t, period=period, length=length):
            at = np.mod(t / period, 1.0)
            return {"tip": np.c_[most * length * np.where(at < 0.5, 2 * at, 2 - 2 * at), 0 * t, 0 * t]}

        yield Scene(
            simulation(periods * period, 400 / (periods * period))
            + beam("rod", length, s, STEEL, f'effects = ["torsion"]\nelements = {elements}')
            + weld("wall", "ground", "rod")
            + force("torque", "rod.tip", T, (1, 0, 0))
            + output("tip", "rod.tip", "rotation"),
            truth,
            {},
            f"{length} m, {periods} periods, {elements} elements",
        )


@case("a cantilever pushed for a third of a period, of 1 to 10 elements, seen 20 times a period or less than once: told where they are few")
def few_samples():
    L, h, F, periods = 1.0, 0.01, 0.05, 12
    A, I = h * h, h**4 / 12
    T = 2 * math.pi * L**2 / 3.516 * math.sqrt(RHO * A / (E * I))
    M, K = beam_matrices(L, E * I, RHO * A, kGA=5 / 6 * G * A, rhoI=RHO * I)
    push = F * np.eye(len(M))[-2]

    def truth(t):
        tip = (after_a_step(M, K, push, t) - after_a_step(M, K, push, np.maximum(t - 0.3 * T, 0.0)))[:, -2]
        return {"tip": np.c_[0 * t, tip, 0 * t]}

    section = f'{{ shape = "rectangle", height = {h}, width = {h} }}'
    for elements in (1, 2, 3, 10):
        for samples in (20, 1.3, 0.37):
            yield Scene(
                simulation(periods * T, samples / T, tolerance=1e-8)
                + beam("arm", L, section, STEEL, f"elements = {elements}")
                + weld("clamp", "ground", "arm")
                + force("force", "arm.tip", f"t < {0.3 * T!r} ? {F} : 0", (0, 1, 0))
                + output("tip", "arm.tip", "displacement"),
                truth,
                {},
                f"{elements} elements, {samples} samples a period",
            )
