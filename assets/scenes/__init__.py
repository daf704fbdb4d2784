"""The makers of what stands in the scenes; `bake` writes what the package reads."""
