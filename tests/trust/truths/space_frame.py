"""Linear finite elements of beams in space, for truths: Timoshenko's, with springs, bodies and supports. SI units, numpy alone."""
import numpy as np

from truths.formulas import rotate


def beam_element(L, m, s):
    """Stiffness and mass (12 x 12) of a straight beam along x: per end u v w, turns about x y z. m, s: scene.MATERIALS, section_of.

    m["tilting"] (1 where it is not said): what the inertia of its sections against bending is multiplied by."""
    E, rho = m["E"], m["rho"]
    G = E / (2 * (1 + m["poisson"]))
    K, M = np.zeros((12, 12)), np.zeros((12, 12))
    for at, k, mass in ((0, E * s["area"], rho * s["area"]), (3, G * s["j"], rho * (s["iy"] + s["iz"]))):
        i = np.ix_((at, at + 6), (at, at + 6))
        K[i] += k / L * np.array([[1, -1], [-1, 1]])
        M[i] += mass * L / 6 * np.array([[2, 1], [1, 2]])
    points, weights = np.polynomial.legendre.leggauss(4)
    # Deflection and slope v' = turn about z; w' = -turn about y.
    for at, sign, I, ks in (((1, 5, 7, 11), 1, s["iz"], s["shear_y"]), ((2, 4, 8, 10), -1, s["iy"], s["shear_z"])):
        EI = E * I
        phi = 12 * EI / (ks * G * s["area"] * L * L)
        signs = np.array([1, sign, 1, sign])
        k = np.array([[12, 6 * L, -12, 6 * L], [6 * L, (4 + phi) * L * L, -6 * L, (2 - phi) * L * L]])
        k = np.vstack([k, [-k[0]], [[6 * L, (2 - phi) * L * L, -6 * L, (4 + phi) * L * L]]]) * EI / (L**3 * (1 + phi))
        mm = np.zeros((4, 4))
        for xi, wi in zip((points + 1) / 2, weights / 2 * L):
            N = [
                1 - 3 * xi**2 + 2 * xi**3 + phi * (1 - xi),
                L * (xi - 2 * xi**2 + xi**3 + phi / 2 * (xi - xi**2)),
                3 * xi**2 - 2 * xi**3 + phi * xi,
                L * (xi**3 - xi**2 - phi / 2 * (xi - xi**2)),
            ]
            T = [6 * (xi**2 - xi) / L, 1 - 4 * xi + 3 * xi**2 + phi * (1 - xi), 6 * (xi - xi**2) / L, 3 * xi**2 - 2 * xi + phi * xi]
            mm += wi * rho * (s["area"] * np.outer(N, N) + m.get("tilting", 1.0) * I * np.outer(T, T)) / (1 + phi) ** 2
        K[np.ix_(at, at)] += np.outer(signs, signs) * k
        M[np.ix_(at, at)] += np.outer(signs, signs) * mm
    return K, M


class SpaceFrame:
    """Nodes with six displacements each. Vectors are in the world's axes."""

    def __init__(self):
        self.places, self.elements, self.points = [], [], []
        self.held = set()

    def node(self, place):
        self.places.append(np.array(place, float))
        return len(self.places) - 1

    def beam(self, first, last, s, m, axes, elements=8):
        """Elements between two nodes; axes: rotation whose columns are the beam's x, y, z. All nodes along it."""
        p, q = self.places[first], self.places[last]
        nodes = [first] + [self.node(p + (q - p) * k / elements) for k in range(1, elements)] + [last]
        length = float(np.linalg.norm(q - p)) / elements
        K, M = beam_element(length, m, s)
        T = np.kron(np.eye(4), np.asarray(axes).T)
        for a, b in zip(nodes, nodes[1:]):
            self.elements.append((a, b, T.T @ K @ T, T.T @ M @ T))
        return nodes

    def body(self, node, mass, J, centre=(0, 0, 0)):
        """A rigid body on a node; J (3 x 3 or 3 numbers) about its centre, which lies `centre` from the node."""
        X = arm(centre)
        M = X.T @ np.block([[mass * np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), np.diag(J) if np.ndim(J) == 1 else J]]) @ X
        self.points.append((node, np.zeros((6, 6)), M))

    def spring(self, node, K, at=(0, 0, 0)):
        """A spring (6 x 6, or 3 x 3 on displacements) to the ground, on a point `at` from the node."""
        full = np.zeros((6, 6))
        full[: len(K), : len(K)] = K
        X = arm(at)
        self.points.append((node, X.T @ full @ X, np.zeros((6, 6))))

    def hold(self, node, which=range(6)):
        self.held |= {6 * node + k for k in which}

    def matrices(self):
        """K, M of all degrees of freedom and those that are free."""
        n = 6 * len(self.places)
        K, M = np.zeros((n, n)), np.zeros((n, n))
        for a, b, k, m in self.elements:
            i = np.r_[6 * a : 6 * a + 6, 6 * b : 6 * b + 6]
            K[np.ix_(i, i)] += k
            M[np.ix_(i, i)] += m
        for a, k, m in self.points:
            i = slice(6 * a, 6 * a + 6)
            K[i, i] += k
            M[i, i] += m
        return K, M, np.array([i for i in range(n) if i not in self.held])

    def weight(self, gravity):
        """Forces (n) of an acceleration of gravity."""
        _, M, _ = self.matrices()
        return M @ np.tile(np.r_[gravity, 0, 0, 0], len(self.places))

    def along(self, nodes, load):
        """Forces (n) of a load per length (3 numbers) along the straight beam through these nodes."""
        f = np.zeros(6 * len(self.places))
        for a, b in zip(nodes, nodes[1:]):
            d = self.places[b] - self.places[a]
            moment = np.cross(d, load) * np.linalg.norm(d) / 12
            for node, sign in ((a, 1), (b, -1)):
                f[6 * node : 6 * node + 3] += np.asarray(load) * np.linalg.norm(d) / 2
                f[6 * node + 3 : 6 * node + 6] += sign * moment
        return f

    def at(self, node, force=(0, 0, 0), moment=(0, 0, 0), offset=(0, 0, 0)):
        """Forces (n) of a force and a moment on a point `offset` from a node."""
        f = np.zeros(6 * len(self.places))
        f[6 * node : 6 * node + 3] = force
        f[6 * node + 3 : 6 * node + 6] = np.asarray(moment) + np.cross(offset, force)
        return f

    def rest(self, f):
        """Displacements (nodes x 6) under forces (n)."""
        K, _, free = self.matrices()
        u = np.zeros(len(f))
        u[free] = np.linalg.solve(K[np.ix_(free, free)], f[free])
        return u.reshape(-1, 6)


def arm(offset):
    """Displacement of a point `offset` from a node from the node's (6 x 6)."""
    x, y, z = offset
    X = np.eye(6)
    X[:3, 3:] = -np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return X


def axes_of(turn):
    """Rotation of a rotation vector; columns x, y, z."""
    return rotate(turn)
