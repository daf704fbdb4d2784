"""Detection of `Keypoints` in images (`detector`), or without images (`emulator`)."""
