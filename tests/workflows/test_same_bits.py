"""What `tests/robustness/same_bits.py` compares, so that its claim can fail."""

import json

import same_bits


def run_of(folder, policy: bytes, value: float):
    (folder / "policy").mkdir(parents=True)
    (folder / "policy" / "policy.safetensors").write_bytes(policy)
    measure = {"measure": "rmse", "target": "knee_angle_r", "value": value}
    (folder / "metrics.json").write_text(json.dumps({"measures": [measure]}))
    return same_bits.results(folder)


def test_one_bit_of_a_file_or_of_a_measure_is_seen(tmp_path):
    first = run_of(tmp_path / "a", b"\x00", 0.1)
    assert run_of(tmp_path / "b", b"\x00", 0.1) == first
    assert run_of(tmp_path / "c", b"\x01", 0.1) != first
    assert run_of(tmp_path / "d", b"\x00", 0.1 + 2e-17) != first, "the next double"


def test_values_are_apart_by_margins():
    assert same_bits.apart(1.5, 1.0, 0.25) == 2.0
    assert same_bits.apart(3.0, 3.0, 0.0) == 0.0
    assert same_bits.apart(3.0, 2.0, 0.0) == float("inf")
    assert same_bits.apart(None, None, 0.0) == 0.0
    assert same_bits.apart(None, 2.0, 1.0) == float("inf")


def test_the_ways_have_the_workers_that_they_say():
    for way, (workers, _) in same_bits.WAYS.items():
        settings = same_bits.settings(workers)
        assert [each for each in settings if "workers" in each] == [
            f"--set=training.workers={workers}"
        ], way
