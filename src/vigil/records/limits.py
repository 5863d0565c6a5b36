"""Limits of runs. They have a module without the models of records, so that settings load without these models."""

MAX_EPOCHS = 10_000
"""Maximum number of plays of one episode in a run."""
