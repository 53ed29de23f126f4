"""How far a completed sequence is from the true one."""
