"""Forks: recorded plays that another agent continues from a step."""
