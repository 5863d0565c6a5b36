"""Verbs for evaluations that others must be able to trust: challenges, served packs, and leaderboards."""
