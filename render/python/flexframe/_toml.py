"""Python values as TOML text: what a scene file may hold."""

import math

import numpy as np


def _text(value):
    escapes = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}
    return '"' + "".join(escapes.get(c, c if c >= " " and c != "\x7f" else f"\\u{ord(c):04x}") for c in value) + '"'


def _key(key, at):
    if not isinstance(key, str):
        raise TypeError(f"{at or 'scene'}: a key must be text, found {key!r}")
    bare = key and all(c.isascii() and (c.isalnum() or c in "_-") for c in key)
    return key if bare else _text(key)


def to_toml(value, root=False, at=""):
    """The text of a value; of a dict inline, or with root=True as a document. at: where it stands, for messages.

    Raises TypeError for what TOML has not, ValueError for numbers that are not finite.
    """
    if root:
        return "".join(f"{_key(key, at)} = {to_toml(item, at=str(key))}\n" for key, item in value.items())
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        number = float(value)
        if not math.isfinite(number):
            raise ValueError(f"{at + ': ' if at else ''}a scene holds finite numbers, found {number}")
        return repr(number)
    if isinstance(value, dict):
        inside = (f"{_key(key, at)} = {to_toml(item, at=f'{at}.{key}' if at else str(key))}" for key, item in value.items())
        return "{ " + ", ".join(inside) + " }"
    if isinstance(value, np.ndarray):
        return to_toml(value.tolist(), at=at)
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(to_toml(item, at=f"{at}[{k}]") for k, item in enumerate(value)) + "]"
    if isinstance(value, str):
        return _text(value)
    if hasattr(value, "__fspath__"):
        return _text(str(value))
    what = "None (leave the key out)" if value is None else f"a value of type {type(value).__name__}"
    raise TypeError(f"{at + ': ' if at else ''}a scene holds numbers, texts, true and false, lists and tables, found {what}")
