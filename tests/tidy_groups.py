"""Puts sources together for clang-tidy: `python3 tests/tidy_groups.py BUILD FILE...` (called by tests/tidy.sh).

Most of clang-tidy's time goes into the headers of Eigen, which every source includes: sixteen sources in one unit cost a tenth of sixteen
units. clang's analyzer treats a .cpp that the unit includes as the unit's own code. Sources that name the same helper at the outermost
level do not meet in a unit; a unit that the compiler refuses nevertheless is halved until it compiles.

Reads BUILD/compile_commands.json; writes BUILD/groups/group_N.cpp and BUILD/groups/compile_commands.json; prints the groups' files.
Exit 1 with the compiler's words where a source alone does not compile, or has no command.
"""
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

MOST = 16  # sources a unit: beyond it only memory grows
NAMES = [
    re.compile(r"^(?:[A-Za-z_][^\n;{}()=]*?[\s&*>])([A-Za-z_]\w*)\s*(?:\(|=|\{|\[)", re.M),
    re.compile(r"^(?:struct|class|enum class|enum|union)\s+([A-Za-z_]\w*)", re.M),
    re.compile(r"^using\s+([A-Za-z_]\w*)\s*=", re.M),
    re.compile(r"^namespace\s+(\w+)\s*=", re.M),
]


def names_in(path):
    """Names that the source writes at the beginning of a line: what it defines outside of functions and types."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    return {found for pattern in NAMES for found in pattern.findall(text)}


def grouped(files):
    """Lists of at most MOST files of one module that share no name."""
    groups = []
    for path in files:
        module, names = path.split("/")[0], names_in(path)
        for group in groups:
            if group["module"] == module and len(group["files"]) < MOST and not group["names"] & names:
                group["files"].append(path)
                group["names"] |= names
                break
        else:
            groups.append({"module": module, "files": [path], "names": names})
    return [group["files"] for group in groups]


def arguments_of(command):
    """(option, ...) tuples of a compile command, without the compiler, the output and the source."""
    words = shlex.split(command)[1:]
    words = words[: words.index("-o")]
    found = []
    while words:
        count = 2 if words[0] in ("-I", "-isystem", "-include") else 1
        found.append(tuple(words[:count]))
        words = words[count:]
    return found


def unit(build, commands, files, number):
    """Writes the unit of these files; returns its compile command. A helper of one source may be a local name in another: no -Wshadow."""
    path = os.path.join(build, "groups", f"group_{number}.cpp")
    with open(path, "w", encoding="utf-8") as file:
        file.writelines(f'#include "{os.path.abspath(source)}"\n' for source in files)
    options = dict.fromkeys(option for source in files for option in commands[os.path.abspath(source)])
    words = [word for option in options if option != ("-Wshadow",) for word in option]
    return {"directory": build, "file": path, "command": shlex.join(["clang++", *words, "-Wno-shadow", "-c", path])}


def main():
    build, files = os.path.abspath(sys.argv[1]), sys.argv[2:]
    with open(os.path.join(build, "compile_commands.json"), encoding="utf-8") as file:
        commands = {entry["file"]: arguments_of(entry["command"]) for entry in json.load(file)}
    unknown = [path for path in files if os.path.abspath(path) not in commands]
    if unknown:
        sys.exit(f"no compile command for {', '.join(unknown)}: is it in the list of its CMakeLists.txt?")
    shutil.rmtree(os.path.join(build, "groups"), ignore_errors=True)
    os.makedirs(os.path.join(build, "groups"))

    def compiles(entry):
        command = [*shlex.split(entry["command"]), "-fsyntax-only"]
        return subprocess.run(command, cwd=build, capture_output=True, text=True, check=False)

    entries, number, waiting = [], 0, grouped(files)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        while waiting:
            units = [unit(build, commands, group, number + i) for i, group in enumerate(waiting)]
            number += len(waiting)
            halves = []
            for group, entry, ran in zip(waiting, units, pool.map(compiles, units)):
                if ran.returncode == 0:
                    entries.append(entry)
                elif len(group) == 1:
                    sys.exit(f"{group[0]} does not compile:\n{ran.stderr}")
                else:
                    halves += [group[: len(group) // 2], group[len(group) // 2 :]]
            waiting = halves
    with open(os.path.join(build, "groups", "compile_commands.json"), "w", encoding="utf-8") as file:
        json.dump(entries, file, indent=1)
    print("\n".join(entry["file"] for entry in entries))


main()
