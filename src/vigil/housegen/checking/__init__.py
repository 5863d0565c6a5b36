"""Checking: rules that every house must keep, statistics, and labelled plans."""
