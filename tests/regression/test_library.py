"""Flexframe as a library: installed and used by four programs from outside of the tree; and as a part of another project."""
import gzip
import json
import math
import os
import pathlib
import subprocess

from program import expect, finish, flexframe, near, source, temporary_folder

build = pathlib.Path(flexframe).resolve().parent
cache = dict(line.split("=", 1) for line in (build / "CMakeCache.txt").read_text().splitlines() if "=" in line and line[0] not in "#/")
# A compiler's own flags decide what links with the libraries: sanitizers.
sanitize = cache.get("FLEXFRAME_SANITIZE:STRING", "")
flags = f"-fsanitize={sanitize}" if sanitize else ""


def done(*words, **more):
    out = subprocess.run([str(w) for w in words], capture_output=True, text=True, timeout=500, **more)
    expect(out.returncode == 0, f"{' '.join(map(str, words))}: exit {out.returncode}\n{out.stdout[-3000:]}\n{out.stderr[-3000:]}")
    return out.stdout


def entry(name):
    return next((value for key, value in cache.items() if key.startswith(name + ":")), "")


def configure(project, folder, *words):
    return done(
        "cmake", "-G", "Ninja", "-S", project, "-B", folder, f"-DCMAKE_CXX_COMPILER={entry('CMAKE_CXX_COMPILER')}",
        f"-DCMAKE_C_COMPILER={entry('CMAKE_C_COMPILER')}", f"-DCMAKE_CXX_FLAGS={flags}", "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON", *words,
    )  # fmt: skip


def cart_by_hand(steps=500):
    """The controlled pendulum on a cart by its equations of motion and Runge-Kutta steps of 0.1 ms, rows as cart prints them."""
    mass, bob, arm, inertia, g = 1.0, 0.2, 0.5, 0.004, 9.81

    def rate(s, push):
        x, v, angle, turn = s
        c, d = math.cos(angle), math.sin(angle)
        a11, a12, a22 = mass + bob, -bob * arm * c, bob * arm * arm + inertia
        b1, b2 = push - bob * arm * d * turn * turn, bob * g * arm * d
        det = a11 * a22 - a12 * a12
        return v, (b1 * a22 - a12 * b2) / det, turn, (a11 * b2 - a12 * b1) / det

    state, rows = (0.0, 0.0, 0.1, 0.0), []
    for k in range(steps):
        push = 9.7 * state[0] + 10.8 * state[1] - 61.0 * state[2] - 13.9 * state[3]
        h = 1e-4
        for _ in range(100):
            k1 = rate(state, push)
            k2 = rate([s + 0.5 * h * r for s, r in zip(state, k1)], push)
            k3 = rate([s + 0.5 * h * r for s, r in zip(state, k2)], push)
            k4 = rate([s + h * r for s, r in zip(state, k3)], push)
            state = tuple(s + h / 6 * (a + 2 * b + 2 * c + d) for s, a, b, c, d in zip(state, k1, k2, k3, k4))
        if k % 10 == 9:
            rows.append((0.01 * (k + 1), state[0], state[2], push))
    return rows


