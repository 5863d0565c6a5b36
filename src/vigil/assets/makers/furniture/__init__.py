"""Makers of furniture."""
