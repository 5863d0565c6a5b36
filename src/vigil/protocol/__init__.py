"""Data types and rules of the protocol: actions, observations, prompts, replies, goals, episodes, houses, world."""
