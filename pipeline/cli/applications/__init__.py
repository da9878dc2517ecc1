"""Commands of one kind of scene each: wear over cycles, wrenches from strain gauges, force feedback."""
