"""Compiled code is taken only from a folder that is ours, and from files that we wrote."""

import importlib.util
import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from gaitval._internal.numba import cache_home, compiled, compiled_cache
from gaitval._internal.numba.cache_home import own_folder
from gaitval.errors import ConfigurationError

pytestmark = pytest.mark.skipif(os.name != "posix", reason="users and links as POSIX has them")
NOBODY = 65534
as_root = pytest.mark.skipif(
    not hasattr(os, "getuid") or os.getuid() != 0, reason="only root can give a file to another"
)
SOURCE = """
from gaitval._internal.numba.compiled import njit

@njit
def double(x):
    return 2.0 * x

@njit
def triple(x):
    return 3.0 * x
"""


class Evil:
    """Makes a file when it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self):
        return (open, (str(self.mark), "w"))


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A cache of one file of functions, both compiled: `again` compiles or loads them anew."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "some.py").write_text(SOURCE)
    return tmp_path


def again(place: Path) -> tuple[int, int]:
    """Loaded from the cache, and compiled, by functions that must give the right results."""
    compiled_cache.key_in.cache_clear()
    compiled._own_folder.cache_clear()
    spec = importlib.util.spec_from_file_location("some", place / "some.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert (module.double(3.0), module.triple(3.0)) == (6.0, 9.0)
    both = (module.double.stats, module.triple.stats)
    return sum(sum(each.cache_hits.values()) for each in both), sum(
        sum(each.cache_misses.values()) for each in both
    )


def files(place: Path, ending: str) -> list[Path]:
    found = sorted((place / "cache").rglob(f"*.{ending}"))
    assert len(found) == 2
    return found


def test_what_we_compiled_is_loaded(place):
    assert again(place) == (0, 2)
    assert again(place) == (2, 0)
    folder = place / "cache" / "gaitval"
    assert folder.stat().st_mode & 0o777 == 0o700
    assert (folder / "key").stat().st_mode & 0o777 == 0o600


def test_another_checkout_of_the_same_has_nothing_to_compile(place, monkeypatch):
    """Of a file of the package; of others, only those at the same place are the same."""
    package = place / "one" / "gaitval"
    shutil.copytree(place, package, ignore=lambda *_: ["one", "cache"])
    monkeypatch.setattr(compiled_cache, "_PACKAGE", package)
    assert again(package) == (0, 2)
    assert again(place) == (0, 2)
    another = place / "two" / "gaitval"
    shutil.copytree(package, another)
    monkeypatch.setattr(compiled_cache, "_PACKAGE", another)
    assert again(another) == (2, 0)
    with (another / "some.py").open("a") as file:  # where it is not among `compiled.SOURCES`
        file.write("# changed\n")
    assert again(another) == (0, 2)


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("keeps", [0, 32])
def test_a_file_of_somebody_else_is_not_unpickled(place, ending, keeps):
    """Neither as numba writes them, nor behind the hash of a file of ours."""
    again(place)
    mark = place / "ran"
    planted = pickle.dumps(Evil(mark))
    pickle.loads(planted).close()
    assert mark.exists(), "the plant itself works"
    mark.unlink()
    for path in files(place, ending):
        path.write_bytes(path.read_bytes()[:keeps] + planted)
    assert again(place) == (0, 2)
    assert not mark.exists()
    assert again(place) == (2, 0), "written anew"


def test_a_cache_that_came_with_its_key_is_not_believed(place):
    """As out of an archive: the key's file has another time on this disk."""
    again(place)
    (place / "cache").rename(place / "made")
    shutil.copytree(place / "made", place / "cache", copy_function=shutil.copy2)
    assert again(place) == (0, 2)
    shutil.rmtree(place / "cache")
    (place / "made").rename(place / "cache")
    assert again(place) == (2, 0)


@pytest.mark.parametrize("spoilt", ["readable", "link", "second name", "short", "folder", "none"])
def test_a_key_that_others_may_know_is_replaced(place, spoilt):
    again(place)
    key = place / "cache" / "gaitval" / "key"
    old = key.read_bytes()
    if spoilt == "readable":
        key.chmod(0o644)
    elif spoilt == "second name":
        os.link(key, place / "known")
    elif spoilt == "short":
        key.write_bytes(old[:8])
    else:
        key.rename(place / "known")
        if spoilt == "link":
            key.symlink_to(place / "known")
        if spoilt == "folder":
            key.mkdir()
    assert again(place) == (0, 2)
    if spoilt != "folder":  # without a key nothing is kept
        assert key.read_bytes() != old
        assert key.stat().st_mode & 0o777 == 0o600
        assert again(place) == (2, 0)


def refused(base: Path, *words: str) -> None:
    with pytest.raises(ConfigurationError) as error:
        own_folder(base)
    for word in (str(base), "XDG_CACHE_HOME", *words):
        assert word in str(error.value)


