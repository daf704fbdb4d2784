"""From a wanted joint velocity to what the servos are told in every substep."""

import math

from hrc_env.core.kernels import kernel
from hrc_env.core.typing import Floats, JointAngles, JointVelocities
from hrc_env.geometry.chains import SerialChain

END_MARGIN_RAD = 0.02
"""Where the arm comes to rest before the end of a joint's range."""
BRAKE_SHARE = 0.7
"""Share of the slew limit that stopping before an end counts on."""


def substep_commands(
    chain: SerialChain,
    slew_rad_s2: float,
    leash_rad: float,
    sim_dt: float,
    lead_s: Floats,
    q: JointAngles,
    qd: JointVelocities,
    held: JointAngles,
    command: JointVelocities,
    wanted: JointVelocities,
    hold: Floats,
    rate: Floats,
) -> None:
    """Commands of one control step: limited in size, slew and before the joints' ends.

    Args:
        chain: for its ranges and velocity limits.
        slew_rad_s2: fastest change of a command [rad/s^2].
        leash_rad: how far the holding servo's angle may be ahead of a blocked joint [rad].
        sim_dt: length of a substep [s].
        lead_s: (N,) how far the rate servo's command runs ahead: inertia / damping [s]. Its
            torque then pays for the acceleration, and the holding servo need not lag.
        q, qd: (B, N) angles [rad] and velocities [rad/s] now.
        held: (B, N) angles that the holding servos hold [rad]; kept near a blocked arm, as are the
            commands, so that it leaves at once.
        command: (B, N) the command in force; at the end of the step on return [rad/s].
        wanted: (B, N) wanted velocities [rad/s]; what is not finite counts as 0.
        hold: (B, T, N) written: mean velocity in each substep, so that the holding servo's
            integral is exact however time is cut [rad/s].
        rate: (B, T, N) written: velocity at the end of each substep, with the lead [rad/s].
    """
    ranges, limits = chain.range_rad, chain.velocity_limit_rad_s
    _shorten_leashes(q, qd, held, command, leash_rad, slew_rad_s2 * sim_dt * rate.shape[1])
    _ramp(q, command, wanted, ranges, limits, slew_rad_s2, sim_dt, lead_s, hold, rate)


@kernel
def _shorten_leashes(q, qd, held, command, leash, reach):
    for b in range(q.shape[0]):
        for i in range(q.shape[1]):
            held[b, i] = min(max(held[b, i], q[b, i] - leash), q[b, i] + leash)
            command[b, i] = min(max(command[b, i], qd[b, i] - reach), qd[b, i] + reach)


@kernel
def _ramp(q, command, wanted, ranges, limits, slew, sim_dt, lead_s, hold, rate):
    brake, ctrl_dt = BRAKE_SHARE * slew, sim_dt * rate.shape[1]
    for b in range(q.shape[0]):
        for i in range(q.shape[1]):
            target = wanted[b, i]
            if not math.isfinite(target):
                target = 0.0
            target = min(limits[i], max(-limits[i], target))
            # v ctrl_dt + v^2 / (2 brake) = room: the speed that still stops in time.
            room_up = max(0.0, ranges[i, 1] - END_MARGIN_RAD - q[b, i])
            room_down = max(0.0, q[b, i] - ranges[i, 0] - END_MARGIN_RAD)
            fastest_up = brake * (math.sqrt(ctrl_dt**2 + 2 * room_up / brake) - ctrl_dt)
            fastest_down = brake * (math.sqrt(ctrl_dt**2 + 2 * room_down / brake) - ctrl_dt)
            target = min(fastest_up, max(-fastest_down, target))
            now = command[b, i]
            for t in range(rate.shape[1]):
                change = min(slew * sim_dt, max(-slew * sim_dt, target - now))
                # Ramp for |change| / slew, then constant: the mean over the substep.
                ramped = abs(change) / (slew * sim_dt)
                hold[b, t, i] = now + change * (1.0 - 0.5 * ramped)
                now += change
                rate[b, t, i] = now + lead_s[i] * change / sim_dt
            command[b, i] = now
