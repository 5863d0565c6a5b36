"""Leaderboard: bundles that submit a run, the check of bundles by playing them again, and the static site of entries.

A bundle is data only: nothing in it is executed. Source: decision 68.
"""
