"""A scene compiled against its records."""
