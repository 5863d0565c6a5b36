"""Simulators: the protocol that every backend keeps, and the backends by name.

A backend is told where to stand and what to do, never what is wanted: it knows neither episodes
nor goals, and a `Report` never reaches it.
"""
