"""An asked accuracy without a search: kept against truths of scipy and of series, for little more than the run; told where it is not."""
import json
import pathlib
import re
import sys

import numpy as np
from scipy.integrate import simpson, solve_ivp
from scipy.optimize import brentq

from program import examples, expect, history, run, run_parts

sys.path.append(str(pathlib.Path(__file__).parents[1] / "trust"))
from kinds.effects import hand_crank  # noqa: E402
from kinds.frames import bracket_in_space, supports  # noqa: E402
from kinds.plane import micro_resonator, scissor_lift, stacker_mast, stopped_flap  # noqa: E402
from kinds.states import steered_beam  # noqa: E402
from kinds.wide import dropped_rod  # noqa: E402
from run_trust import make  # noqa: E402
from truths.formulas import Linear, beam_matrices  # noqa: E402


def ask(folder, text, accuracy, *words):
    scene, table = folder / "scene.toml", folder / "h.csv"
    scene.write_text(text)
    done = run("simulate", scene, "--csv", table, "--accuracy", repr(accuracy), "--fresh", "--json", *words)
    return json.loads(done.stdout)["simulation"], {name: np.array(values) for name, values in history(table).items()}


def judge(name, summary, error, asked):
    estimate, search = summary["accuracy"]["error"], summary["accuracy"]["search_cpu_seconds"]
    print(f"{name}, {asked:g}: error {error:.1e}, estimate {estimate:.1e}, run {summary['cpu_seconds']:.4f}, search {search:.4f} CPU s")
    expect(error <= asked or summary["warnings"], f"{name}: {asked:g} was asked, the error is {error:.2e} without a warning")
    expect(estimate <= asked or summary["warnings"], f"{name}: an estimate of {estimate:.2e} without a warning")


def double_pendulum(folder):
    # Two point masses on rods of 1 m: the textbook's equations.
    text = (
        "[simulation]\nduration = 3\noutput_rate = 100\ngravity = [0, -9.81, 0]\n"
        + '[[body]]\nname = "a"\nkind = "rigid"\nmass = 1.0\ncentre_of_mass = [1, 0, 0]\nframes = { end = [1, 0, 0] }\n'
        + '[[body]]\nname = "b"\nkind = "rigid"\nmass = 1.0\ncentre_of_mass = [1, 0, 0]\n'
        + '[[joint]]\nname = "p"\nkind = "revolute"\nparent = "ground"\nchild = "a"\ninitial = { value = 0.3 }\n'
        + '[[joint]]\nname = "q"\nkind = "revolute"\nparent = "a.end"\nchild = "b"\n'
        + '[[output]]\nname = "p"\nof = "p"\nquantity = "value"\n[[output]]\nname = "q"\nof = "q"\nquantity = "value"\n'
    )

    def rates(_, y):
        p, q, vp, vq = y  # angles from the horizontal, absolute
        c, s = np.cos(p - q), np.sin(p - q)
        M = np.array([[2.0, c], [c, 1.0]])
        f = np.array([-s * vq**2 - 2 * 9.81 * np.cos(p), s * vp**2 - 9.81 * np.cos(q)])
        return [vp, vq, *np.linalg.solve(M, f)]

    for asked in (1e-1, 1e-3, 1e-5):
        summary, h = ask(folder, text, asked)
        truth = solve_ivp(rates, (0, 3), [0.3, 0.3, 0, 0], method="DOP853", t_eval=h["t"], rtol=1e-12, atol=1e-12).y
        bend = truth[1] - truth[0]
        error = max(np.abs(h["p"] - truth[0]).max() / np.ptp(truth[0]), np.abs(h["q"] - bend).max() / np.ptp(bend))
        judge("double pendulum", summary, error, asked)
        told = summary["accuracy"]["error"]
        expect(0.2 * error <= told <= 5 * error, f"double pendulum: {told:.2e} told, {error:.2e} true")
        expect(len(summary["accuracy"]["chosen"]) == 1 and "as written" in summary["accuracy"]["chosen"][0], "a search was made")


def thick_pendulum(folder):
    # A beam on a hinge whose weight bends it by a micrometre: a rigid bar, whose sections' rotary inertia is worth 2e-3 after five seconds.
    L, h, g = 1.46, 0.07, 2.9
    pull = -g * L / 2 / (L * L / 3 + h * h / 12)
    text = (
        f"[simulation]\nduration = 5\noutput_rate = 50\ngravity = [0, {-g}, 0]\n"
        f'[[body]]\nname = "bar"\nkind = "beam"\nlength = {L}\nsection = {{ shape = "rectangle", width = {h}, height = {h} }}\n'
        "material = { density = 2700, youngs_modulus = 7e10, poisson = 0.3 }\n"
        '[[joint]]\nname = "hinge"\nkind = "revolute"\nparent = "ground"\nchild = "bar.root"\ninitial = { value = -0.2 }\n'
        '[[output]]\nname = "turn"\nof = "bar"\nquantity = "rotation"\n'
    )
    for asked in (1e-2, 1e-3):
        summary, h_ = ask(folder, text, asked)
        angle = solve_ivp(lambda _, y: [y[1], pull * np.cos(y[0])], (0, 5), [-0.2, 0], t_eval=h_["t"], rtol=1e-12, atol=1e-12).y[0]
        error = np.abs(h_["turn.z"] - angle).max() / np.ptp(angle)
        judge("thick pendulum", summary, error, asked)
        expect(error <= max(5 * summary["accuracy"]["error"], 1e-5), f"{error:.2e} true, {summary['accuracy']['error']:.2e} told")


def told_beside_loose_runs(folder):
    # The rod of a driven crank, of four modes: what two loose runs are apart by is time nearly all, and was told as what modes lack (2.3e-4
    # where 3e-5 at most are true).
    scene = make(hand_crank, 313, 0)
    summary, h = ask(folder, scene.text, 1e-2)
    (folder / "scene.toml").write_text(scene.text)
    effects = 'body.rod.effects=["axial", "bending_xy", "stiffening", "shear"]'
    finer = ("--set", "body.rod.elements=96", "--set", "body.rod.keep_modes=32", "--tolerance", "1e-9", "--method", "exponential")
    run("simulate", folder / "scene.toml", "--csv", folder / "t.csv", "--set", effects, *finer, "--no-effect-check", "--no-error-estimate")
    truth = history(folder / "t.csv")
    error = 0.0
    for name in ("x", "tip"):
        vectors = [np.array([np.asarray(c[f"{name}.{axis}"]) for axis in "xyz"]) for c in (h, truth)]
        error = max(error, np.linalg.norm(vectors[0] - vectors[1], axis=0).max() / np.ptp(vectors[1], axis=1).max())
    judge("rod of a crank", summary, error, 1e-2)
    expect(error <= 5 * summary["accuracy"]["error"], f"{error:.2e} true, {summary['accuracy']['error']:.2e} told")
    expect(summary["accuracy"]["error"] <= 1e-4, f"{error:.2e} true, {summary['accuracy']['error']:.2e} told")


