"""Completion of files, one or many, which can be continued after an interruption."""
