import pytest

from vigil.errors import SettingError
from vigil.housegen.base.spec import SPECS, HouseSpec, spec_for


def test_a_number_of_rooms_names_a_spec():
    assert spec_for("4") is SPECS["4-room"]
    assert all(len(rooms) == 4 for rooms in spec_for("4").choices)


@pytest.mark.parametrize("name", ["0", "11", "castle", ""])
def test_unknown_specs_are_refused_with_those_known(name):
    with pytest.raises(SettingError, match="Known: kitchen"):
        spec_for(name)


def test_too_many_rooms_for_the_area_are_refused_with_what_would_fit():
    with pytest.raises(SettingError, match=r"they need 42 to 112 m2"):
        HouseSpec(name="shed", choices=(("Kitchen", "LivingRoom", "Bedroom", "Bathroom"),), area_m2=20.0)


@pytest.mark.parametrize(("name", "meant"), [("kichen", "kitchen"), ("4-rooms", "4-room")])
def test_misspelt_specs_are_guessed(name, meant):
    with pytest.raises(SettingError, match=f"Did you mean '{meant}'"):
        spec_for(name)


@pytest.mark.parametrize("kind", ["Attic", "bedroom", 3])
def test_unknown_kinds_of_rooms_are_refused_with_what_would_fit(kind):
    with pytest.raises(SettingError, match=rf"kind of room {kind!r} does not exist\..*Bedroom, Bathroom"):
        HouseSpec.model_validate({"name": "odd", "choices": [["Kitchen", kind]]})


def test_ceilings_that_no_house_has_are_refused():
    with pytest.raises(SettingError, match="ceiling_m"):
        HouseSpec(name="burrow", choices=(("Kitchen",),), ceiling_m=(1.0, 2.0))


def test_every_count_of_rooms_has_a_spec():
    for count in range(1, 11):
        assert {len(rooms) for rooms in spec_for(str(count)).choices} == {count}
