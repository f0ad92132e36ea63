"""The package stays as small, plain and typed as `reports/evidence/house.csv` requires."""

import pytest

from evidence import house, read


@pytest.mark.parametrize("measure", [house.types, house.words], ids=lambda each: each.__name__)
def test_what_must_be_is(measure):
    """But for rows whose stored value misses its must: those may not get worse."""
    stored = {row["what"]: float(row["value"]) for row in read(house.CSV)}
    for row in measure(None):
        was = stored[row.what]
        worse = row.value > was if row.relation == "<=" else row.value < was - 1e-9
        assert row.kept or not worse, f"{row.what}: {row.value}"


def test_the_package_does_not_grow_beyond_its_limit():
    (row,) = (each for each in read(house.CSV) if each["what"] == house.LINES)
    assert house.lines_of(house.modules()) <= max(float(row["must"]), float(row["value"]))


def test_what_is_not_documented_is_found(tmp_path):
    code = 'def f(a, bee):\n    """Of `a`."""\n    raise ValueError(\'x\')\n'
    (tmp_path / "one.py").write_text(code)
    (function,) = house.tree_of(tmp_path / "one.py").body
    assert not house.is_documented(function)
    (tmp_path / "two.py").write_text(code.replace("Of `a`.", "Of `a` and `bee`; ValueError: no."))
    (function,) = house.tree_of(tmp_path / "two.py").body
    assert house.is_documented(function)
