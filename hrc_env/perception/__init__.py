"""Images to `Keypoints` (`eyes`), or `Keypoints` without images (`emulator`)."""