def shear_between_two_supports(folder):
    # A clamped tube whose tip is guided, pushed in the middle: shear bends it sixteen times as much as its tip alone would tell, and modes
    # bring that with one over their number (1.3e-3 was true, 4.6e-4 told).
    scene = make(supports, 283, 0)
    for asked in (1e-2, 1e-3):
        summary, h = ask(folder, scene.text, asked)
        truth = np.asarray(scene.truth(h["t"])["mid"])[:, 1]
        error = np.abs(h["mid.y"] - truth).max() / np.ptp(truth)
        judge("tube between two supports", summary, error, asked)


def released_beam(folder):
    # A clamped beam under a force that comes at once: its vibrations have to be followed. Series of Euler and Bernoulli, tip's deflection
    # over the static one; slender, so that shear and rotary inertia are worth 3e-4.
    L, E, rho, d, F = 1.0, 2e11, 8000.0, 0.01, 0.5
    EI, mu = E * np.pi * d**4 / 64, rho * np.pi * d * d / 4
    beta = np.array([1.8751040687, 4.6940911330, 7.8547574382, 10.995540735, 14.137168391, *(np.pi * (np.arange(6, 40) - 0.5))])
    omega = beta**2 / L**2 * np.sqrt(EI / mu)
    duration = 2 * 2 * np.pi / omega[0]
    text = (
        f"[simulation]\nduration = {duration!r}\noutput_rate = {400 / duration!r}\ngravity = [0, 0, 0]\n"
        f'[[body]]\nname = "strip"\nkind = "beam"\nlength = {L}\nsection = {{ shape = "circle", diameter = {d} }}\n'
        f"material = {{ density = {rho}, youngs_modulus = {E} }}\n"
        '[[joint]]\nname = "clamp"\nkind = "weld"\nparent = "ground"\nchild = "strip.root"\n'
        f'[[force]]\nkind = "force"\non = "strip.tip"\ndirection = [0, 1, 0]\nvalue = {F}\n'
        '[[output]]\nname = "tip"\nof = "strip.tip"\nquantity = "displacement"\n'
    )
    for asked in (1e-1, 1e-2):
        summary, h = ask(folder, text, asked)
        # At the tip every normalised shape is 2, so that each mode's share is 4 F / (mu L omega^2).
        truth = (4 * F / (mu * L * omega**2) * (1 - np.cos(np.outer(h["t"], omega)))).sum(axis=1)
        judge("released beam", summary, np.abs(h["tip.y"] - truth).max() / np.ptp(truth), asked)


def tapered_at_rest(folder):
    # Nothing moves: pieces that are too few for how the section changes have to be seen all the same.
    length, width, force, E = 1.2, 0.04, 50.0, 2.1e11
    text = (
        '[simulation]\nduration = 0.1\noutput_rate = 200\nstart = "static"\n'
        f'[[body]]\nname = "bar"\nkind = "beam"\nlength = {length}\nmaterial = {{ density = 7850, youngs_modulus = {E} }}\n'
        f'sections = [ {{ at = 0, shape = "rectangle", width = {width}, height = 0.04 }}, '
        f'{{ at = 1, shape = "rectangle", width = {width}, height = 0.02 }} ]\n'
        '[[joint]]\nname = "clamp"\nkind = "weld"\nparent = "ground"\nchild = "bar"\n'
        f'[[force]]\nname = "load"\nkind = "force"\non = "bar.tip"\ndirection = [0, -1, 0]\nvalue = {force}\n'
        '[[output]]\nname = "tip"\nof = "bar.tip"\nquantity = "position"\n'
    )
    x = (np.arange(4000) + 0.5) * length / 4000
    height = 0.04 - 0.02 * x / length
    bending = (force * (length - x) ** 2 / (E * width * height**3 / 12)).sum() * length / 4000
    shear = (force / (5 / 6 * E / 2.6 * width * height)).sum() * length / 4000
    for asked in (1e-1, 1e-3):
        summary, h = ask(folder, text, asked)
        judge("tapered beam at rest", summary, abs(h["tip.y"][-1] + bending + shear) / (bending + shear), asked)


