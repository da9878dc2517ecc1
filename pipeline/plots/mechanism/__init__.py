"""Pictures of bodies that turn by any angle, held by joints."""
