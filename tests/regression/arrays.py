"""For regression tests that compare histories, as numpy arrays, with truths of their own."""
import numpy as np
from program import expect, history, run


def simulate(folder, text, *words, code=0):
    """The histories, or stderr of a run that is to fail."""
    columns = simulate_and_say(folder, text, *words, code=code)
    if code == 0:
        del columns["said"]
    return columns


def simulate_and_say(folder, text, *words, code=0):
    """The same, and what the program said as "said"."""
    scene = folder / "scene.toml"
    scene.write_text(text)
    done = run("simulate", scene, "-o", folder / "r.h5", "--csv", folder / "h.csv", *words, code=code)
    if code:
        return done.stderr
    columns = {k: np.array(v) for k, v in history(folder / "h.csv").items()}
    columns["said"] = done.stdout
    return columns


def off(a, b, bound, what):
    worst = np.max(np.abs(np.asarray(a) - np.asarray(b)))
    expect(worst <= bound, f"{what}: off by {worst:.3g}, allowed {bound:.3g}")


def refused(folder, text_of, cases):
    """Of each case (text, words) the scene text_of(text) is refused with all the words."""
    for case, words in cases:
        says = simulate(folder, text_of(case), code=2)
        for word in words:
            expect(word in says, f"{case!r}: '{word}' is not in: {says}")
