"""Keys of records: what each product depends on, sources included."""
