"""`gudgeon report`: the settings of a sweep, their timed runs, errors, convergence and choice."""
