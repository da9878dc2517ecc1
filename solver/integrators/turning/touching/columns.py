"""Columns of `Work.touch`, what a section does; `core/ports/sections.hpp` sets them."""

DEPTH, RATE, FORCE, SLIDING = range(4)
"""Indentation [m] and its rate [m/s], see `STRETCH`, force [N], sliding speed [m/s]."""
NORMAL, DRAG, APART, ARM = 4, 7, 10, 13
"""Where vectors begin: n, force of friction on the journal [N], d, and the section's place from the journal's point."""
LAW, TWIST = 16, 17
"""Force of the law, which is `FORCE` on a round bearing [N], and where the moment on a worn journal begins [N m]."""
GRIP, ALONG, DEFLECTING = 20, 21, 22
"""Of a cone: limit of friction less the force of its spring [N], velocity along its deflection [m/s], and where the
rate of the deflection begins [m/s]."""
STRETCH = 24
"""Rate of the indentation over that of the way along the normal: 1, but of elastic bearings, whose loss acts on the
latter and so gives its restitution back, whatever the potential."""
OVER = 25
"""Of a point before another body: whether it is over the surface of that."""
