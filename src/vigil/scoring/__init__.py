"""Verdicts: pure functions of records and a pack."""
