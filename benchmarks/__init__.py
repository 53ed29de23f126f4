"""How fast dynmesh is, beside what else one could use: ``python -m benchmarks``."""
