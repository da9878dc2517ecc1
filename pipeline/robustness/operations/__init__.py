"""What the cases of `gudgeon robustness` do to a scene."""
