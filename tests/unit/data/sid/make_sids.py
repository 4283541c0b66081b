#!/usr/bin/env python3
"""Makes the SID files of this folder again: the same physics in every dialect of SID text that is found in practice, and truth.txt beside
them.

Needs numpy. python3 make_sids.py

Everything is computed here from its definition and by nothing of the program that reads it: a beam or rod is a cloud of particles (Gauss
points along the axis and over the section) that move with the displacement field u = phi(x) q + 1/2 q' phi2(x) q, and each block of the
file is the sum over the particles that Wallrapp (1994) and Schwertassek, Wallrapp (1999) define it to be. truth.txt holds these sums at
full precision in the form in which they are defined (not in that of any dialect), frequencies by closed theory or by numpy's eigenvalues.

blocked.SID_FEM: steel beam of 2.5 m on supports, bending in both planes and twist, 4 modes; 'new modal =' without a name, numbers with D,
  Gr blocked per mode, Ge interleaved, Me unit.
lumped.SID_FEM: rod of 1 m, one bending mode; its mass lies in three points, more than the mode's own mass allows; the same, of one mode:
  no layout to be told.
tabs.SID_FEM: clamped beam, 3 modes, turned node axes; tabs in the header and trailing blanks, Ke symmetric with one triangle written.
reduced.SID_FEM: free straight beam, 8 shapes that are no eigenmodes; 'new modal' alone, mCM and mmi for mdCM and J, E exponents, Ct of
  order 1 without entries, full Me, Gr and Ge interleaved.
stiffened.SID_FEM: clamped beam, 2 modes with second-order displacements, pre-stress, stress modes; phi of order 1, Ct and Oe of order 1,
  sigma, a block that nobody knows, a name behind 'new modal ='.
swapped.SID_FEM: the beam of blocked.SID_FEM; first-order entries as (row, column, mode), J 3 x 3, Gr and Ge blocked, no blanks, CR LF.
"""
import pathlib

import numpy as np

HERE = pathlib.Path(__file__).parent
TENSOR = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # J: 11 22 33 12 13 23
OE = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))  # Oe: wx^2 wy^2 wz^2 wx wy, wy wz, wx wz


