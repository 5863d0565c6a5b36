"""Makers of things that one can carry, and of decoration."""
