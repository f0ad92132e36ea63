"""A file that the package ships and a script of this folder computes: written, or compared."""

import argparse
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

from gaitval._internal.io.artefacts import write_text


def parser_of(documentation: str) -> argparse.ArgumentParser:
    """Of `SCRIPT DATA [--check]`; `documentation` is the script's own."""
    parser = argparse.ArgumentParser(description=documentation.splitlines()[0])
    parser.add_argument("data", type=Path, help="what the file is computed from")
    parser.add_argument("--check", action="store_true", help="write nothing, fail if out of date")
    return parser


def ship(
    files: Mapping[Path, Callable[[Path], str]], arguments: argparse.Namespace, script: str
) -> None:
    """Write each of `files` as the data give it, or with `--check` end with an error if one is
    another.

    Parameters
    ----------
    files : by path, what makes the contents of the data.
    arguments : as `parser_of` parses them.
    script : its name in this folder.
    """
    for file, make in files.items():
        text = make(arguments.data)
        if not arguments.check:
            write_text(file, text)
        elif not file.is_file() or file.read_text(encoding="utf-8") != text:
            sys.exit(
                f"{file} is not what the data give. Run `python -m experiments.{script} DATA`."
            )
