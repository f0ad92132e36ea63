#!/usr/bin/env bash
# The wheel alone does the main job: builds an sdist, a wheel of it, installs that into a new
# virtual environment with the extra `study` and runs `gaitval subject 5` from an empty folder.
#
#   bash scripts/wheel_check.sh [--set section.key=value ...]    (settings go to `gaitval subject`)
#
# Environment: PYTHON  the Python to make the environments with (default: python3)
#              DIST    a folder of the checkout to keep sdist and wheel in (default: they are removed)
set -euo pipefail
cd "$(dirname "$0")/.."

temporary=$(mktemp -d)
trap 'rm -rf "$temporary"' EXIT
unset PYTHONPATH
checkout=$PWD

bin() { # the folder of an environment's commands; Windows has another name for it
    if [ -d "$1/Scripts" ]; then echo "$1/Scripts"; else echo "$1/bin"; fi
}

"${PYTHON:-python3}" -m venv "$temporary/build"
"$(bin "$temporary/build")/python" -m pip install --quiet --disable-pip-version-check \
    -c constraints.txt build
dist=${DIST:+$checkout/$DIST}
dist=${dist:-$temporary/dist}
"$(bin "$temporary/build")/python" -m build --outdir "$dist" . # the wheel is the sdist's

"${PYTHON:-python3}" -m venv "$temporary/venv"
commands=$(bin "$temporary/venv")
"$commands/python" -P scripts/hashed.py --quiet
"$commands/python" -m pip install --quiet --disable-pip-version-check \
    -c constraints.txt "$(echo "$dist"/*.whl)[study]"

mkdir "$temporary/empty"
cd "$temporary/empty"
"$commands/python" - "$checkout" <<'END'
import sys
from pathlib import Path

import gaitval

package = Path(gaitval.__file__).resolve()
assert Path(sys.argv[1]).resolve() not in package.parents, f"{package} is the checkout's"
END
# Without its extra an application is there, and says what it lacks.
"$commands/gaitval" judge --help >/dev/null
status=0
"$commands/gaitval" cohort table.csv 2>said || status=$?
if [ "$status" -ne 2 ] || ! grep -q "gaitval\[cohort\]" said; then
    echo "wheel_check: gaitval cohort without Dask ended with $status and said: $(cat said)" >&2
    exit 1
fi
"$commands/gaitval" subject 5 "$@"
for name in metrics.json report.html report-details.html report.pdf; do
    if [ ! -s "reports/S05/$name" ]; then
        echo "wheel_check: reports/S05/$name was not written" >&2
        exit 1
    fi
done
echo "wheel_check: $(basename "$dist"/*.whl) did the main job in an empty folder"
