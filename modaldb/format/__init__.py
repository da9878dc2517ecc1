"""The file of a record: HDF5 with a seal, what it may hold, and reading it without trust."""
