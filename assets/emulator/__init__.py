"""The emulator beside the pixels: clips, the network's detections, the fit, the proof."""
