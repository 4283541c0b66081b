"""The list of plain cases: what each says, and which tests hold it besides."""
from collections import namedtuple
from dataclasses import dataclass

CASES = {}
Case = namedtuple("Case", "says held make")


@dataclass
class Modes:
    """A scene whose small motions are asked for: poles (rad/s, imaginary part >= 0) that `check` has to find, and how many it has
    to call unstable, and rigid where that is said. scale: of the error, default each pole's size."""

    text: str
    poles: tuple
    what: str
    unstable: int = 0
    rigid: int | None = None
    scale: float | None = None
    claim: float = 0.01


def case(says, held=""):
    """Makes a generator of scenes a case; `says` is its row in the table."""

    def add(make):
        CASES[make.__name__] = Case(says, held, make)
        return make

    return add
