"""Streaming: validated episodes in new houses without end, for training."""
