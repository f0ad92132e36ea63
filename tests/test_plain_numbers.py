"""Numbers of texts: what only Python takes for one is refused, in every format."""

import math
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from motion_files import forces, trc

from gaitval._internal.text.plain_numbers import plain_float, plain_int
from gaitval.errors import GaitvalError
from gaitval.mocap.mot import read_storage
from gaitval.mocap.text_cells import positive
from gaitval.mocap.trc import read_trc
from gaitval.model.urdf import _number
from gaitval.scaling.opensim.fields import number

ONLY_PYTHON = ["1_0", "1_0.5", "1e1_0", "\u0661\u0662", "\uff11"]


@pytest.mark.parametrize("text", ONLY_PYTHON)
def test_what_only_python_takes_for_a_number_is_none(text: str) -> None:
    assert math.isfinite(float(text))  # it does
    with pytest.raises(ValueError, match=re.escape(text)):
        plain_float(text)
    with pytest.raises(ValueError, match=r"not a number|invalid"):
        plain_int(text)


@pytest.mark.parametrize("text", [" 10 ", "-1.5e-3", "+2", "nan", "inf", ".5"])
def test_others_are_as_before(text: str) -> None:
    assert repr(plain_float(text)) == repr(float(text))
    assert plain_int(" -12 ") == -12


@pytest.mark.parametrize("wrong", ["7_00", "\u0667"])
def test_a_damaged_cell_is_refused_with_its_line(tmp_path: Path, wrong: str) -> None:
    for make, read, row in ((forces, read_storage, 60), (trc, read_trc, 8)):
        path = make(tmp_path / f"a.{read.__name__}")
        lines = path.read_text().splitlines()
        cells = lines[row].split("\t")
        lines[row] = "\t".join([*cells[:3], wrong, *cells[4:]])
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        with pytest.raises(GaitvalError, match=rf"line {row + 1}: '{wrong}' is not a number"):
            read(path)


def test_a_rate_of_other_formats() -> None:
    with pytest.raises(GaitvalError, match="'1_00'"):
        positive(Path("a.tsv"), "1_00", "FREQUENCY")


@pytest.mark.parametrize("written", ["<mass>1_1.7</mass>", "<mass>\u0661</mass>"])
def test_a_number_of_an_osim(written: str) -> None:
    body = ElementTree.fromstring(f"<Body>{written}</Body>")
    with pytest.raises(GaitvalError, match=r"a\.osim: <mass> is .*, not finite numbers"):
        number(body, "mass", "a.osim")


def test_a_number_of_a_urdf() -> None:
    link = ElementTree.fromstring('<link><inertial><mass value="1_1.7"/></inertial></link>')
    with pytest.raises(ValueError, match=r"1_1\.7"):
        _number(link, "inertial/mass", "value")
