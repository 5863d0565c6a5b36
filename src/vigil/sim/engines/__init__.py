"""Engines: what draws a scene and casts rays into it for the engine-neutral simulator."""
