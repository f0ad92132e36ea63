#!/usr/bin/env bash
# Makes the virtual environment of this checkout, with the exact versions of constraints.txt.
# Does nothing when it is up to date; mends it when an earlier call was interrupted.
#
# Environment: GAITVAL_VENV  where the environment goes (default .venv)
#              PYTHON        the Python 3.11 to make it with (default: python3.11, then python3)
set -euo pipefail
cd "$(dirname "$0")/.."

venv=${GAITVAL_VENV:-.venv}
stamp=$venv/.gaitval-installed      # holds the hash of what was installed
unfinished=$venv/.gaitval-unfinished # is there while an installation runs
wanted=$(cat pyproject.toml constraints.txt scripts/setup.sh | sha256sum | cut -d' ' -f1)

stop() {
    printf 'setup: %s\n' "$*" >&2
    exit 2
}

is_python_311() {
    "$1" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' 2>/dev/null
}

find_python() {
    local candidate
    for candidate in ${PYTHON:-python3.11 python3 python}; do
        if is_python_311 "$candidate"; then
            echo "$candidate"
            return
        fi
    done
    stop "no Python 3.11 found (looked for: ${PYTHON:-python3.11 python3 python})." \
        "gaitval needs 3.11, because dartpy 6.20 has no files for other versions." \
        "Install it (Debian 12: 'sudo apt-get install python3.11 python3.11-venv'; anywhere:" \
        "'pyenv install 3.11'), or name it: 'make setup PYTHON=/path/to/python3.11'."
}

# Debian packages that are missing: dartpy loads libGL, weasyprint loads Pango (for the PDF).
missing_packages() {
    local python=$1
    "$python" -c 'import ensurepip' 2>/dev/null || echo python3.11-venv
    "$python" - <<'END'
import ctypes
libraries = {
    "libGL.so.1": "libgl1",
    "libpango-1.0.so.0": "libpango-1.0-0",
    "libpangoft2-1.0.so.0": "libpangoft2-1.0-0",
    "libpangocairo-1.0.so.0": "libpangocairo-1.0-0",
}
for library, package in libraries.items():
    try:
        ctypes.CDLL(library)
    except OSError:
        print(package)
END
}

install_packages() {
    local root=()
    if ! command -v apt-get >/dev/null; then
        stop "system libraries are missing, and there is no apt-get here to install them." \
            "Install what provides these Debian packages, then run this again: $*"
    fi
    if [ "$(id -u)" -ne 0 ]; then
        if ! sudo -n true 2>/dev/null; then
            stop "system libraries are missing. Run this line, then the same command again:
    sudo apt-get update && sudo apt-get install --yes $*"
        fi
        root=(sudo)
    fi
    echo "setup: installing system libraries: $*"
    # An index that is only out of date may still do: the installation below decides.
    "${root[@]}" apt-get update -qq || echo "setup: apt-get update failed; trying to go on." >&2
    "${root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install --yes --no-install-recommends "$@" ||
        stop "apt-get could not install $*. Its message is above; mend that and run this again."
}

if [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$wanted" ] && "$venv/bin/python" -c '' 2>/dev/null
then
    exit 0
fi

python=$(find_python)
mapfile -t packages < <(missing_packages "$python")
if [ "${#packages[@]}" -gt 0 ]; then
    install_packages "${packages[@]}"
fi

if [ -e "$unfinished" ] || ! "$venv/bin/python" -m pip --version >/dev/null 2>&1; then
    [ ! -e "$venv" ] || echo "setup: $venv is unfinished; making it anew."
    "$python" -m venv --clear "$venv"
fi
is_python_311 "$venv/bin/python" ||
    stop "$venv is not of Python 3.11. Delete it ('make clean'), then run this again."

echo "setup: installing the Python packages into $venv (about 2 GB, some minutes)"
rm -f "$stamp"
touch "$unfinished"
"$venv/bin/python" -m pip install --disable-pip-version-check \
    -c constraints.txt -e '.[test,dev]' ||
    stop "pip failed. Its message is above; the same command starts over."
"$venv/bin/python" -c 'import dartpy, weasyprint' ||
    stop "dartpy or weasyprint cannot be loaded: a system library is missing (see above)."
echo "$wanted" >"$stamp"
rm -f "$unfinished"
echo "setup: done"
