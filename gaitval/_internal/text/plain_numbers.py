"""Numbers of texts that others wrote, as every program reads them.

Python's `float` and `int` also take `1_0` for 10, and digits of other scripts. OpenSim and the rest
do not: they stop at such a letter, or refuse it. In a measurement it is damage.
"""

from collections.abc import Sequence


def plain_float(text: str) -> float:
    """The number that `text` says in ASCII, blanks around it allowed. Raises ValueError."""
    return float(_plain(text))


def plain_floats(texts: Sequence[str]) -> list[float]:
    """`plain_float` of each of `texts`, of which all letters are looked at at once."""
    _plain(" ".join(texts))
    return [float(text) for text in texts]


def plain_int(text: str) -> int:
    """The whole number that `text` says in ASCII, blanks around it allowed. Raises ValueError."""
    return int(_plain(text))


def _plain(text: str) -> str:
    if "_" in text or not text.isascii():
        raise ValueError(f"{text!r} is not a number")
    return text
