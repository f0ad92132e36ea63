"""What a measurement is worth: the topic has the name of the decorator `evidence.measurement`.

An import of this package puts it where the decorator was, so it is one, too.
"""

import sys
from types import ModuleType
from typing import Any

from evidence import registry


class _Topic(ModuleType):
    """A package that marks measurements when it is called."""

    def __call__(self, *options: registry.Option) -> Any:
        return registry.measurement(*options)


sys.modules[__name__].__class__ = _Topic
