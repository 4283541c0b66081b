"""Elastic mechanisms in the plane, for truths: geometrically exact beams in absolute coordinates, rigid bodies, joints by multipliers.

Shares nothing with the program: no floating frames, no modes, no tree of joints. Nodes carry (x, y, angle) in the world. Beams are straight
elements with linear interpolation and one point of integration (Simo, Vu-Quoc 1986); their shear flexibility is enlarged by
h^2/(12 EI), so that they are exact at rest in small bending (MacNeal 1978), and their mass across the element is that of cubic
shapes, turned with it; of what these add to the linear ones only the acceleration across counts (the rest is of h^2/L^2 (speed/w1)^2).
Rates by generalised alpha for index 3 (Arnold,
Bruels 2007) with even steps, halved and extrapolated until two answers agree. SI units."""
import math

import numpy as np
from scipy.linalg import lu_factor, lu_solve

TINY = 1e-30


def turned(c, s, o):
    """Vector o = (2,) turned by an angle of given cosine and sine (...)."""
    return np.stack([c * o[0] - s * o[1], s * o[0] + c * o[1]], -1)


class Point:
    """A place on a node, `offset` in its axes, or on the ground (node None)."""

    def __init__(self, node, offset):
        self.node, self.offset = node, np.array(offset, float)

    def at(self, q):
        if self.node is None:
            return np.broadcast_to(self.offset, q.shape[:-1] + (2,))
        i = 3 * self.node
        return q[..., i : i + 2] + turned(np.cos(q[..., i + 2]), np.sin(q[..., i + 2]), self.offset)

    def arm(self, q):
        """Derivative of the place along the node's angle (..., 2)."""
        a = q[..., 3 * self.node + 2]
        return turned(-np.sin(a), np.cos(a), self.offset)

    def rate(self, q, v):
        if self.node is None:
            return np.zeros(q.shape[:-1] + (2,))
        i = 3 * self.node
        return v[..., i : i + 2] + self.arm(q) * v[..., i + 2 : i + 3]

    def acceleration(self, q, v, a):
        if self.node is None:
            return np.zeros(q.shape[:-1] + (2,))
        i = 3 * self.node
        place = self.at(q) - q[..., i : i + 2]
        return a[..., i : i + 2] + self.arm(q) * a[..., i + 2 : i + 3] - place * v[..., i + 2 : i + 3] ** 2

    def push(self, q, force, to):
        """Adds a force (..., 2) at this place to the generalised forces `to`."""
        if self.node is not None:
            i = 3 * self.node
            to[..., i : i + 2] += force
            to[..., i + 2] += (self.arm(q) * force).sum(-1)


