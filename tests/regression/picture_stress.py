"""The largest stress that a picture of a reduced body shows, of strips with one interface and what holds them in their own deck."""
import re

from program import run

YIELD = 1e9  # Pa


def largest_stress(folder, deck, interface, frame, loads):
    """Pa: what YIELD is safe against, at rest. deck: a file in `folder`; loads: (direction, N) on the body's frame."""
    run("reduce", folder / deck, "-o", folder / "strip.h5", "--interface", interface, "--stress", "--quiet")
    forces = "".join(
        f'[[force]]\nname = "f{k}"\nkind = "force"\non = "strip.{frame}"\ndirection = {direction}\nvalue = {value}\n'
        for k, (direction, value) in enumerate(loads)
    )
    (folder / "strip.toml").write_text(
        "[simulation]\nduration = 0.001\noutput_rate = 4000\ngravity = [0, 0, 0]\n"
        '[[body]]\nname = "strip"\nkind = "modal"\nfile = "strip.h5"\ninitial = { static = true }\n'
        f'[[joint]]\nname = "held"\nkind = "weld"\nparent = "ground"\nchild = "strip"\n{forces}'
        f'[render]\ncolor_by = "stress"\nyield_stress = {YIELD}\nsize = [64, 48]\nvideo = "none"\n'
    )
    run("simulate", folder / "strip.toml", "-o", folder / "strip_r.h5", "--quiet")
    out = run("render", folder / "strip_r.h5", "-o", folder / "pictures", "--frames", "0:1", "--workers", 1).stdout
    return YIELD / float(re.search(r"safety factor against yielding is ([0-9.e+-]+)", out)[1])
