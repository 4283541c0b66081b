#!/usr/bin/env python3
"""Makes the pages: examples/pages/make.py [--build build/clang] [--to build/pages] [--quick].

The site is made of the pages that lie in the folders, of those here, of the program's own --help, of the Python module's docstrings and of
the public headers' comments. Every block of a page here that is marked `sh`, `python` or `toml` is run or read in a folder of its own; a
command that fails, a link that leads nowhere or a word that Sphinx does not know ends with exit 1. --quick leaves out C++ and commands.

Needs the packages of [nightly] in tests/packages.txt. The first page is then build/pages/html/index.html.
"""

import argparse
import fcntl
import os
import pathlib
import pty
import re
import shutil
import struct
import subprocess
import sys
import termios

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE.parent.parent
MATHJAX = pathlib.Path("/usr/share/javascript/mathjax")
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\[\]]*\])*)\]\(([^)\s]+)\)")
problems = []


def run(words, **more):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, **more)
    if done.returncode != 0:
        problems.append(f"{' '.join(map(str, words))}: exit {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}")
    return done


class Pages:
    """The folder that Sphinx reads: pages of the tree at their own places, pages of this folder at the top."""

    def __init__(self, stage):
        self.stage = stage
        self.done = set()

    def add(self, page, to):
        """A page of the tree, and what it links to."""
        if to in self.done:
            return
        self.done.add(to)
        self.write(to, page.read_text(encoding="utf-8"), page)

    def write(self, to, text, page):
        target = self.stage / to
        target.parent.mkdir(parents=True, exist_ok=True)
        parts = re.split(r"(^```.*?^```$|^(?: {4}[^\n]*\n)+)", text, flags=re.M | re.S)
        for k in range(0, len(parts), 2):
            parts[k] = LINK.sub(lambda m: self.link(m, page, to), parts[k])
        target.write_text("".join(parts), encoding="utf-8")

    def link(self, match, page, to):
        picture, words, address = match.groups()
        if re.match(r"[a-z]+:|#", address):
            return match.group(0)
        path, _, anchor = address.partition("#")
        file = (page.parent / path).resolve()
        if file.is_dir():
            file = file / "README.md"
        if not file.exists() or SOURCE not in file.parents:
            problems.append(f"{page.relative_to(SOURCE)}: the link to {address} leads nowhere")
            return words
        place = self.place_of(file)
        if file.suffix == ".md":
            self.add(file, place)
        else:
            (self.stage / place).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(file, self.stage / place)
        relative = os.path.relpath(place, pathlib.Path(to).parent) + (f"#{anchor}" if anchor else "")
        return f"{picture}[{words}]({relative})"

    @staticmethod
    def place_of(file):
        inside = file.relative_to(SOURCE)
        return inside.name if file.parent == HERE else str(pathlib.Path("tree") / inside)


def with_answers(text, page, folder, environment, quick):
    """The page with what its commands print below them. Blocks: ```sh, ```python, ```toml FILE (a file), ```text (shown only)."""

    def block(match):
        kind, name, body = match.group(1), match.group(2).strip(), match.group(3)
        if kind == "toml" and name:
            (folder / name).write_text(body, encoding="utf-8")
            return f"```toml\n{body}```"
        if quick or kind not in ("sh", "python"):
            return f"```{kind}\n{body}```"
        words = ["bash", "-euo", "pipefail", "-c", body] if kind == "sh" else ["/usr/bin/python3", "-c", body]
        done = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True)
        if done.returncode != 0:
            problems.append(f"{page.name}: exit {done.returncode} of\n{body}{done.stdout[-1500:]}{done.stderr[-3000:]}")
        printed = done.stdout if name != "quiet" else ""
        printed = printed.replace(str(folder) + "/", "").replace(str(SOURCE) + "/", "")
        return f"```{kind}\n{body}```" + (f"\n\n```text\n{printed.rstrip()}\n```" if printed.strip() else "")

    return re.sub(r"^```(sh|python|toml)([^\n]*)\n(.*?)^```$", block, text, flags=re.M | re.S)


def on_terminal(words, columns):
    """What a program prints on a terminal that is so wide: the help's lines are folded there."""
    mine, its = pty.openpty()
    fcntl.ioctl(its, termios.TIOCSWINSZ, struct.pack("HHHH", 1000, columns, 0, 0))
    with subprocess.Popen([str(w) for w in words], stdout=its, stderr=its) as running:
        os.close(its)
        text = b""
        while True:
            try:
                part = os.read(mine, 65536)
            except OSError:  # the other end is closed
                break
            if not part:
                break
            text += part
    os.close(mine)
    if running.returncode != 0:
        problems.append(f"{words}: exit {running.returncode}")
    return text.decode().replace("\r\n", "\n")


def check_python_names(environment):
    """Every public name of the module stands on the page of its reference."""
    names = run(["/usr/bin/python3", "-c", "import flexframe; print(*flexframe.__all__)"], env=environment).stdout.split()
    page = (HERE / "python.rst").read_text(encoding="utf-8")
    for name in names:
        if not name.startswith("__") and not re.search(rf":: flexframe\.{name}$", page, flags=re.M):
            problems.append(f"python.rst: flexframe.{name} is missing")