class Plane:
    """Nodes, beams between them, masses, conditions c(q, t) = 0 and loads, to be followed in time."""

    def __init__(self, gravity=(0.0, 0.0)):
        self.start, self.mass, self.beams, self.rows, self.loads = [], [], [], [], []
        self.gravity = np.array(gravity, float)

    def node(self, x, y, angle, mass=0.0, inertia=0.0):
        self.start.append((x, y, angle))
        self.mass.append((mass, inertia))
        return len(self.start) - 1

    def element(self, a, b, h, EA, GA, EI, rhoA, rhoI, damping):
        GA = 1 / ((1 / GA if math.isfinite(GA) else 0.0) + h * h / (12 * EI))
        self.beams.append((a, b, h, EA, GA, EI, rhoA, rhoI, damping))

    # Conditions: each gives value (rows), and rows of the Jacobian by (row, column, value).

    def pin(self, a, b):
        """Both places are one. Row numbers of its two forces on `a`."""

        def condition(q, t, c, G, k):
            c[k : k + 2] = a.at(q) - b.at(q)
            for p, sign in ((a, 1.0), (b, -1.0)):
                if p.node is not None:
                    i = 3 * p.node
                    G[k, i] += sign
                    G[k + 1, i + 1] += sign
                    G[k : k + 2, i + 2] += sign * p.arm(q)

        return self._add(condition, 2)

    def linear(self, terms, value):
        """Sum of factor x coordinate = value(t); terms: (index in q, factor)."""

        def condition(q, t, c, G, k):
            c[k] = sum(f * q[i] for i, f in terms) - value(t)
            for i, f in terms:
                G[k, i] += f

        return self._add(condition, 1)

    def slide(self, a, b, direction):
        """`a` stays on the line through `b` along `direction`, which turns with b's node. The force is normal to it, on `a`."""
        d = np.array(direction, float) / np.hypot(*direction)

        def condition(q, t, c, G, k):
            angle = 0.0 if b.node is None else q[3 * b.node + 2]
            n = turned(np.cos(angle), np.sin(angle), np.array([-d[1], d[0]]))
            gap = a.at(q) - b.at(q)
            c[k] = n @ gap
            for p, sign in ((a, 1.0), (b, -1.0)):
                if p.node is not None:
                    i = 3 * p.node
                    G[k, i : i + 2] += sign * n
                    G[k, i + 2] += sign * (n @ p.arm(q))
            if b.node is not None:
                G[k, 3 * b.node + 2] += np.array([-n[1], n[0]]) @ gap

        return self._add(condition, 1)

    def _add(self, condition, size):
        at = sum(s for _, s in self.rows)
        self.rows.append((condition, size))
        return at

    # ---- equations

    def prepare(self):
        self.q0 = np.array(self.start, float).ravel()
        n = self.n = len(self.q0)
        self.m = sum(s for _, s in self.rows)
        M = np.zeros((n, n))
        for i, (m, J) in enumerate(self.mass):
            M[3 * i, 3 * i] += m
            M[3 * i + 1, 3 * i + 1] += m
            M[3 * i + 2, 3 * i + 2] += J
        across = []
        for a, b, h, _, _, _, rhoA, rhoI, _ in self.beams:
            for k, r in ((0, rhoA), (1, rhoA), (2, rhoI)):
                i, j = 3 * a + k, 3 * b + k
                # Mean of the consistent and the lumped mass: waves along the beam are right to fourth order.
                M[i, i] += r * h * 5 / 12
                M[j, j] += r * h * 5 / 12
                M[i, j] += r * h / 12
                M[j, i] += r * h / 12
            H = np.array(
                [
                    [156, 22 * h, 54, -13 * h],
                    [22 * h, 4 * h * h, 13 * h, -3 * h * h],
                    [54, 13 * h, 156, -22 * h],
                    [-13 * h, -3 * h * h, -22 * h, 4 * h * h],
                ]
            ) * (rhoA * h / 420)
            H[np.ix_((0, 2), (0, 2))] -= rhoA * h * np.array([[5, 1], [1, 5]]) / 12
            across.append(H)
        self.across = np.array(across)
        self.M = M
        self.weight = np.tile(np.r_[self.gravity, 0.0], n // 3)
        e = np.array(self.beams, float).reshape(-1, 9)
        self.ends = e[:, :2].astype(int)
        self.h = e[:, 2]
        self.D = e[:, 3:6]
        self.damping = e[:, 8]
        self.index = (3 * self.ends[:, :, None] + np.arange(3)).reshape(-1, 6)
        self.scatter = np.zeros((len(e) * 6, n))
        self.scatter[np.arange(len(e) * 6), self.index.ravel()] = 1.0

    def strains(self, u):
        """Strains (..., elements, 3) and their derivatives along the elements' coordinates u (..., elements, 6): (..., elements, 3, 6)."""
        d = (u[..., 3:5] - u[..., 0:2]) / self.h[:, None]
        angle = (u[..., 2] + u[..., 5]) / 2
        c, s = np.cos(angle), np.sin(angle)
        e1, e2 = c * d[..., 0] + s * d[..., 1], -s * d[..., 0] + c * d[..., 1]
        kappa = (u[..., 5] - u[..., 2]) / self.h
        # A bent element is longer than its chord by (kappa h)^2/24: beams held at both ends stretch by that.
        strain = np.stack([e1 - 1 + (kappa * self.h) ** 2 / 24, e2, kappa], -1)
        B = np.zeros(strain.shape + (6,), u.dtype)
        ch, sh = c / self.h, s / self.h
        B[..., 0, 0], B[..., 0, 1], B[..., 0, 3], B[..., 0, 4] = -ch, -sh, ch, sh
        B[..., 1, 0], B[..., 1, 1], B[..., 1, 3], B[..., 1, 4] = sh, -ch, -sh, ch
        B[..., 0, 2], B[..., 0, 5] = e2 / 2 - kappa * self.h / 12, e2 / 2 + kappa * self.h / 12
        B[..., 1, 2] = B[..., 1, 5] = -e1 / 2
        B[..., 2, 2], B[..., 2, 5] = -1 / self.h, 1 / self.h
        return strain, B

    def stresses(self, q, v):
        """N, Q, M of each element's middle (..., elements, 3), with material damping."""
        return self.of_elements(q[..., self.index], v[..., self.index])

    def of_elements(self, u, w):
        """The same by the elements' coordinates and rates (..., elements, 6), and the strains' derivatives."""
        strain, B = self.strains(u)
        rate = (B * w[..., None, :]).sum(-1)
        return self.D * (strain + self.damping[:, None] * rate), B

    def pull(self, u, w):
        """What the elements resist with along their coordinates (..., elements, 6)."""
        stress, B = self.of_elements(u, w)
        return (stress[..., None] * B).sum(-2) * self.h[:, None]

    def forces(self, t, q, v):
        """All that acts but inertia and conditions (..., n)."""
        Q = np.zeros(np.broadcast_shapes(q.shape, v.shape), np.result_type(q, v))
        if len(self.h):
            f = self.pull(q[..., self.index], v[..., self.index])
            Q -= f.reshape(f.shape[:-2] + (-1,)) @ self.scatter
        for load in self.loads:
            load(t, q, v, Q)
        return Q

    def inertia(self, q):
        """Mass matrix of the nodes at q."""
        if not len(self.h):
            return self.M
        u = q[self.index]
        angle = (u[:, 2] + u[:, 5]) / 2
        T = np.zeros((len(u), 4, 6))
        T[:, 0, 0] = T[:, 2, 3] = -np.sin(angle)
        T[:, 0, 1] = T[:, 2, 4] = np.cos(angle)
        T[:, 1, 2] = T[:, 3, 5] = 1.0
        M = self.M.copy()
        np.add.at(M, (self.index[:, :, None], self.index[:, None, :]), np.swapaxes(T, 1, 2) @ self.across @ T)
        return M

    def tangents(self, t, q, v):
        """Derivatives of the forces along coordinates and rates (n, n) by complex steps: of loads along each, of elements along their own
        six."""
        q, v = q + 0j, v + 0j
        u, w = q[self.index], v[self.index]
        step, own = 1j * TINY * np.eye(self.n), 1j * TINY * np.eye(6)[:, None]
        out = []
        for at, elements in (((q + step, v), (u + own, w)), ((q, v + step), (u, w + own))):
            Q = np.zeros((self.n, self.n), complex)
            for load in self.loads:
                load(t, *at, Q)
            T = Q.imag.T / TINY
            if len(self.h):
                f = self.pull(*elements).imag / TINY  # along each of its own: (6, elements, 6)
                np.subtract.at(T, (self.index[:, :, None], self.index[:, None, :]), np.moveaxis(f, 0, -1))
            out.append(T)
        return out

    def conditions(self, q, t):
        c, G, k = np.zeros(self.m), np.zeros((self.m, self.n)), 0
        for condition, size in self.rows:
            condition(q, t, c, G, k)
            k += size
        return c, G

    def rest(self, loads_at=0.0):
        """Coordinates and multipliers at rest, by Newton."""
        q, l = self.q0.copy(), np.zeros(self.m)
        for _ in range(60):
            c, G = self.conditions(q, loads_at)
            r = self.forces(loads_at, q, 0 * q) + self.inertia(q) @ self.weight - G.T @ l
            K, _ = self.tangents(loads_at, q, 0 * q)
            # Derivative of G^T l along q by differences: conditions are cheap.
            L = np.zeros((self.n, self.n))
            for i in range(self.n):
                step = np.zeros(self.n)
                step[i] = 1e-7
                L[:, i] = (self.conditions(q + step, loads_at)[1].T @ l - G.T @ l) / 1e-7
            unit = abs(K).max()
            A = np.block([[-K + L, unit * G.T], [unit * G, np.zeros((self.m, self.m))]])
            x = np.linalg.lstsq(A, np.r_[r, -unit * c], rcond=1e-15)[0]  # a hanging load is held only once its force is known
            q, l = q + x[: self.n], l + unit * x[self.n :]
            if abs(x[: self.n]).max() < 1e-12 * (1 + abs(q).max()):
                return q, l
        raise RuntimeError("no rest found")

    def march(self, times, per, q=None, v=None, rho=0.8):
        """States at times: q, v, a, multipliers; `per` steps from one time to the next."""
        q = self.q0.copy() if q is None else q.copy()
        v = np.zeros(self.n) if v is None else v.copy()
        am, af = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
        gamma = 0.5 + af - am
        beta = 0.25 * (gamma + 0.5) ** 2
        h = (times[1] - times[0]) / per
        n, t = self.n, times[0]
        a, l = self._begin(t, q, v, h)
        aux = a.copy()
        out = [(q.copy(), v.copy(), a.copy(), l.copy())]
        factor, since, mb, mg = None, 0, (1 - am) / (h * h * beta * (1 - af)), gamma / (h * beta)
        for k in range(per * (len(times) - 1)):
            t = times[0] + (k + 1) * h
            predicted = v + h * (1 - gamma) * aux
            q = q + h * v + h * h * (0.5 - beta) * aux
            aux1 = (af * a - am * aux) / (1 - am)
            q, v, a = q + h * h * beta * aux1, predicted + h * gamma * aux1, np.zeros(n)
            aux = aux1
            size = 1e-13 * (abs(self.q0).max() + 1e-300)
            before = np.inf
            M = self.inertia(q)  # of the predicted place: its change within a step is below what is neglected
            for iteration in range(25):
                if factor is None or since > 20 or (iteration and iteration % 5 == 0):
                    K, C = self.tangents(t, q, v)
                    _, G = self.conditions(q, t)
                    A = np.block([[M * mb - C * mg - K, G.T], [G, np.zeros((self.m, self.m))]])
                    if not np.isfinite(A).all():
                        raise RuntimeError(f"no step found at {t}")
                    unit = abs(A[:n, :n]).max()
                    A[n:] *= unit
                    A[:n, n:] *= unit
                    factor, since = lu_factor(A), 0
                c, G = self.conditions(q, t)
                r = M @ (a - self.weight) - self.forces(t, q, v) + G.T @ l
                x = lu_solve(factor, -np.r_[r, unit * c])
                x[n:] *= unit
                q, v, a, l = q + x[:n], v + mg * x[:n], a + mb * x[:n], l + x[n:]
                aux = aux + x[:n] / (h * h * beta)
                step = abs(x[:n]).max()
                if step < size or (step < 1e4 * size and step > 0.3 * before):  # as right as rounding lets it be
                    break
                before = step
            else:
                raise RuntimeError(f"no step found at {t}")
            since += 1 + 4 * (iteration > 4)
            if (k + 1) % per == 0:
                out.append((q.copy(), v.copy(), a.copy(), l.copy()))
        return [np.array(x) for x in zip(*out)]

    def _begin(self, t, q, v, h):
        """Accelerations and multipliers that fit the start: conditions differentiated twice along the motion."""
        c, G = self.conditions(q, t)
        d = 1e-4 * h
        # d/dt (G v) and the drives' own accelerations, by central differences of c along q + s v.
        back = (self.conditions(q - d * v, t - d)[0] - 2 * c + self.conditions(q + d * v, t + d)[0]) / d**2 if v.any() else None
        d = 0.02 * h
        drive = (self.conditions(q, t - d)[0] - 2 * c + self.conditions(q, t + d)[0]) / d**2
        rhs = -(drive if back is None else back)
        M = self.inertia(q)
        unit = abs(M).max()
        A = np.block([[M, unit * G.T], [unit * G, np.zeros((self.m, self.m))]])
        x = np.linalg.solve(A, np.r_[self.forces(t, q, v) + M @ self.weight, unit * rhs])
        return x[: self.n], unit * x[self.n :]


def converged(model, times, readings, start=None, want=1e-3, per=4, most=32):
    """readings(model, q, v, a, l) -> {name: array}, with steps halved until two extrapolated answers agree to `want` of each range."""
    model.prepare()
    q, l = start(model) if start else (None, None)
    last, best = None, None
    while True:
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                states = model.march(times, per, q)
        except RuntimeError:  # steps too long for what moves so fast
            if 2 * per > most:
                raise
            last, best, per = None, None, 2 * per
            continue
        now = readings(model, *states)
        rich = None if last is None else {k: (4 * now[k] - last[k]) / 3 for k in now}
        if best is not None:
            told = {k: v[~np.isnan(v).all(axis=1)] for k, v in rich.items()}  # samples that have a truth
            worst = max((np.nanmax(abs(rich[k] - best[k])) / np.nanmax(np.ptp(told[k], axis=0)), k) for k in rich)
            if worst[0] < want:
                return rich
            if 2 * per > most:
                raise RuntimeError(f"the truth of {worst[1]} is known to {worst[0]:.1e} of its range only")
        last, best, per = now, rich, 2 * per
