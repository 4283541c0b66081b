"""Motion of any rigid mechanism by the principle of virtual work, for truths: poses from coordinates, everything else by differentiation.

Bodies hang on joints in a tree, loops are closed by conditions with multipliers. Velocities of bodies are complex steps of their poses
along the coordinates (Squire, Trapp 1998), accelerations differences of these along the motion. numpy and scipy alone, SI units.
A rotation is described by its rotation vector, so turns in balls and free bodies stay below a full turn."""
import math

import numpy as np
from scipy.integrate import solve_ivp

STEP = 1e-30


def skew(v):
    """Cross-product matrices (..., 3, 3) of vectors (..., 3)."""
    K = np.zeros(v.shape[:-1] + (3, 3), v.dtype)
    K[..., 0, 1], K[..., 0, 2], K[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    return K - np.swapaxes(K, -1, -2)


def turn(v):
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3), real or complex."""
    square = (v * v).sum(-1)
    small = abs(square) < 1e-8
    a = np.sqrt(np.where(small, 1.0, square))
    s = np.where(small, 1 - square / 6 + square**2 / 120, np.sin(a) / a)
    c = np.where(small, 0.5 - square / 24 + square**2 / 720, (1 - np.cos(a)) / np.where(small, 1.0, square))
    K = skew(v)
    return np.eye(3) + s[..., None, None] * K + c[..., None, None] * (K @ K)


def turns_about(a, angle):
    """The same about one constant axis: angle (...)."""
    K = skew(a)
    return np.eye(3) + np.sin(angle)[..., None, None] * K + (1 - np.cos(angle))[..., None, None] * (K @ K)


def cross(a, b):
    """Cross product of two vectors, or of each row of a with b; numpy's own takes ten times as long."""
    return np.stack(
        [
            a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1],
            a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
            a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0],
        ],
        -1,
    )


def turn_vector(R):
    """Rotation vector of one rotation matrix, shorter than pi."""
    a = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    s, c = np.linalg.norm(a), (np.trace(R) - 1) / 2
    if s < 1e-9 and c < 0:
        w, V = np.linalg.eigh((R + R.T) / 2)
        return math.pi * V[:, -1]
    return a * (math.atan2(s, c) / s if s > 1e-12 else 1.0)


def cross_axes(axis):
    """The joint's x and y (SCENE.md): x is the coordinate axis least along the axis, made normal to it; y = axis times x."""
    e = np.eye(3)[int(np.argmin(np.round(abs(axis), 12)))]
    x = e - axis * (e @ axis)
    x /= np.linalg.norm(x)
    return x, cross(axis, x)


SIZES = {"weld": 0, "revolute": 1, "screw": 1, "prismatic": 1, "cylindrical": 2, "universal": 2}
SIZES |= {"constant-velocity": 2, "pin-slot": 2, "spherical": 3, "planar": 3, "free": 6}


class Joint:
    """The child's frame on the parent's. kind and axis as in a scene; position and rotation (vector) of the joint's parent frame."""

    def __init__(self, kind, axis=(0, 0, 1), position=(0, 0, 0), rotation=(0, 0, 0), pitch=0.0):
        self.kind, self.size, self.pitch = kind, SIZES[kind], pitch
        self.axis = np.array(axis, float) / np.linalg.norm(axis)
        self.x, self.y = cross_axes(self.axis)
        self.position, self.rotation = np.array(position, float), np.array(rotation, float)
        self.R = turn(self.rotation)

    def place(self, q):
        """Rotation (..., 3, 3) and place (..., 3) of the child's frame in the joint's parent frame."""
        k, a = self.kind, self.axis
        none = np.zeros(q.shape[:-1] + (3,), q.dtype)
        along = lambda i, v: q[..., i : i + 1] * v
        if k == "weld":
            return np.broadcast_to(np.eye(3), q.shape[:-1] + (3, 3)), none
        if k == "revolute":
            return turns_about(a, q[..., 0]), none
        if k == "screw":
            return turns_about(a, q[..., 0]), self.pitch * along(0, a)
        if k == "prismatic":
            return np.broadcast_to(np.eye(3), q.shape[:-1] + (3, 3)), along(0, a)
        if k == "cylindrical":
            return turns_about(a, q[..., 1]), along(0, a)
        if k == "universal":
            return turns_about(a, q[..., 0]) @ turns_about(self.x, q[..., 1]), none
        if k == "constant-velocity":
            return turn(along(0, self.x) + along(1, self.y)), none
        if k == "spherical":
            return turn(q[..., :3]), none
        if k == "pin-slot":
            return turns_about(a, q[..., 1]), along(0, self.x)
        if k == "planar":
            return turns_about(a, q[..., 2]), along(0, self.x) + along(1, self.y)
        return turn(q[..., 3:6]), q[..., :3]


