"""Activities of a worker, each with a start function and a motion in closed form.

`start_...(draws, height, worker)` plans an activity from `N_START` uniform random numbers in [0, 1)
and the height of the work [m] (0 for a random height), and returns its duration [s]. Work in place
and the handling of loads are planned in two steps, `planning.finish_plan(plan_...)` and
`loads.finish_lift(plan_...)`. The fields `start_x`, `start_y` and `start_yaw` are the worker's pose
at the beginning; `end_x`, `end_y` and `end_yaw` are the pose at the end. Only loads stay in the
hands from one activity to the next.
"""
