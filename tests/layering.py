#!/usr/bin/env python3
"""The house rules of includes and of what lies where: prints each breach, exit 1 if there is one.

    tests/layering.sh [ROOT]        the clone this file lies in, or ROOT
    tests/layering.sh --self-test   plants every breach in a small tree of its own and demands that it is found
"""
import os
import re
import sys

TOP = ["CMakeLists.txt", "CMakePresets.json", "LICENSE", "README.md", "assets", "examples", "interp", "render", "sim", "tests"]
# Folders that a build or a run leaves at the top.
PRODUCTS = ["build", "out"]
# In this order: a room includes its own files and those of the rooms before it. A file beside the rooms is the door: it may include them
# all, and no room includes it.
ROOMS = {
    "sim": ["base", "scene", "bodies", "reduce", "model", "dynamics", "time", "start", "results", "run", "accuracy", "sweep"],
    "render": ["base", "picture", "image", "frame", "draw", "film", "import", "cli", "python"],
}
# The one header that every module includes.
SHARED_HEADER = '#include "sim/base/error.h"'
OUTER_RENDER = ("render/film/", "render/import/", "render/cli/", "render/python/")


def drawing(path):
    return path.startswith("render/") and not path.startswith(OUTER_RENDER)


def below(*folders):
    return lambda path: path.startswith(folders)


def library(path):
    return path.startswith(("sim/", "interp/")) or drawing(path) or path.startswith(("render/film/", "render/import/"))


# (rule, which C++ files, what must not stand in them)
BANNED = [
    ("sim knows only itself", below("sim/"), r'#include "(interp|render)/'),
    ("interp knows only itself", below("interp/"), r'#include "(sim|render)/'),
    ("the drawing part knows only itself", drawing, r'#include "(sim|interp)/'),
    ("what reads other programs' files knows no kernel map", below("render/import/"), r'#include "interp/'),
    (
        "includes are written from the project's root",
        lambda path: library(path) or path.startswith("render/cli/"),
        r'#include "(\.|[^/"]+")',
    ),
    ("the library prints", library, r"(std::(cout|cerr|clog)|[^a-zA-Z_:]f?printf *\(|fmt::print|std::puts|[^a-zA-Z_]perror *\()"),
    (
        "catch of everything outside main",
        lambda path: path.startswith("render/cli/") and path != "render/cli/main.cpp",
        r"catch \(const std::exception",
    ),
]
# What has no inertia is a case of its own: its fields are known to the files of this name alone, all others take its door (massless.h).
BANNED.append(
    (
        "what has no inertia is known behind its door only",
        lambda path: path.startswith("sim/") and not path.startswith("sim/reduce/") and "/massless" not in path,
        r"(\.|->)massless\b",
    )
)
for module, rooms in ROOMS.items():
    for place, room in enumerate(rooms):
        inside = below(f"{module}/{room}/")
        BANNED.append((f"the door of {module} is opened from inside", inside, rf'#include "{module}/[a-z_]+\.h"'))
        if rooms[place + 1 :]:
            BANNED.append(
                (f"{module}/{room} stands before what it includes", inside, rf'#include "{module}/({"|".join(rooms[place + 1:])})/')
            )

# Each foreign library behind its door: (name, its headers, files that may include them, how many files at most)
CONFINED = [
    (
        "SUNDIALS",
        r"(cvode|cvodes|arkode|ida|idas|kinsol|nvector|sunlinsol|sunmatrix|sunnonlinsol|sundials)",
        r"sim/time/(integrat|cvode|arkode|ida)[a-z_]*\.(h|cpp)",
        None,
    ),
    ("OpenGL", r"GL/", r"render/draw/[a-z_]+\.h", 1),
    ("assimp", r"assimp/", r"render/picture/mesh[a-z_]*\.cpp", 1),
    ("meshoptimizer", r"meshoptimizer", r"render/film/detail\.cpp", 1),
    ("stb_image", r"stb(/|_|/stb_)image", r"render/image/png\.cpp", 1),
    ("stb_truetype", r"stb(/|_|/stb_)truetype", r"render/image/text\.cpp", 1),
    ("libdeflate", r"libdeflate", r"render/base/deflate\.cpp", 1),
    ("HDF5", r"(hdf5|H5)", r"sim/base/hdf5_file\.h", 1),
    ("muParser", r"muParser", r"sim/scene/expression\.cpp", 1),
    ("toml++", r"toml(\+\+|\.hpp|plusplus)", r"sim/scene/toml_input\.cpp", 1),
    ("xxHash", r"xxhash", r"interp/hash\.h", 1),
    ("matio", r"matio", r"render/import/modelica\.cpp", None),
    ("libzip", r"zip\.h", r"render/import/arrays\.cpp", None),
    ("pugixml", r"pugixml", r"render/import/[a-z_]+\.cpp", None),
    ("NetCDF", r"netcdf", r"render/import/mbdyn[a-z_]*\.cpp", None),
    ("CLI11", r"CLI/", r"render/cli/.*", None),
    ("Boost", r"boost/", r"sim/sweep/design\.cpp", 1),
    ("NLopt", r"nlopt", r"sim/sweep/search\.cpp", 1),
    ("Eigen/Sparse", r"Eigen/(Sparse|SparseCholesky)", r"(sim|interp|render/film)/.*", None),
]

