"""`flexframe spectrum` on signals that are known:  spectra.py FLEXFRAME [--count N] [--seed S] [--kind NAME] [--number N] [--keep FOLDER]

Kinds: `driven`, a joint that a sum of sines drives; `chain`, masses and springs let go (its modes by numpy); `derived`, outputs computed
from others (expressions, rates); `order`, cams on a shaft whose speed changes, over its turns; `coarse`, any of these with too few samples,
`slow`, with few periods or a drift, `unseen`, an acceleration whose fast part the way does not show, and `computed`, products and functions
of outputs and expressions of time, as slow as samples show or faster. Compared: every line of the file with Hann's window over the exact
samples by numpy (of even samples), and the largest line told with the largest sine of the signal itself, which samples may not show.
Claims: a line 1e-3 of the largest; a sine's amplitude 2 % and its frequency a tenth of the distance of two lines, where no other sine lies
within four lines or has more than 0.9 of its amplitude. Exit 1 if one is wrong without a warning, or refused.
"""
import csv
import json
import math
import pathlib
import subprocess
import sys

import numpy as np
import scipy.linalg

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from arguments import judge_each, suite_parser  # noqa: E402
from scene import pick  # noqa: E402
from scene_text import joint, output, rigid, simulation, table  # noqa: E402

KINDS = ("driven", "chain", "derived", "order", "coarse", "slow", "unseen", "computed")
LINE, SIZE, PLACE = 1e-3, 0.02, 0.1


