"""What sources say of fields is what pydantic would read of them."""

from pydantic import ConfigDict

from gaitval.configuration import Configuration, ValidationSettings
from gaitval.field_texts import field_texts
from gaitval.metrics.record_results import Kinds, RecordedCurves
from gaitval.session.request import ImportOptions, Request


def test_texts_are_those_that_pydantic_reads():
    """Also of a class that inherits from another."""
    for model in (ImportOptions, Request):
        known = {name: each.description for name, each in model.model_fields.items()}
        assert len(known) > 10
        assert field_texts(model) == {name: text for name, text in known.items() if text}


def test_a_field_without_a_text_has_none():
    class Bare(ImportOptions):
        model_config = ConfigDict(frozen=False)
        left_out: float = 0.0

    assert "left_out" not in field_texts(Bare)
    assert "trials" in field_texts(Bare)


def test_every_setting_of_a_walk_has_one():
    assert {*ValidationSettings.model_fields} == {*field_texts(ValidationSettings)}
    assert "seed" in Configuration.model_fields


def test_a_generic_class_with_its_types_has_those_of_the_class():
    assert field_texts(RecordedCurves) == field_texts(Kinds[float]) == field_texts(Kinds)