def followed_vibrations(folder):
    # Effects that the program chooses, vibrations that have to be followed: the runs that judge cost a few times the run itself.
    # The slider-crank's rod rings after its torque ends, and modes bring that down too slowly: told after one look. A search took
    # 11 and 17 runs for them.
    # The pendulum bends by 1.2 degrees: displacements of second order in one frame are 1.75e-3 of its deflection off, whatever its elements
    # (beside two, four and eight volumes of twelve, 24 and 48 elements in all). That was not seen, and 1e-3 seemed kept; large_bending
    # follows it (beside four volumes of six elements 9e-6 of the deflection with 24 elements).
    # What hid behind errors of time was taken for modes that lack: 8.7 CPU s for the slider-crank at 1e-2, of which the run 0.02. Then a
    # loose run had told that it is kept, and a tight one was made besides (4.5 runs in all).
    questions = (
        ("pendulum", 3e-3, 9.0, True),
        ("pendulum", 1e-3, 11.0, True),
        ("pendulum", 1e-4, 20.0, True),
        ("slider_crank", 1e-3, 12.0, False),
        ("slider_crank", 1e-2, 6.0, True),
    )
    for name, asked, most, reached in questions:
        text = (examples / f"{name}.toml").read_text().split("[render]")[0]
        text = re.sub(r"(?m)^tolerance = .*\n", "", re.sub(r"effects = \[.*?\]", 'effects = "auto"', text))
        summary, h = ask(folder, text, asked)
        estimate, search = summary["accuracy"]["error"], summary["accuracy"]["search_cpu_seconds"]
        print(f"{name}, {asked:g}: estimate {estimate:.1e}, run {summary['cpu_seconds']:.3f}, search {search:.3f} CPU s")
        expect(search < most * summary["cpu_seconds"], f"{name}: the search took {search / summary['cpu_seconds']:.0f} runs")
        told = any("was not reached" in w for w in summary["warnings"])
        expect(told != reached and (estimate <= asked) == reached, f"{name}: an estimate of {estimate:.1e}, {summary['warnings']}")
        if name == "pendulum" and asked == 1e-3:
            # Twelve elements a mode: of three, which err more than the modes left out, 24 modes of 72 were taken.
            modes = int(re.search(r"(\d+) modes?", " ".join(summary["accuracy"]["chosen"]))[1])
            expect(modes <= 12, f"{name}: {modes} modes were taken")
            fine = "--method exponential --tolerance 1e-7 --no-error-estimate --no-effect-check".split()
            for word in (
                'effects=["axial","bending_xy","stiffening","shear","large_bending"]',
                "elements=250",
                "keep_modes=24",
                "keep_axial=4",
            ):
                fine += ["--set", f"body.pendulum.{word}"]
            run("simulate", folder / "scene.toml", "--csv", folder / "truth.csv", *fine)
            truth = {key: np.array(values) for key, values in history(folder / "truth.csv").items()}
            error = np.abs(h["deflection.y"] - truth["deflection.y"]).max() / np.ptp(truth["deflection.y"])
            judge(name, summary, error, 1e-3)
            # Bending lacks most, and what stretching lacks falls slowly: with that taken for all of it the tolerance had to go down to
            # 4.2e-8, at 5040 evaluations.
            expect(summary["evaluations"] < 2500, f"{name}: {summary['evaluations']} evaluations")


def error_that_does_not_fall(folder):
    # An arm of two elastic beams, asked for 1e-2: at 3e-7, above which the exponential method does not sample what oscillates, it is
    # half as far from the truth as from the run at 3e-6. A third was told (5.9e-3 of time where 7.3e-3 is true), and taken for enough.
    metal = "material = { density = 4430.0, youngs_modulus = 1.1e11, poisson = 0.31 }"
    beam = lambda name, length: (
        f'[[body]]\nname = "{name}"\nkind = "beam"\nlength = {length}\nsection = {{ shape = "circle", diameter = 0.0121 }}\n{metal}\n'
    )
    turn = lambda angle: f'motion = "t < 0.113 ? {angle}*(t/0.113 - sin(2*pi*t/0.113)/(2*pi)) : {angle}"\n'
    text = (
        "[simulation]\nduration = 0.147\noutput_rate = 1327\ngravity = [0, 0, 0]\n"
        + beam("upper", 0.2875)
        + beam("fore", 0.23)
        + '[[body]]\nname = "payload"\nkind = "rigid"\nmass = 0.0358\ninertia = [2.96e-5, 2.96e-5, 2.96e-5]\n'
        + "centre_of_mass = [0.0144, 0.0086, 0.0115]\n"
        + '[[joint]]\nname = "shoulder"\nkind = "revolute"\nparent = "ground"\nchild = "upper.root"\n'
        + turn(0.55)
        + '[[joint]]\nname = "elbow"\nkind = "revolute"\nparent = "upper.tip"\nchild = "fore.root"\naxis = [0, 1, 0]\n'
        + "rotation = [0, 0, 0.5]\n"
        + turn(0.54)
        + '[[joint]]\nname = "grip"\nkind = "weld"\nparent = "fore.tip"\nchild = "payload"\n'
        + '[[output]]\nname = "bent"\nof = "upper.tip"\nquantity = "displacement"\n'
    )
    summary, h = ask(folder, text, 1e-2)
    fine = "--method dirk --tolerance 1e-8 --no-error-estimate --no-effect-check".split()
    for body in ("upper", "fore"):
        for word in ('effects=["axial","bending_xy","bending_xz","torsion","stiffening","shear"]', "elements=8"):
            fine += ["--set", f"body.{body}.{word}"]
    run("simulate", folder / "scene.toml", "--csv", folder / "truth.csv", *fine)
    truth = {key: np.array(values) for key, values in history(folder / "truth.csv").items()}
    error = np.abs(h["bent.y"] - truth["bent.y"]).max() / np.ptp(truth["bent.y"])
    judge("arm of two beams", summary, error, 1e-2)
    expect(error < 0.7 * summary["accuracy"]["error"], f"arm of two beams: {error:.1e} of {summary['accuracy']['error']:.1e} told")


def straight_whatever_is_asked(folder):
    # A rod of which implicit steps lose the vibrations, asked for a tenth: 49 runs were made (120 times the run's CPU time). A damped strip
    # let go, asked for a thousandth, 35 of them (186 times).
    steel = "{ density = 7850, youngs_modulus = 2.1e11, poisson = 0.3 }"
    crank = (
        "[simulation]\nduration = 1.2\noutput_rate = 200\ngravity = [0, 0, 0]\n"
        + '[[body]]\nname = "crank"\nkind = "rigid"\nmass = 0.05\ninertia = [1e-4, 1e-4, 1e-4]\nframes = { end = [0.1, 0, 0] }\n'
        + f'[[body]]\nname = "rod"\nkind = "beam"\nlength = 0.4\nsection = {{ shape = "circle", diameter = 0.001 }}\nmaterial = {steel}\n'
        + 'frames = { mid = 0.5 }\n[[body]]\nname = "slider"\nkind = "rigid"\nmass = 0.05\ninertia = [1e-5, 1e-5, 1e-5]\n'
        + '[[joint]]\nname = "shaft"\nkind = "revolute"\nparent = "ground"\nchild = "crank"\n'
        + 'motion = "2*pi*(t < 0.6 ? t/2 - 0.6/(2*pi)*sin(pi*t/0.6) : t - 0.3)"\n'
        + '[[joint]]\nname = "pin"\nkind = "revolute"\nparent = "crank.end"\nchild = "rod.root"\n'
        + '[[joint]]\nname = "wrist"\nkind = "revolute"\nparent = "rod.tip"\nchild = "slider"\n'
        + '[[joint]]\nname = "guide"\nkind = "prismatic"\nparent = "ground"\nchild = "slider"\naxis = [1, 0, 0]\n'
        + '[[output]]\nname = "mid"\nof = "rod.mid"\nquantity = "displacement"\n'
    )
    strip = (
        "[simulation]\nduration = 0.3\noutput_rate = 1000\ngravity = [0, 0, 0]\n"
        + f'[[body]]\nname = "strip"\nkind = "beam"\nlength = 0.5\nsection = {{ shape = "circle", diameter = 0.008 }}\nmaterial = {steel}\n'
        + "damping = { ratio = 0.02 }\n"
        + '[[joint]]\nname = "clamp"\nkind = "weld"\nparent = "ground"\nchild = "strip.root"\n'
        + '[[force]]\nkind = "force"\non = "strip.tip"\ndirection = [0, 1, 0]\nvalue = 1\n'
        + '[[output]]\nname = "tip"\nof = "strip.tip"\nquantity = "displacement"\n'
    )
    for name, text, asked in (("crank", crank, 1e-1), ("strip", strip, 1e-3)):
        summary, _ = ask(folder, text, asked)
        estimate, search = summary["accuracy"]["error"], summary["accuracy"]["search_cpu_seconds"]
        print(f"{name}: estimate {estimate:.1e}, run {summary['cpu_seconds']:.4f}, search {search:.4f} CPU s, {summary['warnings']}")
        expect(estimate <= asked and not summary["warnings"], f"{name}: an estimate of {estimate:.1e}, {summary['warnings']}")
        expect(search < 20 * summary["cpu_seconds"], f"{name}: the search took {search / summary['cpu_seconds']:.0f} runs")


