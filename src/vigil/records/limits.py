"""Limits of what a run may hold, apart from the models of records, so that settings load without them."""

MAX_EPOCHS = 10_000
"""Maximum number of plays of one episode in a run."""
