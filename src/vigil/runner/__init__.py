"""Runs: their settings, their workers and models, and the folder with their records."""
