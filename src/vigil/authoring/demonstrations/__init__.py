"""Demonstrations: what a model would have been sent in episodes of a stream, and what the solver answered."""
