"""Scenes for users, one folder each; the wheel carries them as `gudgeon.examples`."""
