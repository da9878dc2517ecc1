"""Faces of convex solids that end at edges: which points are beside the face that they may meet."""
