#!/usr/bin/env bash
# Makes the virtual environment of this checkout, with the exact versions of constraints.txt, and
# where locks/ knows this system and Python with every file of the main job checked by its hash.
# Does nothing when it is up to date; repairs it when an earlier call was interrupted.
# Runs in bash 3.2 and later (macOS has 3.2).
#
#   bash scripts/setup.sh [EXTRA ...]    the main job, and these extras of pyproject.toml
#
# Environment: GAITVAL_VENV  where the environment goes (default .venv)
#              PYTHON        the Python to make it with (default: the first one that fits)
#              PIP_*         pip's own settings (PIP_EXTRA_INDEX_URL, PIP_FIND_LINKS, …) hold
set -euo pipefail
cd "$(dirname "$0")/.."

venv=${GAITVAL_VENV:-.venv}
bin=$venv/bin
[ "${OS:-}" != Windows_NT ] || bin=$venv/Scripts
stamp=$venv/.gaitval-installed       # holds the checksum of what was installed, and its extras
unfinished=$venv/.gaitval-unfinished # is there while an installation runs
wanted=$(cat pyproject.toml constraints.txt locks/*.txt scripts/setup.sh scripts/hashed.py | cksum)
candidates=${PYTHON:-python3 python3.13 python3.12 python3.14 python3.11 python}
extras="study $*"
newline=$'\n'
libraries="libgl1 libpango-1.0-0 libpangoft2-1.0-0 libpangocairo-1.0-0"

stop() {
    printf 'setup: %s\n' "$*" >&2
    exit 2
}

# dartpy has files for Python 3.12 to 3.14, and for 3.11 on Linux x86-64 only.
fits() {
    "$1" - <<'END' >/dev/null 2>&1
import platform, sys
old = platform.system() == "Linux" and platform.machine() == "x86_64"
sys.exit(not ((3, 11 if old else 12) <= sys.version_info[:2] <= (3, 14)))
END
}

# Sets `python` to the first candidate that fits; fails where none does.
find_python() {
    local candidate
    for candidate in $candidates; do
        if fits "$candidate"; then
            python=$candidate
            return 0
        fi
    done
    return 1
}

python_from_uv() {
    command -v uv >/dev/null || return 1
    echo "setup: no Python 3.11 to 3.14 here (looked for: $candidates); asking uv for 3.13"
    uv python install 3.13 && python=$(uv python find 3.13) && fits "$python"
}

# The line that installs what is missing; its arguments are Debian's names of the packages.
line_for_this_system() {
    if command -v apt-get >/dev/null; then
        echo "sudo apt-get update && sudo apt-get install --yes --no-install-recommends $*"
    elif command -v dnf >/dev/null; then
        echo "sudo dnf install python3.13 mesa-libGL pango"
    elif command -v pacman >/dev/null; then
        echo "sudo pacman -S python libglvnd pango"
    elif command -v brew >/dev/null; then
        echo "brew install python@3.13 pango"
    else
        echo "(with this system's package manager: Python 3.13, libGL and Pango)"
    fi
}

can_be_root() {
    [ "$(id -u)" -eq 0 ] || sudo -n true 2>/dev/null
}

# Installs Debian packages, or stops with the line that does.
install_packages() {
    local why=$1 root=""
    shift
    if ! command -v apt-get >/dev/null || ! can_be_root; then
        stop "$why. Run this line (as root, without sudo, where there is no sudo)," \
            "then the same command again:
    $(line_for_this_system "$@")"
    fi
    [ "$(id -u)" -eq 0 ] || root=sudo
    echo "setup: installing with apt-get: $*"
    # An index that is only out of date may still do: the installation below decides.
    $root apt-get update -qq || echo "setup: apt-get update failed; trying to go on." >&2
    $root env DEBIAN_FRONTEND=noninteractive \
        apt-get install --yes --no-install-recommends "$@" ||
        stop "apt-get could not install $*. Its message is above; fix that and run this again."
}

# Debian packages that are missing: dartpy loads libGL, weasyprint loads Pango (for the PDF).
# Elsewhere than on Linux the imports at the end show it.
missing_packages() {
    "$python" - <<'END'
import ctypes
import sys

try:
    import ensurepip
except ImportError:
    print(f"python3.{sys.version_info.minor}-venv")
libraries = {
    "libGL.so.1": "libgl1",
    "libpango-1.0.so.0": "libpango-1.0-0",
    "libpangoft2-1.0.so.0": "libpangoft2-1.0-0",
    "libpangocairo-1.0.so.0": "libpangocairo-1.0-0",
}
for library, package in libraries.items() if sys.platform == "linux" else ():
    try:
        ctypes.CDLL(library)
    except OSError:
        print(package)
END
}

has_gpu() {
    command -v nvidia-smi >/dev/null || [ -e /dev/nvidia0 ] || [ -e /proc/driver/nvidia ]
}

# Whether what is installed is what the files say now.
is_of_today() {
    [ -f "$stamp" ] && [ "$(head -n 1 "$stamp")" = "$wanted" ]
}

# Whether all extras are in place.
is_done() {
    local extra
    is_of_today || return 1
    for extra in $extras; do
        grep -qx "$extra" "$stamp" || return 1
    done
    "$bin/python" -c '' 2>/dev/null
}

# The extras with those that they ask for themselves, a line each; fails if there is no such one.
with_theirs() {
    "$bin/python" - "$@" <<'END'
import re
import sys
import tomllib

with open("pyproject.toml", "rb") as file:
    known = tomllib.load(file)["project"]["optional-dependencies"]
found, waiting = set(), sys.argv[1:]
while waiting:
    extra = waiting.pop()
    if extra not in known:
        sys.exit(f"setup: no extra {extra!r}; there are: {', '.join(known)}")
    found.add(extra)
    asked = (re.fullmatch(r"gaitval\[(.+)\]", line) for line in known[extra])
    waiting += [name for each in asked if each for name in each[1].split(",")]
print(*sorted(found), sep="\n")
END
}

# Whether torch is still to be installed, and the one that pip would take needs packages of CUDA.
torch_brings_cuda() {
    ! "$bin/python" -c 'import importlib.metadata as m; m.version("torch")' 2>/dev/null || return 1
    "$bin/python" -m pip install --disable-pip-version-check --dry-run --quiet --ignore-installed \
        --no-deps --report - -c constraints.txt torch 2>/dev/null |
        "$bin/python" -c '
import json, platform, sys
needs = json.load(sys.stdin)["install"][0]["metadata"].get("requires_dist", [])
cuda = any(need.startswith(("nvidia-", "cuda-")) for need in needs)
sys.exit(not (cuda and platform.system() == "Linux"))'
}

if is_done; then
    exit 0
fi

if ! find_python && ! python_from_uv; then
    # shellcheck disable=SC2086 # a list of package names
    install_packages "no Python 3.11 to 3.14 found (looked for: $candidates), and none through uv" \
        python3 python3-venv $libraries
    find_python ||
        stop "the Python of this system does not fit: dartpy has files for Python 3.12 to 3.14," \
            "and for 3.11 on Linux x86-64. Install uv and run the same command again, or name a" \
            "Python that fits: make setup PYTHON=/path/to/python3.13"
fi
packages=$(missing_packages)
if [ -n "$packages" ]; then
    # shellcheck disable=SC2086
    install_packages "system libraries are missing" $packages
fi

if [ -e "$unfinished" ] || ! "$bin/python" -m pip --version >/dev/null 2>&1; then
    [ ! -e "$venv" ] || echo "setup: $venv is unfinished; making it anew."
    "$python" -m venv --clear "$venv"
fi
fits "$bin/python" ||
    stop "$venv has a Python that does not fit. Delete it ('make clean'), then run this again."

# shellcheck disable=SC2086 # words
asked=$(with_theirs $extras) || exit 2 # before minutes of work: a name that is no extra
if is_of_today; then
    asked=$(printf '%s\n' "$asked" "$(tail -n +2 "$stamp")" | sort -u) # what was there stays
fi

# Measured on Linux x86-64 with `du -s`.
size="1.6 GB"
[ $# -eq 0 ] || size="at most 3.1 GB"
if ! has_gpu && torch_brings_cuda; then
    size="$size, and 3.7 GB of CUDA"
    echo "setup: pip's torch brings 3.7 GB of CUDA with it, which a machine without an NVIDIA GPU"
    echo "    cannot use. It works, but to save it press Ctrl-C and run (uv: pip install uv)"
    echo "    uv venv --clear --seed --python 3.13 .venv && uv pip install --python .venv \\"
    echo "        --torch-backend cpu -c constraints.txt torch && make setup"
fi
echo "setup: installing the Python packages of ${asked//$newline/, } into $venv"
echo "    ($size, some minutes)"
rm -f "$stamp"
touch "$unfinished"
# --no-compile: Python compiles what is imported; to compile all takes longer, and 300 MB.
# Where Python may not keep that (PYTHONDONTWRITEBYTECODE), pip compiles, or each start would.
compile=--no-compile
[ -z "${PYTHONDONTWRITEBYTECODE:-}" ] || compile=--compile
"$bin/python" -P scripts/hashed.py "$compile" ||
    stop "pip failed, or a file is not the one of locks/. Its message is above."
"$bin/python" -m pip install --disable-pip-version-check "$compile" \
    -c constraints.txt -e ".[${asked//$newline/,}]" ||
    stop "pip failed. Its message is above; the same command starts over."
"$bin/python" -c 'import dartpy, weasyprint' ||
    stop "dartpy or weasyprint cannot be loaded: a system library is missing (see above). Try:
    $(line_for_this_system "$libraries")"
# Nor would it keep our own, which is not installed but stands here.
[ "$compile" = --no-compile ] || "$bin/python" -m compileall -q -j 0 gaitval
printf '%s\n' "$wanted" "$asked" >"$stamp"
rm -f "$unfinished"
echo "setup: done"
