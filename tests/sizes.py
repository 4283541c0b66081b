#!/usr/bin/env python3
"""Sizes of the sources: tests/sizes.py [--limit LINES] [ROOT]

Prints files, lines and functions of every module, the functions beyond the limit (100 lines) and those with more than six parameters. A
function may be longer, or have more, where the comment above it says why: "Long: ...", "Parameters: ...". Exits with 1 if one has no
reason.
"""

import pathlib
import re
import sys

SKIP = re.compile(
    r"^\s*(namespace|struct|class|enum|union|extern|using|template|typedef|//|#|\}|return|if|for|while|switch|else|do)\b|^\s*(//|#|\}|\{)"
)


MOST_PARAMETERS = 6


def parameters(head):
    """How many parameters the head of a function has."""
    head = re.sub(r'"(?:[^"\\]|\\.)*"', "", head)
    head = head.replace("operator()", "operator").replace("->", "")
    at = head.find("(")
    depth, angle, count = 0, 0, 1
    for k in range(at, len(head)):
        depth += (head[k] in "([{") - (head[k] in ")]}")
        angle += (head[k] == "<") - (head[k] == ">")
        count += head[k] == "," and depth == 1 and angle == 0
        if depth == 0:
            break
    return count


def functions(lines):
    """(first line, name, lines, comment above, head) of every function that ends with a brace at its own indent."""
    i = 0
    while i < len(lines):
        line = lines[i]
        indent = len(line) - len(line.lstrip(" "))
        if indent <= 2 and line.strip() and not SKIP.match(line) and "(" in line and not line.rstrip().endswith(";"):
            # The head may go over several lines until its brace.
            j = i
            while j < len(lines) and not lines[j].rstrip().endswith(("{", ";", "}")) and j - i < 12:
                j += 1
            if j < len(lines) and lines[j].rstrip().endswith("{") and "=" not in line.split("(")[0]:
                end = next((k for k in range(j + 1, len(lines)) if re.match(rf"^ {{{indent}}}\}}", lines[k])), None)
                if end is not None:
                    above = []
                    k = i - 1
                    while k >= 0 and lines[k].strip().startswith(("//", "template")):
                        above.append(lines[k])
                        k -= 1
                    name = re.search(r"([\w:~]+)\s*\(", line)
                    if name and not line.strip().startswith(("struct", "class")):
                        yield i + 1, name.group(1), end - i + 1, " ".join(above), " ".join(lines[i : j + 1])
                        i = end
        i += 1


def main():
    arguments, limit = sys.argv[1:], 100
    if arguments[:1] == ["--limit"]:
        limit, arguments = int(arguments[1]), arguments[2:]
    root = pathlib.Path(arguments[0]) if arguments else pathlib.Path(__file__).resolve().parent.parent
    bad = 0
    print(f"{'module':10} {'files':>6} {'lines':>7} {'functions':>10} {'longest':>8} {'beyond ' + str(limit):>11}")
    listed = []
    for module in ("sim", "interp", "render"):
        files = lines = count = longest = beyond = 0
        for path in sorted((root / module).rglob("*")):
            if path.suffix not in (".h", ".cpp") or "shaders" in path.name:  # texts in another language
                continue
            text = path.read_text(encoding="utf-8").split("\n")
            files += 1
            lines += len(text) - 1
            for first, name, length, above, head in functions(text):
                count += 1
                if (given := parameters(head)) > MOST_PARAMETERS:
                    reason = "Parameters:" in above
                    bad += not reason
                    listed.append(f"{path.relative_to(root)}:{first}: {name} {given} parameters{' (with a reason)' if reason else ''}")
                longest = max(longest, length)
                if length > limit:
                    beyond += 1
                    reason = "Long:" in above
                    bad += not reason
                    listed.append(f"{path.relative_to(root)}:{first}: {name} {length} lines{' (with a reason)' if reason else ''}")
        print(f"{module:10} {files:6} {lines:7} {count:10} {longest:8} {beyond:11}")
    print("\n".join(listed))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