def forms_that_do_not_fit(folder):
    # The blade's eigenforms are those of other ends: finite elements take their place before the search, not volumes, whose comparison with
    # such forms says nothing of bending. Truth: three times as many modes of twice the elements at 1e-9.
    blade = (examples / "beams" / "blade.toml").read_text().replace("duration = 15.0", "duration = 2.0")
    blade = re.sub(r"(?m)^mesh = .*\n", "", re.sub(r"(?s)\n\[render\].*", "", blade))
    summary, h = ask(folder, blade, 1e-3)
    elements = 'model = "finite-element"\nelements = 24\nkeep_modes = 6\nkeep_axial = 3'
    (folder / "truth.toml").write_text(re.sub(r"(?m)^modes = .*\n", "", blade).replace('model = "modal"', elements))
    run("simulate", folder / "truth.toml", "--csv", folder / "t.csv", "--tolerance", "1e-9", "--no-error-estimate", "--no-effect-check")
    truth = {name: np.array(values) for name, values in history(folder / "t.csv").items()}
    judge("blade", summary, np.abs(h["flap"] - truth["flap"]).max() / np.ptp(truth["flap"]), 1e-3)
    expect(not summary["warnings"], f"blade: {summary['warnings']}")
    expect(any("finite-element" in word for word in summary["accuracy"]["chosen"]), f"blade: {summary['accuracy']['chosen']}")


def rod_pulled(folder):
    # A rod pulled at its end within a few of its periods: waves along it, each reflection at the clamp with the other sign (d'Alembert).
    # What the modes of stretching lack falls as 1/n.
    E, A, L, F, T, end = 2.1e11, 0.035 * 0.0256, 0.246, 18500.0, 4.27e-4, 1.52e-3
    text = (
        f"[simulation]\nduration = {end}\noutput_rate = {200 / end}\ngravity = [0, 0, 0]\n"
        + f'[[body]]\nname = "rod"\nkind = "beam"\nlength = {L}\nsection = {{ shape = "rectangle", height = 0.035, width = 0.0256 }}\n'
        + "material = { density = 7850, youngs_modulus = 2.1e11, poisson = 0.3 }\n"
        + '[[joint]]\nname = "clamp"\nkind = "weld"\nparent = "ground"\nchild = "rod.root"\n'
        + '[[force]]\nkind = "force"\non = "rod.tip"\ndirection = [1, 0, 0]\n'
        + f'value = "{F} * (t < {T} ? sin(pi*t/{2 * T})^2 : 1)"\n'
        + '[[output]]\nname = "tip"\nof = "rod.tip"\nquantity = "displacement"\n'
    )
    c = np.sqrt(E / 7850.0)
    t = np.linspace(0.0, end, 200001)

    def force(at):
        return np.where(at < 0.0, 0.0, np.where(at < T, F * np.sin(np.pi * np.clip(at, 0.0, T) / (2 * T)) ** 2, F))

    speed = c / (E * A) * (force(t) + 2 * sum((-1) ** k * force(t - 2 * k * L / c) for k in range(1, 40)))
    place = np.r_[0.0, np.cumsum((speed[1:] + speed[:-1]) / 2 * np.diff(t))]
    for asked in (1e-2, 3e-3):
        summary, h = ask(folder, text, asked)
        truth = np.interp(h["t"], t, place)
        judge("pulled rod", summary, np.abs(h["tip.x"] - truth).max() / np.ptp(truth), asked)


def stubby_beam(folder):
    # Of 3.3 heights, let go from a load: shear is 0.07 of its deflection, and what modes alone lack of that falls as 1/n. With 8 of them
    # 2.0e-3 were lacking, 6e-4 told, where 1e-3 was asked.
    L, h, w, E, rho, poisson, T = 2.2, 0.66, 0.85, 7e10, 2700.0, 0.33, 0.0104
    EI, mu, end = E * w * h**3 / 12, rho * w * h, 0.0437
    k = 5 / 6
    text = (
        f"[simulation]\nduration = {end}\noutput_rate = {200 / end}\ngravity = [0, 0, 0]\n"
        + f'[[body]]\nname = "arm"\nkind = "beam"\nlength = {L}\nsection = {{ shape = "rectangle", height = {h}, width = {w} }}\n'
        + f"material = {{ density = {rho}, youngs_modulus = {E}, poisson = {poisson} }}\n"
        + '[[joint]]\nname = "clamp"\nkind = "weld"\nparent = "ground"\nchild = "arm.root"\n'
        + '[[force]]\nkind = "force"\non = "arm.tip"\ndirection = [0, 1, 0]\n'
        + f'value = "4000 * (t < {T} ? sin(pi*t/{2 * T})^2 : 1)"\n'
        + '[[output]]\nname = "tip"\nof = "arm.tip"\nquantity = "displacement"\n'
    )
    M, K = beam_matrices(L, EI, mu, kGA=E / (2 * (1 + poisson)) * k * w * h, rhoI=rho * w * h**3 / 12)

    def load(t):
        return np.where(t < T, 4000 * np.sin(np.pi * t / (2 * T)) ** 2, 4000.0)

    for asked in (1e-2, 1e-3):
        summary, got = ask(folder, text, asked)
        truth = Linear(M, K).respond(np.eye(len(K))[-2], load, got["t"])[:, -2]
        judge("stubby beam", summary, np.abs(got["tip.y"] - truth).max() / np.ptp(truth), asked)


