"""Forks: recorded plays that are continued from a step."""
