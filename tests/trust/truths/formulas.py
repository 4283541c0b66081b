"""Truths that do not come from the program: closed formulas, small finite elements of numpy, ODEs of scipy. SI units."""
import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import eigh


# ---- sections --------------------------------------------------------------------------------------------------------------------


def torsion_rectangle(b, h):
    """Saint-Venant's constant of a solid rectangle by its series (Timoshenko, Goodier 1970, art. 109)."""
    b, h = max(b, h), min(b, h)
    return b * h**3 / 3 * (1 - 192 / math.pi**5 * h / b * sum(math.tanh(n * math.pi * b / (2 * h)) / n**5 for n in range(1, 60, 2)))


def of_rectangles(parts):
    """Area, iy (int z^2), iz (int y^2), iyz about the common centroid of rectangles (y, z, height along y, width along z).

    And the sum of their torsion constants."""
    A = sum(h * w for _, _, h, w in parts)
    yc, zc = sum(y * h * w for y, _, h, w in parts) / A, sum(z * h * w for _, z, h, w in parts) / A
    iz = sum(w * h**3 / 12 + h * w * (y - yc) ** 2 for y, _, h, w in parts)
    iy = sum(h * w**3 / 12 + h * w * (z - zc) ** 2 for _, z, h, w in parts)
    iyz = sum(h * w * (y - yc) * (z - zc) for y, z, h, w in parts)
    return A, iy, iz, iyz, sum(torsion_rectangle(h, w) for _, _, h, w in parts)


# ---- linear vibrations -----------------------------------------------------------------------------------------------------------


class Linear:
    """M u'' + C u' + K u = f F(t), from rest or from equilibrium under F(0).

    Modes, each stepped exactly for a force that is linear between fine samples."""

    def __init__(self, M, K, zeta=None):
        squares, self.modes = eigh(K, M)
        self.omega = np.sqrt(np.maximum(squares, 0.0))
        self.zeta = np.zeros_like(self.omega) if zeta is None else np.broadcast_to(zeta, self.omega.shape)

    def respond(self, f, F, times, equilibrium=False, fine=40000):
        """Displacements (len(times) x size) at times; F a function of an array of times. times evenly spaced from 0."""
        per = max(1, math.ceil(fine / max(1, len(times) - 1)))
        dt = (times[1] - times[0]) / per
        grid = times[0] + dt * np.arange(per * (len(times) - 1) + 1)
        loads = np.asarray(F(grid), float)
        p = self.modes.T @ f
        w, z = self.omega, self.zeta
        wd = w * np.sqrt(1 - z * z)
        e, s, c = np.exp(-z * w * dt), np.sin(wd * dt), np.cos(wd * dt)
        a11, a12 = e * (c + z * w / wd * s), e * s / wd
        a21, a22 = -w * w * a12, e * (c - z * w / wd * s)
        q = p * loads[0] / w**2 if equilibrium else np.zeros_like(w)
        v = np.zeros_like(w)
        out = [q.copy()]
        for k in range(len(grid) - 1):
            # Particular solution under p (F0 + slope t).
            slope = (loads[k + 1] - loads[k]) / dt
            A = p * (loads[k] / w**2 - 2 * z * slope / w**3)
            B = p * slope / w**2
            h, g = q - A, v - B
            q, v = a11 * h + a12 * g + A + B * dt, a21 * h + a22 * g + B
            if (k + 1) % per == 0:
                out.append(q.copy())
        return np.array(out) @ self.modes.T


def rod_matrices(length, EA, rhoA, elements=80, tip_mass=0.0):
    """Axial bar, held at its root: M, K over the free nodes (last: the tip)."""
    h = length / elements
    n = elements + 1
    M, K = np.zeros((n, n)), np.zeros((n, n))
    for e in range(elements):
        i = slice(e, e + 2)
        M[i, i] += rhoA * h / 6 * np.array([[2, 1], [1, 2]])
        K[i, i] += EA / h * np.array([[1, -1], [-1, 1]])
    M[-1, -1] += tip_mass
    return M[1:, 1:], K[1:, 1:]


