"""Shared parts of the house generator: random draws, specs, and models of furniture."""
