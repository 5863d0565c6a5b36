"""Probes of a run: at which steps, with which messages, and how the answers are recorded."""
