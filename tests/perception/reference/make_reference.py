"""Landmarks of the official MediaPipe package for the pictures in ../data.

Run it in an environment of its own (the package wants numpy below 2), from this folder:

    python -m venv reference-env
    reference-env/bin/pip install mediapipe==0.10.21 "numpy<2"
    reference-env/bin/python make_reference.py

Writes ../data/reference.json: per picture 33 rows (x, y in pixels, visibility).
"""

import json
from pathlib import Path

import cv2
import mediapipe as mp

DATA = Path(__file__).parents[1] / "data"


def landmarks(pose: mp.solutions.pose.Pose, path: Path) -> list[list[float]]:
    """(33, 3) x, y [px], visibility of the one person in a picture."""
    image = cv2.cvtColor(cv2.imread(str(path)), cv2.COLOR_BGR2RGB)
    height, width = image.shape[:2]
    found = pose.process(image).pose_landmarks
    if found is None:
        raise SystemExit(f"The official package finds nobody in {path.name}.")
    return [
        [round(p.x * width, 3), round(p.y * height, 3), round(p.visibility, 4)]
        for p in found.landmark
    ]


def main() -> None:
    """Write the reference of all pictures."""
    with mp.solutions.pose.Pose(static_image_mode=True, model_complexity=1) as pose:
        people = {path.name: landmarks(pose, path) for path in sorted(DATA.glob("*.png"))}
    reference = {"mediapipe": mp.__version__, "model_complexity": 1, "landmarks_px": people}
    (DATA / "reference.json").write_text(json.dumps(reference, indent=None) + "\n")


if __name__ == "__main__":
    main()
