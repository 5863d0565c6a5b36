"""Packing: selecting drafts for a frozen pack, verifying and measuring the pack, and describing it."""
