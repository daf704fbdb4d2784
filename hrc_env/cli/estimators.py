"""Command-line arguments that choose estimators, by name or as MODULE:FUNCTION."""

from collections.abc import Sequence


def resolve_estimators(words: Sequence[str]) -> tuple[str, ...]:
    """Register the estimators given as MODULE:FUNCTION, and return the names of all.

    An estimator given as MODULE:FUNCTION gets the name of its function.

    Raises:
        ConfigError: the function or name does not exist, or the estimator is incomplete.
    """
    return tuple(dict.fromkeys(_register(word) if ":" in word else word for word in words))


def _register(word: str) -> str:
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
