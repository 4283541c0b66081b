"""Settings that a search for an accuracy found are kept and reused; a question, scene or file that is another is searched anew."""
import json
import re

from program import examples, expect, run, run_parts


def simulate(scene, folder, *words):
    done = run("simulate", scene, "--csv", folder / "h.csv", "--accuracy", "1e-2", "--json", *words)
    summary = json.loads(done.stdout)["simulation"]
    return summary, (folder / "h.csv").read_bytes()


def searched(summary):
    return summary["accuracy"]["search_cpu_seconds"] > 0


def kept_and_reused(folder):
    scene = folder / "short.toml"
    text = (examples / "pendulum.toml").read_text()
    text = text.replace("duration = 1.2", "duration = 0.3").replace("elements = 10", "elements = 4")
    scene.write_text(text)
    memory = folder / "h.settings.toml"
    first, numbers = simulate(scene, folder)
    expect(searched(first) and memory.is_file(), "the first run leaves no settings")
    again, same = simulate(scene, folder)
    expect(not searched(again), f"the second run searches again: {again['accuracy']}")
    expect(same == numbers, "the second run has other numbers")
    for key in ["asked", "error", "time", "space", "effects", "column", "half_cost", "chosen"]:
        expect(again["accuracy"][key] == first["accuracy"][key], f"the second run states another {key}")
    expect(again["warnings"] == first["warnings"], "the second run warns otherwise")
    expect(any("--fresh" in note for note in again["notes"]), f"the second run does not say that it reuses: {again['notes']}")

    # Searched anew: asked for, another accuracy, another scene, another option.
    for words in [["--fresh"], ["--method", "erk"], ["--set", "simulation.duration=0.29"]]:
        other, _ = simulate(scene, folder, *words)
        expect(searched(other), f"{words}: the settings of another question are used")
    simulate(scene, folder)

    # A file that was changed, cut off or emptied leads to a search, never to other numbers.
    good = memory.read_text()
    spoilt = [re.sub(r"tolerance = \S+", "tolerance = 1e-3", good), good[: len(good) // 2], "", good.replace("keep_modes", "keep_mode")]
    for k, other in enumerate(spoilt):
        memory.write_text(other)
        summary, numbers_now = simulate(scene, folder)
        expect(numbers_now == numbers, f"spoilt settings {k}: other numbers")
        expect(searched(summary) or other == good, f"spoilt settings {k} were used")


run_parts(kept_and_reused)
