"""Foundations that know nothing of episodes: geometry, JSON files, settings, versions."""