def cross(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


class Body:
    """Particles with mass m[i] at c[i], displacements phi[i] (3 x n) and second-order phi2[i] (3 x n x n); Me, Ke, De, ksigma as given."""

    def __init__(self, m, c, phi, Me, Ke, De, phi2=None, ksigma=None, structural=None):
        self.n = n = phi.shape[2]
        self.m, self.c, self.phi = m, c, phi
        self.phi2 = np.zeros((len(m), 3, n, n)) if phi2 is None else phi2
        self.stiffened = phi2 is not None
        self.Me, self.Ke, self.De = Me, Ke, De
        self.ksigma = np.zeros(n) if ksigma is None else ksigma
        self.labels, self.nodes, self.comment, self.name = [], [], "", ""
        self.mass = m.sum()
        self.md0 = np.einsum("i,ia->a", m, c)
        self.md1 = np.einsum("i,iak->ak", m, phi)
        self.md2 = np.einsum("i,iajk->ajk", m, self.phi2)

        # Inertia tensor of particles at r: sum m (r.r 1 - r r').
        def tensor(a, b, *letters):
            """sum m (a.b 1 - (a b' + b a')/2), of fields a, b with trailing letters of modes."""
            one, two = letters
            dot = np.einsum("i,ia%s,ia%s->%s%s" % (one, two, one, two), m, a, b)
            pair = np.einsum("i,ia%s,ib%s->ab%s%s" % (one, two, one, two), m, a, b)
            pair2 = np.einsum("i,ia%s,ib%s->ba%s%s" % (one, two, one, two), m, a, b)
            return np.einsum("ab,...->ab...", np.eye(3), dot) - (pair + pair2) / 2

        J0, J1, Jpp = tensor(c, c, "", ""), 2 * tensor(c, phi, "", "j"), 2 * tensor(phi, phi, "j", "k")
        Jc2 = 2 * tensor(c, self.phi2, "", "jk")
        self.J0 = np.array([J0[a, b] for a, b in TENSOR])
        self.J1 = np.array([J1[a, b] for a, b in TENSOR])
        self.J2 = np.array([(Jpp + Jc2)[a, b] for a, b in TENSOR])
        # Angular momentum of an elastic rate: sum m r x phi_j; its part linear in q_k.
        eps = np.zeros((3, 3, 3))
        for a, b, d, s in ((0, 1, 2, 1), (1, 2, 0, 1), (2, 0, 1, 1), (0, 2, 1, -1), (2, 1, 0, -1), (1, 0, 2, -1)):
            eps[a, b, d] = s
        self.Cr0 = np.einsum("abd,i,ib,idj->aj", eps, m, c, phi)
        self.Cr1 = np.einsum("abd,i,ibk,idj->ajk", eps, m, phi, phi) + np.einsum("abd,i,ib,idjk->ajk", eps, m, c, self.phi2)
        # Gyroscopic blocks as Wallrapp defines them: Gr_j = -2 sum m c~ phi~_j (3 x 3), Ge_j = -2 sum m phi' phi~_j (n x 3).
        self.Gr = [sum(-2 * m[i] * cross(c[i]) @ cross(phi[i][:, j]) for i in range(len(m))) for j in range(n)]
        self.Ge = [sum(-2 * m[i] * phi[i].T @ cross(phi[i][:, j]) for i in range(len(m))) for j in range(n)]

        # Oe: what the frame's rotation does to the modes: sum m phi_j' w~ w~ r, columns by products of w.
        def centrifugal(r):
            out = np.zeros((n, 6))
            for k, (a, b) in enumerate(OE):
                A = np.zeros((3, 3))
                A[a, b] += 0.5
                A[b, a] += 0.5
                W = (A - np.trace(A) * np.eye(3)) * (1 if a == b else 2)
                out[:, k] = np.einsum("i,iaj,ab,ib->j", m, phi, W, r)
            return out

        self.Oe0 = centrifugal(c)
        self.Oe1 = np.stack([centrifugal(phi[:, :, k]) for k in range(n)])  # mode, row, column
        if self.stiffened:
            for k in range(n):
                for col, (a, b) in enumerate(OE):
                    A = np.zeros((3, 3))
                    A[a, b] += 0.5
                    A[b, a] += 0.5
                    W = (A - np.trace(A) * np.eye(3)) * (1 if a == b else 2)
                    self.Oe1[k, :, col] += np.einsum("i,iaj,ab,ib->j", m, self.phi2[:, :, :, k], W, c)

    def node(self, ident, origin, phi, psi, rotation=None, phi2=None, sigma=None):
        self.nodes.append((ident, np.array(origin, float), phi, psi, np.eye(3) if rotation is None else rotation, phi2, sigma))


class Writer:
    """SID text of one dialect. order: 'rkc' or 'rck'; gyro: layouts of Gr and Ge, 'i' interleaved or 'b' blocked."""

    def __init__(
        self,
        body,
        head="",
        modal="      new modal                                 =",
        exponent="D",
        gyro="ib",
        order="rkc",
        J33=False,
        names=("mdCM", "J"),
        digits=11,
        trailing=" ",
        eol="\n",
        tight=False,
        empty_Ct=False,
        Me_unit=False,
        extra=(),
        higher=(),
    ):
        self.b, self.lines = body, []
        self.exponent, self.order, self.digits, self.trailing, self.eol, self.tight = exponent, order, digits, trailing, eol, tight
        b, n = body, body.n
        self.lines += [
            head % (len(b.nodes), n),
            " part" + trailing,
            modal,
            "           refmod" + trailing,
            "                mass                            = " + self.number(b.mass),
            "                nelastq                         =     %d" % n,
        ]
        self.lines += ["                ielastq (%4d)                  = %s" % (k + 1, b.labels[k]) for k in range(n)]
        self.lines += ["           end refmod" + trailing, "           frame" + trailing]
        for ident, origin, phi, psi, ap, phi2, sigma in b.nodes:
            self.lines += [
                "                new node                        =    %s" % ident,
                "                     rframe                     =    body ref",
            ]
            self.block("origin", origin[:, None], [phi[:, [k]] for k in range(n)], depth=21)
            self.block("phi", phi, [] if phi2 is None else [phi2[:, :, k] for k in range(n)], depth=21)
            self.block("psi", psi, [], depth=21)
            self.block("AP", ap, [cross(psi[:, k]) @ ap for k in range(n)], depth=21)
            if sigma is not None:
                self.block("sigma", np.zeros((6, 1)), [sigma[:, [k]] for k in range(n)], depth=21)
            self.lines.append("                end node" + trailing)
        self.lines.append("           end frame" + trailing)
        self.block(names[0], b.md0[:, None], [b.md1[:, [k]] for k in range(n)])
        if J33:
            full = lambda six: np.array([[six[0], six[3], six[4]], [six[3], six[1], six[5]], [six[4], six[5], six[2]]])
            self.block(names[1], full(b.J0), [full(b.J1[:, k]) for k in range(n)])
        else:
            self.block(names[1], b.J0[:, None], [b.J1[:, [k]] for k in range(n)])
        if empty_Ct:
            self.block("Ct", np.zeros((n, 3)), [np.zeros((n, 3))] * n, structure=3)
        else:
            self.block("Ct", b.md1.T, [b.md2[:, :, k].T for k in range(n)] if b.stiffened else [])
        self.block("Cr", b.Cr0.T, [b.Cr1[:, :, k].T for k in range(n)])
        self.block("Me", b.Me, [], structure=4 if Me_unit else 2)
        for name, parts, layout in (("Gr", b.Gr, gyro[0]), ("Ge", b.Ge, gyro[1])):
            rows = parts[0].shape[0]
            flat = np.zeros((rows, 3 * n))
            for j in range(n):
                for c in range(3):
                    flat[:, n * c + j if layout == "i" else 3 * j + c] = parts[j][:, c]
            self.block(name, flat, [])
        self.block("Oe", b.Oe0, [b.Oe1[k] for k in range(n)])
        self.block("ksigma", b.ksigma[:, None], [])
        self.lines += list(extra)
        self.block("Ke", b.Ke, [], structure=2 if np.count_nonzero(b.Ke - np.diag(np.diag(b.Ke))) else 1)
        self.block("De", b.De, [], structure=2 if np.count_nonzero(b.De - np.diag(np.diag(b.De))) else 1)
        self.lines += ["      end modal" + trailing, " end part" + trailing]

    def number(self, v):
        return ("%*.*E" % (self.digits + 7, self.digits, v)).replace("E", self.exponent)

    def block(self, name, m0, m1, depth=11, structure=3):
        pad = " " * depth
        pair = "%s%-27s= %4d"
        if structure == 3 and not np.any(m0) and not any(np.any(m) for m in m1):
            structure = 0
        self.lines.append(pad + name + self.trailing)
        for key, value in (
            ("order", 1 if m1 else 0),
            ("nrow", m0.shape[0]),
            ("ncol", m0.shape[1]),
            ("nq", self.b.n),
            ("nqn", 0),
            ("structure", structure),
        ):
            self.lines.append(("%s     %-22s= %4d" % (pad, key, value)) if not self.tight else "%s=%d" % (key, value))

        def put(index, value):
            if self.tight:
                self.lines.append("\t%s=%s" % (index.replace(" ", ""), self.number(value).strip()))
            else:
                self.lines.append("%s     %-22s=%s" % (pad, index, self.number(value)))

        if structure != 4:
            for r in range(m0.shape[0]):
                for c in range(m0.shape[1]):
                    if m0[r, c] and not (structure == 2 and c > r):
                        put("m0(%2d,%2d)" % (r + 1, c + 1), m0[r, c])
        for k, m in enumerate(m1):
            for r in range(m.shape[0]):
                for c in range(m.shape[1]):
                    if m[r, c]:
                        a, b = (k + 1, c + 1) if self.order == "rkc" else (c + 1, k + 1)
                        put("m1(%2d,%2d,%2d)" % (r + 1, a, b), m[r, c])
        self.lines.append(pad + "end " + name + self.trailing)

    def text(self):
        return self.eol.join(self.lines) + self.eol


def beam(length, width, height, rho, shapes, panels=24):
    """Particles of a beam along x and functions of its modes. shapes: a list of (kind, w, w', w'') with kind 'y', 'z' (bending), 'x'
    (twist), 'u' (stretch)."""
    g, w = np.polynomial.legendre.leggauss(4)
    xs = np.concatenate([(p + (g + 1) / 2) * length / panels for p in range(panels)])
    ws = np.tile(w / 2 * length / panels, panels)
    g2, w2 = np.polynomial.legendre.leggauss(2)
    m, c, phi = [], [], []
    for x, wx in zip(xs, ws):
        for gy, wy in zip(g2, w2):
            for gz, wz in zip(g2, w2):
                y, z = gy * width / 2, gz * height / 2
                m.append(rho * wx * wy / 2 * width * wz / 2 * height)
                c.append((x, y, z))
                phi.append(field(shapes, x, y, z))
    return np.array(m), np.array(c), np.array(phi)


def field(shapes, x, y, z):
    """Displacement of a particle of the section at x, plane sections, 3 x n."""
    u = np.zeros((3, len(shapes)))
    for k, (kind, w, dw, _) in enumerate(shapes):
        if kind == "y":
            u[:, k] = (-y * dw(x), w(x), 0)
        elif kind == "z":
            u[:, k] = (-z * dw(x), 0, w(x))
        elif kind == "x":
            u[:, k] = (0, -z * w(x), y * w(x))
        else:
            u[:, k] = (w(x), 0, 0)
    return u


def turn(shapes, x):
    psi = np.zeros((3, len(shapes)))
    for k, (kind, w, dw, _) in enumerate(shapes):
        if kind == "y":
            psi[2, k] = dw(x)
        elif kind == "z":
            psi[1, k] = -dw(x)
        elif kind == "x":
            psi[0, k] = w(x)
    return psi


def scaled(shape, s):
    kind, w, dw, ddw = shape
    return (kind, lambda x: s * w(x), lambda x: s * dw(x), lambda x: s * ddw(x))


def sine(kind, n, length):
    a = n * np.pi / length
    return (kind, lambda x: np.sin(a * x), lambda x: a * np.cos(a * x), lambda x: -a * a * np.sin(a * x))


def clamped(kind, k, length):
    lam = (1.875104068711961, 4.694091132974174)[k] / length
    s = (np.sinh(lam * length) - np.sin(lam * length)) / (np.cosh(lam * length) + np.cos(lam * length))
    return (
        kind,
        lambda x: np.cosh(lam * x) - np.cos(lam * x) - s * (np.sinh(lam * x) - np.sin(lam * x)),
        lambda x: lam * (np.sinh(lam * x) + np.sin(lam * x) - s * (np.cosh(lam * x) - np.cos(lam * x))),
        lambda x: lam**2 * (np.cosh(lam * x) + np.cos(lam * x) - s * (np.sinh(lam * x) + np.sin(lam * x))),
    )


def power(kind, p, length):
    return (
        kind,
        lambda x: (x / length) ** p,
        lambda x: p * x ** (p - 1) / length**p,
        lambda x: p * (p - 1) * x ** max(p - 2, 0) / length**p,
    )


def stiffness(shapes, length, E, G, Iy, Iz, J, A):
    """Ke by Gauss integration of EI w'' w'', EA u' u', GJ theta' theta'."""
    g, w = np.polynomial.legendre.leggauss(40)
    xs, ws = (g + 1) / 2 * length, w / 2 * length
    n = len(shapes)
    K = np.zeros((n, n))
    for a in range(n):
        for b in range(n):
            if shapes[a][0] != shapes[b][0]:
                continue
            kind = shapes[a][0]
            order, factor = (3, E * Iz if kind == "y" else E * Iy) if kind in "yz" else (2, G * J if kind == "x" else E * A)
            K[a, b] = factor * sum(wx * shapes[a][order](x) * shapes[b][order](x) for x, wx in zip(xs, ws))
    return (K + K.T) / 2


def normalised(shapes, length, width, height, rho):
    """Each shape scaled to a modal mass of 1."""
    m, c, phi = beam(length, width, height, rho, shapes)
    return [scaled(s, 1 / np.sqrt(np.einsum("i,ia,ia->", m, phi[:, :, k], phi[:, :, k]))) for k, s in enumerate(shapes)]


def mode_labels(K, M):
    f = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real) / (2 * np.pi)
    return sorted(f)


