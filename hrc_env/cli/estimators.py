"""Estimators as words of a command: names, or functions of the user's own."""

from collections.abc import Sequence


def estimators_named(words: Sequence[str]) -> tuple[str, ...]:
    """Return the names of estimators; those given as MODULE:FUNCTION are registered by the
    function's name.

    Raises:
        ConfigError: no such function or name, or an estimator that lacks something.
    """
    return tuple(dict.fromkeys(_registered(word) if ":" in word else word for word in words))


def _registered(word: str) -> str:
    from hrc_env.core.brought import function_called  # here: --help imports no simulator
    from hrc_env.registration import register_estimator
    from hrc_env.tracking.estimators import ESTIMATORS, find_estimator

    made = function_called(
        "estimator", word, "a function of (P, ctrl_dt, config) or an EstimatorSpec"
    )
    spec = find_estimator(made)
    if spec.name not in ESTIMATORS or ESTIMATORS[spec.name].make is not spec.make:
        register_estimator(spec)
    return spec.name
