"""Scoring: verdicts and rates as pure functions of records and a pack."""
