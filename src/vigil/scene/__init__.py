"""Geometry of a house, computed from the house document without an engine: things, solids, outlines and supports."""
