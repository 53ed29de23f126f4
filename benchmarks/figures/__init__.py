"""The figures of the documentation: ``python -m benchmarks.figures``."""
