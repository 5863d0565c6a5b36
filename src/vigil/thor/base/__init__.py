"""What the engine's actions work on, and what its answers are made of."""
