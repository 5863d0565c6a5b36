"""Drafting: proposals of episodes in houses, and the files that hold them."""
