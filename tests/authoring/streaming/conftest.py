"""One house of a stream: number 15 of every stream is a bathroom, the cheapest house there is."""

import pytest

from vigil.authoring.streaming.houses import StreamHouse, StreamHouseMaker, StreamSettings

BATHROOM = 15


@pytest.fixture(scope="session")
def pointing() -> StreamHouse:
    return StreamHouseMaker(StreamSettings(7, ("PG",))).made(BATHROOM)
