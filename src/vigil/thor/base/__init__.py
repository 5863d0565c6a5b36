"""The world that the engine's actions change, and the parts of the engine's answers."""
