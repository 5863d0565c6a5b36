"""Pointing at marked spots, read in each convention."""

import asyncio
import io
from collections.abc import Sequence

import numpy as np
import pytest
from PIL import Image

from tests.support.narrowing import present
from vigil.agents.conversation import Message
from vigil.protocol.actions import Reply
from vigil.runner.models.completion import (
    CONVENTIONS,
    SPOTS,
    FramePoint,
    PointingCalibration,
    calibrate_pointing,
    draw_spot,
    point_in,
)


def seen(messages: Sequence[Message]) -> FramePoint:
    """Return the position of the magenta disc in the picture that was sent."""
    rgb = np.asarray(Image.open(io.BytesIO(present(messages[-1].picture).data)), dtype=int)
    rows, columns = np.nonzero((rgb[..., 0] > 200) & (rgb[..., 1] < 60))
    return FramePoint(float(columns.mean()), float(rows.mean()))


def pointing(convention: str, off_px: float = 0.0) -> PointingCalibration:
    scale = CONVENTIONS[convention]

    async def ask(messages: Sequence[Message]) -> Reply:
        spot = seen(messages)
        x, y = round((spot.x + off_px) / scale.x, 3), round(spot.y / scale.y, 3)
        return Reply(text=f'x: 1, y: 1 ...</think>{{"arguments": {{"intent": "ground", "x": {x}, "y": {y}}}}}')

    return asyncio.run(calibrate_pointing(ask))


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_the_convention_is_found_with_its_median_error(convention: str) -> None:
    found = pointing(convention, off_px=5.0)
    assert found.answered == len(SPOTS) == 8
    assert found.best == convention
    assert found.medians[convention] == pytest.approx(5.0, abs=0.5)
    assert found.coordinates == (convention if convention != "fractions of 0 to 1" else None)
    others = [error for name, error in found.medians.items() if name != convention]
    assert min(others) > 100


def test_a_model_that_points_anywhere_fits_none() -> None:
    found = pointing("pixel", off_px=90.0)
    assert (found.best, found.coordinates) == (None, None)


def test_answers_without_a_point_are_counted_apart() -> None:
    answers = iter(["I see no disc.", *['{"x": 10, "y": 10}'] * 7])

    async def ask(messages: Sequence[Message]) -> Reply:
        return Reply(text=next(answers))

    assert asyncio.run(calibrate_pointing(ask)).answered == 7
    silent = PointingCalibration((None,) * 8)
    assert (silent.medians, silent.best) == ({}, None)


@pytest.mark.parametrize(
    ("text", "point"),
    [
        ('{"x": 12, "y": 34}', (12, 34)),
        ("x=0.5, y=0.25", (0.5, 0.25)),
        ('<think>"x": 1, "y": 2</think>{"y": 4, "x": 3}', (3, 4)),
        ("[12, 34]", None),
        ("", None),
    ],
)
def test_a_point_is_found_in_an_answer(text: str, point: tuple[float, float] | None) -> None:
    assert point_in(text) == point


def test_a_spot_is_drawn_where_it_is_said() -> None:
    for spot in SPOTS:
        disc = (draw_spot(spot)[..., 0] > 200) & (draw_spot(spot)[..., 1] < 60)
        rows, columns = np.nonzero(disc)
        assert columns.mean() == pytest.approx(spot.x, abs=0.6)
        assert rows.mean() == pytest.approx(spot.y, abs=0.6)
