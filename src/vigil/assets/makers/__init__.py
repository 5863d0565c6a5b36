"""Makers: one module for each kind of thing; each exports a table `MAKERS`."""
