"""The N and M of the paper's Algorithm 1, and the noise of which it gives no number."""

from hrc_env.experiments.beyond.metrics import Found
from hrc_env.experiments.beyond.study import Curves, Line, Panel, Study
from hrc_env.experiments.beyond.trial.setting import Setting
from hrc_env.tracking.config import PaperConfig

PARTICLES = (30, 100, 300, 1000, 3000, 10_000)
ITERATIONS = (1, 2, 5, 10)
SIGMAS_CM = (1, 2, 10)
USUAL_M = 1000
REFERENCE = "particle"


def _called(n: int, m: int) -> str:
    return f"n{n}_m{m}"


def _paper(name: str, n: int, m: int, sigma_cm: float = 5.0) -> Setting:
    tracker = PaperConfig(
        n_iterations=n, n_particles=m, sigma_m=sigma_cm / 100
    )  # fmt: skip
    words = f"N = {n}, M = {m:,}, noise {sigma_cm:g} cm"
    return Setting(name, words, estimator="paper", tracker=tracker, is_timed=True)


SETTINGS = (
    *(_paper(_called(1, m), 1, m) for m in PARTICLES),
    *(_paper(_called(n, USUAL_M), n, USUAL_M) for n in ITERATIONS[1:]),
    *(_paper(f"sigma_{cm}cm", 1, USUAL_M, cm) for cm in SIGMAS_CM),
    Setting(REFERENCE, "the default filter", is_timed=True),
)


def _panels(found: Found) -> tuple[Panel, ...]:
    by_m = {m: _called(1, m) for m in PARTICLES}
    by_n = {n: _called(n, USUAL_M) for n in ITERATIONS}

    def by_time(label: str, names: list[str]) -> Line:
        return Line(label, tuple((found.of("update_us", name).value, name) for name in names))

    sigmas = sorted([*((cm, f"sigma_{cm}cm") for cm in SIGMAS_CM), (5, _called(1, USUAL_M))])
    return (
        Curves("Particles and iterations", "M (N = 1), or N x M (M = 1,000)", (
            Line("M, N = 1", tuple((float(m), name) for m, name in by_m.items())),
            Line("N, M = 1,000", tuple((float(n * USUAL_M), name) for n, name in by_n.items())),
        ), is_log=True),
        Curves("Noise of line 7, N = 1, M = 1,000", "standard deviation [cm]", (
            Line("noise", tuple((float(cm), name) for cm, name in sigmas)),
        ), is_log=True),
        Curves("What it costs", "microseconds per worker and update", (
            by_time("M, N = 1", list(by_m.values())),
            by_time("N, M = 1,000", list(by_n.values())),
            by_time("the default filter", [REFERENCE]),
        ), is_log=True),
    )  # fmt: skip


def _says(found: Found) -> str:
    names = [setting.name for setting in SETTINGS if setting.name != REFERENCE]
    best = found.least(names, "p95")
    words = {setting.name: setting.words for setting in SETTINGS}
    few, usual, many = (_called(1, m) for m in (PARTICLES[0], USUAL_M, PARTICLES[-1]))
    ten = _called(ITERATIONS[-1], USUAL_M)

    def cost(name: str) -> str:
        return f"{found.of('update_us', name).value:,.0f} us"

    return (
        f"The 95th percentile of the error is {found.mm(few, 'p95')} with M = {PARTICLES[0]}, "
        f"{found.mm(usual, 'p95')} with 1,000 and {found.mm(many, 'p95')} with 10,000 particles a "
        f"joint ({cost(few)}, {cost(usual)}, {cost(many)} an update); N = 10 with 1,000 has "
        f"{found.mm(ten, 'p95')}. Its noise moves it from {found.mm('sigma_1cm', 'p95')} (1 cm) to "
        f"{found.mm('sigma_10cm', 'p95')} (10 cm). The best of all, {words[best]}, has "
        f"{found.mm(best, 'p95')}; the default filter has {found.mm(REFERENCE, 'p95')} in "
        f"{cost(REFERENCE)}."
    )


ALGORITHM_1 = Study(
    "algorithm1",
    "N and M of Algorithm 1",
    "The paper gives neither its number of particles M nor of passes N nor the noise of line 7. "
    "Four cameras in the corners of the laboratory; one joint has M particles.",
    SETTINGS,
    _panels,
    _says,
)
