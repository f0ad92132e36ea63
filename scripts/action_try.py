"""Run the steps of `action.yml` as a GitHub runner would, in a clean place.

    python scripts/action_try.py [--with NAME=VALUE ...] [--python PYTHON] [--keep FOLDER]

The place: an empty folder that holds only the baselines of `--baseline` (reports/S05/baseline), a
new home, a new virtual environment, and the variables that a runner sets. Steps that run commands
are run by bash with GitHub's options. Steps that use another action are replaced by stand-ins that
do what is needed here and are recorded: setup-python makes the virtual environment,
upload-artifact lists the files. Prints one line a step and the job summary; the exit code is that
of the action.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).resolve().parent.parent
ACTION = ROOT / "action.yml"
BASH = ("bash", "--noprofile", "--norc", "-eo", "pipefail")
"""How a runner starts `shell: bash`."""
KEPT = re.compile(
    r"(HTTPS?|NO)_PROXY|PIP_\w+|SSL_CERT_FILE|REQUESTS_CA_BUNDLE|LANG|OMP_NUM_THREADS",
    re.IGNORECASE,
)
"""Variables of this machine that say how to reach the package index, and no more."""


@dataclass
class Runner:
    """A job: where it runs, its context, and what has been done.

    Attributes
    ----------
    done : of each step its name and what became of it.
    uploaded : files of the artifact.
    """

    folder: Path
    inputs: dict[str, str]
    python: str
    outputs: dict[str, dict[str, str]] = field(default_factory=dict)
    failed: int = 0
    done: list[tuple[str, str]] = field(default_factory=list)
    uploaded: list[str] = field(default_factory=list)

    def context(self) -> dict[str, str]:
        """What expressions may name."""
        found = {f"inputs.{name}": value for name, value in self.inputs.items()}
        found |= {
            "runner.os": "Linux",
            "runner.temp": str(self.folder / "temp"),
            "github.action_path": str(ROOT),
            "github.workspace": str(self.folder / "work"),
        }
        for step, values in self.outputs.items():
            found |= {f"steps.{step}.outputs.{name}": value for name, value in values.items()}
        return found

    def environment(self) -> dict[str, str]:
        """Variables of a step."""
        return {
            **{name: value for name, value in os.environ.items() if KEPT.fullmatch(name)},
            "PATH": f"{self.folder / 'venv/bin'}:/usr/local/bin:/usr/bin:/bin",
            "HOME": str(self.folder / "home"),
            "CI": "true",
            "GITHUB_ACTIONS": "true",
            "GITHUB_WORKSPACE": str(self.folder / "work"),
            "GITHUB_ACTION_PATH": str(ROOT),
            "GITHUB_STEP_SUMMARY": str(self.folder / "summary.md"),
            "GITHUB_OUTPUT": str(self.folder / "output"),
            "GITHUB_ENV": str(self.folder / "env"),
            "RUNNER_OS": "Linux",
            "RUNNER_TEMP": str(self.folder / "temp"),
        }


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--with", dest="given", action="append", default=[], metavar="NAME=VALUE")
    parser.add_argument("--baseline", action="append", metavar="FOLDER")
    parser.add_argument("--python", default=sys.executable, help="makes the virtual environment")
    parser.add_argument("--keep", type=Path, help="work in this new folder, and leave it")
    arguments = parser.parse_args()
    baselines = arguments.baseline or ["reports/S05/baseline"]
    given = dict(pair.split("=", 1) for pair in arguments.given)
    given.setdefault("baselines", "\n".join(baselines))
    folder = arguments.keep or Path(tempfile.mkdtemp(prefix="action-"))
    try:
        prepare(folder, baselines)
        runner = Runner(folder, inputs_of(action(), given), arguments.python)
        run_steps(runner, action()["runs"]["steps"])
        for name, message in runner.done:
            print(f"{name}: {message}")
        print((folder / "summary.md").read_text(encoding="utf-8"))
    finally:
        if arguments.keep is None:
            shutil.rmtree(folder, ignore_errors=True)
    sys.exit(runner.failed)


def action() -> dict[str, Any]:
    """What `action.yml` says."""
    found: dict[str, Any] = yaml.safe_load(ACTION.read_text(encoding="utf-8"))
    return found


def inputs_of(definition: dict[str, Any], given: dict[str, str]) -> dict[str, str]:
    """The inputs with their defaults; unknown and missing ones are refused."""
    known = definition["inputs"]
    unknown = sorted(set(given) - set(known))
    missing = [n for n, one in known.items() if one.get("required") and n not in given]
    if unknown or missing:
        raise SystemExit(f"action_try: unknown inputs {unknown}, missing inputs {missing}")
    return {name: given.get(name, str(one.get("default", ""))) for name, one in known.items()}


def prepare(folder: Path, baselines: list[str]) -> None:
    """A runner's folders, with nothing in the checkout but the baselines."""
    for name in ("work", "temp", "home"):
        (folder / name).mkdir(parents=True)
    (folder / "summary.md").touch()
    for baseline in baselines:
        shutil.copytree(ROOT / baseline, folder / "work" / baseline)


