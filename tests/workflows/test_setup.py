"""Set-up finds a Python that fits, or stops with the line to run. Nothing is installed here."""

import hashlib
import json
import os
import re
import shutil
import stat
import subprocess
import sys
import zipfile
from pathlib import Path

import hashed
import pytest

ROOT = Path(__file__).resolve().parents[2]
NEEDED = ("bash", "cat", "cksum", "dirname")

pytestmark = pytest.mark.skipif(os.name != "posix", reason="set-up is a bash script")


@pytest.fixture
def commands(tmp_path):
    """Folder that is the whole PATH: what the script itself needs, but no Python."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for name in NEEDED:
        found = shutil.which(name)
        assert found is not None
        (folder / name).symlink_to(found)
    add(folder, "id", "echo 1000")  # an ordinary user
    return folder


def add(folder, name, script):
    """Put a command of this name into the folder."""
    path = folder / name
    path.write_text(f"#!{shutil.which('bash')}\n{script}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)


def python(version):
    """A Python that says whether it fits as this version would, and makes no environment."""
    return f"""
if [ "$1" = - ]; then
    code=$(cat)
    case "$code" in
        *ctypes*) exit 0 ;;
        *) exec {sys.executable} -c "
import sys
from collections import namedtuple
sys.version_info = namedtuple('V', 'major minor micro')({version.replace(".", ", ")}, 0)
$code" ;;
    esac
fi
echo "$0 $*"
exit 3
"""


def set_up(folder, tmp_path, *extras, **environment):
    return subprocess.run(
        [folder / "bash", ROOT / "scripts/setup.sh", *extras],
        env={"PATH": str(folder), "GAITVAL_VENV": str(tmp_path / "venv"), **environment},
        capture_output=True,
        text=True,
    )


@pytest.mark.parametrize(
    ("manager", "line"),
    [
        (
            "apt-get",
            "sudo apt-get update && sudo apt-get install --yes --no-install-recommends "
            "python3 python3-venv libgl1",
        ),
        ("dnf", "sudo dnf install python3.13 mesa-libGL pango"),
        ("pacman", "sudo pacman -S python libglvnd pango"),
        ("brew", "brew install python@3.13 pango"),
    ],
)
def test_an_ordinary_user_without_python_is_told_the_line(commands, tmp_path, manager, line):
    add(commands, manager, "echo must not be called; exit 9")
    done = set_up(commands, tmp_path)
    assert done.returncode == 2
    assert "no Python 3.11 to 3.14 found" in done.stderr
    assert f"    {line}" in done.stderr
    assert "must not be called" not in done.stdout


@pytest.mark.parametrize("version", ["3.11", "3.12", "3.13", "3.14"])
def test_takes_the_first_python_that_fits(commands, tmp_path, version):
    add(commands, "python3", python("3.10"))
    add(commands, "python3.13", python("3.15"))
    add(commands, "python3.12", python(version))
    done = set_up(commands, tmp_path)
    assert done.returncode == 3  # of the environment that this Python does not make
    assert done.stdout == f"{commands}/python3.12 -m venv --clear {tmp_path}/venv\n"


def test_root_gets_the_packages_of_debian(commands, tmp_path):
    add(commands, "id", "echo 0")
    add(commands, "env", 'shift; "$@"')
    add(commands, "apt-get", f'echo "apt-get $*" >>{tmp_path}/calls')
    done = set_up(commands, tmp_path)
    assert "apt-get install --yes" in (tmp_path / "calls").read_text()
    assert done.returncode == 2  # nothing was installed by this apt-get
    assert "does not fit" in done.stderr


@pytest.fixture
def environment(commands, tmp_path):
    """A virtual environment in which pip only writes down its arguments: the file of these. What
    else its Python is asked is answered by the real one, but for libraries, which are all there.
    """
    for name in ("head", "tail", "grep", "sort", "rm", "touch"):
        found = shutil.which(name)
        assert found is not None
        (commands / name).symlink_to(found)
    add(commands, "python3", python("3.13"))
    (tmp_path / "venv" / "bin").mkdir(parents=True)
    calls, report = tmp_path / "calls", tmp_path / "report.json"
    add(
        tmp_path / "venv" / "bin",
        "python",
        f"""
case "$*" in
    "-m pip --version" | "-c " | *"import dartpy"*) exit 0 ;;
    *'version("torch")'*) [ ! -e {report} ]; exit ;;
    *--dry-run*) exec cat {report} ;;
    *hashed.py*) [ ! -e {tmp_path}/other_files ]; exit ;;
    "-m pip install"*) echo "$*" >>{calls}; [ ! -e {tmp_path}/broken ]; exit ;;
    *) exec {sys.executable} "$@" ;;
