"""Probes of what the package does: seeded scenarios whose values were recorded once.

They guard numbers by behaviour and leave the code free to change: a refactoring that is right
moves none of them, and a change of an environment, the tracker or a shield moves some.

    python -m tests.behaviour            # play all, and say what differs
    python -m tests.behaviour --accept   # record what is meant to differ
    python -m tests.behaviour.mutate     # break the code on purpose, and see it noticed
"""