def run_steps(runner: Runner, steps: list[dict[str, Any]]) -> None:
    """Run the steps in order, as a runner does: after a failure only those that always run."""
    for step in steps:
        name = step.get("name", step.get("id", "step"))
        condition = str(step.get("if", ""))
        wanted = not condition or holds(condition, runner.context())
        if not wanted or (runner.failed and "always()" not in condition):
            runner.done.append((name, "skipped"))
            continue
        started = time.perf_counter()
        code = _use(runner, step) if "uses" in step else _run(runner, step)
        runner.failed = runner.failed or code
        message = f"exit code {code}, {time.perf_counter() - started:.0f} s"
        runner.done.append((name, message + (f" ({step['uses']})" if "uses" in step else "")))


def _run(runner: Runner, step: dict[str, Any]) -> int:
    context, environment = runner.context(), runner.environment()
    for name, value in step.get("env", {}).items():
        environment[name] = filled(str(value), context)
    if "sudo" in step["run"] and shutil.which("sudo") is None:
        environment["PATH"] = f"{_without_sudo(runner.folder)}:{environment['PATH']}"
    output = Path(environment["GITHUB_OUTPUT"])
    output.write_text("")
    done = subprocess.run(
        [*BASH, "-c", filled(step["run"], context)],
        cwd=runner.folder / "work",
        env=environment,
        check=False,
    )
    if "id" in step:
        pairs = (line.split("=", 1) for line in output.read_text().splitlines() if "=" in line)
        runner.outputs[step["id"]] = {name: value for name, value in pairs}
    return done.returncode


def _without_sudo(folder: Path) -> Path:
    """A folder with a `sudo` that runs the command as it is, for containers where root has none."""
    commands = folder / "sudo"
    commands.mkdir(exist_ok=True)
    (commands / "sudo").write_text('#!/bin/sh\nexec "$@"\n')
    (commands / "sudo").chmod(0o755)
    return commands


def _use(runner: Runner, step: dict[str, Any]) -> int:
    """The stand-in of another action."""
    what = step["uses"].split("@")[0]
    given = {k: filled(str(v), runner.context()) for k, v in step.get("with", {}).items()}
    if what == "actions/setup-python":
        command = [runner.python, "-m", "venv", str(runner.folder / "venv")]
        return subprocess.run(command, check=False).returncode
    if what == "actions/upload-artifact":
        root = Path(given["path"])
        runner.uploaded = sorted(str(p.relative_to(root)) for p in root.rglob("*") if p.is_file())
        print(f"artifact {given['name']}: {', '.join(runner.uploaded) or 'nothing'}")
        return 0
    raise SystemExit(f"action_try: no stand-in for {step['uses']}")


# ---- Expressions, as far as the action has them. ----


def filled(text: str, context: dict[str, str]) -> str:
    """Text with its `${{ … }}` replaced."""
    return re.sub(r"\$\{\{(.*?)\}\}", lambda one: value_of(one[1].strip(), context), text)


def holds(condition: str, context: dict[str, str]) -> bool:
    """Whether all parts of a condition hold."""
    return all(_part_holds(part.strip(), context) for part in condition.split("&&"))


def _part_holds(part: str, context: dict[str, str]) -> bool:
    if part == "always()":
        return True
    found = re.fullmatch(r"(.+?)\s*(==|!=)\s*(.+)", part)
    if found is None:
        return value_of(part, context) not in ("", "false")
    left, sign, right = value_of(found[1], context), found[2], value_of(found[3], context)
    return (left == right) is (sign == "==")


def value_of(expression: str, context: dict[str, str]) -> str:
    """The value of a name, a text, `format('…', name)`, or the first of `a || b` that is not empty.

    Raises
    ------
    SystemExit : the expression names what is not there.
    """
    alternatives = [part.strip() for part in expression.split("||")]
    if len(alternatives) > 1:
        return next((v for one in alternatives if (v := value_of(one, context))), "")
    if found := re.fullmatch(r"'([^']*)'", expression):
        return found[1]
    if found := re.fullmatch(r"format\('([^']*)',\s*(.+)\)", expression):
        return found[1].replace("{0}", value_of(found[2], context))
    if expression not in context:
        raise SystemExit(f"action_try: ${{{{ {expression} }}}} is not known")
    return context[expression]


if __name__ == "__main__":
    main()
