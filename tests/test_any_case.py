"""Names of options in capitals."""

from collections.abc import Callable

import pytest

from gaitval._internal.text.any_case import as_known, literals_of
from gaitval.apps.export.formats import writer_of
from gaitval.configuration import Configuration, load_configuration
from gaitval.errors import ConfigurationError
from gaitval.kinetics.musculature.forces import criterion_of
from gaitval.model.devices.device import load_devices
from gaitval.scaling.marker_sets import load_marker_set
from gaitval.session.measurement.correct import wanted
from gaitval.session.request import ImportOptions, checked


def test_what_is_not_known_stays_as_it_was_given() -> None:
    assert as_known("A4", ("a4", "letter")) == "a4"
    assert as_known("A5", ("a4", "letter")) == "A5"
    assert as_known(4, ("a4",)) == 4


def test_every_setting_that_is_a_name_takes_it_in_capitals() -> None:
    seen = 0
    for section, values in Configuration():
        for name, field in getattr(type(values), "model_fields", {}).items():
            for literal in literals_of(field.annotation):
                wanted_of = load_configuration(settings=[f"{section}.{name}={literal.upper()}"])
                assert getattr(getattr(wanted_of, section), name) == literal
                seen += 1
    assert seen > 10


def test_options_of_an_import_that_are_names() -> None:
    given = ImportOptions(
        trials="a.c3d", sex="F", aid="Rail", halves="Odd-Even", joint_centres="Hara",
        prosthesis="Left", plate=["FP2=RIGHT", "FP2=NONE"],
    )  # fmt: skip
    assert (given.aid, given.halves, given.joint_centres) == ("rail", "odd-even", "hara")
    assert (given.prosthesis, given.plate) == ("left", (("FP2", "right"), ("FP2", "none")))


@pytest.mark.parametrize("plate", [[["2", 3]], [5], 7, [None], ["2"]])
def test_what_is_no_pair_of_names_is_refused_in_words(plate: object) -> None:
    with pytest.raises(ConfigurationError, match="plate"):
        checked(ImportOptions, {"trials": "a.c3d", "sex": "F", "plate": plate})


@pytest.mark.parametrize(
    ("known", "name"),
    [
        (criterion_of, "squares"),
        (writer_of, "urdf"),
        (load_devices, "hip_exo"),
        (load_marker_set, "wbds"),
        (lambda name: wanted([name]), "delay"),
    ],
)
def test_names_that_are_looked_up(known: Callable[[str], object], name: str) -> None:
    assert known(name.title()) == known(name)