def torsion(b, h):
    """St. Venant's constant of a rectangle, sides b >= h, by its series (Timoshenko, Goodier 1970, art. 109)."""
    b, h = max(b, h), min(b, h)
    return b * h**3 / 3 * (1 - 192 / np.pi**5 * h / b * sum(np.tanh(n * np.pi * b / (2 * h)) / n**5 for n in range(1, 41, 2)))


TRUTH = []


def truth(name, body, frequencies):
    """Blocks of a body, a block a line: file, block, rows, columns, numbers by columns."""

    def put(block, a):
        a = np.atleast_2d(np.asarray(a, float))
        TRUTH.append("%s %s %d %d %s" % (name, block, a.shape[0], a.shape[1], " ".join("%.17g" % v for v in a.T.ravel())))

    put("mass", [[body.mass]])
    put("md0", body.md0[:, None])
    put("md1", body.md1)
    put("J0", body.J0[:, None])
    put("J1", body.J1)
    put("Cr0", body.Cr0)
    for a in range(6):
        put("J2_%d" % a, body.J2[a])
    for a in range(3):
        put("Cr1_%d" % a, body.Cr1[a])
        if body.stiffened:
            put("md2_%d" % a, body.md2[a])
    put("Me", body.Me)
    put("Ke", body.Ke)
    put("De", body.De)
    put("ksigma", body.ksigma[:, None])
    put("frequencies", np.array(frequencies)[:, None])
    for i, (ident, origin, phi, psi, ap, phi2, sigma) in enumerate(body.nodes):
        put("node%d_origin" % i, origin[:, None])
        put("node%d_phi" % i, phi)
        put("node%d_psi" % i, psi)
        put("node%d_rotation" % i, ap)
        if phi2 is not None:
            for a in range(3):
                put("node%d_phi2_%d" % (i, a), phi2[a])
        if sigma is not None:
            put("node%d_sigma" % i, sigma)


