"""Frozen packs: their files, names and freezing. The packaged packs are in `data`."""
