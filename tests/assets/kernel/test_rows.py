"""Makers that are rows of data: all can be read, numbers have the right units, and wrong rows say what is wrong."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from vigil.assets.kernel.asset import Asset
from vigil.assets.kernel.rows import maker_of, makers_in
from vigil.assets.making import MAKERS, ROWS
from vigil.base.geometry import Vec3

SIZE = Vec3(0.4, 1.0, 0.2)
FILES = sorted(ROWS.glob("*.toml"))


def made(row: str, size: Vec3 = SIZE, seed: int = 0) -> Asset:
    return maker_of("Thing", {"about": "A thing.", **tomllib.loads(row)}, {})(size, np.random.default_rng(seed), ())


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_each_row_is_read_and_says_what_it_describes(path: Path) -> None:
    rows = tomllib.loads(path.read_text())
    shared = rows.pop("shared", {})
    for category, row in rows.items():
        assert category in MAKERS
        if "like" not in row:
            maker_of(category, row, shared)
            assert row["about"].endswith(".")


def test_the_row_on_the_page_is_the_plungers() -> None:
    """The row of docs/assets.md."""
    page = (Path(__file__).parents[3] / "docs" / "assets.md").read_text()
    row = tomllib.loads(page.split("```toml\n")[1].split("```")[0])
    assert row["Plunger"] == tomllib.loads((ROWS / "bathroom.toml").read_text())["Plunger"]


def test_no_category_has_two_makers() -> None:
    names = [name for path in FILES for name in makers_in(path)]
    assert len(names) == len(set(names))


def test_numbers_are_shares_of_the_box_and_formulas_are_metres() -> None:
    thing = made(
        'parts = [{look = "wood/oak", box = [1, 1, 1], at = [0, 0.5, 0]}, '
        '{look = "chrome", box = [0.5, "0.1", "depth / 4"], at = [0, 0.5, 0]}]'
    )
    inner = thing.parts[1].mesh.vertices
    assert np.allclose(np.ptp(inner, axis=0), [0.2, 0.1, 0.05], atol=1e-6)


def test_a_row_in_metres_is_stretched_to_its_box() -> None:
    thing = made('unit = true\nparts = [{look = "wood/oak", ball = [3, 3, 3]}]')
    assert np.allclose(np.ptp(thing.parts[0].mesh.vertices, axis=0), SIZE, atol=1e-3)


def test_values_are_drawn_in_order_and_only_when_they_are_wanted() -> None:
    row = """
words = ["{name}", "{kind}"]
values."name, tint" = {colours = ["red", "blue"]}
values.kind = ["plain", "{name}"]
values.other = {colours = ["red", "blue"], without = "name"}
values.missing = {chance = 1.0, when = "kind == 'none'"}
parts = [{look = "plastic/{tint}", box = [1, 1, 1]}, {when = "missing", look = "wax", ball = [1, 1, 1]}]
"""
    things = [made(row, seed=seed) for seed in range(12)]
    assert {tag for thing in things for tag in thing.tags} == {"red", "blue", "plain"}
    assert all(len(thing.parts) == 1 for thing in things)


def test_entries_are_repeated_and_share_what_their_group_says() -> None:
    row = """
parts = [{look = "chrome", each = {side = [-1, 1], k = 3}, let = {x = "side * (k + 1) * 0.05"}, parts = [
    {box = ["0.01", 1, 1], at = ["x", 0.5, 0]},
]}]
"""
    assert len(made(row).parts[0].mesh.vertices) == 6 * 24


def test_what_hangs_on_a_joint_and_what_is_lit_shows_its_state() -> None:
    thing = made("""
parts = [
    {hinge = "door", about = [0, 1, 0], at = [0.5, 0, 0], degrees = 90},
    {look = "glass", joint = "door", box = [1, 1, 1], at = [0, 0.5, 0]},
    {look = "plastic/#111111", lit = "glow/#ffffff", box = [1, 1, 1], at = [0, 0.5, 0]},
]
""")
    door, lamp = thing.parts
    assert (door.joint, door.bears_open, door.is_glass, door.bears_toggle) == ("door", True, True, False)
    assert (lamp.material_on, lamp.bears_toggle, lamp.bears_open) == ("glow/#ffffff", True, False)


WRONG_ROWS = {
    "word = []": "a row cannot have the key 'word'. Did you mean 'words'?",
    "values.kind = {luck = 1}": "value 'kind': the value needs exactly one of",
    'values.share = {by = "kind", a = 1}': "value 'share': the table needs the value 'kind', which does not exist",
    'values.tint = {colours = ["redd"]}': "value 'tint': 'redd' is not among colours. Did you mean 'red'?",
}
WRONG_PARTS = {
    "box = [1, 1, 1]": "'box' needs 'look'",
    'look = "wax", bokx = 1': (
        "an entry must have exactly one shape, one addition (e.g. 'hinge') or 'parts', not 'bokx'. Did you mean 'box'?"
    ),
    'look = "wax", box = 1, ball = 1': (
        "an entry must have exactly one shape, one addition (e.g. 'hinge') or 'parts', not 'box, ball'."
    ),
    'look = "wax", box = [1, 1]': "[1, 1] is not a list of 3 numbers",
    'look = "wax", box = [1, 1, true]': "True is neither a number nor a formula",
    'look = "wax", box = [1, 1, 1], bevl = 0.1': "'box' cannot have the key 'bevl'. Did you mean 'bevel'?",
    'look = "wax", cylinder = 0.1': "'cylinder' needs 'length'",
    'look = "wax", cylinder = 0.1, length = 1, axis = "up"': "'up' is not an axis; the axes are x, y and z",
    'look = "{tint}", box = [1, 1, 1]': "'{tint}' names 'tint', which has no value here.",
    'look = "wax", box = [1, 1, "heightt"]': "'heightt' uses 'heightt', which has no value here. Did you mean 'height'",
    'look = "wax", box = [1, 1, "1 +"]': "'1 +' is not a formula: invalid syntax",
    'look = "wax", box = [1, 1, 1], when = "().real"': "'().real' is not a formula: Attribute is not allowed",
    'look = "wax", box = [1, 1, 1], each = {"x, z" = [[1]]}': "option [1] does not give one value for each of x, z",
    'look = "wax", box = [1, 1, 1], each = {"x in y for z" = [1]}': "'x in y for z' cannot be the name of a value",
    'look = "wax", box = [1, 1, 1], let = {sin = "1"}': "'sin' cannot be the name of a value",
    'parts = [{look = "wax", box = 1}]': "part 1: 1 is not a list of 3 numbers",
}


@pytest.mark.parametrize(
    ("row", "message"),
    [*WRONG_ROWS.items(), *((f"parts = [{{{entry}}}]", f"part 1: {said}") for entry, said in WRONG_PARTS.items())],
)
def test_a_wrong_row_says_what_is_wrong_and_where(row: str, message: str) -> None:
    with pytest.raises(ValueError) as caught:
        made(row)
    assert str(caught.value).startswith(message)


def test_a_wrong_row_names_its_file_and_category(tmp_path: Path) -> None:
    path = tmp_path / "things.toml"
    path.write_text('[Globe]\nabout = "A globe."\nparts = [{ball = [1, 1, 1]}]\n')
    with pytest.raises(ValueError, match=r"^things.toml: Globe: part 1: 'ball' needs 'look'$"):
        makers_in(path)["Globe"](SIZE, np.random.default_rng(0), ())
