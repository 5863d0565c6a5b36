"""How each kind of goal is brought about, and what only looks like it."""
