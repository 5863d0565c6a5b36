"""Limits of runs. This module does not import the models of records, so that settings load without these models."""

MAX_EPOCHS = 10_000
"""Maximum number of plays of one episode in a run."""
