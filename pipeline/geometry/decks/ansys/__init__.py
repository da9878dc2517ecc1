"""Archives of Ansys: blocks of nodes and elements, and what they say beside a mesh."""
