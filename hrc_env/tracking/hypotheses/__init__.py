"""Several bodies that one worker may be: each a Gaussian tree, weighted."""