def places_by_number(folder):
    # A beam whose node is named keeps the elements that the scene gives: its vibrations are followed all the same, and half as many
    # elements tell whether they do. It went to tighter and tighter steps and a search before, up to 460 runs.
    L, E, rho, d = 0.32, 7e10, 2700.0, 0.0156
    EI, mu = E * np.pi * d**4 / 64, rho * np.pi * d * d / 4
    beta = np.array([1.8751040687, 4.6940911330, 7.8547574382, 10.995540735, 14.137168391, *(np.pi * (np.arange(6, 40) - 0.5))])
    omega = beta**2 / L**2 * np.sqrt(EI / mu)
    end = 4 * np.pi / omega[0]
    text = (
        f"[simulation]\nduration = {end!r}\noutput_rate = {400 / end!r}\ngravity = [0, 0, 0]\n"
        f'[[body]]\nname = "strip"\nkind = "beam"\nlength = {L}\nsection = {{ shape = "circle", diameter = {d} }}\nelements = 10\n'
        f'material = {{ density = {rho}, youngs_modulus = {E} }}\neffects = ["bending_xy"]\n'
        '[[joint]]\nname = "clamp"\nkind = "weld"\nparent = "ground"\nchild = "strip.root"\n'
        f'[[force]]\nkind = "force"\non = "strip.tip"\ndirection = [0, 1, 0]\nvalue = 1.0\n'
        '[[output]]\nname = "end"\nof = "strip.node[10]"\nquantity = "displacement"\n'
    )
    for asked, most in ((1e-1, 10.0), (1e-2, 20.0)):
        summary, h = ask(folder, text, asked)
        truth = (4 / (mu * L * omega**2) * (1 - np.cos(np.outer(h["t"], omega)))).sum(axis=1)
        judge("beam with a node", summary, np.abs(h["end.y"] - truth).max() / np.ptp(truth), asked)
        search, own = summary["accuracy"]["search_cpu_seconds"], summary["cpu_seconds"]
        expect(search < most * own, f"beam with a node: {asked:g} took {search / own:.0f} runs")


def console_in_space(folder):
    # Two beams welded at a right angle, of 100 coordinates, are pushed across their plane slowly: the first one bends and twists. As
    # written each of Newton's matrices takes twice as many evaluations; with few modes the runs cost a tenth of that, and no search begins
    # but for the last, which that way does not keep.
    # Closed formula at rest; ramp of 30 periods of sqrt(3 EI / (m L^3)), whose vibrations are 3e-4 of the deflection.
    L1, L2, E, rho, d, F, poisson = 0.5, 0.3, 7e10, 2700.0, 0.008, 0.2, 0.3
    inertia = np.pi * d**4 / 64
    EI, GJ, mass = E * inertia, E / (2 * (1 + poisson)) * 2 * inertia, rho * np.pi * d * d / 4 * (L1 + L2)
    compliance = L1**3 / (3 * EI) + L2**3 / (3 * EI) + L2 * L2 * L1 / GJ
    T = 30 * 2 * np.pi * np.sqrt(compliance * mass)
    end = 1.1 * T

    def ramp(at):
        x = np.minimum(at / T, 1.0)
        return x - np.sin(2 * np.pi * x) / (2 * np.pi)

    def beam(name, length):
        return (
            f'[[body]]\nname = "{name}"\nkind = "beam"\nlength = {length}\nsection = {{ shape = "circle", diameter = {d} }}\n'
            f"material = {{ density = {rho}, youngs_modulus = {E}, poisson = {poisson} }}\n"
        )

    text = (
        f"[simulation]\nduration = {end!r}\noutput_rate = {200 / end!r}\ngravity = [0, 0, 0]\n"
        + beam("one", L1)
        + beam("two", L2)
        + '[[joint]]\nname = "wall"\nkind = "weld"\nparent = "ground"\nchild = "one.root"\n'
        + f'[[joint]]\nname = "knee"\nkind = "weld"\nparent = "one.tip"\nchild = "two.root"\nrotation = [0, 0, {np.pi / 2!r}]\n'
        + '[[force]]\nkind = "force"\non = "two.tip"\ndirection = [0, 0, 1]\n'
        + f'value = "{F} * (t < {T!r} ? t/{T!r} - sin(2*pi*t/{T!r})/(2*pi) : 1)"\n'
        + '[[output]]\nname = "end"\nof = "two.tip"\nquantity = "position"\n'
        + '[[output]]\nname = "knee"\nof = "one.tip"\nquantity = "displacement"\n'
    )
    for asked in (1e-1, 1e-2, 3e-3):
        summary, h = ask(folder, text, asked)
        load = F * ramp(h["t"])
        ends = np.abs(h["end.z"] - load * compliance).max() / (F * compliance)
        knee = L1**3 / (3 * EI)
        judge("console in space", summary, max(ends, np.abs(h["knee.z"] - load * knee).max() / (F * knee)), asked)
        chosen = " ".join(summary["accuracy"]["chosen"])
        expect("'one'" in chosen and "modes" in chosen, f"console in space: {chosen}")
        expect("worth" not in chosen or asked < 5e-3, f"console in space: a search was made, {chosen}")
        expect(not summary["warnings"], f"console in space, {asked}: {summary['warnings']}")


def stiff_beam_between(folder):
    # Three beams welded in space; the middle one is short, but it carries the third, and between rigid ends it would be told to be rigid
    # (0.53 of the range, silently). Truth: Timoshenko's elements in numpy.
    scene = make(bracket_in_space, 151, 0)
    summary, h = ask(folder, scene.text, 1e-2)
    truth = scene.truth(h["t"])
    error = 0.0
    for name, true in truth.items():
        here = np.stack([h[f"{name}.{axis}"] for axis in "xyz"], axis=1)
        error = max(error, np.linalg.norm(here - true, axis=1).max() / np.ptp(true, axis=0).max())
    judge("three beams in space", summary, error, 1e-2)


