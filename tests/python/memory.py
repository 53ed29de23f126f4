"""The memory of this process."""

from pathlib import Path


def own_memory() -> int:
    """Returns the resident memory in kB, without mapped files, which the system can reclaim."""
    status = Path("/proc/self/status").read_text()
    return int(status.partition("RssAnon:")[2].split()[0])