def bending_element(h, EI, rhoA=0.0, kGA=math.inf, rhoI=0.0):
    """m, k of an element over (deflection, slope) of its ends; with kGA Timoshenko's static shape functions."""
    phi = 12 * EI / (kGA * h * h) if math.isfinite(kGA) else 0.0
    k = [[12, 6 * h, -12, 6 * h], [6 * h, (4 + phi) * h * h, -6 * h, (2 - phi) * h * h]]
    k += [[-12, -6 * h, 12, -6 * h], [6 * h, (2 - phi) * h * h, -6 * h, (4 + phi) * h * h]]
    x, w = np.polynomial.legendre.leggauss(5)
    m = np.zeros((4, 4))
    for xi, wi in zip((x + 1) / 2, w / 2 * h):
        N = [1 - 3 * xi**2 + 2 * xi**3 + phi * (1 - xi), h * (xi - 2 * xi**2 + xi**3 + phi / 2 * (xi - xi**2))]
        N += [3 * xi**2 - 2 * xi**3 + phi * xi, h * (-(xi**2) + xi**3 - phi / 2 * (xi - xi**2))]
        R = [6 * (xi**2 - xi) / h, 1 - 4 * xi + 3 * xi**2 + phi * (1 - xi), 6 * (xi - xi**2) / h, 3 * xi**2 - 2 * xi + phi * xi]
        m += wi * (rhoA * np.outer(N, N) + rhoI * np.outer(R, R)) / (1 + phi) ** 2
    return m, EI / (h**3 * (1 + phi)) * np.array(k)


def beam_matrices(length, EI, rhoA, elements=20, kGA=math.inf, rhoI=0.0, tip_mass=0.0, tip_inertia=0.0):
    """Bending, clamped at the root: M, K over (deflection, slope) of the free nodes."""
    m, k = bending_element(length / elements, EI, rhoA, kGA, rhoI)
    n = 2 * (elements + 1)
    M, K = np.zeros((n, n)), np.zeros((n, n))
    for e in range(elements):
        i = slice(2 * e, 2 * e + 4)
        M[i, i] += m
        K[i, i] += k
    M[-2, -2] += tip_mass
    M[-1, -1] += tip_inertia
    return M[2:, 2:], K[2:, 2:]


def frame_at_rest(nodes, members, held, loads):
    """Plane frame in small displacements.

    nodes (x, y), members (a, b, EA, EI, kGA), held {node: (x, y, angle) as 0 or 1}, loads {node: (fx, fy, m)}.

    Displacements (nodes x 3)."""
    K, f = np.zeros((3 * len(nodes),) * 2), np.zeros(3 * len(nodes))
    for a, b, EA, EI, kGA in members:
        d = np.subtract(nodes[b], nodes[a])
        L = np.hypot(*d)
        c, s = d / L
        k = np.zeros((6, 6))
        k[np.ix_((0, 3), (0, 3))] = EA / L * np.array([[1, -1], [-1, 1]])
        k[np.ix_((1, 2, 4, 5), (1, 2, 4, 5))] = bending_element(L, EI, kGA=kGA)[1]
        T = np.kron(np.eye(2), np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))
        i = np.r_[3 * a : 3 * a + 3, 3 * b : 3 * b + 3]
        K[np.ix_(i, i)] += T.T @ k @ T
    for n, load in loads.items():
        f[3 * n : 3 * n + 3] += load
    free = [3 * n + k for n in range(len(nodes)) for k in range(3) if not held.get(n, (0, 0, 0))[k]]
    u = np.zeros(3 * len(nodes))
    u[free] = np.linalg.solve(K[np.ix_(free, free)], f[free])
    return u.reshape(-1, 3)


# ---- motion ----------------------------------------------------------------------------------------------------------------------


def ode(f, y0, times, rtol=1e-11, atol=None, max_step=np.inf, scale=1.0):
    """States at times (len(times) x size) of y' = f(t, y)."""
    done = solve_ivp(
        f,
        (times[0], times[-1]),
        y0,
        method="DOP853",
        t_eval=times,
        rtol=rtol,
        atol=1e-12 * scale if atol is None else atol,
        max_step=max_step,
    )
    if not done.success:
        raise RuntimeError(done.message)
    return done.y.T


