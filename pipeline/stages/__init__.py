"""Stages of a scene: the records that they make, the keys of these records, and running a job."""
