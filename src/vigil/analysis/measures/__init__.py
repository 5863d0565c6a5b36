"""Measures: verdicts of saved runs as rows, and the rates, intervals and comparisons computed from these rows."""
