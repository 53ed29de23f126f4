"""One module for each command, which holds its function and its report."""
