"""What a body has of a deck beside its solid: point masses, couplings, springs, equations and ties."""
