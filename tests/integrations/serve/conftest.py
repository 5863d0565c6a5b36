"""A tiny pack to serve."""

import pytest

from tests.support.tiny_pack import tiny_pack
from vigil.packs.pack import Pack


@pytest.fixture(scope="session")
def pack(tmp_path_factory: pytest.TempPathFactory) -> Pack:
    return tiny_pack(tmp_path_factory.mktemp("packs") / "tiny", 8)
