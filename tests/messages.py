#!/usr/bin/env python3
"""Every sentence that a user can see: tests/messages.py [WORD...]

Lists the texts of three words and more in the sources of sim, interp and render with file and line, neighbouring literals joined; with
WORDs only those that contain one of them. For reading them as a user would.
"""

import pathlib
import re
import sys

LITERAL = re.compile(r'"((?:[^"\\\n]|\\.)*)"')


def texts(path):
    line_of, joined, last_end = None, "", None
    source = path.read_text(encoding="utf-8")
    source = re.sub(r"(?m)^\s*#.*$|//.*$", lambda m: m.group(0) if m.group(0).count('"') % 2 else " " * len(m.group(0)), source)
    for match in LITERAL.finditer(source):
        between = source[last_end : match.start()] if last_end is not None else "x"
        if joined and not between.strip():
            joined += match.group(1)
        else:
            if joined:
                yield line_of, joined
            joined, line_of = match.group(1), source.count("\n", 0, match.start()) + 1
        last_end = match.end()
    if joined:
        yield line_of, joined


def main():
    root = pathlib.Path(__file__).resolve().parent.parent
    words = sys.argv[1:]
    count = 0
    for module in ("sim", "interp", "render"):
        for path in sorted((root / module).rglob("*")):
            if path.suffix not in (".h", ".cpp") or "shaders" in path.name:
                continue
            for line, text in texts(path):
                if len(re.findall(r"[A-Za-z]{2,}", text)) < 3 or (words and not any(w in text for w in words)):
                    continue
                count += 1
                print(f"{path.relative_to(root)}:{line}: {text}")
    print(f"{count} sentences", file=sys.stderr)


if __name__ == "__main__":
    main()