esac""",
    )
    return calls


def installed(calls):
    """Extras of the last call of pip."""
    if not calls.exists():
        return None
    (extras,) = re.findall(r"-e \.\[([\w,]+)\]$", calls.read_text().splitlines()[-1])
    calls.unlink()
    return set(extras.split(","))


def test_installs_what_is_asked_for_and_nothing_twice(commands, tmp_path, environment):
    def after(*extras):
        done = set_up(commands, tmp_path, *extras)
        assert done.returncode == 0, done.stderr
        return installed(environment)

    assert after() == {"study"}
    assert after() is None
    more = after("test", "peers")
    assert more is not None
    assert {"study", "test", "peers", "cohort"} <= more
    assert "lint" not in more
    assert after("test") is after("cohort") is after() is None  # the tests' brought it
    assert after("docs") == {*more, "docs"}
    assert after("peers", "docs") is None


def test_an_extra_that_is_not_there_is_named_before_any_work(commands, tmp_path, environment):
    done = set_up(commands, tmp_path, "cohrt")
    assert done.returncode == 2
    assert "'cohrt'" in done.stderr
    assert "cohort" in done.stderr
    assert installed(environment) is None


def test_files_of_another_hash_end_it(commands, tmp_path, environment):
    (tmp_path / "other_files").touch()
    done = set_up(commands, tmp_path)
    assert done.returncode == 2
    assert "a file is not the one of locks/" in done.stderr
    assert installed(environment) is None


def test_a_file_that_is_not_the_locks_is_not_installed(tmp_path, monkeypatch):
    """The real pip, with a lock that says another hash of a package that lies here."""
    package = tmp_path / "six-1.0-py3-none-any.whl"
    with zipfile.ZipFile(package, "w") as file:
        file.writestr("six.py", "")
        file.writestr(
            "six-1.0.dist-info/METADATA", "Metadata-Version: 2.1\nName: six\nVersion: 1.0\n"
        )
        file.writestr("six-1.0.dist-info/WHEEL", "Wheel-Version: 1.0\nTag: py3-none-any\n")
        file.writestr("six-1.0.dist-info/RECORD", "")
    own = hashlib.sha256(package.read_bytes()).hexdigest()
    monkeypatch.setattr(hashed, "FOLDER", tmp_path)
    options = ["--no-index", "--find-links", str(tmp_path), "--target", str(tmp_path / "there")]
    monkeypatch.setattr(sys, "argv", ["hashed.py", "--quiet", *options])
    torch = "torch==2.0+cpu \\\n    --hash=sha256:" + "0" * 64 + "\n"
    for digest, installs in (("0" * 64, False), (own, True)):
        hashed.lock().write_text(f"{torch}six==1.0 \\\n    --hash=sha256:{digest}\n")
        with pytest.raises(SystemExit) as ended:
            hashed.main()
        assert (ended.value.code == 0) == installs
        assert (tmp_path / "there" / "six.py").exists() == installs


def test_without_a_lock_nothing_is_installed(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(hashed, "FOLDER", tmp_path)
    hashed.main()
    assert "versions are checked, not files" in capsys.readouterr().out


@pytest.mark.skipif(Path("/dev/nvidia0").exists(), reason="a graphics card")
def test_says_how_to_do_without_cuda_before_it_is_downloaded(commands, tmp_path, environment):
    def message(needs):
        report = {"install": [{"metadata": {"requires_dist": needs}}]}
        (tmp_path / "report.json").write_text(json.dumps(report))
        (tmp_path / "venv" / ".gaitval-installed").unlink(missing_ok=True)
        done = set_up(commands, tmp_path)
        assert done.returncode == 0, done.stderr
        return done.stdout

    with_cuda = message(["filelock", "nvidia-cudnn-cu13==9.1; platform_system == 'Linux'"])
    line = "--torch-backend cpu -c constraints.txt torch && make setup"
    if sys.platform == "linux":
        assert with_cuda.index(line) < with_cuda.index("installing the Python packages")
    assert line not in message(["filelock", "sympy"])
    add(commands, "nvidia-smi", "")
    assert line not in message(["nvidia-cudnn-cu13==9.1"])


@pytest.mark.skipif(shutil.which("make") is None, reason="no make")
@pytest.mark.parametrize(
    ("targets", "extras"),
    [
        ("subject", set()),
        ("check", set()),
        ("-j2 lint docs", {"lint", "docs"}),
        ("test SLOW=1", {"test", "peers"}),
        ("setup FOR=cohort", {"cohort"}),
    ],
)
def test_a_target_sets_up_what_it_needs_and_all_at_once(targets, extras):
    """`make -j2 lint docs` would run two pips in one environment if each set up its own."""
    done = subprocess.run(
        ["make", "-n", *targets.split()], cwd=ROOT, capture_output=True, text=True, check=True
    )
    (line,) = re.findall(r"^bash scripts/setup\.sh(.*)$", done.stdout, re.MULTILINE)
    assert set(line.split()) == extras
