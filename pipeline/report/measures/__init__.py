"""What runs are compared in beside their quantities: impacts, motion of the sliding surface, energy of slaps."""
