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
    return re.findall(r"^  ([a-z][a-z-]*) +(.+)$", part, re.M)


def words_of(form, words, text):
    """What may stand behind an option, as its help lists it ("a, b (which is ...) or c"); empty: anything."""
    if form not in ("WORD", "LIST"):
        return []
    if "see below" in words:
        return re.findall(r"^  ([a-z-]+) {2,}\S", text.split("Templates:")[1].split("Examples:")[0], re.M)
    one = r"[a-z][\w-]*"
    plain = re.sub(r" \([^)]*\)", "", words)
    listed = re.search(rf"((?:{one}, )*{one} or {one})", plain)
    if listed:
        return re.split(r", | or ", listed.group(1))
    listed = re.search(rf"any of ({one}(?:,{one})+)", plain)
    return listed.group(1).split(",") if listed else re.findall(rf"'({one})'", plain)


def ending_of(text):
    """The ending of the files that a command takes, ".toml"; empty: any."""
    usage = next((line for line in text.splitlines() if line.startswith("Usage:")), "")
    return ".toml" if "SCENE" in usage else ".h5" if "RESULTS" in usage else ""


class Command:
    """A subcommand as its help tells it. options: [(names, form, words, what may stand behind it)]."""

    def __init__(self, name, words, text):
        self.name, self.words, self.text, self.ending = name, words, text, ending_of(text)
        self.options = [(names, form, told, words_of(form, told, text)) for names, form, told in options_of(text)]


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
    def values(command):
        rows = []
        for names, form, _, allowed in command.options:
            if form:
                make = f'compgen -W "{" ".join(allowed)}" --' if allowed else "compgen -d --" if form == "DIR" else ""
                make = "compgen -f --" if not make and "FILE" in form else make
                # What nobody can guess is left to the user: no names of files behind a number.
                answer = f'mapfile -t COMPREPLY < <({make} "$word")' if make else "COMPREPLY=()"
                rows.append(f"        {'|'.join(names)}) {answer}; return ;;")
        return "\n".join(rows)

    def words(command):
        return " ".join(sorted({name for names, *_ in command.options for name in names}))

    cases = []
    for command in commands:
        ending = f" ending={command.ending}" if command.ending else ""
        cases.append(f'    {command.name}) words="{words(command)}"{ending}\n      case $before in\n{values(command)}\n      esac ;;')
    names = " ".join(command.name for command in commands)
    return f"""# bash completion of flexframe
_flexframe() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD - 1]}} words= ending=
  if ((COMP_CWORD == 1)); then
    mapfile -t COMPREPLY < <(compgen -W "{names} --help --version" -- "$word")
    return
  fi
  case ${{COMP_WORDS[1]}} in
{chr(10).join(cases)}
  esac
  if [[ $word == -* ]]; then mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
  elif [[ $ending ]]; then mapfile -t COMPREPLY < <(compgen -f -X "!*$ending" -- "$word"; compgen -d -- "$word")
  else mapfile -t COMPREPLY < <(compgen -f -- "$word"); fi
}}
complete -o filenames -F _flexframe flexframe
"""


def shell_quote(text):
    return "'" + text.replace("'", "'\\''") + "'"


def zsh(commands):
    names = "\n".join(f"    {shell_quote(command.name + ':' + command.words.replace(':', ' '))}" for command in commands)
    cases = []
    for command in commands:
        rows = []
        for spellings, form, words, allowed in command.options:
            clean = words.replace("[", "(").replace("]", ")").replace(":", " ")
            files = "_files -/" if form == "DIR" else "_files" if "FILE" in form else " "
            behind = f":{form.replace(':', ' ')}:" + (f"({' '.join(allowed)})" if allowed else files) if form else ""
            rows += [f"        {shell_quote(f'{n}[{clean}]{behind}')}" for n in spellings]
        files = f'_files -g "*{command.ending}"' if command.ending else "_files"
        cases.append(f"    {command.name}) _arguments \\\n" + " \\\n".join(rows) + f" \\\n        '*:file:{files}' ;;")
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
    for command in commands:
        lines.append(f"complete -c flexframe -n __fish_use_subcommand -f -a {command.name} -d {shell_quote(command.words)}")
        seen = f"-n '__fish_seen_subcommand_from {command.name}'"
        if command.ending:
            lines.append(f"complete -c flexframe {seen} -k -f -a '(__fish_complete_suffix {command.ending})'")
        for spellings, form, text, allowed in command.options:
            flags = " ".join(f"-l {n[2:]}" if n.startswith("--") else f"-s {n[1:]}" for n in spellings)
            needs = ""
            if form:
                folders = "(__fish_complete_directories)"
                choice = " ".join(allowed) or (folders if form == "DIR" else "")
                needs = f" -x -a {shell_quote(choice)}" if choice else " -r -F" if "FILE" in form else " -x"
            lines.append(f"complete -c flexframe {seen} {flags}{needs} -d {shell_quote(text)}")
    return "\n".join(lines) + "\n"


def main(program, folder):
    folder = pathlib.Path(folder)
    (folder / "man1").mkdir(parents=True, exist_ok=True)
    version = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout.split("\n")[0]
    top = ask(program)
    commands = [Command(name, words, ask(program, name)) for name, words in commands_of(top)]
    (folder / "man1/flexframe.1").write_text(page("flexframe", "flexible multibody simulation and its pictures", version, top))
    for command in commands:
        name = f"flexframe-{command.name}"
        (folder / f"man1/{name}.1").write_text(page(name, command.words, version, command.text))
    (folder / "flexframe.bash").write_text(bash(commands))
    (folder / "_flexframe").write_text(zsh(commands))
    (folder / "flexframe.fish").write_text(fish(commands))


if __name__ == "__main__":
    main(*sys.argv[1:])
