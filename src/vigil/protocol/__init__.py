"""The words of the protocol: actions, observations, prompts, replies, goals, episodes, houses and their world."""
