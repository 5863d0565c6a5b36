"""Observations: a frame is drawn when it is first read, once, and nobody can change it."""

import numpy as np
import pytest

from vigil.protocol.observation import Observation


def test_a_frame_is_drawn_once_and_cannot_be_changed() -> None:
    drawn: list[np.ndarray] = []

    def draw() -> np.ndarray:
        drawn.append(np.zeros((480, 640, 3), np.uint8))
        return drawn[-1]

    seen = Observation(draw)
    assert not drawn
    assert seen.rgb is seen.rgb
    assert len(drawn) == 1
    with pytest.raises(ValueError, match="read-only"):
        seen.rgb[0, 0] = 1
    assert drawn[0].flags.writeable