def sprung_hinge(folder):
    # A beam on a hinge with a stiff spring, pushed at its tip at once. The spring's torque turns its root, of which eigenforms lack 1/n.
    # Series of Euler and Bernoulli: w = a (sinh bx - sin bx) + c sin bx + d (cosh bx - cos bx), EI w'' = k w' at the root; slender.
    L, E, rho, d, F = 1.0, 2e11, 8000.0, 0.01, 0.2
    EI, mu = E * np.pi * d**4 / 64, rho * np.pi * d * d / 4
    k = 20.0 * EI / L

    def form(b):
        # Coefficients of (sinh, sin, cosh - cos) by the moment that vanishes at the tip, and the shear that is left there.
        sh, ch, s, c = np.sinh(b), np.cosh(b), np.sin(b), np.cos(b)
        turn = k * L / (2 * EI * b)  # of d to the sum of the others
        first = sh + turn * (ch + c), -s + turn * (ch + c)
        of = np.array([1.0, -first[0] / first[1]])
        both = turn * of.sum()
        return of, both, of[0] * ch - of[1] * c + both * (sh - s)

    at = np.linspace(0.5, 25.0, 4000)  # beyond, sinh and cosh take too many digits
    values = [form(b)[2] / np.cosh(b) for b in at]
    signs = [i for i in range(len(at) - 1) if values[i] * values[i + 1] < 0 and abs(values[i] - values[i + 1]) < 1.0]
    roots = [brentq(lambda b: form(b)[2] / np.cosh(b), at[i], at[i + 1]) for i in signs]
    x = np.linspace(0.0, 1.0, 4001)
    omega, share = [], []
    for b in roots:
        of, both, _ = form(b)
        w = of[0] * np.sinh(b * x) + of[1] * np.sin(b * x) + both * (np.cosh(b * x) - np.cos(b * x))
        omega.append(b**2 / L**2 * np.sqrt(EI / mu))
        share.append(F * w[-1] ** 2 / (mu * L * simpson(w * w, x=x)))
    omega, share = np.array(omega), np.array(share)
    rest = F * L**2 / k + F * L**3 / (3 * EI)
    expect(abs((share / omega**2).sum() / rest - 1) < 1e-3, f"series of the sprung beam: {(share / omega**2).sum() / rest}")
    duration = 2 * 2 * np.pi / omega[0]
    text = (
        f"[simulation]\nduration = {duration!r}\noutput_rate = {200 / duration!r}\ngravity = [0, 0, 0]\n"
        f'[[body]]\nname = "strip"\nkind = "beam"\nlength = {L}\nsection = {{ shape = "circle", diameter = {d} }}\n'
        f"material = {{ density = {rho}, youngs_modulus = {E} }}\n"
        '[[joint]]\nname = "hinge"\nkind = "revolute"\nparent = "ground"\nchild = "strip.root"\n'
        f"spring = {{ stiffness = {k!r} }}\n"
        f'[[force]]\nkind = "force"\non = "strip.tip"\ndirection = [0, 1, 0]\nvalue = {F}\n'
        '[[output]]\nname = "tip"\nof = "strip.tip"\nquantity = "position"\n'
    )
    for asked in (1e-1, 1e-2):
        summary, h = ask(folder, text, asked)
        truth = (share / omega**2 * (1 - np.cos(np.outer(h["t"], omega)))).sum(axis=1)
        judge("sprung hinge", summary, np.abs(h["tip.y"] - truth).max() / np.ptp(truth), asked)


def hinged_arm(folder):
    # A stiff damped arm falls about its hinge like a rigid one. The moment about the hinge's axis is nothing but rounding, in which no two
    # runs agree: no search may begin for that.
    L, w, rho, E = 0.5, 0.03, 2700.0, 7e10
    text = (
        "[simulation]\nduration = 0.6\noutput_rate = 200\ngravity = [0, -9.81, 0]\n"
        f'[[body]]\nname = "arm"\nkind = "beam"\nlength = {L}\nsection = {{ shape = "rectangle", width = {w}, height = {w} }}\n'
        f"material = {{ density = {rho}, youngs_modulus = {E} }}\ndamping = {{ stiffness = 1e-4 }}\n"
        '[[joint]]\nname = "pin"\nkind = "revolute"\nparent = "ground"\nchild = "arm.root"\n'
        '[[output]]\nname = "turn"\nof = "pin"\nquantity = "value"\n[[output]]\nname = "held"\nof = "pin"\nquantity = "reaction"\n'
    )
    mass, inertia = rho * w * w * L, rho * w * w * L**3 / 3

    def rates(_, y):
        return [y[1], -mass * 9.81 * L / 2 * np.cos(y[0]) / inertia]

    summary, h = ask(folder, text, 5e-2)
    turn, rate = solve_ivp(rates, (0, 0.6), [0, 0], method="DOP853", t_eval=h["t"], rtol=1e-11, atol=1e-12).y
    error = np.abs(h["turn"] - turn).max() / np.ptp(turn)
    # of the hinge on the arm: mass times the acceleration of its centre, less the weight
    spin = rates(0, (turn, rate))[1]
    force = mass * (L / 2 * np.array([-spin * np.sin(turn) - rate**2 * np.cos(turn), spin * np.cos(turn) - rate**2 * np.sin(turn)]))
    force[1] += mass * 9.81
    later = h["t"] > 0.01  # the first instants shake the arm
    apart = np.hypot(h["held.x"] - force[0], h["held.y"] - force[1])[later].max() / max(np.ptp(force[0]), np.ptp(force[1]))
    judge("hinged arm", summary, max(error, apart), 5e-2)
    expect(np.abs(h["held.mz"]).max() < 1e-6 * mass * 9.81 * L, "a hinge holds a moment about its own axis")
    chosen = " ".join(summary["accuracy"]["chosen"])
    expect("worth" not in chosen, f"a search was made: {chosen}")


