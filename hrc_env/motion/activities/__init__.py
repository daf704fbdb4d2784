"""Activities of a worker: a start function and a closed form in time for each.

`start_...(draws, height, worker)` plans an activity from `N_START` uniform draws in [0, 1) and the
height of the work [m] (0: a drawn one), and returns its duration [s]. Work in place and loads are
planned in two steps, `planning.finish_plan(plan_...)` and `loads.finish_lift(plan_...)`. The fields
`start_x`, `start_y` and `start_yaw` are where the worker stands, `end_x` and so on where the worker
will. Only loads stay in the hands from one activity to the next.
"""