def supported():
    """Steel beam of 2.5 m x 0.08 m x 0.2 m on supports: two modes across y, one across z, one of twist; closed theory with the section's
    rotary inertia."""
    L, b, h, rho, E, G = 2.5, 0.08, 0.2, 7850.0, 2.1e11, 8e10
    A, Iz, Iy, J = b * h, h * b**3 / 12, b * h**3 / 12, torsion(b, h)
    shapes = normalised([sine("y", 1, L), sine("z", 1, L), sine("y", 2, L), sine("x", 1, L)], L, b, h, rho)
    m, c, phi = beam(L, b, h, rho, shapes)
    K = stiffness(shapes, L, E, G, Iy, Iz, J, A)
    # Rayleigh's beam on supports: omega^2 = EI a^4 / (rho A + rho I a^2); a rod in twist: omega^2 = GJ a^2 / rho (Iy + Iz).
    a = np.pi / L
    closed = [np.sqrt(E * I * (n * a) ** 4 / (rho * A + rho * I * (n * a) ** 2)) / (2 * np.pi) for I, n in ((Iz, 1), (Iy, 1), (Iz, 2))]
    closed.append(np.sqrt(G * J * a**2 / (rho * (Iy + Iz))) / (2 * np.pi))
    assert np.allclose(np.sqrt(np.diag(K)) / (2 * np.pi), closed, rtol=1e-9), (np.sqrt(np.diag(K)) / (2 * np.pi), closed)
    body = Body(m, c, phi, np.eye(4), np.diag(np.diag(K)), np.diag(0.02 * np.sqrt(np.diag(K))))
    body.labels = ["Eigen Mode %4d : %12.3f Hz" % (k + 1, f) for k, f in enumerate(closed)]
    for i in range(21):
        x = L * (1 - i / 20)
        y, z = (b / 2, -h / 2) if i % 3 else (0, 0)
        body.node(1000 - 7 * i, (x, y, z), field(shapes, x, y, z), turn(shapes, x))
    return body, sorted(closed)


