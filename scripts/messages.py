"""Shipped: writes gaitval/reporting/languages, the texts of pages and results, for translation.

`python scripts/messages.py` brings every catalogue in `gaitval/reporting/languages` up to date: new
texts are added without a translation, those that no page has any more are removed. Texts that come
with the results (labels of figures, credibility) are listed in `gaitval/reporting/texts.txt`, where
`%(name)s` stands for a part that is translated in its turn; `tests/reporting/release_languages.py`
writes a report and names those that are missing. Titles, notes and remedies of limits are read
from `tolerances.toml`, those of quantities from `gaitval/quantities`. A text without a translation
is shown in English; `--check` names those before a release (`make translated`). A new language
begins with `python scripts/messages.py --new fr`.
"""

import argparse
import io
import os
import sys
import tomllib
from pathlib import Path
from typing import Final

from babel.messages.catalog import Catalog
from babel.messages.extract import extract
from babel.messages.pofile import read_po, write_po

from gaitval.metrics.tolerances import WALK_UNITS, load_registry
from gaitval.quantities import QUANTITIES

TEXTS: Final = "texts.txt"
TEMPLATES: Final = Path(__file__).resolve().parent.parent / "gaitval" / "reporting"
LANGUAGES: Final = TEMPLATES / "languages"
_AS_THE_PAGES: Final = {"trimmed": "true", "newstyle_gettext": "true", "silent": "false"}
_WIDTH: Final = 100


def template_texts() -> Catalog:
    """Every text of every template, with the template that it is in."""
    found = Catalog(charset="utf-8")
    for path in sorted(TEMPLATES.glob("*.j2")):
        with path.open("rb") as file:
            for _, text, comments, _ in extract("jinja2", file, options=_AS_THE_PAGES):
                found.add(text, locations=[(path.name, 0)], auto_comments=comments)
    return found


def result_texts() -> Catalog:
    """Every text that comes with the results, with the file that it is in."""
    found = Catalog(charset="utf-8")
    lines = (TEMPLATES / TEXTS).read_text(encoding="utf-8").splitlines()
    for line in lines:
        if line and not line.startswith("#"):
            found.add(line.replace("\\n", "\n"), locations=[(TEXTS, 0)])
    rows = tomllib.loads((TEMPLATES / "checklist.toml").read_text(encoding="utf-8"))["row"]
    for row in rows:
        for text in (row["item"], *(row.get(key, "") for key in ("limit", "answer", "not_done"))):
            if any(letter.isalpha() for letter in text):
                found.add(text.replace("%", "%%"), locations=[("checklist.toml", 0)])
    for quantity in QUANTITIES:
        of_tables = (
            text
            for table in quantity.tables
            for text in (
                *(table.title, table.unit, table.missing),
                *(label for label, *_ in table.rows),
            )
        )
        own = (quantity.title, quantity.axis_label, quantity.note)
        for text in (*own, *quantity.curves.values(), *of_tables):
            if any(letter.isalpha() for letter in text):
                found.add(text.replace("%", "%%"), locations=[("quantities", 0)])
    for tolerance in load_registry().tolerance:
        texts = [tolerance.title]
        if tolerance.measure in WALK_UNITS:  # the report prints their notes and remedies
            texts += [tolerance.note, tolerance.remedy]
        for text in texts:
            if text:
                found.add(text.replace("%", "%%"), locations=[("tolerances.toml", 0)])
    return found


def all_texts() -> Catalog:
    """What every catalogue has to have."""
    found = template_texts()
    for message in result_texts():
        if message.id:
            found.add(message.id, locations=message.locations)
    return found


def catalogue(path: Path) -> Catalog:
    """A catalogue as it is stored."""
    with path.open("rb") as file:
        return read_po(file, locale=path.stem)


def update(path: Path, texts: Catalog) -> None:
    """Bring a catalogue up to date, or begin one; translations stay."""
    known = catalogue(path) if path.is_file() else Catalog(locale=path.stem, charset="utf-8")
    fresh = Catalog(
        locale=path.stem,
        project="gaitval",
        version="pages",
        header_comment="# Texts of the pages; scripts/messages.py keeps the list.",
        fuzzy=False,
    )
    fresh.mime_headers = [
        pair for pair in known.mime_headers if pair[0] in ("Content-Type", "Plural-Forms")
    ]
    for message in texts:
        if not message.id:
            continue
        before = known.get(message.id)
        fresh.add(
            message.id,
            before.string if before is not None else ("", "") if message.pluralizable else "",
            locations=message.locations,
        )
    text = io.BytesIO()
    write_po(text, fresh, width=_WIDTH, omit_header=False, include_lineno=False)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")
    unfinished.write_bytes(_dateless(text.getvalue()))
    unfinished.replace(path)


def _dateless(text: bytes) -> bytes:
    """Without the lines that change with the day and with Babel's version."""
    changing = (  # and those that name nobody
        b'"POT-Creation-Date',
        b'"PO-Revision-Date',
        b'"Generated-By',
        b'"Last-Translator',
        b'"Report-Msgid',
        b'"Language-Team',
    )
    return b"".join(line for line in text.splitlines(True) if not line.startswith(changing))


def lacking(texts: Catalog) -> int:
    """Print which of the texts each catalogue lacks or has no translation of, and those that no
    page has; their number.
    """
    wanted, count = {message.id for message in texts if message.id}, 0
    for path in sorted(LANGUAGES.glob("*.po")):
        stored = {message.id: message for message in catalogue(path) if message.id}
        empty = [key for key, each in stored.items() if not each.string or not all(each.string)]
        for word, found in (
            ("lacks", wanted - stored.keys()),
            ("is of no page", stored.keys() - wanted),
            ("has no translation", empty),
        ):
            count += len(found)
            for text in found:
                print(f"{path.name}: {word}: {text}")
    return count


def main() -> None:
    """Bring the catalogues up to date."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--new", metavar="CODE", help="begin the catalogue of a language")
    parser.add_argument("--check", action="store_true", help="change nothing; exit 1 if some lack")
    given = parser.parse_args()
    if given.check:
        sys.exit(1 if lacking(all_texts()) else 0)
    new = given.new
    paths = sorted(LANGUAGES.glob("*.po")) + ([LANGUAGES / f"{new}.po"] if new else [])
    texts = all_texts()
    for path in paths:
        update(path, texts)
        missing = sum(not message.string for message in catalogue(path) if message.id)
        print(f"{path.name}: {len(texts)} texts, {missing} without a translation")


if __name__ == "__main__":
    main()
