"""The emulator beside the pixels: clips, what the network says of them, the fit, the proof."""
