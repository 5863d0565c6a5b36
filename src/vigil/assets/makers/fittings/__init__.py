"""Makers of what is built in or plugged in: openings, kitchens, baths, lamps, appliances."""
