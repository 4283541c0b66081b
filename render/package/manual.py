#!/usr/bin/env python3
"""Manual pages and completions from what `flexframe --help` says: manual.py FLEXFRAME FOLDER

Writes FOLDER/man1/flexframe.1 and flexframe-COMMAND.1, FOLDER/flexframe.bash, FOLDER/_flexframe (zsh) and FOLDER/flexframe.fish. There is
one text, that of the program: what it says about itself is read here and nowhere written again.
"""

import pathlib
import re
import subprocess
import sys


def ask(program, *words):
    return subprocess.run([program, *words, "--help"], capture_output=True, text=True, check=True).stdout


def options_of(text):
    """[(names, form, words)] of a help text."""
    found = []
    for line in text.splitlines():
        if line.startswith("  -"):
            head, _, words = line.strip().partition("  ")
            names, _, form = head.partition(" ")
            found.append([[n.strip() for n in names.split(",")], form.strip(), words.strip()])
        elif found and line.startswith(" " * 20) and line.strip():
            found[-1][2] = (found[-1][2] + " " + line.strip()).strip()
    return found


def commands_of(text):
    """[(name, words)] of the program's help."""
    part = text.split("Subcommands:")[1]
    return re.findall(r"^  ([a-z]+) +(.+)$", part, re.M)


def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return re.sub(r"^([.'])", r"\\&\1", text, flags=re.M)


SECTIONS = {"Positionals:": "ARGUMENTS", "Options:": "OPTIONS", "Subcommands:": "COMMANDS", "Examples:": "EXAMPLES"}


def body(text):
    """Lines of a help text as roff: sections, options as tagged paragraphs, examples as they stand."""
    lines, kind = [".SH DESCRIPTION"], "text"
    for line in text.splitlines():
        if line.startswith("Usage:"):
            continue
        if line in SECTIONS:
            lines += [".fi"] if kind == "examples" else []
            kind = "examples" if line == "Examples:" else "entries"
            lines += [f".SH {SECTIONS[line]}"] + ([".nf"] if kind == "examples" else [])
        elif kind == "entries" and line.startswith("  ") and not line.startswith(" " * 20):
            head, _, words = line.strip().partition("  ")
            lines += [".TP", f"\\fB{roff(head)}\\fR", roff(words.strip())]
        elif kind == "entries" and line.strip() and not line.startswith(" "):
            lines += [".SH NOTES", roff(line)]
            kind = "text"
        elif line.strip():
            # An indented line of a text is one of its own.
            own = kind == "text" and line.startswith(" ")
            lines += ([".br"] if own else []) + [roff(line.strip() if kind != "examples" else line)] + ([".br"] if own else [])
        elif kind == "text":
            lines.append(".PP")
    return lines + ([".fi"] if kind == "examples" else [])


def page(name, title, version, text):
    lines = [f'.TH {name.upper().replace("-", chr(92) + "-")} 1 "" "flexframe {version}" "User Commands"']
    lines += [".SH NAME", f"{roff(name)} \\- {roff(title)}", ".SH SYNOPSIS"]
    usage = next((line for line in text.splitlines() if line.startswith("Usage:")), "Usage: flexframe [OPTIONS] SUBCOMMAND")
    lines += [roff(usage.removeprefix("Usage: "))] + body(text)
    lines += [".SH SEE ALSO", ".BR flexframe (1);", "the words of scene files: SCENE.md in the package's documentation."]
    return "\n".join(lines) + "\n"


def bash(commands):
    def words(options):
        return " ".join(sorted({name for spellings, _, _ in options for name in spellings}))

    cases = "\n".join(f'    {name}) words="{words(options)}" ;;' for name, _, options in commands)
    names = " ".join(name for name, _, _ in commands)
    return f"""# bash completion of flexframe
_flexframe() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} words
  if ((COMP_CWORD == 1)); then
    mapfile -t COMPREPLY < <(compgen -W "{names} --help --version" -- "$word")
    return
  fi
  case ${{COMP_WORDS[1]}} in
{cases}
  esac
  if [[ $word == -* ]]; then mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
  else mapfile -t COMPREPLY < <(compgen -f -- "$word"); fi
}}
complete -o filenames -F _flexframe flexframe
"""


def shell_quote(text):
    return "'" + text.replace("'", "'\\''") + "'"


def zsh(commands):
    names = "\n".join(f"    {shell_quote(name + ':' + words.replace(':', ' '))}" for name, words, _ in commands)
    cases = []
    for name, _, options in commands:
        rows = []
        for spellings, form, words in options:
            clean = words.replace("[", "(").replace("]", ")").replace(":", " ")
            rows += [f"        {shell_quote(f'{n}[{clean}]' + (f':{form}:_files' if form else ''))}" for n in spellings]
        cases.append(f"    {name}) _arguments \\\n" + " \\\n".join(rows) + " \\\n        '*:file:_files' ;;")
    return f"""#compdef flexframe
_flexframe() {{
  local -a commands=(
{names}
  )
  if ((CURRENT == 2)); then _describe command commands; return; fi
  local command=$words[2]
  shift words
  ((CURRENT--))
  case $command in
{chr(10).join(cases)}
  esac
}}
_flexframe "$@"
"""


def fish(commands):
    lines = ["# fish completion of flexframe"]
    for name, words, options in commands:
        lines.append(f"complete -c flexframe -n __fish_use_subcommand -f -a {name} -d {shell_quote(words)}")
        for spellings, form, text in options:
            flags = " ".join(f"-l {n[2:]}" if n.startswith("--") else f"-s {n[1:]}" for n in spellings)
            needs = " -r" if form else ""
            lines.append(f"complete -c flexframe -n '__fish_seen_subcommand_from {name}' {flags}{needs} -d {shell_quote(text)}")
    return "\n".join(lines) + "\n"


def main(program, folder):
    folder = pathlib.Path(folder)
    (folder / "man1").mkdir(parents=True, exist_ok=True)
    version = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout.split("\n")[0]
    top = ask(program)
    commands = [(name, words, options_of(ask(program, name))) for name, words in commands_of(top)]
    (folder / "man1/flexframe.1").write_text(page("flexframe", "flexible multibody simulation and its pictures", version, top))
    for name, words, _ in commands:
        (folder / f"man1/flexframe-{name}.1").write_text(page(f"flexframe-{name}", words, version, ask(program, name)))
    (folder / "flexframe.bash").write_text(bash(commands))
    (folder / "_flexframe").write_text(zsh(commands))
    (folder / "flexframe.fish").write_text(fish(commands))


if __name__ == "__main__":
    main(*sys.argv[1:])
