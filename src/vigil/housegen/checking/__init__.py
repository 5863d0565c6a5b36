"""Checks that every house must pass."""
