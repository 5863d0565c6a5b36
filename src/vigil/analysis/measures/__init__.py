"""Measures: saved runs as rows of verdicts, rates, intervals and comparisons."""
