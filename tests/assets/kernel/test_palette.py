"""Words for colours: what people call a colour, and silence where two words would do."""

import pytest

from vigil.assets.kernel.palette import COLOURS, word_for


@pytest.mark.parametrize("name", COLOURS)
def test_every_colour_is_called_by_its_own_word(name: str) -> None:
    assert word_for(*(int(COLOURS[name][k : k + 2], 16) for k in (1, 3, 5))) == name


@pytest.mark.parametrize(
    ("rgb", "word"),
    [((76, 41, 94), "purple"), ((37, 93, 59), "green"), ((30, 58, 68), None), ((218, 170, 50), "yellow")],
)
def test_a_dark_purple_is_no_grey(rgb: tuple[int, int, int], word: str | None) -> None:
    assert word_for(*rgb) == word
