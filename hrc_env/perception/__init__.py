"""Detection of keypoints in images (`detector`) and its emulation without images (`emulator`)."""
