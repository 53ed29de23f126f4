"""Every comparison beyond the paper, and the figures of the documentation.

Each module is a command, ``python -m benchmarks.NAME``, and its docstring says what it measures.
`harness` is what they share: which sequences they read, and how they show tables.
"""
