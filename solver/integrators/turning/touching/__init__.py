"""Contact in joints with clearance."""
