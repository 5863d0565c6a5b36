"""Basic modules that do not depend on episodes: geometry, JSON files, settings, versions."""
