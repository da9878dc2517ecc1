"""A scene made a full-FE problem."""
