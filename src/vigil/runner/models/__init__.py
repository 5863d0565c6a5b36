"""Models: how a model's server is reached, and what its answers mean."""
