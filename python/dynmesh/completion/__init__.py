"""Completion of sequences: its start, its ways, what it learns from, and what it did."""
