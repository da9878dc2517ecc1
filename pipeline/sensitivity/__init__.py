"""`gudgeon sensitivity`: derivatives of frequencies and of quantities of a run with respect to keys of its scene."""
