"""Where a published file comes from: the repository behind a DOI, or a mirror."""

from collections.abc import Iterator
from contextlib import contextmanager
from urllib.parse import quote

import pooch
import requests
from pooch.downloaders import doi_to_repository

from gaitval.datasets.download import TIMEOUT, cause_of
from gaitval.datasets.registry import ArchiveFile
from gaitval.errors import ArchiveError


class Mirror:
    """A folder on a web server that contains the published files."""

    def __init__(self, base_url: str) -> None:
        self.base_url = base_url.rstrip("/")

    def address(self, file: ArchiveFile) -> str:
        """The address of a file of this name."""
        return f"{self.base_url}/{quote(file.name)}"

    def stated_md5(self, file: ArchiveFile) -> str:
        """Refuse: a mirror states no hash."""
        raise ArchiveError(
            f"{file.name}: the registry has no hash of this file, and a mirror cannot vouch for "
            "itself. Fetch it once by its DOI (without a mirror); then the mirror can be used."
        )


class Repository:
    """The repository behind a DOI, asked once, when first needed."""

    def __init__(self, doi: str) -> None:
        self.doi = doi
        self._files: dict[str, tuple[str, str]] | None = None

    def _listing(self) -> dict[str, tuple[str, str]]:
        """MD5 and address of every published file, as the repository states them."""
        if self._files is None:
            with _repository_errors(self.doi):
                repository = doi_to_repository(self.doi, timeout=TIMEOUT)
                listing = pooch.create(path=".", base_url="")
                repository.populate_registry(listing)
                self._files = {
                    name: (known.removeprefix("md5:"), repository.download_url(name))
                    for name, known in listing.registry.items()
                }
        return self._files

    def _entry(self, file: ArchiveFile) -> tuple[str, str]:
        listing = self._listing()
        if file.name not in listing:
            raise ArchiveError(
                f"{file.name}: not among the files of doi:{self.doi}, which are: "
                f"{', '.join(sorted(listing)[:8])}. Report it to the maintainers of gaitval."
            )
        return listing[file.name]

    def address(self, file: ArchiveFile) -> str:
        """The address of a file in the repository; refused if its hash is not the expected one."""
        try:
            stated, address = self._entry(file)
        except ArchiveError:
            if file.address is None:
                raise
            # the hash is known, so it does not matter where the bytes come from
            return file.address
        if file.md5 is not None and stated.lower() != file.md5:
            raise ArchiveError(
                f"{file.name}: doi:{self.doi} now states MD5 {stated}, but gaitval's registry has "
                f"{file.md5}. The publication was changed; nothing was downloaded. Report it to "
                "the maintainers of gaitval."
            )
        return address

    def stated_md5(self, file: ArchiveFile) -> str:
        """The hash that the repository states."""
        return self._entry(file)[0].lower()


@contextmanager
def _repository_errors(doi: str) -> Iterator[None]:
    """Turn whatever fails between a DOI and its list of files into an `ArchiveError`."""
    by_hand = (
        f"Or download the files in a browser from https://doi.org/{doi}, put them into the "
        "folder of the data set and run this again: those with a hash in gaitval's registry are "
        "verified there."
    )
    try:
        yield
    except requests.HTTPError as error:
        status = None if error.response is None else error.response.status_code
        if status == 404:
            raise ArchiveError(f"doi:{doi}: no such DOI (HTTP status 404).") from None
        raise ArchiveError(
            f"doi:{doi}: the repository answers with HTTP status {status}. Try again later. "
            + by_hand
        ) from None
    except (requests.ConnectionError, requests.Timeout) as error:
        raise ArchiveError(
            f"doi:{doi}: cannot be reached ({cause_of(error)}). Check the network connection and "
            "the proxy settings. " + by_hand
        ) from None
    except (requests.RequestException, ValueError, LookupError) as error:
        raise ArchiveError(
            f"doi:{doi}: the repository's answer is not a list of files ({error}). Try again "
            "later. " + by_hand
        ) from None
