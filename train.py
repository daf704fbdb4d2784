"""Train a policy with PPO: `python -m hrc_env train`, of which this is another door.

python train.py                                           # minutes on two cores
python train.py --resume runs/quick --timesteps 2000000   # go on where it stopped
python train.py --proximity 0 --out runs/reckless         # without the safety term
"""

import sys

from hrc_env.__main__ import main

if __name__ == "__main__":
    sys.exit(main(["train", *sys.argv[1:]]))
