"""Products and their keys, what is fresh, and running a job."""
