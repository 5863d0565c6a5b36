"""The engine-neutral simulator: what the body and the hand can do in a scene, and what is seen of it."""
