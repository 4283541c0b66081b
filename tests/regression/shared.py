"""Shared libraries against static ones: shared.py FLEXFRAME SOURCE_DIR [SHARED_FLEXFRAME], for the nightly run.

FLEXFRAME is linked statically. The other one is built here with BUILD_SHARED_LIBS=ON where none is given. Histories and pictures must have
the same bits; the libraries show nothing but Flexframe's own functions and what they are made of.
"""

import os
import pathlib
import subprocess
import sys

from program import examples, expect, finish, flexframe, source, temporary_folder


def done(*words):
    out = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    expect(out.returncode == 0, f"{' '.join(map(str, words))}: exit {out.returncode}\n{out.stdout[-2000:]}\n{out.stderr[-3000:]}")
    return out.stdout


with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    if len(sys.argv) > 3:
        shared = pathlib.Path(sys.argv[3]).resolve()
    else:
        # With the compiler of the static ones: another one makes other bits.
        cache = (pathlib.Path(flexframe).resolve().parent / "CMakeCache.txt").read_text()
        compilers = [f"-D{line}" for line in cache.splitlines() if line.startswith(("CMAKE_CXX_COMPILER:", "CMAKE_C_COMPILER:"))]
        off = [f"-DFLEXFRAME_{part}=OFF" for part in ("TESTS", "BENCHMARKS", "PYTHON")]
        done(
            "cmake",
            "-G",
            "Ninja",
            "-S",
            source,
            "-B",
            folder / "build",
            "-DCMAKE_BUILD_TYPE=Release",
            "-DBUILD_SHARED_LIBS=ON",
            *compilers,
            *off,
        )
        done("cmake", "--build", folder / "build", "--target", "flexframe", "-j", os.cpu_count())
        shared = folder / "build/flexframe"
    libraries = sorted(shared.parent.rglob("libflexframe_*.so"))
    expect(len(libraries) == 4, f"shared libraries: {libraries}")
    for library in libraries:
        # Eigen's factorisation PartialPivLU is made in one file and used by the others (symbols.map).
        names = [line.split(" ", 2)[2] for line in done("nm", "-D", "-C", "--defined-only", library).splitlines()]
        foreign = [name for name in names if "flexframe::" not in name and not name.startswith("Eigen::PartialPivLU")]
        expect(len(names) > 20 and foreign == [], f"{library.name}: {len(names)} names, foreign ones: {foreign[:5]}")
    # Installed, the program finds them wherever that is.
    done("cmake", "--install", shared.parent, "--prefix", folder / "prefix", "--component", "program")
    expect("libraries" in done(folder / "prefix/bin/flexframe", "--version"), "the installed program does not start")
    for scene in ("pendulum", "slider_crank", "engine", "dlr_slider_crank", "cart_pendulum"):
        made = {}
        for kind, program in (("static", flexframe), ("shared", shared)):
            to = folder / scene / kind
            to.mkdir(parents=True)
            done(program, "simulate", examples / f"{scene}.toml", "-o", to / "r.h5", "--csv", to / "r.csv", "--quiet")
            done(program, "render", to / "r.h5", "-o", to / "drawn", "--frames", "8:10", "--size", "480x270", "--no-video", "--quiet")
            made[kind] = [(to / "r.csv").read_bytes(), *(p.read_bytes() for p in sorted((to / "drawn/frames").glob("*.png")))]
        expect(len(made["static"]) == 3 and made["static"] == made["shared"], f"{scene}: other bits from shared libraries")
        print(f"{scene}: the same histories and pictures", flush=True)
finish()