def oscillator(m, c, k, x0, v0, times):
    """m x'' + c x' + k x = 0 in closed form, whatever the damping."""
    root = np.sqrt(complex(c * c - 4 * m * k))
    if abs(root) < 1e-9 * max(c, math.sqrt(m * k), 1e-300):
        s = -c / (2 * m)
        return (x0 + (v0 - s * x0) * times) * np.exp(s * times)
    # The slow root from the product of both: no digits are lost far beyond critical damping.
    s1 = (-c - root) / (2 * m)
    s2 = k / (m * s1)
    a2 = (v0 - s1 * x0) / (s2 - s1)
    a1 = x0 - a2
    return (a1 * np.exp(s1 * times) + a2 * np.exp(s2 * times)).real


def piecewise(f_of_mode, events_of_mode, y0, mode, times, rtol=1e-11, atol=1e-12, most=10000, max_step=np.inf):
    """A motion in pieces: in each, y' = f_of_mode(mode)(t, y) until one of events_of_mode(mode) has a zero.

    events_of_mode(mode) is a list of (function, next mode or a function of (t, y)).

    Each piece ends at its event, located to rounding; states at times."""
    t, y = times[0], np.array(y0, float)
    out = np.zeros((len(times), len(y)))
    for _ in range(most):
        events = events_of_mode(mode)
        functions = []
        for g, _next in events:

            def event(s, z, g=g):
                return g(s, z)

            event.terminal = True
            event.direction = getattr(g, "direction", 0)
            functions.append(event)
        done = solve_ivp(
            f_of_mode(mode),
            (t, times[-1]),
            y,
            method="DOP853",
            rtol=rtol,
            atol=atol,
            events=functions or None,
            dense_output=True,
            max_step=min(max_step, (times[-1] - times[0]) / 300),
        )  # a body that rests must not step over what tears it off
        inside = (times >= t) & (times <= done.t[-1] * (1 + 1e-14))
        if inside.any():
            out[inside] = done.sol(np.clip(times[inside], t, done.t[-1])).T
        if done.status != 1 or done.t[-1] >= times[-1]:
            return out
        hit = next(i for i, e in enumerate(done.t_events) if len(e))
        t, y = done.t[-1], done.y[:, -1]
        following = events[hit][1]
        mode = following(t, y) if callable(following) else following
    raise RuntimeError("too many events")


def restarted(f, kinks, y0, times, rtol=1e-11, scale=1.0, stops=(), most=100000):
    """States at times of y' = f(t, y), whose right side has a kink where one of `kinks`, functions of (t, y), is zero.

    Integrated from kink to kink, and anew at `stops`, so that nothing short is stepped over."""
    longest = (times[-1] - times[0]) / 300
    t, y = times[0], np.array(y0, float)
    out = np.zeros((len(times), len(y)))
    borders = sorted({s for s in stops if times[0] < s < times[-1]} | {times[-1]})
    events = []
    for g in kinks:

        def event(s, z, g=g):
            return g(s, z)

        event.terminal = True
        events.append(event)
    away = False  # the kink where this piece begins is not its end: it is left without looking
    for _ in range(most):
        end = next(b for b in borders if b > t)
        end = min(end, t + 1e-7 * longest) if away else end
        done = solve_ivp(
            f,
            (t, end),
            y,
            method="DOP853",
            rtol=rtol,
            atol=1e-12 * scale,
            events=None if away else events,
            dense_output=True,
            max_step=longest,
        )
        inside = (times >= t) & (times <= max(done.t[-1], t + 1e-9 * longest))
        if inside.any():
            out[inside] = done.sol(times[inside]).T if done.t[-1] > t else y
        if done.t[-1] >= times[-1]:
            return out
        t, y, away = done.t[-1], done.y[:, -1], not away
        if done.status < 0:  # a jump that is not at a stop to the last bit
            y, t, away = y + 1e-9 * longest * np.asarray(f(t, y)), t + 1e-9 * longest, False
    raise RuntimeError("too many kinks")


def rotate(v):
    """Rotation matrix of a rotation vector."""
    a = np.linalg.norm(v)
    if a == 0:
        return np.eye(3)
    x, y, z = np.asarray(v) / a
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(a) * K + (1 - math.cos(a)) * K @ K
