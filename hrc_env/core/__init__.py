"""Types, errors, records, random streams and compiled kernels that all subpackages share."""
