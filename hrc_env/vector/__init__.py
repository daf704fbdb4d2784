"""Many environments in one."""
