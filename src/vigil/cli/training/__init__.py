"""Verbs for training agents."""