def mast_let_go(folder):
    # A mast's weight comes on at once: at t = 0 nothing is strained yet, and its foot holds nothing. Elements hold a part of what the first
    # of them weighs; a section that is read near the foot sets its length, with half and with twice as many elements too.
    scene = make(stacker_mast, 151, 0)
    for asked in (1e-2, 1e-3):
        summary, h = ask(folder, scene.text, asked)
        judge("mast let go", summary, np.abs(h["root.y"][0]) / np.ptp(h["root.y"]), asked)


def by_hand(folder, text, beams, elements, *words, method="dirk"):
    # Another method, more elements, all effects, tight: settings that no search chooses.
    scene, table = folder / "scene.toml", folder / "truth.csv"
    scene.write_text(text)
    effects = '["axial","bending_xy","stiffening","shear","large_bending"]'
    richer = [w for b in beams for w in ("--set", f"body.{b}.elements={elements}", "--set", f"body.{b}.effects={effects}")]
    run("simulate", scene, "--csv", table, "--method", method, "--no-error-estimate", "--no-effect-check", *richer, *words)
    return {name: np.array(values) for name, values in history(table).items()}


def apart(h, truth):
    # Relative to ranges, vectors as a whole; what is nothing but rounding counts for nothing.
    vectors, nothing = {}, 1e-9 * max(np.abs(v).max() for name, v in truth.items() if name != "t")
    for name in truth:
        if name != "t":
            vectors.setdefault(name.split(".")[0] + (" moment" if ".m" in name or ".M" in name else ""), []).append(name)
    worst = 0.0
    for names in vectors.values():
        a, b = (np.stack([of[n] for n in names], axis=1) for of in (h, truth))
        if (size := np.ptp(b, axis=0).max()) > nothing:
            worst = max(worst, np.linalg.norm(a - b, axis=1).max() / size)
    return worst


def energy_after_a_blow(folder):
    # What a blow against a stop leaves missing of the energy is its own error, of the order of what is asked, and no vibration that was
    # stepped over, which could move the outputs by the root of it: 1e-2 at a tolerance of 1e-7, where 6e-5 is true.
    text = make(stopped_flap, 211, 0).text
    truth = by_hand(folder, text, ["flap"], 20, "--tolerance", "1e-10")
    summary, h = ask(folder, text, 1e-3)
    judge("flap on a stop", summary, apart(h, truth), 1e-3)
    expect(summary["tolerance"] > 5e-10, f"flap on a stop at 1e-3 ran at a tolerance of {summary['tolerance']:.1e}")


def energy_of_a_steered_beam(folder):
    # The same where a controller keeps the vibrations from being followed: it ran down to 9e-11, 150 000 evaluations.
    text = make(steered_beam, 227, 0).text
    truth = by_hand(folder, text, ["arm"], 20, "--tolerance", "1e-8")
    summary, h = ask(folder, text, 1e-3)
    judge("steered beam", summary, apart(h, truth), 1e-3)
    expect(summary["evaluations"] < 20000, f"steered beam at 1e-3 took {summary['evaluations']} evaluations")


def shear_that_the_section_lacks(folder):
    # A thick bar under a load that grows slowly, its section without shear areas: it lacks F L / (k G A) of its deflection, which no
    # setting brings. A search passed it over without a word.
    L, area, i, young = 0.5, 1e-3, 8.333e-6, 2.1e11
    section = f'{{ shape = "general", area = {area}, iy = {i}, iz = {i}, j = 1e-5%s }}'
    text = (
        "[simulation]\nduration = 1\noutput_rate = 100\ngravity = [0, 0, 0]\n"
        + f'[[body]]\nname = "beam"\nkind = "beam"\nlength = {L}\nsection = {section}\n'
        + f"material = {{ density = 7800, youngs_modulus = {young}, poisson = 0.3 }}\ndamping = {{ ratio = 0.02 }}\n"
        + '[[joint]]\nname = "clamp"\nkind = "weld"\nparent = "ground"\nchild = "beam.root"\n'
        + '[[force]]\nkind = "force"\non = "beam.tip"\ndirection = [0, 1, 0]\nvalue = "1000*t^2"\n'
        + '[[output]]\nname = "tip"\nof = "beam.tip"\nquantity = "position"\n'
    )
    bends, shears = 1000 * L**3 / (3 * young * i), 1000 * L / (0.8 * young / 2.6 * area)
    for asked in (0.2, 1e-2):
        summary, h = ask(folder, text % "", asked)
        error = abs(h["tip.y"][-1] - bends - shears) / (bends + shears)
        judge("a section without shear areas", summary, error, asked)
        told = summary["accuracy"]["error"]
        expect(0.5 * error < told < 3 * error, f"shear that is missing: {error:.2g}, told {told:.2g}")
        expect(any("shear_y" in w for w in summary["warnings"]), f"not told of shear areas: {summary['warnings']}")
        summary, h = ask(folder, text % ", shear_y = 0.8, shear_z = 0.8", asked)
        judge("with shear areas", summary, abs(h["tip.y"][-1] / (bends + shears) - 1), asked)
        expect(not summary["warnings"], f"warned of {summary['warnings']}")


def what_plain_runs_warn_of(folder):
    # A welded I section that twists (the weld keeps it from warping: 43 % less), and a strip that tips over across the plane in which it is
    # computed (beyond Prandtl's load, 216 N): told of plain runs, of asked ones not.
    def bar(section, more):
        return (
            "[simulation]\nduration = 0.05\noutput_rate = 400\ngravity = [0, 0, 0]\n"
            + f'start = "static"\n[[body]]\nname = "bar"\nkind = "beam"\nlength = 1\nsection = {section}\n'
            + "material = { density = 7850, youngs_modulus = 2.1e11, poisson = 0.3 }\ndamping = { ratio = 0.05 }\n"
            + '[[joint]]\nname = "clamp"\nkind = "weld"\nparent = "ground"\nchild = "bar.root"\n'
            + f'[[force]]\non = "bar.tip"\n{more}[[output]]\nname = "tip"\nof = "bar.tip"\nquantity = "position"\n'
            + '[[output]]\nname = "turn"\nof = "bar.tip"\nquantity = "rotation"\n'
        )

    profile = '{ shape = "i", width = 0.1, height = 0.1, web = 0.006, flange = 0.008 }'
    strip = '{ shape = "rectangle", height = 0.04, width = 0.004 }'
    push = 'kind = "force"\ndirection = [0, -1, 0]\nvalue = "%g*(1 + 0.01*sin(100*t))"\n'
    twist = 'kind = "torque"\ndirection = [1, 0, 0]\nvalue = "10*sin(50*t)"\n'
    for text, words, wanted in (
        (bar(profile, twist), "free to warp", True),
        (bar(strip, push % 230), "holds in the plane only", True),
        (bar(strip, push % 200), "holds in the plane only", False),
    ):
        summary, _ = ask(folder, text, 1e-2)
        expect(any(words in w for w in summary["warnings"]) == wanted, f"{words}, wanted {wanted}: {summary['warnings']}")


