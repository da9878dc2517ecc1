"""What `make bench` and `make bench-peers` time; outside the default run."""
