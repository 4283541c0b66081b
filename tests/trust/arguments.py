"""Arguments that the suites of this room have in common."""
import argparse
import pathlib

WORDS = {
    "kind": {"action": "append", "default": [], "help": "scenes of this kind alone, as often as wanted"},
    "number": {"type": int, "help": "this scene alone"},
    "keep": {"type": pathlib.Path, "metavar": "FOLDER", "help": "where scenes go that went wrong"},
    "table": {"type": pathlib.Path, "metavar": "FILE", "help": "page whose table is replaced"},
    "rows": {"type": pathlib.Path, "metavar": "FILE", "help": "where lines go, one a scene; those that are there are not run again"},
    "short": {"action": "store_true", "help": "what continuous integration runs"},
}
NUMBERS = {
    "count": "scenes",
    "seed": "of the random scenes",
    "limit": "CPU seconds a run may take",
    "truth_limit": "CPU seconds a truth may take; a scene without one has no verdict",
    "jobs": "scenes at a time",
}


def suite_parser(doc, *words, **numbers):
    """A parser with the program's path, those words of WORDS, and those numbers with their defaults; with `count` goes `seed`, 1.

    What a script has beside them it adds itself, its examples or scenes first."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    if "count" in numbers:
        numbers = {"seed": 1, **numbers}
    for name, default in numbers.items():
        parser.add_argument("--" + name.replace("_", "-"), type=int, default=default, help=f"{NUMBERS[name]} ({default})")
    for word in words:
        parser.add_argument("--" + word, **WORDS[word])
    return parser
