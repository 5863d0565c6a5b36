"""Marks of tests that ask models through Inspect."""

import pytest

INSPECT = [
    pytest.mark.filterwarnings("ignore:The 'initial' parameter is deprecated:DeprecationWarning"),
    pytest.mark.filterwarnings("ignore:Unclosed <MemoryObject:ResourceWarning"),
    pytest.mark.usefixtures("collected", "inspect_unformatted"),
]
"""Marks that collect Inspect's unclosed in-memory streams (anyio) while the warnings about them are filtered."""
