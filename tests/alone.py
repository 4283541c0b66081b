"""Whether every source compiles by itself, with the other compiler too: builds put many of them into one, where one's include serves all.

tests/alone.py BUILD [FOLDER ..]: sources of sim, interp and render, or of these folders; syntax only, some ten minutes on two cores.
BUILD has the generated headers. Ends with 1 where a source has an error or a warning."""

import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
WORDS = ["-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", "-DFMT_SHARED", f"-I{ROOT}"]
SYSTEM = ["/usr/include/eigen3", "/usr/include/hdf5/serial"]


def compiled(source, build):
    words = [*WORDS, f"-I{build / 'include'}", *(word for folder in SYSTEM for word in ("-isystem", folder))]
    # Names of files that the build fills in.
    words += [f'-D{name}=""' for name in sorted(set(re.findall(r"\bFLEXFRAME_\w+_(?:FILE|DIR)\b", source.read_text(encoding="utf-8"))))]
    done = subprocess.run(["g++", *words, source], capture_output=True, text=True)
    return source, done.returncode, done.stderr


def main():
    build, folders = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2:] or ["sim", "interp", "render"]
    sources = sorted(path for folder in folders for path in (ROOT / folder).rglob("*.cpp") if "python" not in path.parts)
    if not sources:
        sys.exit(f"no sources in {', '.join(folders)}")
    bad = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for source, code, said in pool.map(lambda path: compiled(path, build), sources):
            if code:
                bad += 1
                print(f"{source.relative_to(ROOT)}:\n{said[:2000]}", flush=True)
    print(f"{len(sources)} sources by themselves, {bad} with errors or warnings")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
