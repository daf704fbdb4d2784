"""Train a policy with PPO, as `python -m hrc_env train` does.

python train.py                                           # minutes on two cores
python train.py --resume runs/quick --timesteps 2000000   # continue it
python train.py --proximity 0 --out runs/reckless         # without the safety term
"""

import sys

from hrc_env.__main__ import main

if __name__ == "__main__":
    sys.exit(main(["train", *sys.argv[1:]]))
