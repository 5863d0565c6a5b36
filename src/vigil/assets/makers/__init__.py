"""Makers of assets: one module for each group of things; each module exports a table `MAKERS`."""
