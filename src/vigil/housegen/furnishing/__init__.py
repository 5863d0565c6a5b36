"""Furnishing: furniture, what hangs on walls, and small objects."""
