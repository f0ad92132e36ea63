"""What the pages' templates are compiled to, kept for the next page: half of what a page took.

Whoever reads such a file runs what it says. So it begins with a keyed hash, as those of numba do
(`compiled_cache`), and one without the right hash is compiled and written anew.
"""

import hmac
from contextlib import suppress
from functools import cache
from hashlib import blake2b
from pathlib import Path
from typing import Final

import jinja2
from jinja2.bccache import Bucket

from gaitval.artefacts import replacing
from gaitval.cache_home import own_cache
from gaitval.compiled_cache import key_in
from gaitval.errors import ArtefactError, ConfigurationError

_SIZE: Final = 32


class CompiledTemplates(jinja2.BytecodeCache):
    """Templates that are compiled alike for all languages, by the hash of their names."""

    def load_bytecode(self, bucket: Bucket) -> None:
        """Fill `bucket`, whose source jinja compares, if this user has written such a file."""
        if (folder := _folder()) is None:
            return
        with suppress(OSError):
            content = memoryview((folder / bucket.key).read_bytes())
            if hmac.compare_digest(_seal(folder, bucket.key, content[_SIZE:]), content[:_SIZE]):
                bucket.bytecode_from_string(bytes(content[_SIZE:]))

    def dump_bytecode(self, bucket: Bucket) -> None:
        """Keep what is in `bucket`."""
        if (folder := _folder()) is None:
            return
        content = bucket.bytecode_to_string()
        sealed = _seal(folder, bucket.key, content) + content
        with suppress(ArtefactError), replacing(folder / bucket.key) as temporary:
            temporary.write_bytes(sealed)


@cache
def _folder() -> Path | None:
    """Where they are kept; None where there is no folder of this user's own."""
    try:
        folder = own_cache() / "templates"
        folder.mkdir(mode=0o700, exist_ok=True)
    except (ConfigurationError, OSError):
        return None
    return folder


def _seal(folder: Path, name: str, content: bytes | memoryview) -> bytes:
    sealed = blake2b(key=key_in(folder.parent), digest_size=_SIZE)
    sealed.update(f"{name}\0".encode())
    sealed.update(content)
    return sealed.digest()
