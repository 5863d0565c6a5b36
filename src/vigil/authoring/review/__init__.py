"""Review: whether an episode holds, by rules, by replayed solutions, and by people."""
