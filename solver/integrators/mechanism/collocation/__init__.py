"""What steps by collocation have in common: points, rates of their stages, how these converge."""
