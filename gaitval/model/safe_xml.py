"""XML from outside, parsed so that it can do no harm.

A document may not have a document type: with one come entities, which read other files or grow
without end. Depth is bounded.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree
from xml.parsers import expat

from gaitval.errors import ModelError

DEPTH: Final = 100
"""Most elements inside each other; an OpenSim model with muscles has about twenty."""


def parse_xml(
    path: Path,
    content: bytes,
    *,
    root: str,
    kind: str,
    on_start: Callable[[str], None] = lambda _: None,
) -> ElementTree.Element:
    """The tree of the document `content` of the file `path`; what is not XML of this `kind` ("a
    URDF") with this outermost element, `root`, or not safe (a document type, too deep), is refused:
    raises ModelError. `on_start` is called with the name of every element, and may refuse it.

    Names are taken as they are, without namespaces: OpenSim writes elements such as
    `HuntCrossleyForce::ContactParameters`, at which ElementTree's own parser stops.
    """
    builder = ElementTree.TreeBuilder()
    depth = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        if depth == 0 and tag != root:
            raise ModelError(f"{path}: the outermost element is <{tag:.80}>, not <{root}>.")
        depth += 1
        if depth > DEPTH:
            raise ModelError(
                f"{path}: more than {DEPTH} elements lie in each other, which {kind} does not have."
            )
        on_start(tag)
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def doctype(*_: Any) -> None:
        raise ModelError(
            f"{path}: has a document type, which is refused because {kind} needs none. Remove it."
        )

    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = builder.data
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(content, True)
    except (expat.ExpatError, ValueError, LookupError) as error:
        raise ModelError(f"{path}: not XML ({error}); it is truncated or not {kind}.") from None
    return builder.close()
