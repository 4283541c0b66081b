#!/usr/bin/env python3
"""The rooms of the project and who includes whom: tests/rooms.py [--svg FILE | --check FILE] [ROOT]

Prints a line a room with its files, its lines and the rooms it includes directly. Exits with 1 where the includes between rooms go round
in a circle. --svg draws them (needs graphviz' dot): an arrow from a room to what it is built on; arrows that follow from others are left
out. --check: exits with 1 where such a drawing shows other rooms or arrows than there are.
"""

import collections
import html
import pathlib
import re
import subprocess
import sys

INCLUDE = re.compile(r'^\s*#\s*include\s+"((?:sim|interp|render)/[^"]+)"', re.M)


def room_of(path):
    """sim/time/system.h -> sim/time; interp/map.h -> interp; sim/simulate.h -> sim (the door)."""
    parts = path.split("/")
    return "/".join(parts[:2]) if parts[0] != "interp" and len(parts) > 2 else parts[0]


def survey(root):
    files, lines, uses = collections.Counter(), collections.Counter(), collections.defaultdict(collections.Counter)
    for module in ("sim", "interp", "render"):
        for path in sorted((root / module).rglob("*")):
            if path.suffix not in (".h", ".cpp"):
                continue
            text = path.read_text(encoding="utf-8")
            here = room_of(path.relative_to(root).as_posix())
            files[here] += 1
            lines[here] += text.count("\n")
            for included in INCLUDE.findall(text):
                there = room_of(included)
                if there != here:
                    uses[here][there] += 1
    return files, lines, uses


def circle(uses):
    """A path of rooms that ends where it began, or None."""
    state = {}

    def visit(room, path):
        state[room] = "open"
        for there in uses.get(room, ()):
            if state.get(there) == "open":
                return path[path.index(there) :] + [there]
            if there not in state and (found := visit(there, path + [there])):
                return found
        state[room] = "done"
        return None

    for room in list(uses):
        if room not in state and (found := visit(room, [room])):
            return found
    return None


def arrows(uses):
    """Pairs (room, built on) that do not follow from others; uses has no circle."""

    def reached(room):
        return set(uses.get(room, ())).union(*(reached(there) for there in uses.get(room, ())))

    return {(a, b) for a in uses for b in uses[a] if not any(b in reached(c) for c in uses[a])}


def draw(rooms, uses, svg):
    colours = {"sim": "#dce9f7", "interp": "#e3f3df", "render": "#f9e7d4"}
    dot = [
        "digraph rooms {",
        'rankdir=BT; nodesep=0.25; ranksep=0.35; bgcolor="white";',
        (
            'node [shape=box, style="rounded,filled", fontname="DejaVu Sans", fontsize=11, color="#5a6b7b"]; edge [color="#7b8794",'
            " arrowsize=0.6];"
        ),
    ]
    for room in rooms:
        name = f"{room} (door)" if room == "sim" else room
        dot.append(f'"{room}" [label="{name}", fillcolor="{colours[room.split("/")[0]]}"];')
    dot += [f'"{a}" -> "{b}";' for a, b in sorted(arrows(uses))] + ["}"]
    subprocess.run(["dot", "-Tsvg", "-o", svg], input="\n".join(dot), text=True, check=True)


def drawn_otherwise(rooms, uses, svg):
    """Rooms and arrows in which a drawing differs from what there is."""
    titles = {html.unescape(t) for t in re.findall(r"<title>([^<]*)</title>", pathlib.Path(svg).read_text(encoding="utf-8"))} - {"rooms"}
    return titles ^ (set(rooms) | {f"{a}->{b}" for a, b in arrows(uses)})


def main():
    arguments = sys.argv[1:]
    task = svg = None
    if arguments[:1] in (["--svg"], ["--check"]):
        if len(arguments) < 2:
            sys.exit(__doc__)
        task, svg, arguments = arguments[0], arguments[1], arguments[2:]
    root = pathlib.Path(arguments[0]) if arguments else pathlib.Path(__file__).resolve().parent.parent
    files, lines, uses = survey(root)
    for room in files:
        print(f"{room:16} {files[room]:3} files {lines[room]:6} lines   includes {', '.join(sorted(uses[room])) or 'nothing'}")
    if found := circle(uses):
        print("CIRCLE:", " -> ".join(found))
        return 1
    if task == "--svg":
        draw(files, uses, svg)
    if task == "--check" and (other := drawn_otherwise(files, uses, svg)):
        print(f"{svg} is drawn otherwise ({', '.join(sorted(other))}): make it anew by tests/rooms.py --svg {svg}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
