"""Arguments that the suites of this room have in common, and the way through samples that are judged one by one."""
import argparse
import collections
import pathlib
import random
import shutil
import sys
import tempfile

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


def judge_each(args, name, sample, judge, needs_ccx=False):
    """Samples by chance, a line each, then how many of each verdict; exit 1 where one is silent or refused.

    sample(r, number): with a description `what`; judge(program, sample, folder, r): verdict and note. A ValueError of it is a refusal, a
    RuntimeError one of CalculiX: open. args: program, count, seed, number and, where the suite has it, keep."""
    if needs_ccx and not shutil.which("ccx"):
        sys.exit("the program ccx is missing (package calculix-ccx): nothing was compared")
    program = str(pathlib.Path(args.program).resolve())
    counts = collections.Counter()
    for number in range(args.count) if args.number is None else [args.number]:
        r = random.Random(f"{name} {args.seed} {number}")
        one = sample(r, number)
        with tempfile.TemporaryDirectory(prefix=f"flexframe_{name.replace(' ', '_')}_") as folder:
            try:
                verdict, what = judge(program, one, pathlib.Path(folder), r)
            except ValueError as refusal:
                verdict, what = "refused", str(refusal)
            except RuntimeError as failure:
                verdict, what = "open", "CalculiX: " + " ".join(str(failure).split())[-100:]
            if getattr(args, "keep", None):
                shutil.copytree(folder, args.keep / str(number), dirs_exist_ok=True)
        counts[verdict] += 1
        print(f"{verdict:8} {number}: {one.what}: {what}", flush=True)
    print(", ".join(f"{n} {v}" for v, n in counts.items()))
    sys.exit(1 if counts["silent"] or counts["refused"] else 0)
