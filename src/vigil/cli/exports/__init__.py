"""`vigil export`: exports runs on disk, for people and for other tools."""
