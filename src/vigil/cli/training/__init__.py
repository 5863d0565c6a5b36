"""Verbs for those who train agents."""
