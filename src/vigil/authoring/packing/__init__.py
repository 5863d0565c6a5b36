"""Packing: functions that select drafts for a frozen pack, and that verify, measure and describe the pack."""
