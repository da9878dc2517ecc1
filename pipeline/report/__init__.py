"""Error against run time: what a scene is swept over, how its runs are timed, and what they tell."""
