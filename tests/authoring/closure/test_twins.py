"""What the first frames of twins may show, and why what is gone is gone."""

from itertools import permutations

import pytest

from vigil.authoring.closure.twins import BrokenRule, reason_for_absence
from vigil.authoring.language.referring import LOOK_ALIKES, DescribedThing, Phrase

SOUGHT = Phrase("kettle", support="dining table")


def item(name: str, support: str = "stove", **facts: object) -> DescribedThing:
    return DescribedThing(id=f"{name} on {support}", category="", name=name, support=support, **facts)  # type: ignore[arg-type]


def test_another_of_its_name_lies_elsewhere() -> None:
    assert reason_for_absence([SOUGHT], [item("kettle"), item("mug")]) == "elsewhere"
    assert reason_for_absence([SOUGHT], [item("mug")]) == "absent"
    black = Phrase("kettle", colour="black", support="dining table")
    assert reason_for_absence([black], [item("kettle", colours=("black",))]) == "elsewhere"
    assert reason_for_absence([black], [item("kettle", colours=("white",))]) == "absent"


@pytest.mark.parametrize("names", [pair for group in LOOK_ALIKES for pair in permutations(group, 2)], ids=" for ".join)
def test_what_may_be_taken_for_it_is_none_of_its_name(names: tuple[str, str]) -> None:
    gone, other = names
    assert reason_for_absence([Phrase(gone, support="bed")], [item(other)]) == "absent"


def test_what_is_called_more_exactly_is_none_of_its_name() -> None:
    assert reason_for_absence([Phrase("box", support="bed")], [item("tissue box")]) == "absent"


@pytest.mark.parametrize("left", ["kettle", "pot"])
def test_nothing_that_may_be_taken_for_it_is_left_where_it_is_sought(left: str) -> None:
    with pytest.raises(BrokenRule, match="fits") as broken:
        reason_for_absence([SOUGHT], [item(left, "dining table")])
    assert broken.value.rule == "distinguished"
