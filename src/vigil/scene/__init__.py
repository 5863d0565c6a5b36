"""Geometry of a house, computed from its document: things, solids, outlines and supports, without an engine."""
