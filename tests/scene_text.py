"""Scenes of the tests, table by table: rigid("arm", mass=2) is [[body]] with its name, kind and mass, in words of SCENE.md.

A key that is a word of Python takes an underscore (from_). Strings stay strings, so that "[L, 0, 0]" is an expression. What stands behind
the named words of a table may also be written as lines of the scene file: joint("a", "revolute", "ground", "arm", "axis = [1, 0, 0]").
"""
import json


def toml(value):
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(v)}" for key, v in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(toml, value)) + "]"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, (str, bool)) else repr(value)


def section(header, /, *lines, **words):
    """[header], of which a scene has one."""
    return "\n".join([f"[{header}]", *(f"{key.rstrip('_')} = {toml(value)}" for key, value in words.items()), *lines, ""])


def table(header, /, *lines, **words):
    """[[header]], of which it may have many."""
    return section(f"[{header}]", *lines, **words)


def simulation(duration, *lines, **words):
    return section("simulation", *lines, duration=duration, **words)


def ground(**frames):
    return section("ground", frames=frames)


def rigid(name, *lines, **words):
    return table("body", *lines, name=name, kind="rigid", **words)


def body(name, kind, *lines, **words):
    return table("body", *lines, name=name, kind=kind, **words)


def joint(name, kind, parent, child, *lines, **words):
    return table("joint", *lines, name=name, kind=kind, parent=parent, child=child, **words)


def force(kind, on, *lines, **words):
    return table("force", *lines, kind=kind, on=on, **words)


def coupling(name, kind, joints, *lines, **words):
    return table("coupling", *lines, name=name, kind=kind, joints=joints, **words)


def output(name, of, quantity, *lines, **words):
    return table("output", *lines, name=name, of=of, quantity=quantity, **words)
