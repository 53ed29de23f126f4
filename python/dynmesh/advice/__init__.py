"""What is told of data and cameras by info and rig, and after a result that is not good."""
