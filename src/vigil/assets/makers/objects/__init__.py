"""Makers of things that can be carried, and of decoration."""
