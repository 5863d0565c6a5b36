"""Agents: what answers an observation with a reply. None of them can see hidden state.

The contract is an import rule (`tests/test_imports.py`): nothing here knows worlds, goals, simulators or episodes.
"""
