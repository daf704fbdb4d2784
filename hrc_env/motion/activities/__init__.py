"""What a worker can do: a start function and a closed form in time for each activity.

`start_...(draws, height, me)` plans from N_START uniform draws in [0, 1) and the work's height (0:
draw one), and returns how long it takes [s]. Work in place and loads are planned in two steps, as
`planning.finish(plan_...)` and `loads.finish_lift(plan_...)`. `start_x` and so on say where the
worker stands, `end_x` where they will. Only loads stay in the hands from one to the next.
"""
