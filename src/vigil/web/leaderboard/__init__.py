"""Leaderboard: bundles that submit a run, the check that plays a bundle's replies again, and the static site of
entries.

A bundle is data only: nothing in it is executed. Source: decision 68.
"""
