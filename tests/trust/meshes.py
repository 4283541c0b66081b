"""Estimated errors of meshes against true ones:  meshes.py FLEXFRAME [--count N] [--seed S] [--number N] [--kind KIND]

Random bars, plates and beams, tapered, bent, twisted, held at one end or free, meshed coarsely with every kind of element. `reduce` tells
the error of its lowest six frequencies; the true one is that against CalculiX on a fine mesh of quadratic elements (C3D20, S8R), whose
shapes are known from the program on the same mesh (frequencies of both must agree to 1 %, of shells 3 %, of beams, solids there, 10 %,
else the body is "open"; shells and beams are then compared with the program's fine mesh). Per frequency: "low" is a true error above 1 %
that is told three times too small (and below 30 %), "silent" one without a warning; "high" an error told above 1 % and three times too
large. Exit 1 if there is a silent one, or more than 5 % low or high.
"""
import argparse
import json
import pathlib
import random
import shutil
import subprocess
import sys

import h5py
import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).parent), str(pathlib.Path(__file__).parents[1])]
from mesh_verdicts import MODES, judge_bodies, verdicts  # noqa: E402
from meshed import DIMENSION, KINDS, Mesh, calculix_frequencies, set_of  # noqa: E402
from scene import pick  # noqa: E402

TURN = 0.1  # m: turns as displacements, some tenth of the body's length
AGREE = {1: 0.1, 2: 0.03, 3: 0.01}  # both programs on the fine mesh, by dimension


class Body:
    def __init__(self, r, kind):
        self.kind = kind or pick(r, *KINDS)
        self.dimension = DIMENSION[KINDS[self.kind][0]]
        quadratic = KINDS[self.kind][1]
        L = 1.0
        B = r.uniform(0.05, 0.6) if self.dimension > 1 else r.uniform(0.03, 0.1)
        H = B * r.uniform(0.1, 1) if self.dimension == 3 else B * r.uniform(0.5, 1) if self.dimension == 1 else B * r.uniform(0.02, 0.1)
        self.size = (L, B, H)
        most = (6, 2, 2) if quadratic else (14, 5, 4)
        self.counts = tuple(r.randint(low, high) for low, high in zip((2, 1, 1), most))
        taper, bent, twist = r.uniform(0.5, 1), pick(r, 0.0, r.uniform(-0.4, 0.4)), pick(r, 0.0, r.uniform(-0.6, 0.6))
        if self.dimension == 1:
            taper, twist = 1.0, 0.0
        self.free = r.random() < 0.3
        self.material = pick(r, (2.1e11, 0.3, 7850.0), (7e10, 0.33, 2700.0), (3e9, 0.38, 1200.0))

        def place(x, y=0.5, z=0.5):
            s, a = 1 + (taper - 1) * x, twist * x
            across, up = (y - 0.5) * B * s, (z - 0.5) * H * s
            c, n = np.cos(a), np.sin(a)
            return x * L, c * across - n * up, n * across + c * up + bent * L * x * x

        self.place = place
        self.what = f"{self.kind}, {'x'.join(map(str, self.counts[: self.dimension]))}, L/B {L / B:.2g}, B/H {B / H:.2g}" + (
            ", free" if self.free else ""
        )

    def deck(self, kind, counts):
        mesh = Mesh(kind, counts, self.place)
        E, nu, rho = self.material
        L, B, H = self.size
        text = mesh.text() + set_of("ROOT", mesh.where(lambda at: at[0] == 0))
        text += f"*MATERIAL, NAME=M\n*ELASTIC\n{E:.8g}, {nu}\n*DENSITY\n{rho:.8g}\n"
        if KINDS[kind][0] in ("quad", "tri"):
            text += f"*SHELL SECTION, ELSET=BODY, MATERIAL=M\n{H:.10g}\n"
        elif KINDS[kind][0] == "line":
            text += f"*BEAM SECTION, ELSET=BODY, MATERIAL=M, SECTION=RECT\n{B:.10g}, {H:.10g}\n0., 1., 0.\n"
        else:
            text += "*SOLID SECTION, ELSET=BODY, MATERIAL=M\n"
        return text + ("" if self.free else f"*BOUNDARY\nROOT, 1, {3 if DIMENSION[KINDS[kind][0]] == 3 else 6}\n")

    def fine(self):
        """Kind and counts of the truth: whole multiples, so that it has the nodes of the coarse mesh."""
        if self.dimension == 2:
            return "S8R", tuple(n * -(-least // n) for n, least in zip(self.counts, (18, 8)))
        if self.dimension == 1:
            return "B32", (self.counts[0] * -(-24 // self.counts[0]),)
        return "C3D20", tuple(n * -(-least // n) for n, least in zip(self.counts, (18, 4, 4)))

    def solid(self):
        """A beam as a solid."""
        return "C3D20", (24, 4, 4)


def reduced(program, folder, name, text, modes):
    """What reduce says, shapes: {place: (6, modes)}."""
    (folder / f"{name}.inp").write_text(text)
    words = ["reduce", f"{name}.inp", "-o", f"{name}.h5", "--method", "eigen", "--modes", str(modes), "--json", "--no-stiffening"]
    words += ["--nodes", "100000", "--cache", "none"]
    done = subprocess.run([program, *words], cwd=folder, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=300)
    if done.returncode:
        raise ValueError(done.stderr.strip()[-200:])
    told = json.loads(done.stdout)
    with h5py.File(folder / f"{name}.h5") as file:
        points, phi, psi = (file[f"nodes/{word}"][:] for word in ("origin", "phi", "psi"))
    # Turns count as much as displacements: twist of a beam moves no node.
    shapes = {tuple(np.round(p, 7) + 0.0): np.vstack([f, TURN * t]) for p, f, t in zip(points, phi, psi)}
    return told, shapes


def judge(program, body, folder):
    """[(true, told, verdict)] and the warnings; None: no truth."""
    told, shapes = reduced(program, folder, "coarse", body.deck(body.kind, body.counts), MODES)
    kind, counts = body.fine()
    text = body.deck(kind, counts)
    fine, fine_shapes = reduced(program, folder, "fine", text, MODES + 4)
    truth = calculix_frequencies(folder, "truth", body.deck(*body.solid()) if body.dimension == 1 else text, MODES + 4, body.free)
    hertz = np.array(fine["frequencies"])
    if len(truth) < len(hertz):
        return None, "no frequencies"
    # Shells and beams are bricks in CalculiX: what differs is theory, not mesh; it only confirms theirs.
    apart = abs(hertz / truth - 1)[:MODES].max()
    if apart > AGREE[body.dimension]:
        return None, f"fine meshes differ by {apart:.2g}"
    if body.dimension < 3:
        truth = hertz
    common = [p for p in shapes if p in fine_shapes]
    if len(common) < min(4, len(shapes)):
        return None, f"{len(common)} common nodes"
    a = np.concatenate([shapes[p] for p in common])
    b = np.concatenate([fine_shapes[p] for p in common])
    return verdicts(told, a, b, truth), ""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--number", type=int)
    parser.add_argument("--kind", choices=list(KINDS))
    args = parser.parse_args()
    if not shutil.which("ccx"):
        sys.exit("the program ccx is missing (package calculix-ccx): nothing was compared")
    program = str(pathlib.Path(args.program).resolve())

    def body_of(number):
        r = random.Random(f"meshes {args.seed} {number}")
        return Body(r, args.kind or list(KINDS)[7 * number % len(KINDS)])  # the first ones are of all forms

    judge_bodies(args, body_of, lambda body, folder: judge(program, body, folder))


if __name__ == "__main__":
    main()
