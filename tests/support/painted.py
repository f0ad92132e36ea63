"""What a browser paints of a figure."""

import re
from collections.abc import Iterator
from xml.etree import ElementTree

import numpy as np

XLINK = "{http://www.w3.org/1999/xlink}href"


def style_of(node: ElementTree.Element) -> dict[str, str]:
    pairs = (each.partition(":") for each in node.get("style", "").split(";"))
    return {name.strip(): value.strip() for name, _, value in pairs if name.strip()}


def drawn(text: str) -> list[tuple[str, np.ndarray, dict[str, str], tuple[str, ...], str]]:
    """What a browser paints of an SVG, in order: kind, place, look, clips and words."""
    tree = ElementTree.fromstring(text)
    named = {node.get("id"): node for node in tree.iter() if node.get("id")}

    def walk(node, at, look, clips) -> Iterator[tuple]:
        tag = node.tag.rpartition("}")[2]
        if tag in ("defs", "style", "clipPath"):
            return
        look = look | style_of(node)
        clips = (*clips, node.get("clip-path")) if node.get("clip-path") else clips
        moved = re.search(r"translate\(([-\d.]+)[ ,]([-\d.]+)\)", node.get("transform", ""))
        turned = re.sub(r"translate\([^)]*\)", "", node.get("transform", "")).strip()
        if moved and not turned:
            at = at + np.array([float(moved[1]), float(moved[2])])
        if turned:
            look = look | {"transform": node.get("transform")}
        if tag == "use":
            shift = np.array([float(node.get("x")), float(node.get("y"))])
            yield from walk(named[node.get(XLINK)[1:]], at + shift, look, clips)
        elif tag == "path" and (look.get("fill") != "none" or "stroke" in look):  # else unseen
            numbers = np.array(re.findall(r"-?\d[\d.]*", node.get("d")), dtype=float)
            letters = "".join(re.findall("[A-Za-z]", node.get("d")))
            # marks of one line are as many paths, or one
            ends = [i for i, each in enumerate(letters.lower().replace("z", "")) if each == "m"]
            parts = zip(ends, [*ends[1:], None], strict=True) if letters == "ML" * len(ends) else ()
            for first, end in parts or [(0, None)]:
                part = slice(first, end)
                yield letters[part], numbers.reshape(-1, 2)[part] + at, look, clips, ""
        elif tag == "text":
            yield "text", at[None], look, clips, node.text
        for child in node:
            yield from walk(child, at, look, clips)

    return [*walk(tree, np.zeros(2), {}, ())]