OUTSIDE = re.compile(
    r"(PROJECT_SOURCE_DIR\}|CMAKE_SOURCE_DIR\}|FLEXFRAME_SOURCE_DIR\)?)/\.\.(/|\"|$)|(^|[^.])\.\./shared|[Ss]eed 00[0-9]", re.MULTILINE
)
MACHINE = re.compile(r"(^|[^A-Za-z0-9_.~}/-])/(work|root|home|farm)/", re.MULTILINE)


def lines_with(text, pattern):
    """(number, line) of each line of text in which the compiled pattern is found."""
    if not pattern.search(text):
        return []
    return [(number, line) for number, line in enumerate(text.split("\n"), 1) if pattern.search(line)]


def breaches(files, top):
    """One line a breach; files: path from the root -> text, top: the names at the top level."""
    out = []
    code = {path: text for path, text in files.items() if path.endswith((".h", ".cpp"))}
    for rule, where, pattern in BANNED:
        pattern = re.compile(pattern, re.MULTILINE)
        for path, text in code.items():
            if where(path):
                out += [f"{rule}: {path}:{n}:{line}" for n, line in lines_with(text, pattern) if SHARED_HEADER not in line]
    for module, rooms in ROOMS.items():
        inside = re.compile(rf"{module}/(({'|'.join(rooms)})/.*|[^/]*)")
        out += [f"no room of {module}: {path}" for path in code if path.startswith(module + "/") and not inside.fullmatch(path)]
    for name, header, allowed, most in CONFINED:
        header = re.compile(rf'^ *# *include *[<"]{header}', re.MULTILINE)
        users = [path for path, text in code.items() if not path.startswith("tests/") and header.search(text)]
        stray = [path for path in users if not re.fullmatch(allowed, path)]
        if stray:
            out.append(f"{name} is included outside its place: {' '.join(stray)}")
        elif most is not None and len(users) > most:
            out.append(f"{name} is included in more than {most} file(s): {' '.join(users)}")
    for name in top:
        if name not in TOP + PRODUCTS and not name.startswith("."):
            out.append(f"the top level has a name of its own: {name} (allowed: {' '.join(TOP)})")
    out += [f"the top level lacks {name}" for name in TOP if name not in top]
    for path, text in files.items():
        if path != "tests/layering.py":
            out += [f"a file outside the repository: {path}:{n}:{line}" for n, line in lines_with(text, OUTSIDE)]
            out += [f"a path of one machine: {path}:{n}:{line}" for n, line in lines_with(text, MACHINE)]
    return out


def read(root):
    """Text files below root, without what git, builds and runs put there; binary and very large ones are left out."""
    files = {}
    for folder, below_it, names in os.walk(root):
        if folder == root:
            below_it[:] = [name for name in below_it if name not in PRODUCTS + [".git"]]
        for name in names:
            path = os.path.join(folder, name)
            if name == ".git" or os.path.islink(path) or os.path.getsize(path) > 2000 * 1024:
                continue
            with open(path, "rb") as file:
                content = file.read()
            if b"\0" not in content:
                files[os.path.relpath(path, root)] = content.decode(errors="replace")
    return dict(sorted(files.items()))