def main():
    head = "%5d %3d    :No. nodes, No. modes: "
    # Blocked Gr, the interleaved Ge that such files have.
    body, f = supported()
    (HERE / "blocked.SID_FEM").write_text(Writer(body, head=head + "no geometric stiffness", gyro="bi", Me_unit=True).text())
    truth("blocked", body, f)
    (HERE / "swapped.SID_FEM").write_bytes(
        Writer(
            body,
            head=head + "indices row, column, mode",
            gyro="bb",
            order="rck",
            J33=True,
            tight=True,
            eol="\r\n",
            trailing="",
            modal=" New Modal = rod",
            Me_unit=True,
        )
        .text()
        .encode()
    )
    truth("swapped", body, f)

    # One mode of a clamped rod, its mass in three points: m phi^2 there is more than the modal mass 1 of the finer model.
    L, s, rho, E = 1.0, 0.01, 7850.0, 2.1e11
    shape = normalised([clamped("y", 0, L)], L, s, s, rho)
    K = stiffness(shape, L, E, 8e10, s**4 / 12, s**4 / 12, 0.141 * s**4, s * s)
    m = rho * s * s * L * np.array([0.25, 0.25, 0.5])
    c = np.array([(x, 0, 0) for x in (0, L / 2, L)])
    phi = np.array([field(shape, *p) for p in c])
    one = Body(m, c, phi, np.eye(1), K, 0.01 * K)
    f1 = 1.875104068711961**2 / (2 * np.pi * L * L) * np.sqrt(E * s * s / 12 / rho)
    one.labels = ["Eigen Mode    1 : %12.3f Hz" % f1]
    for i, p in enumerate(c):
        one.node(11 + i, p, phi[i], turn(shape, p[0]))
    (HERE / "lumped.SID_FEM").write_text(Writer(one, head=head + "three masses", gyro="ii", Me_unit=True).text())
    rayleigh = np.sqrt(K[0, 0]) / (2 * np.pi)  # of that shape with the sections' rotary inertia
    assert abs(rayleigh - f1) < 1e-4 * f1, (rayleigh, f1)
    truth("lumped", one, [rayleigh])

    # A clamped beam, three modes, node axes turned; tabs and blanks.
    L, b, h, rho, E, G = 0.8, 0.03, 0.05, 2700.0, 7e10, 2.6e10
    shapes = [clamped("y", 0, L), clamped("z", 0, L), power("u", 1, L)]
    m, c, phi = beam(L, b, h, rho, shapes)
    M = np.einsum("i,iaj,iak->jk", m, phi, phi)
    K = stiffness(shapes, L, E, G, b * h**3 / 12, h * b**3 / 12, torsion(b, h), b * h)
    C = np.linalg.cholesky(M)
    T = np.linalg.inv(C).T  # shapes combined so that the mass matrix is unit and Ke is full
    R = np.linalg.qr(np.array([[1, 0.2, 0.1], [0.1, 1, -0.3], [0, 0.2, 1.0]]))[0]
    T = T @ R
    cart = Body(m, c, phi @ T, np.eye(3), T.T @ K @ T, np.diag([30.0, 40.0, 50.0]))
    cart.Ke = (cart.Ke + cart.Ke.T) / 2
    cart.labels = ["shape %d" % (k + 1) for k in range(3)]
    for i, p in enumerate([(0, 0, 0), (L / 2, b / 2, 0), (L, 0, 0), (L, 0, h / 2)]):
        a = 0.3 * i
        ap = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1.0]])
        cart.node((1, 12, 144, 7)[i], p, field(shapes, *p) @ T, turn(shapes, p[0]) @ T, ap)
    f = mode_labels(cart.Ke, cart.Me)
    (HERE / "tabs.SID_FEM").write_text(
        Writer(cart, head="\t%d\t%d\t:No. nodes,\tNo. modes:\ttabs", gyro="ii", trailing="     ", Me_unit=True).text()
    )
    truth("tabs", cart, f)

    # A free beam about its middle in shapes that are no eigenmodes: Me and Ke full.
    L, b, h, rho, E, G = 2.0, 0.06, 0.1, 7850.0, 2.1e11, 8e10
    shift = lambda s: (s[0], lambda x, s=s: s[1](x + L / 2), lambda x, s=s: s[2](x + L / 2), lambda x, s=s: s[3](x + L / 2))
    shapes = [
        sine("y", 1, L),
        sine("z", 1, L),
        power("x", 1, L),
        sine("y", 2, L),
        sine("z", 2, L),
        power("u", 1, L),
        sine("y", 3, L),
        sine("z", 3, L),
    ]
    m, c, phi = beam(L, b, h, rho, shapes)
    c = c - np.array([L / 2, 0, 0])
    # Without rigid motion: what the shapes carry of it is taken out (mean axes), so that Ct and Cr vanish.
    rigid = np.zeros((len(m), 3, 6))
    for i in range(len(m)):
        rigid[i, :, :3] = np.eye(3)
        rigid[i, :, 3:] = -cross(c[i])
    RM = np.einsum("i,iaj,iak->jk", m, rigid, rigid)
    share = np.linalg.solve(RM, np.einsum("i,iaj,iak->jk", m, rigid, phi))
    phi = phi - rigid @ share
    M = np.einsum("i,iaj,iak->jk", m, phi, phi)
    K = stiffness(shapes, L, E, G, b * h**3 / 12, h * b**3 / 12, torsion(b, h), b * h)
    M, K = np.where(abs(M) > 1e-12 * abs(M).max(), M, 0), np.where(abs(K) > 1e-12 * abs(K).max(), K, 0)
    free = Body(m, c, phi, M, K, 1e-5 * K)
    for a in (free.md0, free.md1, free.Cr0, free.J1):
        a[abs(a) < 1e-9] = 0.0  # rounding of the sums; printed, it would be an entry
    free.labels = ["shape function %d" % (k + 1) for k in range(8)]
    for ident, x in ((1, 0.0), (2, L)):
        p = np.array([x - L / 2, 0, 0])
        at = np.zeros((3, 6))
        at[:, :3] = np.eye(3)
        at[:, 3:] = -cross(p)
        rotation = np.zeros((3, 6))
        rotation[:, 3:] = np.eye(3)
        free.node(ident, p, field(shapes, x, 0, 0) - at @ share, turn(shapes, x) - rotation @ share)
    (HERE / "reduced.SID_FEM").write_text(
        Writer(
            free,
            head=head + "Geo_Stiff=no",
            modal="      new modal",
            exponent="E",
            gyro="ii",
            names=("mCM", "mmi"),
            trailing="",
            empty_Ct=True,
        ).text()
    )
    truth("reduced", free, mode_labels(K, M))

    # Second-order displacements of bending (foreshortening), pre-stress and stress at nodes.
    L, b, h, rho, E, G = 1.0, 0.02, 0.03, 2700.0, 7e10, 2.6e10
    shapes = normalised([clamped("y", 0, L), clamped("z", 0, L)], L, b, h, rho)
    m, c, phi = beam(L, b, h, rho, shapes)
    K = stiffness(shapes, L, E, G, b * h**3 / 12, h * b**3 / 12, torsion(b, h), b * h)
    K = np.diag(np.diag(K))
    g, w = np.polynomial.legendre.leggauss(40)

    def shortening(x):
        """u_x = -1/2 int_0^x (v'^2 + w'^2): 1/2 q' phi2 q."""
        out = np.zeros((3, 2, 2))
        for k in range(2):
            out[0, k, k] = -sum(wi / 2 * x * shapes[k][2]((gi + 1) / 2 * x) ** 2 for gi, wi in zip(g, w))
        return out

    table = {x: shortening(x) for x in sorted(set(c[:, 0]))}
    stiff = Body(m, c, phi, np.eye(2), K, 0.01 * np.sqrt(K), phi2=np.array([table[p[0]] for p in c]), ksigma=np.array([3.5, -1.25]))
    stiff.labels = ["Eigen Mode %4d : %12.3f Hz" % (k + 1, np.sqrt(K[k, k]) / (2 * np.pi)) for k in range(2)]
    for i, x in enumerate((0.25, 0.5, 1.0)):
        y, z = (b / 2, h / 2) if i < 2 else (0, 0)
        sigma = np.zeros((6, 2))
        sigma[0] = (-E * y * shapes[0][3](x), -E * z * shapes[1][3](x))
        stiff.node("tip" if i == 2 else 10 * (i + 1), (x, y, z), field(shapes, x, y, z), turn(shapes, x), phi2=shortening(x), sigma=sigma)
    (HERE / "stiffened.SID_FEM").write_text(
        Writer(
            stiff,
            head=head + "Geo_Stiff=yes",
            modal="      new modal                                 = strut",
            gyro="ii",
            digits=14,
            Me_unit=True,
            extra=["           K0omega", "              m0(1,1) = 3.0", "           end K0omega"],
        ).text()
    )
    truth("stiffened", stiff, sorted(np.sqrt(np.diag(K)) / (2 * np.pi)))
    (HERE / "truth.txt").write_text("\n".join(TRUTH) + "\n")
    for path in sorted(HERE.glob("*.SID_FEM")) + [HERE / "truth.txt"]:
        print(path.name, path.stat().st_size, "bytes")


main()
