"""The gate of `file_gate` for Parquet files."""

from pathlib import Path

from gaitval.file_gate import Refusal, check_unpacked, passed


def parquet_rows(path: Path, refusal: Refusal, *, largest: int) -> int:
    """Rows of a Parquet file, whose few bytes may say that they unpack to any number.

    Parameters are those of `passed`.

    Raises
    ------
    GaitvalError : of type `refusal`, as `passed`, or it unpacks to too much.
    OSError, ValueError : it is not Parquet; pyarrow's own errors.
    """
    from pyarrow import parquet  # type: ignore[import-untyped]

    about = parquet.read_metadata(passed(path, refusal, largest=largest))
    groups = (about.row_group(i).total_byte_size for i in range(about.num_row_groups))
    check_unpacked(groups, path, refusal)
    return int(about.num_rows)
