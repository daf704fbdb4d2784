"""Numbers with intervals, of plain arrays: exact for counts, a bootstrap over seeds for means."""

import numpy as np

import hrc_env

# Two robots on the same twelve seeds: return, and contacts in ten seconds each.
calm = np.array([41.0, 38.5, 44.2, 40.1, 39.7, 45.0, 42.3, 37.9, 43.1, 40.8, 41.6, 39.2])
hasty = calm + np.array([3.0, 1.5, 4.2, -0.5, 2.2, 3.1, 0.4, 2.8, 1.9, 3.3, 2.0, 1.1])
calm_contacts, hasty_contacts = np.zeros(12), np.array([0, 1, 0, 2, 0, 0, 1, 0, 3, 0, 1, 0])
hours = 12 * 10 / 3600

mean = hrc_env.estimate_mean(calm)
print(f"return {mean.value:.1f} ({mean.low:.1f} to {mean.high:.1f}), {mean.n} seeds")
assert mean.low < calm.mean() < mean.high

# Nothing happened, which does not say that nothing can: at most 3.7 in as much time (Poisson).
rate = hrc_env.estimate_rate(calm_contacts, hours, "1/h")
assert rate.value == rate.low == 0
assert np.isclose(rate.high * hours, 3.6889, atol=1e-3)

# All of twelve trials: the share may still be as low as .735 (Clopper and Pearson).
share = hrc_env.estimate_share(calm_contacts == 0)
assert np.isclose(share.low, 0.7354, atol=1e-3)

# Differences: of means pair by pair, whose seeds are alike; of rates from exact intervals.
more = hrc_env.compare_means(hasty, calm)
alone = hrc_env.estimate_mean(hasty).high - hrc_env.estimate_mean(hasty).low
assert more.difference.low > 0
assert more.p < 0.05
assert more.difference.high - more.difference.low < alone  # pairing takes the seeds' spread out
print(f"return {more.difference.value:+.1f}, p = {more.p:.4f}")

often = hrc_env.compare_rates(hasty_contacts, calm_contacts, hours, hours, "1/h")
print(f"contacts an hour {often.difference.value:+.0f}, p = {often.p:.4f}")
assert often.difference.low > 0
assert np.isclose(often.p, 2 * 0.5**8)  # eight events, all on one side

for wrong in (
    lambda: hrc_env.estimate_rate([0.5], 1.0),
    lambda: hrc_env.compare_means([1.0], [1.0, 2.0]),
):
    try:
        wrong()
        raise AssertionError("to be refused")
    except hrc_env.ConfigError as error:
        print(error)
