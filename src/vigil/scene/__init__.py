"""Scene: the one geometry of a house, from its document to things, solids, outlines and supports; no engine is here."""
