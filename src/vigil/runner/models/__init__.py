"""Models: how the server of a model is reached, and how its answers are read."""
