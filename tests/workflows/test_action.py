"""The GitHub action: its file, its middle, and its steps run in a clean place."""

import os
import re
import subprocess
import sys
from pathlib import Path

import action_check
import action_try
import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]

JUNIT = """<testsuites><testsuite tests="2"><testcase classname="gaitval.angle_rmse"
 name="knee_angle_r"><failure message="lost: 1 deg in the baseline, 3 deg now"/></testcase>
<testcase classname="gaitval.angle_rmse" name="knee_angle_l"/></testsuite></testsuites>"""


@pytest.fixture(autouse=True)
def installed(monkeypatch, tmp_path):
    """What `fake_gaitval` makes is installed."""
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "installed"))


@pytest.fixture(scope="module")
def definition():
    return action_try.action()


def steps_that_run(definition):
    return [step for step in definition["runs"]["steps"] if "run" in step]


# ---- The file. ----


def test_every_input_is_used_and_every_name_in_an_expression_is_known(definition):
    text = action_try.ACTION.read_text()
    used = set(re.findall(r"inputs\.([\w-]+)", text))
    assert used == set(definition["inputs"])
    runner = action_try.Runner(Path("/nowhere"), dict.fromkeys(definition["inputs"], "x"), "python")
    runner.outputs["check"] = {"lost": "0", "folder": "x"}
    for expression in re.findall(r"\$\{\{(.*?)\}\}", text):
        action_try.value_of(expression.strip(), runner.context())  # refuses unknown names


WORKFLOWS = sorted((ROOT / ".github/workflows").glob("*.yml"))


@pytest.mark.parametrize(
    "path", [ROOT / "action.yml", *WORKFLOWS, ROOT / "docs/tutorials/ci.md"], ids=lambda p: p.name
)
def test_actions_of_others_are_pinned_by_commit(path):
    """A tag can be moved to other code."""
    used = re.findall(r"^ *-? *uses: (\S+)", path.read_text(encoding="utf-8"), re.MULTILINE)
    others = [one for one in used if one != "./.gaitval"]  # a checkout of ours
    assert others
    for one in others:
        assert re.fullmatch(r"actions/[\w-]+@[0-9a-f]{40}", one), one


def test_the_job_that_signs_and_tags_a_release_runs_nothing_of_the_repository():
    jobs = yaml.safe_load((ROOT / ".github/workflows/release.yml").read_text())["jobs"]
    assert "permissions" not in jobs["build"]
    publish = jobs["publish"]
    assert publish["permissions"] == {
        "contents": "write", "id-token": "write", "attestations": "write"
    }  # fmt: skip
    names = [step["uses"].partition("@")[0] for step in publish["steps"] if "uses" in step]
    assert names == ["actions/download-artifact", "actions/attest-build-provenance"]
    for step in [*publish["steps"], *jobs["build"]["steps"]]:
        assert "${{" not in step.get("run", "")


def test_no_input_is_pasted_into_a_command(definition):
    """`${{ inputs.x }}` in a script is run as code; in a variable it is only text."""
    for step in steps_that_run(definition):
        assert "${{" not in step["run"], step["name"]
        assert step["shell"] == "bash"


def test_commands_are_valid_and_quote_their_variables(definition):
    for step in steps_that_run(definition):
        done = subprocess.run(["bash", "-n"], input=step["run"], text=True, check=False)
        assert done.returncode == 0, step["name"]
        for variable in re.finditer(r"\$\{?\w+", step["run"]):
            before = step["run"][: variable.start()]
            assert before.count('"') % 2 == 1, f"{step['name']}: {variable[0]} is not quoted"
        declared = set(step.get("env", {}))
        assert set(re.findall(r"\$\{?(\w+)", step["run"])) <= declared, step["name"]


# ---- Its middle. ----


