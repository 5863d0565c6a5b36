"""Demonstrations: the requests that a model would get in episodes of a stream, with the solver's answers."""