def commands_page(program):
    """The command line from the program's own words."""
    out = ["# Commands", "", "What `flexframe COMMAND --help` says."]
    top = run([program, "--help"]).stdout
    for name in re.findall(r"^  ([a-z][a-z-]*) {3,}", top.split("Subcommands:")[1], flags=re.M):
        out += ["", f"## flexframe {name}", "", "```text", on_terminal([program, name, "--help"], 104).rstrip(), "```"]
    return "\n".join(out) + "\n"


def cpp_pages(build, out):
    """The public headers, by Doxygen, below cpp/ of the site. Their comments are plain ones: a filter makes Doxygen's of them."""
    text = (HERE / "Doxyfile").read_text(encoding="utf-8")
    root = build / "include"
    text += f"INPUT = {root / 'flexframe'}\nSTRIP_FROM_PATH = {root}\nSTRIP_FROM_INC_PATH = {root}\nOUTPUT_DIRECTORY = {out}\n"
    (out / "Doxyfile").write_text(text, encoding="utf-8")
    run(["doxygen", out / "Doxyfile"], cwd=HERE)


def main():
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    words.add_argument("--build", default="build/clang", help="a build with the program and the Python module")
    words.add_argument("--to", default="build/pages", help="where the site goes")
    words.add_argument("--quick", action="store_true", help="no C++ reference, commands are not run")
    given = words.parse_args()
    build, out = (SOURCE / given.build).resolve(), (SOURCE / given.to).resolve()
    program = build / "flexframe"
    stage, work, html = out / "stage", out / "work", out / "html"
    for folder in (stage, work, html):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
    environment = {
        **os.environ,
        "PATH": f"{build}:/usr/bin:/bin",
        "PYTHONPATH": str(build / "python"),
        "EXAMPLES": str(SOURCE / "examples"),
    }
    environment.update(PYTHONDONTWRITEBYTECODE="1", NO_COLOR="1", SOURCE=str(SOURCE))

    pages = Pages(stage)
    pages.done = {page.name for page in HERE.glob("*.md")}
    for page in sorted(HERE.glob("*.md")):
        folder = work / page.stem
        folder.mkdir()
        text = with_answers(page.read_text(encoding="utf-8"), page, folder, environment, given.quick)
        # Pictures that the page's commands have made: ![...](made/NAME.png) is NAME.png of its folder.
        for name in re.findall(r"\]\(made/([^)]+)\)", text):
            made = folder / name
            if made.exists():
                (stage / "made" / page.stem / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(made, stage / "made" / page.stem / name)
            elif not given.quick:
                problems.append(f"{page.name}: its commands have made no {name}")
        for entry in re.findall(r"<tree/([^>]+)>$", text, flags=re.M):  # of a table of contents
            pages.add(SOURCE / f"{entry}.md", f"tree/{entry}.md")
        if given.quick:
            text = re.sub(r"!\[[^\]]*\]\(made/[^)]+\)", "", text)
        parts = re.split(r"(!\[[^\]]*\]\(made/[^)]+\))", text)
        hidden = {f"@@{k}@@": part.replace("(made/", f"(made/{page.stem}/") for k, part in enumerate(parts) if k % 2}
        pages.write(page.name, "".join(part if k % 2 == 0 else f"@@{k}@@" for k, part in enumerate(parts)), page)
        text = (stage / page.name).read_text(encoding="utf-8")
        for mark, picture in hidden.items():
            text = text.replace(mark, picture)
        (stage / page.name).write_text(text, encoding="utf-8")
    (stage / "all.md").write_text("# All pages of the tree\n\n```{toctree}\n:glob:\n:titlesonly:\n\ntree/**\n```\n", encoding="utf-8")
    (stage / "commands.md").write_text(commands_page(program), encoding="utf-8")
    check_python_names(environment)
    shutil.copy(HERE / "python.rst", stage)
    shutil.copy(HERE / "conf.py", stage)
    (stage / "static").mkdir()
    shutil.copy(HERE / "pages.css", stage / "static")
    # Of MathJax what one way of output takes; its fonts for others are some 50 MB.
    for part in ("MathJax.js", "config/TeX-AMS_SVG.js", "jax/input/TeX", "jax/element", "jax/output/SVG", "extensions"):
        target = stage / "static/mathjax" / part
        target.parent.mkdir(parents=True, exist_ok=True)
        copy = shutil.copytree if (MATHJAX / part).is_dir() else shutil.copy
        copy(MATHJAX / part, target)
    if not given.quick:
        cpp_pages(build, out)
    sphinx = ["/usr/bin/python3", "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", stage, html]
    run(sphinx, env=environment)
    if not given.quick:
        shutil.copytree(out / "cpp", html / "cpp", dirs_exist_ok=True)
        for address in re.findall(r'<a href="([^"#:]+)">', (HERE / "cpp.md").read_text(encoding="utf-8")):
            if not (html / address).exists():
                problems.append(f"cpp.md: the link to {address} leads nowhere")
    print(*problems, sep="\n\n")
    count = len(list(html.rglob("*.html")))
    print(f"{count} pages in {html}, {len(problems)} problems")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
