"""What `--help` shows by example, and the completion of commands in shells."""
