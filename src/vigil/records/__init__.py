"""Data written by a run: records, their files, shards and costs. It uses no simulator, network or clock."""
