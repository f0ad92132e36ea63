"""Sizes that are drawn: as many as in the list, by their seed, none smaller than a fault."""

from claims.measurement.planting import Sizes, drawn_sizes, faults


def test_drawn_faults_are_as_many_of_each_cause_and_those_of_their_seed():
    plates = ("1", "2", "3")

    def kinds(sizes):
        return sorted(each.causes[0].split(" ")[0] for each in faults(plates, sizes))

    assert kinds(drawn_sizes(1)) == kinds(Sizes())
    names = [each.name for each in faults(plates, drawn_sizes(1))]
    assert names == [each.name for each in faults(plates, drawn_sizes(1))]
    assert names != [each.name for each in faults(plates, drawn_sizes(2))]


def test_a_drawn_fault_is_large_and_on_the_first_or_last_plate():
    for seed in range(20):
        for each in faults(("1", "2", "3"), drawn_sizes(seed)):
            kind, _, plate = each.causes[0].partition(" ")
            least = {"delay": 0.02, "mass": 0.08, "gain": 0.08, "place": 0.025, "scale": 0.02}
            assert abs(each.size) >= least.get(kind, 0.0) - 1e-9
            assert plate in ("", "1", "3", "all", "low-passed")
