"""Contact dynamics of flexible bodies from modal records: `system.compile`, then `simulate`."""
