"""A house of a stream with three episodes, which tests of demonstrations share."""

import pytest

from vigil.authoring.streaming.houses import StreamHouse, StreamHouseMaker, StreamSettings
from vigil.authoring.streaming.stream import Stream, StreamItem, items_in


@pytest.fixture(scope="session")
def house() -> StreamHouse:
    """A bathroom with an episode of each of three families."""
    made = StreamHouseMaker(StreamSettings(7, ("PG", "SV", "AI"))).made(15)
    one_each = {draft.episode.family: draft for draft in made.drafts}
    assert set(one_each) == {"PG", "SV", "AI"}
    return made.model_copy(update={"drafts": tuple(draft for draft in made.drafts if draft in one_each.values())})


@pytest.fixture(scope="session")
def items(house: StreamHouse) -> list[StreamItem]:
    return list(items_in([house]))


@pytest.fixture
def stream(house: StreamHouse, monkeypatch: pytest.MonkeyPatch) -> Stream:
    """A stream of this one house, at no cost."""
    monkeypatch.setattr(StreamHouseMaker, "made", lambda self, number: house)
    return Stream(7, families=("PG", "SV", "AI"), first=15, last=16, workers=0)