def length_shared_by_two(folder):
    # Two beams between two clamps: as long as one of them may stretch, the other need not. What one was given explicitly took it from the
    # other, which a search of 120 runs then left out, 0.9 off with a warning.
    text = make(micro_resonator, 223, 0).text
    truth = by_hand(folder, text, ["left", "right"], 20, "--tolerance", "1e-9", method="bdf")
    summary, h = ask(folder, text, 1e-1)
    error = max(np.abs(h[name] - truth[name]).max() / np.ptp(truth[name]) for name in ("y.y", "R.x", "R.y", "stress"))
    judge("resonator", summary, error, 1e-1)
    expect(error <= 1e-1 and not summary["warnings"], f"resonator at 0.1: {error:.1e} off, {summary['warnings']}")


def few_modes_of_a_lift(folder):
    # Few modes begin where the scene as written was too loose, with the effects that it called for: they were given up and the scene run as
    # written, with twice its elements beside it, in 23 times the run.
    text = make(scissor_lift, 211, 0).text
    truth = by_hand(folder, text, ["left", "right"], 16, "--tolerance", "1e-7")
    summary, h = ask(folder, text, 1e-1)
    judge("scissor lift", summary, apart(h, truth), 1e-1)
    chosen = summary["accuracy"]["chosen"]
    expect(any("modes" in c for c in chosen), f"scissor lift at 0.1: {chosen}")


def far_too_loose_at_first(folder):
    # The first runs of a resonator between clamped beams are thousands of times too far off: a search of fifty runs began, where four
    # cheap ones bring it there.
    text = make(micro_resonator, 211, 0).text
    truth = by_hand(folder, text, ["left", "right"], 24, "--tolerance", "1e-9", method="bdf")
    for asked in (1e-2, 1e-3):
        summary, h = ask(folder, text, asked)
        error = max(np.abs(h[name] - truth[name]).max() / np.ptp(truth[name]) for name in ("y.y", "R.x", "R.y", "stress"))
        judge("resonator", summary, error, asked)
        chosen = summary["accuracy"]["chosen"]  # a search tells what it left out, too
        expect(not any("worth" in c for c in chosen), f"resonator at {asked:g} was searched for: {chosen}")


def modes_of_stretching(folder):
    # A rod that falls on its stop lacks modes of stretching, and got more of bending until a search began, of 36 runs.
    text = make(dropped_rod, 233, 0).text
    truth = by_hand(folder, text, ["rod"], 40, "--tolerance", "1e-6", "--set", 'body.rod.effects=["axial"]')
    summary, h = ask(folder, text, 1e-3)
    error = max(np.abs(h[name] - truth[name]).max() / np.ptp(truth[name]) for name in ("x", "tip.x"))
    judge("dropped rod", summary, error, 1e-3)
    chosen = summary["accuracy"]["chosen"]
    expect(not any("worth" in c for c in chosen), f"dropped rod was searched for: {chosen}")


def stretching_beside_vibrations(folder):
    # The template's rod rings so that its first run is over a range off, and what that made of stretching, worth 1e-4, was not to be
    # trusted: a search left it out and warned of 0.51 (1e-2) and 0.0035 (3e-3), measured by another method and too loosely.
    run("new", folder / "press", "-t", "slider-crank")
    text = (folder / "press.toml").read_text(encoding="utf-8")
    truth = by_hand(folder, text, ["rod"], 24, "--tolerance", "1e-9")
    for asked in (1e-1, 1e-2, 3e-3):
        summary, h = ask(folder, text, asked)
        judge("template of a slider-crank", summary, apart(h, truth), asked)
        expect(not summary["warnings"], f"slider-crank at {asked:g}: {summary['warnings']}")
        chosen = summary["accuracy"]["chosen"]
        expect(not any("worth" in c for c in chosen), f"slider-crank at {asked:g} was searched for: {chosen}")


def few_modes_of_a_rotor(folder):
    # Two modes of each half of a shaft do, and sixteen to begin with came to no end: searches of 6 to 16 CPU s, the longest for 3e-3.
    run("new", folder / "rotor", "-t", "rotor")
    text = (folder / "rotor.toml").read_text(encoding="utf-8")
    effects = '["bending_xy","bending_xz","torsion","stiffening","shear","axial"]'
    all_on = [w for b in ("left", "right") for w in ("--set", f"body.{b}.effects={effects}")]
    truth = by_hand(folder, text, [], 0, "--tolerance", "1e-9", *all_on)
    summary, h = ask(folder, text, 3e-3)
    judge("template of a rotor", summary, apart(h, truth), 3e-3)
    chosen = summary["accuracy"]["chosen"]
    expect(not summary["warnings"] and not any("worth" in c for c in chosen), f"rotor at 3e-3: {chosen}, {summary['warnings']}")


# Half of the time of all: every night.
LONG = (console_in_space, followed_vibrations, error_that_does_not_fall, few_modes_of_a_rotor)
run_parts(
    energy_after_a_blow,
    far_too_loose_at_first,
    modes_of_stretching,
    stretching_beside_vibrations,
    energy_of_a_steered_beam,
    shear_that_the_section_lacks,
    what_plain_runs_warn_of,
    length_shared_by_two,
    few_modes_of_a_lift,
    hinged_arm,
    mast_let_go,
    stiff_beam_between,
    sprung_hinge,
    stubby_beam,
    places_by_number,
    straight_whatever_is_asked,
    double_pendulum,
    thick_pendulum,
    told_beside_loose_runs,
    shear_between_two_supports,
    released_beam,
    tapered_at_rest,
    forms_that_do_not_fit,
    rod_pulled,
    *(LONG if "--all" in sys.argv else ()),
)
