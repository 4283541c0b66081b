"""Doxygen's filter: the headers' plain comments as Doxygen's. doxygen_comments.py FILE"""

import re
import sys

lines = open(sys.argv[1], encoding="utf-8").read().splitlines()
out, head = [], True
for line in lines:
    # The comment at the top speaks of the file.
    if head and line.startswith("//"):
        out.append(("/// @file\n" if not out else "") + "///" + line[2:].replace("@", "\\@").replace("<", "\\<").replace(">", "\\>"))
        continue
    head = False
    alone = re.match(r"(\s*)//(?!/)(.*)$", line)
    behind = re.match(r"(.*[^\s].*?)\s*//(?!/)(.*)$", line)
    found = alone or behind
    if found:
        said = found.group(2).replace("\\", "\\\\").replace("@", "\\@").replace("<", "\\<").replace(">", "\\>").replace("#", "\\#")
        out.append(found.group(1) + ("///" if alone else " ///<") + said)
    else:
        out.append(line)
print("\n".join(out))
