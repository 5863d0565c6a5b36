"""Sweeps: commands that try to break VIGIL by many random cases, for hours if one lets them; no tests."""
