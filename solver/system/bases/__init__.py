"""The bases of bodies: fewer coordinates than they have, or others as a force passes."""