class Signal:
    """`columns`: {column: (function of times, [(amplitude, frequency)])}; `shaft`: function of times, turns."""

    def __init__(self, r, kind):
        self.kind, self.words, self.columns, self.shaft, self.quick = kind, [], {}, None, False
        self.duration = r.uniform(1, 8)
        count = round(2 ** r.uniform(6, 11))
        self.rate = count / self.duration
        self.text = ""
        base = {"coarse": pick(r, "driven", "chain", "order"), "slow": pick(r, "driven", "chain")}.get(kind, kind)
        getattr(self, base)(r)
        self.what = f"{kind}{'' if base == kind else ' ' + base}, {count} samples"
        if r.random() < 0.25 and kind not in ("slow", "order"):
            a = r.uniform(0, 0.3) * self.duration
            self.words += ["--from", repr(a)]
        self.text = simulation(self.duration, output_rate=self.rate, tolerance=1e-8, gravity=[0.0, 0.0, 0.0]) + self.text

    def frequencies(self, r, count):
        """Hz, of a sensible number of periods and samples, or of neither where the kind says so."""
        low, high = 6 / self.duration, self.rate / 3
        if self.kind == "coarse":
            low, high = 0.55 * self.rate, 5 * self.rate
        elif self.kind == "slow":
            low, high = 0.3 / self.duration, 2.5 / self.duration
        return [math.exp(r.uniform(math.log(low), math.log(high))) for _ in range(count)]

    def driven(self, r):
        count = r.randint(1, 4)
        sines = [(10 ** r.uniform(-3, 0), f, r.uniform(0, 6)) for f in self.frequencies(r, count)]
        if self.kind == "coarse" and r.random() < 0.4:
            # The fast one beside a slower one that samples show.
            sines.append((max(a for a, _, _ in sines) * r.uniform(0.1, 0.8), self.rate / r.uniform(5, 20), 0.3))
        mean = pick(r, 0.0, r.uniform(-3, 3))
        drift = r.uniform(-1, 1) * max(a for a, _, _ in sines) if self.kind == "slow" and r.random() < 0.5 else 0.0
        motion = f"{mean!r} + {drift!r}*t" + "".join(f" + {a!r}*sin({2 * math.pi * f!r}*t + {p!r})" for a, f, p in sines)
        self.text += (
            rigid("m", mass=1.0) + joint("j", "prismatic", "ground", "m", axis=[1, 0, 0], motion=motion) + output("x", "j", "value")
        )
        self.columns["x"] = (
            lambda t: mean + drift * t + sum(a * np.sin(2 * math.pi * f * t + p) for a, f, p in sines),
            [(a, f) for a, f, _ in sines],
        )

    def derived(self, r):
        """Rate, acceleration and an expression of a driven joint."""
        self.driven(r)
        f, sines = self.columns.pop("x")
        self.text += output("v", "j", "rate")
        h = 1e-7 * self.duration
        self.columns["x"] = (f, sines)
        self.columns["v"] = (lambda t: (f(t + h) - f(t - h)) / (2 * h), [(2 * math.pi * g * a, g) for a, g in sines])
        self.text += table("output", name="double", expression="2*x - 1")
        self.columns["double"] = (lambda t: 2 * f(t) - 1, [(2 * a, g) for a, g in sines])

    def unseen(self, r):
        """A fast vibration that samples show neither in the way nor in its frequency, and that is most of the acceleration, or not."""
        slow, fast, little = self.rate * r.uniform(0.03, 0.06), self.rate * r.uniform(0.6, 5), 10 ** r.uniform(-6, -3)
        sines = [(1.0, slow), (little, fast)]
        motion = " + ".join(f"{a!r}*sin({2 * math.pi * g!r}*t)" for a, g in sines)
        self.text += (
            rigid("m", mass=1.0) + joint("j", "prismatic", "ground", "m", axis=[1, 0, 0], motion=motion) + output("y", "m", "acceleration")
        )
        rates = [((2 * math.pi * g) ** 2 * a, g) for a, g in sines]
        self.columns["y.x"] = (lambda t: -sum(a * np.sin(2 * math.pi * g * t) for a, g in rates), rates)

    def computed(self, r):
        """A product, a power or a function of driven joints, or an expression of time alone: as slow as the samples show, or faster."""
        a, b, c = r.uniform(0.3, 2), r.uniform(0.3, 2), pick(r, 0.0, r.uniform(-2, 2))
        f, g = (self.rate * math.exp(r.uniform(math.log(0.02), math.log(0.36))) for _ in range(2))
        alone = self.rate * math.exp(r.uniform(math.log(0.02), math.log(4)))
        for name, size, rate in (("x", a, f), ("y", b, g)):
            motion = f"{size!r}*sin({2 * math.pi * rate!r}*t)"
            self.text += rigid("m" + name, mass=1.0) + joint(name, "prismatic", "ground", "m" + name, axis=[1, 0, 0], motion=motion)
            self.text += output(name + "1", name, "value")
        x, y = (lambda t: a * np.sin(2 * math.pi * f * t)), (lambda t: b * np.sin(2 * math.pi * g * t))
        text, value = pick(
            r,
            ("x1*y1", lambda t: x(t) * y(t)),
            ("x1^2 + c*y1", lambda t: x(t) ** 2 + c * y(t)),
            ("x1*(y1 + c)", lambda t: x(t) * (y(t) + c)),
            ("sin(3*x1) + y1", lambda t: np.sin(3 * x(t)) + y(t)),
            ("c*x1 - 2*y1", lambda t: c * x(t) - 2 * y(t)),
            ("x1 + c*sin(w*t)", lambda t: x(t) + c * np.sin(2 * math.pi * alone * t)),
            ("sin(w*t)", lambda t: np.sin(2 * math.pi * alone * t)),
        )
        text = text.replace("c*", f"({c!r})*").replace("+ c)", f"+ ({c!r}))").replace("w*", f"{2 * math.pi * alone!r}*")
        self.text += table("output", name="z", expression=text)
        # Eight times as long, so that lines lie eight times as close.
        fine = np.arange(2**18) * 8 * self.duration / 2**18
        at, lines = lines_of(fine, value(fine))
        peaks = [k for k in range(4, len(at) - 4) if lines[k] == lines[k - 4 : k + 5].max() > 0.01 * lines[2:].max()]
        # The squares of one sine's lines add up to 1.5 of its own.
        self.columns["z"] = (value, [(math.sqrt(float((lines[k - 2 : k + 3] ** 2).sum()) / 1.5), float(at[k])) for k in peaks])
        self.quick = any(g > 0.42 * self.rate for _, g in self.columns["z"][1])

    def chain(self, r):
        n = r.randint(1, 4)
        f = self.frequencies(r, 1)[0]
        m = np.array([r.uniform(0.5, 2) for _ in range(n)])
        k = np.array([r.uniform(0.5, 2) for _ in range(n)])
        K = np.diag(k + np.append(k[1:], 0)) - np.diag(k[1:], 1) - np.diag(k[1:], -1)
        values, V = scipy.linalg.eigh(K, np.diag(m))
        factor = (2 * math.pi * f) ** 2 / values[0 if self.kind == "coarse" else -1]
        k, w = k * factor, np.sqrt(values * factor)
        start = np.array([r.uniform(-1, 1) for _ in range(n)])
        q = V.T @ (m * start)
        for i in range(n):
            at = "ground" if i == 0 else f"m{i - 1}"
            self.text += rigid(f"m{i}", mass=float(m[i]))
            # Coordinates of the joints are relative: each spring's own.
            value = float(start[i] - (start[i - 1] if i else 0.0))
            self.text += joint(
                f"j{i}", "prismatic", at, f"m{i}", axis=[1, 0, 0], initial={"value": value}, spring={"stiffness": float(k[i])}
            )
            self.text += output(f"x{i}", f"m{i}", "position")
            share = V[i] * q
            self.columns[f"x{i}.x"] = (
                lambda t, share=share: np.cos(np.outer(t, w)) @ share,
                [(abs(a), g / (2 * math.pi)) for a, g in zip(share, w)],
            )

    def order(self, r):
        # Turns: steady or running up.
        speed = self.rate / r.uniform(30, 60)
        up = pick(r, 0.0, r.uniform(0, 1.5)) * speed / self.duration
        speed -= 0.5 * up * self.duration
        turns = f"({speed!r}*t + {0.5 * up!r}*t*t)"
        highest = (speed + up * self.duration) / self.rate  # turns a sample
        a, p = 10 ** r.uniform(-3, 0), r.uniform(0, 6)
        span = (speed + 0.5 * up * self.duration) * self.duration
        if self.kind == "coarse":
            n = r.uniform(0.6, 5) / highest
        else:
            n = math.exp(r.uniform(math.log(6 / span), math.log(max(0.1 / highest, 6.5 / span))))
        self.text += rigid("w", mass=1.0, inertia=[1, 1, 1]) + joint("shaft", "revolute", "ground", "w", motion=f"2*pi*{turns}")
        self.text += rigid("m", mass=1.0)
        self.text += joint("cam", "prismatic", "ground", "m", axis=[0, 1, 0], motion=f"{a!r}*sin(2*pi*{n!r}*{turns} + {p!r})")
        self.text += output("angle", "shaft", "value") + output("y", "cam", "value")
        self.shaft = lambda t: speed * t + 0.5 * up * t * t
        self.words = ["--order", "angle", "--column", "y"]
        self.columns["y"] = (lambda t: a * np.sin(2 * math.pi * n * self.shaft(t) + p), [(a, n)])


