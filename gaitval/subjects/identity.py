"""Who a subject is: laboratory, person and trial, and what to assume where nothing says so.

Two subjects are of the same person if laboratory and person are the same. Files and imports that
do not say them are still read; what was assumed is kept in `Subject.guessed` for a reader to see.
"""

import re
from collections.abc import Mapping, Sequence
from typing import Any, Final, Literal, NamedTuple

from gaitval._internal.io.text_tables import HIDDEN

Aid = Literal["crutches", "rail", "support"]
"""What carries a part of a walking person's body: crutches, canes or a walker; the rail of a
treadmill; a harness."""

WBDS: Final = "WBDS"
"""Laboratory of the people of Fukuchi, Fukuchi & Duarte (2018), WBDS01 to WBDS42."""
OWN: Final = "own"
"""Laboratory of a recording for which none is given."""

_PERSON: Final = re.compile(r"(WBDS\d\d)(?:\s|(?:walk|static)|$)", re.IGNORECASE)
_TRIAL: Final = re.compile(r"WBDS\d\dwalk([TO]\w{1,3}?)(?:mkr|_?grf)?", re.IGNORECASE)


def wbds_person(text: str) -> str:
    """The person of WBDS that `text`, a name of a file or a person, begins with; else empty."""
    found = _PERSON.match(text)
    return found[1].upper() if found else ""


def wbds_trial(stem: str) -> str:
    """The trial of WBDS that a file is of, by its name without ending, `stem`; else empty."""
    found = _TRIAL.fullmatch(stem)
    return found[1] if found else ""


def trial_name(text: str) -> str:
    """A trial's name from any text: letters, digits, hyphen and underscore are kept."""
    return re.sub(r"[^A-Za-z0-9_-]", "", text) or "recorded"


def line_of_text(text: str) -> str:
    """The `text` in one line that pages, tables and XML can show: line breaks and tabs are blanks.
    Raises ValueError where a letter is another one of `text_tables.HIDDEN`.
    """
    text = re.sub(r"\s*[\n\r\t\v\f\x85\u2028\u2029]\s*", " ", text)
    if found := HIDDEN.search(text):
        raise ValueError(
            f"{text!r}: letter {found.start() + 1} is {found[0]!r}, which no page can show. Take "
            "it out."
        )
    return text


def same_name(one: str, other: str) -> bool:
    """Whether `one` and the `other` name are of one person or laboratory, however they are
    written: capitals and blanks do not count.
    """
    first, second = ("".join(name.split()).casefold() for name in (one, other))
    return first == second


class Identity(NamedTuple):
    """Who it is; `guessed` says what of it nobody gave, and where it was taken from."""

    person: str
    laboratory: str
    guessed: str | None


def identity(
    person: str | None,
    laboratory: str | None,
    *,
    sources: Sequence[str],
    name: str,
    recorded: tuple[str, str] = ("", ""),
) -> Identity:
    """Who a subject is, from the `person` and `laboratory` that were given and, where one is None,
    from names: `sources`, of the files or an earlier file's source, by which people of WBDS are
    known; `recorded`, the person's in a recording and that of its file; and the subject's `name`.
    """
    of_wbds = next(((wbds_person(text), text) for text in sources if wbds_person(text)), None)
    candidates = (
        of_wbds and (of_wbds[0], f"as {of_wbds[1]} says"),
        recorded[0] and (recorded[0], f"the name in {recorded[1]}"),
        (name, "the name of the subject"),
    )
    assumed: list[str] = []
    if person is None:
        person, origin = next(each for each in candidates if each)
        assumed.append(f'person "{person}", {origin}')
    known = _known(person)
    if laboratory is None:
        laboratory = WBDS if known else OWN
        origin = "the dataset of that person" if laboratory == WBDS else "since none was given"
        assumed.append(f'laboratory "{laboratory}", {origin}')
    if known and same_name(str(laboratory), WBDS):  # else their own gait would be other people's
        person, laboratory = known, WBDS
    return Identity(person, laboratory, "; ".join(assumed) or None)


def _known(person: object) -> str:
    """The person of WBDS, however it is written; a file may have anything here, not only text."""
    return wbds_person("".join(str(person).split()))


def with_identity(values: Mapping[str, Any]) -> dict[str, Any]:
    """The values of a subject file, with person, trial and laboratory.

    Earlier files have only `source`, whose first word was the person and whose last the trial. That
    holds for people of WBDS. An import wrote the names of its files there, which name nobody: the
    name of such a subject is taken for the person's.
    """
    source, given = str(values.get("source", "")), dict(values)
    person, laboratory, guessed = identity(
        given.get("person"),
        given.get("laboratory"),
        sources=[source],
        name=str(values.get("identifier") or "unnamed"),
    )
    found = {"trial": trial_name("".join(source.split()[-1:])), **given}
    found |= {"person": person, "laboratory": laboratory}
    return found | {"guessed": guessed} if guessed else found
