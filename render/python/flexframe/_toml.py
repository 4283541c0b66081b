"""Python values as TOML text: what a scene file may hold."""

import math

import numpy as np


def _text(value):
    escapes = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}
    return '"' + "".join(escapes.get(c, c if c >= " " and c != "\x7f" else f"\\u{ord(c):04x}") for c in value) + '"'


def _key(key):
    bare = key and all(c.isascii() and (c.isalnum() or c in "_-") for c in key)
    return key if bare else _text(key)


def to_toml(value, root=False):
    """The text of a value; of a dict inline, or with root=True as a document. Raises TypeError for what TOML has not."""
    if root:
        return "".join(f"{_key(key)} = {to_toml(item)}\n" for key, item in value.items())
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        number = float(value)
        if not math.isfinite(number):
            raise ValueError(f"a scene holds finite numbers, found {number}")
        return repr(number)
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(key)} = {to_toml(item)}" for key, item in value.items()) + " }"
    if isinstance(value, np.ndarray):
        return to_toml(value.tolist())
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(to_toml(item) for item in value) + "]"
    if isinstance(value, str):
        return _text(value)
    if hasattr(value, "__fspath__"):
        return _text(str(value))
    raise TypeError(f"{type(value).__name__} is nothing that a scene file can hold")
