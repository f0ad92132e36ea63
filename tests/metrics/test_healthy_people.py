"""Which healthy people a page's bands and norms are of, each group once."""

from gaitval.gait.healthy_controls import load_controls
from gaitval.metrics.healthy_people import healthy_people
from gaitval.metrics.norms import norms_at


def test_every_norm_has_one_group_of_people_and_their_number():
    found = healthy_people(40.0)
    whose = {what: each for each in found for what in each.of}
    assert len(whose) == sum(len(each.of) for each in found), "nothing is of two groups"
    for name, norm in norms_at(1.2, 0.9, 40.0).items():
        kind, _, parameter = name.partition("/")
        of = whose[parameter if kind == "parameter" else kind]
        assert of.people == (norm.people or None)
    assert whose["gait profile"].people == load_controls().people
    assert [each.people or 0 for each in found] == sorted(
        (each.people or 0 for each in found), reverse=True
    )
    assert len({(each.people, each.how, each.source) for each in found}) == len(found)


def test_a_child_is_beside_children():
    (children,) = healthy_people(8.0)
    assert "children" in children.how
    assert set(children.of) == {name.partition("/")[0] for name in norms_at(1.2, 0.7, 8.0)}
    assert healthy_people(None) == healthy_people(40.0)
