"""Pictures and pages of sequences. They require the extra `view`."""