class Body:
    def __init__(self, parent, at, joint, frame, mass, inertia, centre):
        """parent: number of the body or -1; at: the joint's place on it; frame: the joint's place on this body; inertia 3 x 3."""
        self.parent, self.at, self.joint, self.frame = parent, np.array(at, float), joint, np.array(frame, float)
        self.mass, self.inertia, self.centre = mass, np.array(inertia, float), np.array(centre, float)


class Mechanism:
    """Bodies in the order of the tree. loads(motion) -> list of (body, point in the body's axes, force, moment) in world axes.

    coordinate_loads(t, q, qd) -> generalised forces on the coordinates. conditions(R, p) -> residuals (..., c) of the loops."""

    def __init__(self, bodies, gravity=(0, 0, 0), loads=None, coordinate_loads=None, conditions=None):
        self.bodies, self.gravity = bodies, np.array(gravity, float)
        self.loads, self.coordinate_loads, self.conditions = loads, coordinate_loads, conditions
        self.first = np.cumsum([0] + [b.joint.size for b in bodies])
        self.size = int(self.first[-1])

    def poses(self, q):
        """Rotations (..., bodies, 3, 3) and places (..., bodies, 3) of the body frames."""
        R, p = [], []
        for b, at in zip(self.bodies, self.first):
            Rj, pj = b.joint.place(q[..., at : at + b.joint.size])
            base, origin = (np.eye(3), np.zeros(3)) if b.parent < 0 else (R[b.parent], p[b.parent])
            Rf = base @ b.joint.R
            Rb = Rf @ Rj
            x = b.at + b.joint.position
            origin = origin + (base @ x[:, None])[..., 0] + (Rf @ pj[..., None])[..., 0]
            R.append(Rb)
            p.append(origin - (Rb @ b.frame[:, None])[..., 0])
        return np.stack(R, -3), np.stack(p, -2)

    def rates(self, q, directions):
        """Velocities of the body frames for rates (k, n): linear (k, bodies, 3), angular, and of the conditions (k, c)."""
        R, p = self.poses(q + 1j * STEP * directions)
        v = p.imag / STEP
        S = (R.imag / STEP) @ np.swapaxes(R.real, -1, -2)
        w = np.stack([S[..., 2, 1], S[..., 0, 2], S[..., 1, 0]], -1)
        c = self.conditions(R, p).imag / STEP if self.conditions else None
        return v, w, c, R.real, p.real

    def motion(self, t, q, qd):
        """Everything at one instant: rates' columns, poses, velocities, the accelerations that belong to qdd = 0."""
        n = self.size
        h = 2e-3 / max(1.0, np.linalg.norm(qd, np.inf))
        # Columns of the velocities, then the velocity itself and four of its neighbours along the motion.
        points = np.repeat(q[None, :], n + 5, 0)
        directions = np.vstack([np.eye(n), np.repeat(qd[None, :], 5, 0)])
        for row, k in enumerate((0, -2, -1, 1, 2)):
            points[n + row] += k * h * qd
        v, w, c, R, p = self.rates(points, directions)
        slope = lambda a: (a[n + 1] - 8 * a[n + 2] + 8 * a[n + 3] - a[n + 4]) / (12 * h)
        return {
            "t": t,
            "q": q,
            "qd": qd,
            "R": R[n],
            "p": p[n],
            "Jv": v[:n],
            "Jw": w[:n],
            "Jc": c[:n] if c is not None else None,
            "v": v[n],
            "w": w[n],
            "bv": slope(v),
            "bw": slope(w),
            "bc": slope(c) if c is not None else None,
        }

    def wrenches(self, m):
        """Force and moment about the body's origin on each body by loads and weight, world axes (bodies, 3)."""
        F, T = np.zeros((len(self.bodies), 3)), np.zeros((len(self.bodies), 3))
        for i, b in enumerate(self.bodies):
            F[i] += b.mass * self.gravity
            T[i] += cross(m["R"][i] @ b.centre, b.mass * self.gravity)
        for body, point, f, moment in self.loads(m) if self.loads else []:
            if body >= 0:
                F[body] += f
                T[body] += cross(m["R"][body] @ np.asarray(point, float), f) + moment
        return F, T

    def inertia_wrench(self, i, m, a, alpha):
        """Rate of momentum of body i and of its moment about the body's origin, for accelerations of that origin."""
        b, R, w = self.bodies[i], m["R"][i], m["w"][i]
        r = R @ b.centre
        I = R @ b.inertia @ R.T
        f = b.mass * (a + cross(alpha, r) + cross(w, cross(w, r)))
        return f, I @ alpha + cross(w, I @ w) + cross(r, f)

    def solve(self, m):
        """qdd and the loops' multipliers."""
        n, F, T = self.size, *self.wrenches(m)
        M, Q = np.zeros((n, n)), np.zeros(n)
        if self.coordinate_loads:
            Q += self.coordinate_loads(m["t"], m["q"], m["qd"])
        for i, b in enumerate(self.bodies):
            R = m["R"][i]
            r = R @ b.centre
            Jc = m["Jv"][:, i] + cross(m["Jw"][:, i], r)
            M += b.mass * Jc @ Jc.T + m["Jw"][:, i] @ (R @ b.inertia @ R.T) @ m["Jw"][:, i].T
            f, moment = self.inertia_wrench(i, m, m["bv"][i], m["bw"][i])
            Q += m["Jv"][:, i] @ (F[i] - f) + m["Jw"][:, i] @ (T[i] - moment)
        if self.conditions is None:
            return np.linalg.solve(M, Q), np.zeros(0)
        # Rows may repeat one another: the smallest change of the free motion that keeps them (Udwadia, Kalaba 1992).
        L = np.linalg.cholesky(M)
        A = np.linalg.solve(L, m["Jc"]).T
        free = np.linalg.solve(M, Q)
        multipliers = np.linalg.lstsq(A @ A.T, -m["bc"] - m["Jc"].T @ free, rcond=1e-9)[0]
        return free + np.linalg.solve(M, m["Jc"] @ multipliers), multipliers

    def follow(self, q, qd, times, rtol=1e-7, atol=1e-10):
        """Coordinates and rates at times, with everything that instants() tells of them."""
        n = self.size

        def f(t, y):
            return np.concatenate([y[n:], self.solve(self.motion(t, y[:n], y[n:]))[0]])

        done = solve_ivp(f, (times[0], times[-1]), np.concatenate([q, qd]), "DOP853", times, rtol=rtol, atol=atol)
        if not done.success:
            raise RuntimeError(done.message)
        return done.y[:n].T, done.y[n:].T

    def farthest_turn(self, qs):
        """Longest rotation vector of the balls and free bodies in coordinates (times, n)."""
        longest = 0.0
        for b, at in zip(self.bodies, self.first):
            if b.joint.kind in ("spherical", "free", "constant-velocity"):
                v = qs[:, at + b.joint.size - (2 if b.joint.kind == "constant-velocity" else 3) : at + b.joint.size]
                longest = max(longest, float(np.linalg.norm(v, axis=1).max()))
        return longest

    def instants(self, qs, qds, times):
        """For each time: the motion with accelerations "a", "alpha" of the body frames and "qdd"."""
        for t, q, qd in zip(times, qs, qds):
            m = self.motion(t, q, qd)
            m["qdd"], m["multipliers"] = self.solve(m)
            m["a"] = np.tensordot(m["qdd"], m["Jv"], 1) + m["bv"]
            m["alpha"] = np.tensordot(m["qdd"], m["Jw"], 1) + m["bw"]
            yield m

    def reaction(self, i, m):
        """Force and moment of joint i on its child about the joint's place on the child, world axes. Trees only."""
        F, T = self.wrenches(m)
        beyond = {i}
        for k in range(i + 1, len(self.bodies)):
            if self.bodies[k].parent in beyond:
                beyond.add(k)
        place = m["p"][i] + m["R"][i] @ self.bodies[i].frame
        force, moment = np.zeros(3), np.zeros(3)
        for k in beyond:
            f, t = self.inertia_wrench(k, m, m["a"][k], m["alpha"][k])
            force += f - F[k]
            moment += t - T[k] + cross(m["p"][k] - place, f - F[k])
        return np.concatenate([force, moment])