with temporary_folder() as folder:
    folder = pathlib.Path(folder)
    prefix = folder / "prefix"
    done("cmake", "--install", build, "--prefix", prefix)
    for file in ("bin/flexframe", "include/flexframe/sim/simulation.h", "share/flexframe/examples/slider_crank.toml"):
        expect((prefix / file).exists(), f"{file} is not installed")
    # Headers do not lean on the tree: what they include is installed beside them.
    for header in (prefix / "include/flexframe").rglob("*.h"):
        for line in header.read_text().splitlines():
            if line.startswith("#include <flexframe/"):
                expect((prefix / "include" / line.split("<")[1].split(">")[0]).exists(), f"{header}: {line}")
            expect(not line.startswith('#include "'), f"{header}: {line}")

    # Manual pages and completions say what --help says.
    manual = gzip.decompress((prefix / "share/man/man1/flexframe-run.1.gz").read_bytes()).decode()
    expect(manual.startswith(".TH FLEXFRAME") and "tolerance" in manual, manual[:300])
    done("bash", "-n", prefix / "share/bash-completion/completions/flexframe")
    completed = done(
        "bash", "-c", f"source {prefix}/share/bash-completion/completions/flexframe; COMP_WORDS=(flexframe run --to); COMP_CWORD=2; "
        "_flexframe; echo ${COMPREPLY[*]}; COMP_WORDS=(flexframe si); COMP_CWORD=1; _flexframe; echo ${COMPREPLY[*]}",
    )  # fmt: skip
    expect(completed.split() == ["--tolerance", "simulate"], f"completion: {completed}")
    expect((prefix / "share/man/man1/flexframe-load-path.1.gz").exists(), "load-path has no manual page")
    # Words behind an option, files of the kind that a command takes, nothing behind a number.
    for name in ("a.toml", "b.h5", "c.txt"):
        (folder / "typed" / name).parent.mkdir(exist_ok=True)
        (folder / "typed" / name).write_text("")
    for typed, wanted in (
        ("lo", "load-path"),
        ("run --color-by s", "strain stress"),
        ("new --template r", "rotor robot-arm results"),
        ("study --axes el", "elements"),
        ("export x.h5 --to v", "vtk vtkhdf"),
        ("reduce x.inp --contact o", "open"),
        ("run --frame-rate 1", ""),
        ("run ", "a.toml"),
        ("render ", "b.h5"),
        ("info ", "a.toml b.h5 c.txt"),
    ):
        script = (
            f'source {prefix}/share/bash-completion/completions/flexframe; read -ra COMP_WORDS <<<"flexframe $1"; '
            '[[ $1 == *" " ]] && COMP_WORDS+=(""); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _flexframe; echo ${COMPREPLY[*]}'
        )
        found = done("bash", "-c", script, "bash", typed, cwd=folder / "typed").split()
        expect(sorted(found) == sorted(wanted.split()), f"completion of 'flexframe {typed}': {found}, wanted {wanted}")
    for file in ("share/zsh/vendor-completions/_flexframe", "share/fish/vendor_completions.d/flexframe.fish"):
        text = (prefix / file).read_text()
        expect("tolerance" in text and "simulate" in text, f"{file}: {text[:500]}")

    uses = folder / "uses"
    configure(source / "examples/library", uses, f"-DCMAKE_PREFIX_PATH={prefix}")
    done("cmake", "--build", uses)
    # An installed scene finds its meshes; the installed program runs it.
    scene = prefix / "share/flexframe/examples/slider_crank.toml"
    done(prefix / "bin/flexframe", "check", scene)

    lines = done(uses / "cart", source / "examples/library/cart.toml").splitlines()
    rows = [[float(word) for word in line.split()] for line in lines[:-1]]
    expect(len(rows) == 50, f"cart prints {len(rows)} rows")
    off = max(abs(a - b) for ours, theirs in zip(rows, cart_by_hand()) for a, b in zip(ours, theirs))
    near(off, 0.0, 2e-6, "controlled cart against equations by hand")
    expect(abs(rows[-1][2]) < 1e-4, f"the pendulum is not upright at the end: {rows[-1][2]}")

    text = done(uses / "kernel_map")
    expect("8 nodes move 2121 vertices" in text, text)
    near(float(text.split("rotation off by ")[1].split()[0]), 0.0, 1e-12, "rigid rotation through the map")
    near(float(text.split("bent by ")[1].split()[0]), 0.1, 2e-3, "bending through the map")

    done(uses / "drawing", folder / "wave.png")
    data = (folder / "wave.png").read_bytes()
    expect(data[:8] == b"\x89PNG\r\n\x1a\n" and len(data) > 20000, f"wave.png has {len(data)} bytes")

    done("/usr/bin/python3", source / "assets/beam/make_beam.py", folder / "beam.inp")
    text = done(uses / "part", folder / "beam.inp", folder / "part.png", cwd=folder)
    done(pathlib.Path(flexframe).resolve(), "reduce", "beam.inp", "-o", "beam.sid", "--interface", "root=average:ROOT", "--interface",
    "tip=average:TIP",
         "--modes", "6", "--json", "--quiet", cwd=folder)  # fmt: skip
    same = (folder / "beam.sid").read_text().split("\n", 2)[2] == (folder / "part.sid").read_text().split("\n", 2)[2]
    expect("18 coordinates" in text and "warning" not in text, text)
    expect(same, "a body reduced by the library is not the program's")
    expect((folder / "part.png").stat().st_size > 20000, "part.png is small")

    # Inside another project: targets, but no warnings, tests, output folder or root of ours.
    host = folder / "host"
    host.mkdir()
    (host / "CMakeLists.txt").write_text(
        f"cmake_minimum_required(VERSION 3.25)\nproject(host LANGUAGES CXX C)\nenable_testing()\nadd_subdirectory({source} flexframe)\n"
        "add_executable(host host.cpp)\ntarget_link_libraries(host PRIVATE flexframe::film)\n"
    )
    (host / "host.cpp").write_text(
        '#include <flexframe/film.h>\nint main() { return flexframe::film::parse_scales("1,20").size() == 2 ? 0 : 1; }\n'
    )
    configure(host, host / "build")
    commands = {pathlib.Path(c["file"]).name: c["command"] for c in json.loads((host / "build/compile_commands.json").read_text())}
    foreign = [name for name, c in commands.items() if "/tests/" in c or "-Wconversion" in c]
    expect(foreign == [], f"a subproject brings tests or warnings: {foreign}")
    ours = commands["host.cpp"]
    expect("-W" not in ours.replace("-Wno", ""), f"flags of ours reach the host: {ours}")
    roots = [w for w in ours.split() if w.startswith(("-I", "-isystem")) and w.removeprefix("-I").rstrip("/") == str(source)]
    expect(roots == [], f"the repository's root is an include path of the host: {ours}")
    expect("main.cpp" in commands, "the program is part of a subproject")
    tests = done("ctest", "-N", "--test-dir", host / "build")
    expect("Total Tests: 0" in tests, f"a subproject brings tests: {tests}")
    # Its own source compiles with what it is given.
    done(*ours.replace("-c ", "-fsyntax-only -c ").split(), cwd=host / "build", env=os.environ)

    # Shared libraries can be configured too, with the list of symbols.
    configure(
        source, folder / "shared", "-DBUILD_SHARED_LIBS=ON", "-DFLEXFRAME_TESTS=OFF", "-DFLEXFRAME_BENCHMARKS=OFF", "-DFLEXFRAME_PYTHON=OFF"
    )
    expect("symbols.map" in (folder / "shared/build.ninja").read_text(), "shared libraries without a list of symbols")

version = subprocess.run([flexframe, "--version"], capture_output=True, text=True).stdout.splitlines()
expect(version[0].count(".") == 2 and all(part.isdigit() for part in version[0].split(".")), f"first line of --version: {version[0]}")
for word in ("compiler", "renderer", "libraries"):
    expect(any(line.startswith(word) for line in version[1:]), f"--version does not say {word}: {version}")
expect("Eigen 3" in version[-1] and "SUNDIALS 6" in version[-1], version[-1])
finish()
