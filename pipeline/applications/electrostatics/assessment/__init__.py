"""What scenes of conductors are judged by: error against run time over panels, grid and splines."""
