"""Joints: each prescribes a motion and holds a point of a body. A new one is a file and a line here."""

from gudgeon.solver.joints.slider_crank import SliderCrank

JOINTS = {"slider-crank": SliderCrank}

Joint = SliderCrank
