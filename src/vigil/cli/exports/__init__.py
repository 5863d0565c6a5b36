"""`vigil export`: runs on disk, for people and for other tools."""
