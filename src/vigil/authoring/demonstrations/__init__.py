"""Demonstrations: the requests that a model would get in episodes of a stream, each with the solver's answer."""
