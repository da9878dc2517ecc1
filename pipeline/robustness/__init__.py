"""`gudgeon robustness`: runs a scene under extreme parameters and checks each result against rules."""
