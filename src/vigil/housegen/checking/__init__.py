"""Checking: rules that every house must satisfy, statistics, and labelled plans."""
