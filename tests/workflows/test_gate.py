"""The check detects planted faults: a few of those of `tests/robustness/gate_mutations.py`."""

from pathlib import Path

import gate_mutations as gate
import pytest

from gaitval.artefacts import write_json


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What of a check without a fault the others start from; it says nothing."""
    folder: Path = tmp_path_factory.mktemp("gate") / "prepared"
    found = gate.checked(gate.NOTHING, folder)
    assert found["refused"] is None
    assert found["inputs"] == []
    assert found["lost"] == []
    write_json(folder.parent / "nothing.json", found)
    return folder


@pytest.mark.slow
def test_a_fault_of_a_baseline_is_refused_and_its_figures_tell_it_too(prepared: Path) -> None:
    found = gate.checked("correction with the other sign", prepared)
    assert "changed since it was stored" in found["refused"]
    assert found["refused_when_sealed"] is None
    assert found["by_check"] == "figures"
    assert found["ratio"] > 1.0


@pytest.mark.slow
def test_a_fault_of_the_code_is_told_by_inputs_and_figures(prepared: Path) -> None:
    found = gate.checked("sign of the hip adduction angle", prepared)
    assert found["inputs"] == ["the code in gaitval/metrics"]
    assert found["by_check"] == "figures"


def test_a_refused_input_is_not_told_by_figures() -> None:
    assert gate.by_figures({"by_check": "figures"})
    assert gate.by_figures({"by_check": "does not walk", "error": "RecordError: no gait cycle"})
    assert not gate.by_figures({"by_check": "does not walk", "error": "PolicyError: another body"})
    assert not gate.by_figures({"by_check": "refused"})
    assert not gate.by_figures({"by_check": None, "by_test": "tests/test_errors.py::test_b"})


def test_all_faults_can_be_planted() -> None:
    """Their texts are in the package, each once."""
    for fault in gate.code_faults().values():
        text = (gate.ROOT / "gaitval" / fault["file"]).read_text(encoding="utf-8")
        assert text.count(fault["old"]) == 1, fault["name"]
        assert all((gate.ROOT / test).exists() for test in fault["tests"]), fault["name"]
