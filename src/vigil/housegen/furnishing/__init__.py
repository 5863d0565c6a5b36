"""Furnishing: furniture, objects on walls, and small objects."""
