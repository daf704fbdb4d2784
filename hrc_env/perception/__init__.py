"""Images to `Keypoints` (`detector`), or `Keypoints` without images (`emulator`)."""
