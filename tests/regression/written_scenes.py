"""Mechanisms written as text, as a reader of SCENE.md writes them, for the tests that try many: what a scene begins with, bodies, a run
that may say no warning, and truths by geometry and scipy."""
import numpy as np
from arrays import off
from program import expect, history, run
from scipy.integrate import solve_ivp

written = []


def head(duration, gravity="[0, -9.81, 0]", more=""):
    return f"[simulation]\nduration = {duration}\noutput_rate = 100\ngravity = {gravity}\n{more}\n"


def rigid(name, mass=1, inertia="[0.01, 0.01, 0.01]", frames="", more=""):
    frames = f"frames = {{ {frames} }}\n" if frames else ""
    return f'[[body]]\nname = "{name}"\nkind = "rigid"\nmass = {mass}\ninertia = {inertia}\n{frames}{more}\n'


def ground(frames):
    return f"[ground]\nframes = {{ {frames} }}\n"


def simulate(folder, name, text, *words):
    """The histories of a scene written as `text`; a refusal and a warning are failures."""
    written.append(name)
    (folder / f"{name}.toml").write_text(text)
    done = run("simulate", folder / f"{name}.toml", "-o", folder / "r.h5", "--csv", folder / "h.csv", *words)
    expect("WARNING" not in (done.stdout + done.stderr).upper(), f"{name}: {done.stdout}{done.stderr}")
    return {k: np.array(v) for k, v in history(folder / "h.csv").items()} if done.returncode == 0 else None


def same(name, h, column, truth, bound):
    if h is not None:
        off(h[column], truth, bound, f"{name}: {column}")


def meet(a, r, b, s, side):
    """The point r from a and s from b (complex), left (1) or right (-1) of the way from a to b."""
    d = abs(b - a)
    x = (d * d + r * r - s * s) / (2 * d)
    return a + (b - a) / d * (x + 1j * side * np.sqrt(r * r - x * x))


def ode(f, y, t):
    return solve_ivp(f, (0, t[-1]), y, t_eval=t, rtol=1e-10, atol=1e-12).y
