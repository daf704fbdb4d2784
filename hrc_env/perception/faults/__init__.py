"""What goes wrong with cameras: asked for by argument, drawn from a generator of its own."""
