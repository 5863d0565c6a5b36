"""What a run wrote down: records, their files, shards and costs. No simulator, network or clock."""