@pytest.mark.parametrize("mode", [0o777, 0o757])
def test_a_way_that_others_can_write_to_is_refused(tmp_path, mode):
    (tmp_path / "shared" / "cache").mkdir(parents=True)
    (tmp_path / "shared").chmod(mode)
    refused(tmp_path / "shared" / "cache", str(tmp_path / "shared"), f"{mode:o}")
    (tmp_path / "shared").chmod(0o1000 | mode)  # as the folder of temporary files is
    assert own_folder(tmp_path / "shared" / "cache").is_dir()


def test_the_group_counts_unless_it_is_the_private_one(tmp_path, monkeypatch):
    base = tmp_path / "cache"
    base.mkdir()
    base.chmod(0o775)
    monkeypatch.setattr(cache_home, "_alone_in", lambda _: False)
    refused(base, "775")
    monkeypatch.setattr(cache_home, "_alone_in", lambda _: True)
    assert own_folder(base).is_dir()


def test_the_folder_itself_is_closed_to_others(tmp_path):
    """One that an earlier version made may be open to be read, or to a group."""
    (tmp_path / "gaitval").mkdir()
    (tmp_path / "gaitval").chmod(0o777)
    assert own_folder(tmp_path).stat().st_mode & 0o777 == 0o700


@as_root
@pytest.mark.parametrize("whose", ["gaitval", ".", ".."])
def test_another_users_folder_is_refused(tmp_path, whose):
    """The attack: a folder made before by somebody else, who is told to whom to give it."""
    base = tmp_path / "first" / "cache"
    (base / "gaitval").mkdir(parents=True)
    os.chown(base / whose, NOBODY, NOBODY)
    refused(base, str(NOBODY))


@as_root
@pytest.mark.parametrize("which", ["gaitval", "cache"])
def test_another_users_link_is_refused_and_ones_own_is_not(tmp_path, which):
    ours, base = tmp_path / "ours", tmp_path / "cache"
    (ours / "gaitval").mkdir(parents=True)
    if which == "gaitval":
        base.mkdir()
    link = base / "gaitval" if which == "gaitval" else base
    link.symlink_to(ours / "gaitval" if which == "gaitval" else ours)
    assert own_folder(base).is_dir()
    os.chown(link, NOBODY, NOBODY, follow_symlinks=False)
    refused(base, str(NOBODY))


@pytest.mark.parametrize("variable", ["NUMBA_CACHE_DIR", "XDG_CACHE_HOME"])
def test_a_path_that_begins_in_the_current_folder_does_not_count(tmp_path, monkeypatch, variable):
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv(variable, "cache")
    monkeypatch.chdir(tmp_path)
    assert compiled._cache_folder().parent == tmp_path / "home" / ".cache" / "gaitval"


def test_numbas_own_settings_do_not_say_where_it_is(tmp_path, monkeypatch):
    """Nor which code finds it: both may come from a file of the current folder."""
    monkeypatch.setattr("numba.core.config.CACHE_DIR", str(tmp_path / "elsewhere"))
    monkeypatch.setattr("numba.core.config.CACHE_LOCATOR_CLASSES", "evil.Locator")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "some.py").write_text(SOURCE)
    again(tmp_path)
    assert files(tmp_path, "nbi")
    assert not (tmp_path / "elsewhere").exists()


ONE = """
import sys, time
sys.path.insert(0, {folder!r})
from numba.core import event
from gaitval._internal.numba.compiled import njit

class Seen(event.Listener):
    def on_start(self, event):
        print("compiles", flush=True)
        time.sleep(1.0)
    def on_end(self, event):
        pass

@njit
def double(x):
    return 2.0 * x

event.register("numba:compile", Seen())
assert double(3.0) == 6.0
"""


def test_of_two_processes_one_compiles_and_the_other_waits(tmp_path):
    script = tmp_path / "one.py"
    script.write_text(ONE.format(folder=str(Path(__file__).parents[1])))
    both = [
        subprocess.Popen(
            [sys.executable, str(script)],
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
            stdout=subprocess.PIPE,
            text=True,
        )
        for _ in range(2)
    ]
    said = [process.communicate(timeout=120)[0] for process in both]
    assert [process.returncode for process in both] == [0, 0]
    assert sorted(said) == ["", "compiles\n"]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_a_forked_process_compiles_what_its_parent_has_not(tmp_path):
    """A lock is of the process that made it: the workers of a first study are forked."""
    code = (
        "import os\n"
        "from gaitval._internal.numba.compiled import njit\n"
        "@njit\ndef twice(x):\n    return 2 * x\n"
        "twice(1)\n"
        "child = os.fork()\n"
        "if not child:\n    os._exit(0 if twice(1.5) == 3.0 else 1)\n"
        "raise SystemExit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))\n"
    )
    (tmp_path / "forks.py").write_text(code, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-P", str(tmp_path / "forks.py")],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
