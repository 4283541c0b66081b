"""Motion of rigid mechanisms in a plane, closed in any way, for truths: bodies in absolute coordinates, joints as conditions.

A body's coordinates are the place of its centre of mass and its angle, so that the mass matrix is a constant diagonal. What joints hold is
kept exactly: coordinates and rates are brought back onto the conditions in every evaluation, along the direction of least kinetic energy.
No coordinate is chosen to lead the others, so dead points and change points of one link are places like any other. Multipliers are the
forces of the joints. numpy and scipy alone, SI units."""
import numpy as np
from scipy.integrate import solve_ivp


class NotClosed(RuntimeError):
    """No position near the one before closes the loops."""


class PlaneLoops:
    """Bodies (mass, inertia about the centre of mass); ground is -1.

    pins: (i, point, j, point), points from the centre of mass in the body's axes, of ground in the world.
    slides: (i, point, place, direction): that point stays on a line of ground, and the body does not turn.
    drive: (i, j, function of t -> angle of i against j, its rate and acceleration) or None."""

    def __init__(self, bodies, pins, slides=(), drive=None, gravity=(0.0, 0.0)):
        n = len(bodies)
        self.n, self.size, self.drive = n, 3 * n, drive
        self.M = np.array([[m, m, J] for m, J in bodies], float).ravel()
        self.weight = np.array([[m * gravity[0], m * gravity[1], 0.0] for m, _ in bodies]).ravel()
        self.i, self.j = np.array([p[0] for p in pins]), np.array([p[2] for p in pins])
        self.a, self.b = np.array([p[1] for p in pins], float), np.array([p[3] for p in pins], float)
        self.slides = [(i, np.array(c, float), np.array(p, float), np.array(u, float)) for i, c, p, u in slides]
        self.rows = 2 * len(pins) + 2 * len(self.slides) + (drive is not None)
        self.rate_of_drive, self.acceleration_of_drive = 0.0, 0.0

    def conditions(self, t, q):
        """Residuals, their derivatives (rows, 3 bodies) and the points' arms."""
        at = np.append(q.reshape(-1, 3), [[0.0, 0.0, 0.0]], 0)
        c, s = np.cos(at[:, 2]), np.sin(at[:, 2])
        spun = lambda k, v: np.stack([c[k] * v[:, 0] - s[k] * v[:, 1], s[k] * v[:, 0] + c[k] * v[:, 1]], 1)
        A, B = spun(self.i, self.a), spun(self.j, self.b)
        res, G = np.zeros(self.rows), np.zeros((self.rows, self.size + 3))
        m = len(self.i)
        res[: 2 * m] = (at[self.i, :2] + A - at[self.j, :2] - B).ravel()
        x, y = np.arange(0, 2 * m, 2), np.arange(1, 2 * m, 2)
        for k, arm, sign in ((self.i, A, 1.0), (self.j, B, -1.0)):  # ground is the last one, cut off below
            k = np.where(k < 0, self.n, k)
            G[x, 3 * k] += sign
            G[y, 3 * k + 1] += sign
            G[x, 3 * k + 2] -= sign * arm[:, 1]
            G[y, 3 * k + 2] += sign * arm[:, 0]
        row, bias = 2 * m, np.zeros(self.rows)
        for i, point, place, u in self.slides:
            arm, across = spun(np.array([i]), point[None])[0], np.array([-u[1], u[0]])
            res[row], res[row + 1] = across @ (at[i, :2] + arm - place), at[i, 2]
            G[row, 3 * i : 3 * i + 3] = [across[0], across[1], across @ [-arm[1], arm[0]]]
            G[row + 1, 3 * i + 2] = 1.0
            row += 2
        if self.drive:
            i, j, f = self.drive
            angle, self.rate_of_drive, self.acceleration_of_drive = f(t)
            res[row] = at[i, 2] - at[j, 2] - angle
            G[row, 3 * i + 2] += 1.0
            if j >= 0:
                G[row, 3 * j + 2] -= 1.0
        return res, G[:, : self.size], A, B

    def push(self, G):
        """Smallest change of the coordinates, by their kinetic energy, per change of the conditions."""
        W = G / self.M
        return W, W @ G.T

    def close(self, t, q):
        scale = 1e-14 * max(1e-3, abs(q).max())
        last = np.inf
        for _ in range(30):
            res, G, A, B = self.conditions(t, q)
            size = abs(res).max()
            if size <= scale or size < 1e-11 and size > 0.2 * last:
                return q, G, A, B
            if not np.isfinite(size):
                break
            W, S = self.push(G)
            q = q - W.T @ np.linalg.solve(S, res)
            last = size
        raise NotClosed(f"open by {size:.2g} at t = {t:.6g} s")

    def close_rates(self, G, qd):
        res = G @ qd
        if self.drive:
            res[-1] -= self.rate_of_drive
        W, S = self.push(G)
        return qd - W.T @ np.linalg.solve(S, res)

    def accelerations(self, G, A, B, qd):
        """Accelerations and multipliers: what each condition pushes on body i."""
        w = np.append(qd[2::3], 0.0)
        bias = np.zeros(self.rows)
        m = 2 * len(self.i)
        bias[:m] = (B * w[self.j, None] ** 2 - A * w[self.i, None] ** 2).ravel()
        if self.drive:
            bias[-1] = -self.acceleration_of_drive
        W, S = self.push(G)
        multipliers = np.linalg.solve(S, -bias - W @ self.weight)
        return (self.weight + G.T @ multipliers) / self.M, multipliers

    def follow(self, q, qd, times, rtol=1e-12):
        """Coordinates and rates at times (ascending, from the start's on)."""
        if self.rows == self.size:
            qs, qds, now = [], [], times[0]
            for t in times:
                parts = max(1, int(np.ceil((t - now) / (times[-1] - times[0]) * 2000)))
                for at in np.linspace(now, t, parts + 1)[1:] if t > now else [t]:
                    q, G, _, _ = self.close(at, q)
                now = t
                qs.append(q)
                qds.append(self.close_rates(G, qd))
            return np.array(qs), np.array(qds)
        n = self.size

        def f(t, y):
            q, G, A, B = self.close(t, y[:n])
            qd = self.close_rates(G, y[n:])
            return np.concatenate([qd, self.accelerations(G, A, B, qd)[0]])

        speed = max(1e-12, abs(qd).max(), np.sqrt(abs(self.weight / self.M).max() * abs(q).max()))
        scale = np.concatenate([np.full(n, abs(q).max()), np.full(n, speed)])
        done = solve_ivp(f, (times[0], times[-1]), np.concatenate([q, qd]), "DOP853", times, rtol=rtol, atol=rtol * scale)
        if not done.success:
            raise RuntimeError(done.message)
        qs = [self.close(t, y[:n]) for t, y in zip(times, done.y.T)]
        return np.array([x[0] for x in qs]), np.array([self.close_rates(x[1], y[n:]) for x, y in zip(qs, done.y.T)])

    def energy(self, q, qd):
        return 0.5 * (self.M * qd * qd).sum(-1) - q @ self.weight