def self_test():
    """Names of the planted breaches that are not found, and what is blamed in a clean tree."""
    plants = [
        ("sim/a.cpp", '#include "interp/map.h"', "sim knows only itself"),
        ("sim/a.h", '#include "render/image/image.h"', "sim knows only itself"),
        ("interp/a.cpp", '#include "sim/base/types.h"', "interp knows only itself"),
        ("interp/a.cpp", '#include "sim/base/errors.h"', "interp knows only itself"),
        ("render/image/a.h", '#include "sim/results/results.h"', "the drawing part knows only itself"),
        ("render/draw/a.cpp", '#include "interp/map.h"', "the drawing part knows only itself"),
        ("render/import/a.cpp", '#include "interp/map.h"', "what reads other programs' files knows no kernel map"),
        ("sim/a.cpp", '#include "types.h"', "includes are written from the project's root"),
        ("interp/a.cpp", "std::cout << 1;", "the library prints"),
        ("sim/a.cpp", '  printf("x");', "the library prints"),
        ("render/cli/run.cpp", "catch (const std::exception& e) {", "catch of everything outside main"),
        ("sim/run/a.cpp", "if (model.massless.rates.empty()) return;", "what has no inertia is known behind its door only"),
        ("examples/x.toml", 'file = "/' + 'home/someone/x.obj"', "a path of one machine"),
        ("packages.txt", "cmake", "the top level has a name of its own: packages.txt"),
        ("cmake/Compiler.cmake", "set(x 1)", "the top level has a name of its own: cmake"),
        ("tests/CMakeLists.txt", 'set(data "${PROJECT_SOURCE_DIR}/../data")', "a file outside the repository"),
        ("tests/a.cpp", "// see .." + "/shared/x.md", "a file outside the repository"),
        ("sim/a.h", "// as in seed 001 eq. 8", "a file outside the repository"),
    ]
    # Every room against its door and every later room, and a folder that is no room.
    for module, rooms in ROOMS.items():
        plants.append((f"{module}/attic/a.cpp", "", f"no room of {module}"))
        for place, room in enumerate(rooms):
            plants.append((f"{module}/{room}/a.cpp", f'#include "{module}/a.h"', f"the door of {module} is opened from inside"))
            plants += [
                (f"{module}/{room}/a.h", f'#include "{module}/{later}/b.h"', f"{module}/{room} stands before what it includes")
                for later in rooms[place + 1 :]
            ]
    # Every foreign library in a place that is not its own.
    headers = {
        "SUNDIALS": "cvode/cvode.h",
        "OpenGL": "GL/gl.h",
        "assimp": "assimp/scene.h",
        "meshoptimizer": "meshoptimizer.h",
        "stb_image": "stb/stb_image.h",
        "stb_truetype": "stb/stb_truetype.h",
        "libdeflate": "libdeflate.h",
        "HDF5": "hdf5.h",
        "muParser": "muParser.h",
        "toml++": "toml++/toml.h",
        "xxHash": "xxhash.h",
        "matio": "matio.h",
        "libzip": "zip.h",
        "pugixml": "pugixml.hpp",
        "NetCDF": "netcdf.h",
        "CLI11": "CLI/CLI.hpp",
        "Boost": "boost/math/special_functions/erf.hpp",
        "NLopt": "nlopt.h",
        "Eigen/Sparse": "Eigen/Sparse",
    }
    for name, _, allowed, _ in CONFINED:
        path = "interp/a.h" if re.fullmatch(allowed, "render/draw/a.cpp") else "render/draw/a.cpp"
        plants.append((path, f"#include <{headers[name]}>", f"{name} is included outside its place"))
    problems = []
    clean = {"sim/base/hdf5_file.h": '#include "sim/base/types.h"\n#include <hdf5.h>\n', "interp/a.cpp": "\n" + SHARED_HEADER + "\n"}
    for path, line, rule in plants:
        # The line stands first, in the middle and last.
        for text in (line + "\nint a;\n", "int a;\n" + line + "\nint b;\n", "int a;\n\n" + line):
            found = breaches({**clean, path: text}, TOP + ([path.split("/")[0]] if path.split("/")[0] not in TOP else []))
            if not any(each.startswith(rule) for each in found):
                problems.append(f"not found: '{line}' in {path} ({rule})")
            if len(found) != 1:
                problems.append(f"one breach, '{line}' in {path}, is told {len(found)} times: {found}")
    for allowed, header in (("render/draw/a.h", "GL/gl.h"), ("render/draw/b.h", "GL/gl.h")):
        clean[allowed] = f"#include <{header}>\n"
    if not any("OpenGL is included in more than 1 file(s)" in each for each in breaches(clean, TOP)):
        problems.append("not found: a library in two files")
    del clean["render/draw/b.h"]
    if "the top level lacks assets" not in breaches(clean, [name for name in TOP if name != "assets"]):
        problems.append("not found: a missing folder")
    problems += [f"a clean tree is blamed: {each}" for each in breaches(clean, TOP + PRODUCTS)]
    return problems


def main():
    if sys.argv[1:] == ["--self-test"]:
        found = self_test()
    else:
        root = sys.argv[1] if len(sys.argv) > 1 else os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
        found = breaches(read(root), sorted(os.listdir(root)))
    print("\n".join(found), end="\n" if found else "")
    return 1 if found else 0


sys.exit(main())
