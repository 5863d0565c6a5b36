"""The engine-neutral simulator: what the agent's body and hand can do in a scene, and what its camera sees."""
