"""Small motions about a state of rest as matrices, and their response to a force that varies as a sine: numpy alone.

M x'' + D x' + K x = f e^(i w t), with conditions G x = 0; what is read is y = (A + i w B - w^2 C) x. SI units."""
import numpy as np
from scipy.linalg import eigvals, null_space


class SmallMotion:
    """names: of what is read, one a row of A, B and C (None: zero)."""

    def __init__(self, M, D, K, f, names, A, B=None, C=None, G=None):
        N = np.eye(len(M)) if G is None or not len(G) else null_space(G / abs(G).max(1)[:, None])
        self.M, self.D, self.K = (N.T @ X @ N for X in (M, D, K))
        self.f, self.names = N.T @ f, list(names)
        self.A, self.B, self.C = ((np.zeros((len(self.names), len(M))) if X is None else X) @ N for X in (A, B, C))

    def _all(self):
        n = len(self.M)
        # A time in which the middle of the spectrum is of size one.
        w = np.sqrt(abs(np.trace(np.linalg.solve(self.M, self.K))) / n)
        K, D = np.linalg.solve(self.M, self.K) / w**2, np.linalg.solve(self.M, self.D) / w
        return eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-K, -D]])) * w, w

    def poles(self):
        """1/s; those of vibrations by their imaginary part, ascending, one of each pair."""
        p, w = self._all()
        return sorted((x for x in p if x.imag > 1e-6 * w and x.imag > 1e-3 * abs(x)), key=lambda x: x.imag)

    def stable(self):
        p, w = self._all()
        return (p.real <= 1e-6 * np.maximum(abs(p), w)).all()

    def __call__(self, hertz):
        """Complex, frequencies x names."""
        out = np.empty((len(hertz), len(self.names)), complex)
        for k in range(0, len(hertz), 256):
            w = 2 * np.pi * np.asarray(hertz[k : k + 256])[:, None, None]
            x = np.linalg.solve(self.K - w * w * self.M + 1j * w * self.D, np.broadcast_to(self.f[:, None] + 0j, (len(w), len(self.f), 1)))
            out[k : k + 256] = ((self.A + 1j * w * self.B - w * w * self.C) @ x)[:, :, 0]
        return out


def of_machine(machine, push):
    """A plane_machine.Machine beside its rest at t = 0, with what it reads; push(q): generalised forces of a unit force."""
    p = machine.plane
    p.prepare()
    q, l = p.rest()
    zero = 0 * q
    K, D = p.tangents(0.0, q, zero)
    n, (_, G) = p.n, p.conditions(q, 0.0)

    def slope(f, x, i, h):
        step = np.zeros(len(x))
        step[i] = h
        return (8 * (f(x + step) - f(x - step)) - (f(x + 2 * step) - f(x - 2 * step))) / (12 * h)

    # The size of a step: of places the mechanism's, of angles a radian.
    reach = [np.hypot(*offset) for b in machine.bodies.values() for _, offset in b["points"].values()]
    size = max(abs(np.array(p.start)[:, :2]).max(), *reach)
    steps = np.tile([1e-3 * size, 1e-3 * size, 1e-3], n // 3)
    held = lambda x: p.conditions(x, 0.0)[1].T @ l - p.inertia(x) @ p.weight
    K = -K + np.column_stack([slope(held, q, i, steps[i]) for i in range(n)])
    names, rows = [], {k: [] for k in "ABC"}
    for name, (value, _, quantity) in machine.readings.items():
        read = {
            "A": lambda x: np.array(value(0.0, x, zero, zero, l), float),
            "B": lambda x: np.array(value(0.0, q, x, zero, l), float),
            "C": lambda x: np.array(value(0.0, q, zero, x, l), float),
        }
        count = len(read["A"](q))
        names += [name] if count == 1 else [f"{name}.{axis}" for axis in "xyz"[:count]]
        for key, at in (("A", q), ("B", zero), ("C", zero)):
            rows[key].append(np.column_stack([slope(read[key], at, i, steps[i]) for i in range(n)]))
    A, B, C = (np.nan_to_num(np.vstack(rows[k])) for k in "ABC")
    return SmallMotion(p.inertia(q), -D, K, push(q), names, A, B, C, G)