def fake_gaitval(folder: Path, codes: dict[str, int]) -> None:
    """A package `gaitval` in `folder/installed` whose check says what the test wants."""
    package = folder / "installed" / "gaitval"
    package.mkdir(parents=True)
    (package / "__init__.py").touch()
    (package / "__main__.py").write_text(
        "import sys, pathlib\n"
        f"codes = {codes!r}\n"
        "arguments = sys.argv[1:]\n"
        "assert arguments[0] == 'check' and arguments[1] == '--baseline', arguments\n"
        "code = codes[arguments[2]]\n"
        "if code < 0:\n"
        "    import os\n"
        "    os.kill(os.getpid(), -code)\n"
        "print('Inputs: changed: numpy 2.2 -> 2.3' if code < 2 else 'check: no such | folder')\n"
        "print('quick' if '--quick' in arguments else 'all')\n"
        f"text = {JUNIT!r}\n"
        "if code == 0:\n"
        "    text = text.replace('failure', 'system-out')\n"
        "if code < 2:\n"
        "    pathlib.Path(arguments[4]).write_text(text)\n"
        "sys.exit(code)\n"
    )


@pytest.mark.parametrize(
    ("codes", "expected"),
    [({"a": 0}, 0), ({"a": 0, "b/c": 1}, 1), ({"a": 1, "b/c": 2}, 2), ({"b/c": 2, "a": 0}, 2)],
)
def test_all_baselines_are_checked_and_the_worst_decides(tmp_path, monkeypatch, codes, expected):
    fake_gaitval(tmp_path, codes)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BASELINES", "\n".join([*codes, "", " "]))
    monkeypatch.setenv("OUT", "out")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(tmp_path / "step.md"))
    monkeypatch.setenv("GITHUB_OUTPUT", str(tmp_path / "output"))
    with pytest.raises(SystemExit) as ended:
        action_check.main()
    assert ended.value.code == expected
    summary = (tmp_path / "step.md").read_text()
    assert summary == (tmp_path / "out/summary.md").read_text()
    rows = [line for line in summary.splitlines() if line.startswith("| ")][1:]
    assert len(rows) == len(codes)
    assert all(line.count(" | ") == 4 for line in rows)
    lost = sum(code == 1 for code in codes.values())
    assert f"lost={lost}\n" in (tmp_path / "output").read_text()
    assert summary.count("angle_rmse of knee_angle_r: 1 deg in the baseline, 3 deg now") == lost
    for name in codes:
        log = (tmp_path / f"out/{name.replace('/', '-')}.log").read_text()
        assert "quick" in log


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signals")
@pytest.mark.parametrize("order", [("a", "killed"), ("killed", "a")])
def test_a_check_that_was_killed_fails_the_job(tmp_path, monkeypatch, order):
    """The kernel kills a process where memory is short; another baseline may be fine."""
    fake_gaitval(tmp_path, {"a": 0, "killed": -9})
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BASELINES", "\n".join(order))
    monkeypatch.setenv("OUT", "out")
    with pytest.raises(SystemExit) as ended:
        action_check.main()
    assert ended.value.code == 128 + 9
    row = "| killed | **no result** (exit code 137) | – | 0 | – |"
    assert row in (tmp_path / "out/summary.md").read_text()


@pytest.mark.parametrize(
    ("code", "text"),
    [
        ("raise ImportError('no such')", ""), ("sys.exit(0)", ""), ("sys.exit(1)", "<testsuites>"),
        ("sys.exit(0)", JUNIT), ("sys.exit(1)", JUNIT.replace("failure", "system-out")),
        ("sys.exit(0)", "<testsuites></testsuites>"),
    ],
)  # fmt: skip
def test_what_ends_without_a_result_is_no_verdict(tmp_path, monkeypatch, code, text):
    """Python itself ends with 1 after an error, as `gaitval check` does when accuracy was lost."""
    fake_gaitval(tmp_path, {})
    program = f"import sys, pathlib\n{text!r} and pathlib.Path(sys.argv[5]).write_text({text!r})\n"
    (tmp_path / "installed/gaitval/__main__.py").write_text(program + code)
    outcome = action_check.check("a", tmp_path, quick=True)
    assert outcome.code == action_check.CRASHED
    assert "| a | **no result** (exit code 70) |" in action_check.summary([outcome], quick=True)


