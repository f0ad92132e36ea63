"""The words of verdicts, by meaning, and the rows of a page that say them.

The words stand here once more on purpose: a catalogue that has the word of a failed limit for one
that was kept is not told from a right one by anything but its meaning.
"""

import html
import re
from typing import NamedTuple

PINNED = {
    "en": {},
    "de": {
        "passed": "bestanden", "FAILED": "VERLETZT", "goal reached": "Ziel erreicht",
        "not judged": "nicht beurteilt", "decides": "entscheidet", "done": "fertig",
        "ended here": "hier beendet", "not reached": "nicht erreicht", "fell": "gefallen",
        "walked to the planned end": "bis zum geplanten Ende gegangen",
        "The walker falls there.": "Dort fällt das Gehmodell.",
        "identified": "identifiziert", "weak": "schwach", "not identified": "nicht identifiziert",
        "fitted": "angepasst", "predicted": "vorhergesagt",
        "right": "rechts", "left": "links", "Right": "Rechts", "Left": "Links",
        "record": "Aufnahme", "walk": "Gang", "Record": "Aufnahme", "Walk": "Gang",
        "Before": "Vorher", "After": "Nachher", "female": "weiblich", "male": "männlich",
    },
    "pt": {
        "passed": "aprovado", "FAILED": "REPROVADO", "goal reached": "meta alcançada",
        "not judged": "não avaliado", "decides": "decide", "done": "feito",
        "ended here": "terminou aqui", "not reached": "não alcançado", "fell": "caiu",
        "walked to the planned end": "andou até o fim planejado",
        "The walker falls there.": "O caminhante cai ali.",
        "identified": "identificado", "weak": "fraco", "not identified": "não identificado",
        "fitted": "ajustado", "predicted": "previsto",
        "right": "direito", "left": "esquerdo", "Right": "Direito", "Left": "Esquerdo",
        "record": "registro", "walk": "marcha", "Record": "Registro", "Walk": "Marcha",
        "Before": "Antes", "After": "Depois", "female": "feminino", "male": "masculino",
    },
}  # fmt: skip
LANGUAGES = tuple(PINNED)
SENSES = {
    "en": r"(?P<failed>\b[Ff]ail(?:ed|s)?\b|FAILED)|(?P<kept>\bkept\b|(?<!-)\bpass(?:es|ed)?\b)",
    "de": (
        r"(?P<failed>verletzt|VERLETZT|[Nn]icht (?:eingehalten|bestanden|erfüllt)|NICHT EINGEHALTEN"
        r"|verfehlen)|(?P<kept>eingehalten|bestanden|erfüllt)"
    ),
    "pt": (
        r"(?P<failed>[Nn]ão (?:(?:foram|foi|são|se) )?(?:respeitad|aprovad|cumprid)|REPROVADO"
        r"|[Rr]eprovad|NÃO CUMPRIDOS|falhar)|(?P<kept>respeitad|aprovad|cumprid)"
    ),
}
"""What sentences of limits say in each language."""
SIDES = {
    "en": r"(?<!are )\b(?:(right)|(left)(?! out)(?:ward)?)\b",
    "de": r"\b(?:(recht)|(link))",
    "pt": r"\b(?:(direit)|(esquerd))",
}


def word(text: str, language: str) -> str:
    """The one of `PINNED` that means an English `text`."""
    return PINNED[language].get(text, text)


def says(text: str, language: str) -> str:
    """Whether a sentence says, first of all, that limits were "kept" or "failed"."""
    found = re.search(SENSES[language], _without_values(text))
    return "" if found is None else str(found.lastgroup)


def sides(text: str, language: str) -> list[str]:
    """The sides that a text names, in its order."""
    found = re.finditer(SIDES[language], _without_values(text), re.I)
    return ["right" if each[1] else "left" for each in found]


def _without_values(text: str) -> str:
    return re.sub(r"%\(\w+\)s|\{\w+\}", "", text)


class Row(NamedTuple):
    """A row of a table: whether it is marked as failed, its cells, and the class of each word."""

    failed: bool
    cells: list[str]
    marked: list[tuple[str, str]]


def rows_of(page: str) -> list[Row]:
    """The rows of all tables of a page."""
    return [
        Row(
            "failed" in (re.search(r'class="([^"]*)"', given) or [""])[0],
            [plain(each) for each in re.findall(r"<td.*?>(.*?)</td>", inner, re.S)],
            [
                (kind, plain(message))
                for kind, message in re.findall(
                    r'<(?:span|strong) class="(pass|fail)">(.*?)</(?:span|strong)>', inner, re.S
                )
            ],
        )
        for given, inner in re.findall(r"<tr(.*?)>(.*?)</tr>", page, re.S)
    ]


def headline(page: str, which: int = 0) -> tuple[bool, str]:
    """The sentence of a verdict, and whether it is marked as failed."""
    kind, inner = re.findall(r'<p class="(headline[^"]*)">(.*?)</p>', page, re.S)[which]
    return "fail" in kind or 'class="fail"' in inner, plain(inner)


def plain(text: str) -> str:
    """Without tags, entities and line breaks."""
    return " ".join(html.unescape(re.sub(r"<[^>]*>", "", text)).split())
