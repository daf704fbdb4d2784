"""Words that all rooms share: types, errors, records, random streams, compiled kernels."""
