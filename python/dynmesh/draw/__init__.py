"""Pictures and pages of sequences. Needs the extra `view`."""
