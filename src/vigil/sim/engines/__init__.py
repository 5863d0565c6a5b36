"""Engines: they draw a scene and cast rays into it for the engine-neutral simulator."""
