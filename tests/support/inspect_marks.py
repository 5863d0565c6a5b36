"""Marks of tests that ask models through Inspect."""

import pytest

INSPECT = [
    pytest.mark.filterwarnings("ignore:The 'initial' parameter is deprecated:DeprecationWarning"),
    pytest.mark.filterwarnings("ignore:Unclosed <MemoryObject:ResourceWarning"),
    pytest.mark.usefixtures("collected", "plain_tracebacks"),
]
"""Inspect leaves streams of its own (anyio's in memory) open; they are collected while their warnings are filtered."""
