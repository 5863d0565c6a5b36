"""Frozen packs: their files, their names, and the code that freezes them. The package's packs are in `vigil/data`."""
