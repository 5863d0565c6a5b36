"""Frozen packs: what a pack is, its names, and how one is frozen. The packaged ones are in `data`."""
