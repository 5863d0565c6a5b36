"""Shared parts of the house generator: random draws, tables, specs, and models of furniture."""
