"""`vigil export`: what a run left on disk, for people and for other tools."""
