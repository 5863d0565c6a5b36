"""Agents, which answer an observation with a reply and cannot see hidden state.

An import rule (`tests/test_imports.py`) ensures this: no module here imports worlds, goals, simulators or episodes.
"""