def run(program, folder, *words):
    done = subprocess.run([program, *map(str, words)], cwd=folder, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=120)
    if done.returncode:
        raise ValueError(done.stderr.strip()[-300:])
    return done.stdout


def lines_of(x, values):
    """Hann's window over even samples: (places, amplitudes)."""
    n = len(x)
    window = 0.5 - 0.5 * np.cos(2 * math.pi * np.arange(n) / n)
    found = 2 * abs(np.fft.rfft(window * (values - (window @ values) / window.sum()))) / window.sum()
    found[0] = abs(values.mean())
    return np.arange(len(found)) / ((x[-1] - x[0]) * n / (n - 1)), found


def judge(program, signal, folder, _):
    (folder / "s.toml").write_text(signal.text)
    run(program, folder, "simulate", "s.toml", "-q", "-o", "s.h5", "--csv", "s_samples.csv")
    words = list(signal.words)
    if signal.shaft is None:
        words += [word for c in signal.columns for word in ("--column", c)]
    told = json.loads(run(program, folder, "spectrum", "s.h5", "-o", "s.csv", "--json", *words))
    with (folder / "s_samples.csv").open() as file:
        rows = list(csv.reader(row for row in file if not row.startswith("#")))
    t = np.array([float(row[0]) for row in rows[1:]])
    if "--from" in words:
        t = t[t >= float(words[words.index("--from") + 1])]
    table_ = list(csv.DictReader((folder / "s.csv").open()))
    axis = "frequency" if signal.shaft is None else "order"
    warnings, worst, notes = told["warnings"], 0.0, []
    for one in told["outputs"]:
        f, sines = signal.columns[one["column"]]
        x = t if signal.shaft is None else signal.shaft(t)
        even = np.ptp(np.diff(x)) < 1e-6 * np.diff(x).mean()
        at, true = lines_of(x, f(t))
        mine = np.array([float(row[one["column"]]) for row in table_])
        if even:
            off = abs(mine - true[: len(mine)])[1:].max() / true[1:].max()
            worst = max(worst, off / LINE)
            notes.append(f"lines {off:.1e}")
        sines = sorted(sines, reverse=True)
        size, place = sines[0]
        apart = at[1]
        clear = all(abs(g - place) > 4 * apart and a < 0.9 * size for a, g in sines[1:] if a > 1e-3 * size)
        if not clear:
            continue
        off = abs(one["largest"] / size - 1), abs(one[axis] - place) / apart
        worst = max(worst, off[0] / SIZE, off[1] / PLACE)
        notes.append(f"largest {off[0]:.1e}, place {off[1]:.1e}")
    note = f"{notes[0] if notes else 'no claim'}"
    if worst > 1:
        return ("warned" if warnings else "silent"), "; ".join(notes) + (f": {warnings[0][:120]}" if warnings else "")
    few = any(max(sines)[1] < 3.5 / (t[-1] - t[0]) for _, sines in signal.columns.values())
    alarm = warnings and signal.kind not in ("coarse", "slow", "unseen") and not few and not signal.quick
    return ("alarm" if alarm else "right"), note + (f": {warnings[0][:120]}" if warnings else "")


def main():
    parser = suite_parser(__doc__, "number", "keep", count=60)
    parser.add_argument("--kind", choices=KINDS)
    args = parser.parse_args()
    judge_each(args, "spectra", lambda r, number: Signal(r, args.kind or KINDS[number % len(KINDS)]), judge)


if __name__ == "__main__":
    main()