def test_no_module_of_the_folder_that_is_checked_runs(tmp_path, monkeypatch):
    """It is that of whoever made the pull request."""
    fake_gaitval(tmp_path, {"a": 0})
    workspace, marks = tmp_path / "workspace", tmp_path / "marks"
    workspace.mkdir()
    marks.mkdir()
    for name in {*sys.stdlib_module_names, "numpy", "gaitval", "pip", "sitecustomize"}:
        (workspace / f"{name}.py").write_text(f"open({str(marks / name)!r}, 'w').close()\n")
    command = [sys.executable, "-P", str(ROOT / "scripts/action_check.py")]
    environment = os.environ | {"BASELINES": "a", "OUT": str(tmp_path / "out")}
    done = subprocess.run(command, cwd=workspace, env=environment, check=False)
    assert done.returncode == 0
    assert list(marks.iterdir()) == []


def test_every_python_of_the_action_is_told_to_take_no_modules_from_there(definition):
    for step in steps_that_run(definition):
        for line in step["run"].splitlines():
            assert re.search(r"\bpython\b(?! -P )", line) is None, line


def test_quick_can_be_turned_off(tmp_path, monkeypatch):
    fake_gaitval(tmp_path, {"a": 0})
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("QUICK", "false")
    outcome = action_check.check("a", tmp_path, quick=False)
    assert "all" in outcome.log
    assert "Curves only" not in action_check.summary([outcome], quick=False)


def test_a_name_cannot_leave_its_cell_or_become_html():
    outcome = action_check.Outcome("a|b<script>", 0, 1, 0, (), "x\ny", "")
    row = action_check.summary([outcome], quick=True).splitlines()[4]
    assert row == "| a\\|b&lt;script> | kept | 1 | 0 | x y |"


def test_without_baselines_it_says_so(monkeypatch):
    monkeypatch.setenv("BASELINES", "\n \n")
    with pytest.raises(SystemExit, match="BASELINES is empty"):
        action_check.main()


# ---- Its steps. ----


def test_the_steps_run_in_order_and_the_report_is_kept_after_a_failure(tmp_path, definition):
    """With a made-up installation; `scripts/action_try.py` runs them with a real one."""
    folder = tmp_path / "runner"
    fake_gaitval(tmp_path, {"reports/S05/baseline": 0, "reports/nowhere": 2})
    action_try.prepare(folder, ["reports/S05/baseline"])
    given = {
        "baselines": "reports/S05/baseline\nreports/nowhere",
        "system-libraries": "false",
        "python-version": "",
    }
    runner = action_try.Runner(folder, action_try.inputs_of(definition, given), sys.executable)
    commands = folder / "venv/bin"
    commands.mkdir(parents=True)
    # `pip` is not to install anything; all else is this Python.
    (commands / "python").write_text(
        f'#!/bin/sh\n[ "$3" = pip ] && {{ echo "$@" > "{folder}/pip"; exit 0; }}\n'
        f'PYTHONPATH="{tmp_path}/installed" exec "{sys.executable}" "$@"\n'
    )
    (commands / "python").chmod(0o755)
    action_try.run_steps(runner, definition["runs"]["steps"])
    messages = dict(runner.done)
    assert messages["Python"] == messages["System libraries"] == "skipped"
    assert messages["Install"].startswith("exit code 0")
    assert (folder / "pip").read_text().split()[-3:] == [
        "-c", f"{ROOT}/constraints.txt", str(ROOT),
    ]  # fmt: skip
    assert messages["Check"].startswith("exit code 2")
    assert runner.failed == 2
    assert messages["Keep the report"].startswith("exit code 0")
    assert set(runner.uploaded) == {
        "summary.md", "reports-S05-baseline.log", "reports-S05-baseline.xml", "reports-nowhere.log"
    }  # fmt: skip
    summary = (folder / "summary.md").read_text()
    assert "| reports/S05/baseline | kept |" in summary
    assert "| reports/nowhere | **cannot be used** |" in summary
    assert runner.outputs["check"]["lost"] == "0"
