"""Colours by stress of reduced bodies under their own inertia and weight, which their modes hold in part or not at all: largest stress
against closed forms of a rod that spins, is pushed, hangs and swings. Poisson's ratio zero, so that a clamp concentrates nothing."""

import re

from program import *
from rod_deck import rod_deck

E, rho, length, wide, high = 2.1e11, 7850.0, 1.0, 0.1, 0.02
nx = 40
deck = rod_deck(E, rho, length, wide, high, nx)
bending = ("--hold", "ROOT", "--method", "eigen", "--modes", 4)
tipped = ("--hold", "ROOT", "--interface", "tip=rigid:TIP", "--modes", 4)
free = ("--interface", "root=rigid:ROOT", "--modes", 6)

with temporary_folder() as name:
    folder = pathlib.Path(name)
    (folder / "rod.inp").write_text(deck)

    def stress(words, motion, gravity="[0, 0, 0]", rate=2000, told=None):
        """The largest stress that pictures of 0.02 s show, Pa: what a yield stress of 1 GPa is safe against."""
        run("reduce", folder / "rod.inp", "-o", folder / "rod.h5", *words, "--stress", "--quiet")
        child = "rod.root" if words is free else "rod"
        (folder / "rod.toml").write_text(
            f"[simulation]\nduration = 0.02\noutput_rate = {rate}\ngravity = {gravity}\n"
            '[[body]]\nname = "rod"\nkind = "modal"\nfile = "rod.h5"\ninitial = { static = true }\n'
            f'[[joint]]\nname = "drive"\nparent = "ground"\nchild = "{child}"\n{motion}\n'
            '[render]\ncolor_by = "stress"\nyield_stress = 1e9\ncolor_range = "full"\nsize = [64, 48]\nvideo = "none"\n'
        )
        run("simulate", folder / "rod.toml", "-o", folder / "rod_r.h5", "--quiet")
        out = run("render", folder / "rod_r.h5", "-o", folder / "pictures", "--frames", "0:1", "--workers", 1).stdout
        warned = [line for line in out.splitlines() if "WARNING" in line and "sample" in line]
        expect(bool(warned) == bool(told), f"{words} {motion}: {warned}")
        if told:
            expect(told in warned[0], f"{warned[0]}: not {told}")
        found = re.search(r"safety factor against yielding is ([0-9.e+-]+)", out)
        return 1e9 / float(found[1]) if found else 0.0

    spin = 'kind = "revolute"\naxis = [0, 0, 1]\nmotion = "200*t"'
    pull = rho * 200**2 * length**2 / 2
    for what, words in (("bending modes", bending), ("an interface at the tip", tipped), ("a free body", free)):
        near(stress(words, spin), pull, 0.02 * pull, f"root of a rod that spins, {what}")
    push = 'kind = "prismatic"\naxis = [1, 0, 0]\nmotion = "500*t^2"'
    # Elements whose stress along them is even: that of the first one's middle.
    middle = length * (1 - 0.5 / nx)
    near(stress(bending, push), rho * 1000 * middle, 0.005 * rho * 1000 * length, "root of a rod that is pushed")
    hang = 'kind = "weld"'
    near(stress(bending, hang, gravity="[100, 0, 0]"), rho * 100 * middle, 0.005 * rho * 100, "root of a rod that hangs")
    # Weight and acceleration that cancel: falling.
    fall = 'kind = "prismatic"\naxis = [1, 0, 0]\nmotion = "50*t^2"'
    near(stress(bending, fall, gravity="[100, 0, 0]"), 0.0, 1e-3 * rho * 100, "root of a rod that falls")
    # Across it the modes hold nearly all: rho A g L^2 / 2 over the section's modulus.
    bent = rho * wide * high * 10 * middle**2 / 2 / (wide * high**2 / 6)
    for what, words in (("bending modes", bending), ("an interface at the tip", tipped)):
        near(stress(words, hang, gravity="[0, 0, -10]"), bent, 0.005 * bent, f"root of a rod that its weight bends, {what}")

    # Samples too far apart to tell, and too few.
    stress(bending, spin, rate=50, told="fewer than three samples")
    stress(bending, spin, rate=200, told="turns by 1 rad")
    stress(bending, 'kind = "prismatic"\naxis = [1, 0, 0]\nmotion = "1e-3*sin(3000*t)"', rate=2000, told="may be off by")

finish()
