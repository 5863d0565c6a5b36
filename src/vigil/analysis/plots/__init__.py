"""Plots: figures, diagrams and trajectories."""
