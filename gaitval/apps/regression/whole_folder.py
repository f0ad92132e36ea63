"""Write several files of one folder all or none, and say why a disk did not take them."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gaitval._internal.io.artefacts import scratch
from gaitval._internal.io.disk_errors import why_unwritable
from gaitval._internal.io.folder_lock import check_links
from gaitval.errors import ArtefactError, GaitvalError


@contextmanager
def writing_whole(target: Path) -> Iterator[Path]:
    """A temporary folder whose files are moved into `target` when the block ends without an error:
    all of them or none. What else is in `target` stays.

    The folder lies in `target`, because files can be moved in one step within a disk only. Raises
    ArtefactError if the disk does not take the files, or `target` has links to folders.
    """
    try:
        with scratch(target) as temporary:
            check_links(target)
            new, replaced = temporary / "new", temporary / "replaced"
            for folder in (new, replaced):
                folder.mkdir()
            yield new
            _move_in(new, target, replaced)
    except (GaitvalError, OSError) as error:
        if (why := disk_message(error, target)) is None:
            raise
        raise ArtefactError(
            f"{target}: cannot be written: {why}, or give another folder with --to; then run the "
            "same command again. What was there before is unchanged."
        ) from None


def _move_in(new: Path, target: Path, replaced: Path) -> None:
    """Move all files of the folder `new` into `target`, and those that are in their place into
    `replaced`. If one cannot be moved, the others go back.
    """
    names = [path.relative_to(new) for path in sorted(new.rglob("*")) if path.is_file()]
    for name in names:
        for folder in (target, replaced):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
    moved = []
    try:
        for name in names:
            moved.append(name)
            if (target / name).exists():
                (target / name).replace(replaced / name)
            (new / name).replace(target / name)
    except BaseException:
        for name in moved:
            if (replaced / name).exists():
                (replaced / name).replace(target / name)
            elif not (new / name).exists():  # it had nothing in its place
                (target / name).unlink()
        raise


def disk_message(error: Exception, folder: Path) -> str | None:
    """Why the disk did not take a file in `folder`, if an `error` is about that; else None."""
    if not isinstance(error, GaitvalError):
        return why_unwritable(error)
    cause = error.__context__  # `artefacts.writing` makes its error of that of the disk
    if isinstance(cause, Exception) and str(error).startswith(str(folder)):
        return why_unwritable(cause)
    return None
