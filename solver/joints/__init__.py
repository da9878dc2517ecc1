"""Joints: each prescribes the motion of a point of a body."""

from gudgeon.solver.joints.slider_crank import SliderCrank

Joint = SliderCrank
