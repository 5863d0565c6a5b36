"""Drafting: functions that propose episodes in houses, and the files that store the proposals."""
