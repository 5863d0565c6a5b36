"""Perturbed packs: the episodes of a pack with other words, another start near by, or other light."""
