#!/usr/bin/env python3
"""Every public function has its comment: documented.py [INCLUDE_FOLDER], by default build/clang/include.

Looks at the public headers as they are installed. A function is documented by a comment above it, behind it, or above the functions that
stand directly before it. Constructors and operators that say no more than their type, and what the compiler makes (= default), need none.
Exit 1 names the others with file and line.
"""

import pathlib
import re
import sys

FUNCTION = re.compile(r"^(?!.*\b(using|typedef|static_assert|return|friend)\b)[^=;{}]*?([A-Za-z_]\w*|operator\S+)\s*\(")
NEEDS_NONE = re.compile(r"=\s*(default|delete)\s*[;{]|^\s*(explicit\s+)?~?([A-Z]\w*)\((\3\s*(const\s*)?&&?.*)?\)|operator")


def statements(text):
    """Declarations of namespace and class level with the line they begin in: (line, indent, declaration, has a comment, stands alone)."""
    lines = text.splitlines()
    depth_of_body = None  # inside of a function's body: the depth at which it ends
    depth, access, comment, above, k = 0, ["public"], False, False, 0
    while k < len(lines):
        line = lines[k]
        code = re.sub(r'"(\\.|[^"\\])*"', '""', line).split("//")[0]
        stripped = line.strip()
        if depth_of_body is None:
            if not stripped or stripped.startswith("#"):
                comment = above = False
            elif stripped.startswith("//"):
                comment = True
            elif re.match(r"(public|private|protected):", stripped):
                access[-1] = stripped.split(":")[0]
                comment = above = False
            else:
                # A declaration may go over several lines.
                first, whole, said = k, code, comment or "//" in line
                while not re.search(r"[;{}]", whole) and k + 1 < len(lines):
                    k += 1
                    said = said or "//" in lines[k]
                    whole += " " + lines[k].split("//")[0].strip()
                said = said or above
                if all(word == "public" for word in access):
                    yield first + 1, whole.strip(), said
                above, comment, code = said, False, whole
                if code.count("{") > code.count("}"):
                    if re.match(r"\s*(template.*>\s*)?(class|struct|namespace|enum|union)\b", code):
                        access.append("private" if re.match(r"\s*(template.*>\s*)?class\b", code) else "public")
                        above = False
                    else:
                        depth_of_body = depth
        depth += code.count("{") - code.count("}")
        if depth_of_body is not None and depth <= depth_of_body:
            depth_of_body = None
        while depth_of_body is None and len(access) - 1 > depth and len(access) > 1:
            access.pop()
            above = False
        k += 1


def main():
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "build/clang/include")
    headers = sorted(folder.rglob("*.h"))
    count, missing = 0, []
    for header in headers:
        text = header.read_text(encoding="utf-8")
        if not text.startswith("//"):
            missing.append(f"{header.relative_to(folder)}:1: the header does not say what it is for")
        for line, code, said in statements(text):
            if not FUNCTION.match(code) or NEEDS_NONE.search(code):
                continue
            count += 1
            if not said:
                missing.append(f"{header.relative_to(folder)}:{line}: no comment: {code[:120]}")
    print(*missing, f"{len(headers)} public headers, {count} public functions, {len(missing)} without a comment", sep="\n")
    if not headers or count < 50:
        print(f"{folder}: there are too few public headers: is this the include folder of a build?")
        return 1
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
