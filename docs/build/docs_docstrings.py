"""How mkdocstrings reads our docstrings: in `name : text` the text describes a parameter, not its
type.

The type is in the signature, where mypy checks it; so the text is moved to the line below the name,
where numpydoc expects the description, and the site shows both.
"""

import re
from typing import Any

from griffe import Extension, Object

_SECTIONS = r"(?:Parameters|Attributes|Raises|Returns|Yields)\n-+\n"
_SECTION = re.compile(rf"(^{_SECTIONS})(.*?)(?=^\w[^\n]*\n-{{3,}}\n|\Z)", re.MULTILINE | re.DOTALL)
_ENTRY = re.compile(r"^(\w[\w, *]*?) : (.+)$", re.MULTILINE)


def described(text: str) -> str:
    """A docstring with the text after each name on a line of its own."""
    return _SECTION.sub(lambda found: found[1] + _ENTRY.sub(r"\1\n    \2", found[2]), text)


class Descriptions(Extension):
    """Rewrites every docstring before it is parsed."""

    def on_object(self, *, obj: Object, **_: Any) -> None:
        """Called for each module, class, function and attribute."""
        if obj.docstring is not None:
            obj.docstring.value = described(obj.docstring.value)
