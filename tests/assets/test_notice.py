"""The notice on a broken machine: where it hangs, that it can be read, and that shapes know nothing of it."""

import numpy as np
import pytest

from vigil.assets.catalog import CATALOG
from vigil.assets.making import make
from vigil.assets.notice import HEIGHT_M, LINES, MACHINES, WIDTH_M, notice_centre, notice_parts

VARIANTS = range(4)
FRAME_M, TOP_M, LETTER_M = 0.012, HEIGHT_M / 2 - 0.012, 0.035
"""Where the frame ends, from the side and from the middle up, and a little less than the width of a letter."""


@pytest.mark.parametrize("category", sorted(MACHINES))
@pytest.mark.parametrize("variant", VARIANTS)
def test_every_machine_bears_one_on_its_front(category: str, variant: int):
    asset = make(category, CATALOG[category].typical_size, variant)
    sheet, text = notice_parts(asset)
    spot = notice_centre(asset)
    assert spot is not None
    low, high = sheet.mesh.vertices.min(axis=0), sheet.mesh.vertices.max(axis=0)
    assert high[:2] - low[:2] == pytest.approx([WIDTH_M, HEIGHT_M], abs=1e-6)
    assert high[2] == pytest.approx(spot.z, abs=1e-6)
    assert text.mesh.vertices[:, 2].max() > high[2]
    assert {sheet.shown, text.shown} == {"broken"}
    assert sheet.joint in {None, *(joint.name for joint in asset.joints)}
    assert all(part.shown != "broken" for part in asset.parts)


def test_the_text_reads_from_left_to_right_to_who_looks_at_the_front():
    asset = make("Microwave", CATALOG["Microwave"].typical_size, 0)
    spot = notice_centre(asset)
    assert spot is not None
    corners = notice_parts(asset)[1].mesh.vertices - np.array(spot)
    inner = corners[(np.abs(corners[:, 0]) < WIDTH_M / 2 - FRAME_M) & (corners[:, 1] > 0) & (corners[:, 1] < TOP_M)]
    # Who looks at the front has +x on the left, so that the last letter of OUT OF has the least x.
    last = inner[inner[:, 0] < inner[:, 0].min() + LETTER_M]
    foot = last[last[:, 1] < last[:, 1].min() + 1e-4]
    assert LINES[0][-1] == "F"
    assert foot[:, 0].mean() > last[:, 0].mean()


@pytest.mark.parametrize("category", ["Fridge", "Apple", "Sofa", "Faucet", "Candle"])
def test_what_is_no_machine_with_a_front_bears_none(category: str):
    asset = make(category, CATALOG[category].typical_size, 0)
    assert notice_parts(asset) == ()
    assert notice_centre(asset) is None
