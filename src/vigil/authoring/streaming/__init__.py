"""Streaming: an endless sequence of validated episodes in new houses, for training."""
