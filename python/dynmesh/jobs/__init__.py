"""Completion from file to file, one file or many, which an interruption does not undo."""
