"""Contact laws by discrete gradients."""
