"""The speed of dynmesh, compared with other methods: ``python -m benchmarks.speed``."""
