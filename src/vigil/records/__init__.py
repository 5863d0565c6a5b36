"""Data written by a run: records, their files, shards and costs. This package uses no simulator, network or clock."""
