"""What a worker can do: a start function and a closed form in time for each activity.

`start_...(draws, place, me)` is called once, when the activity begins, and returns how long it
lasts [s]: draws are N_START uniform numbers in [0, 1), the place says where to, or at what height
the work is (0: draw one). Work in place and loads begin in two steps, `planning.finish(plan_...)`
and `loads.finish_lift(plan_...)`. Before, `start_x` and so on say where the worker stands, after
it `end_x` where they will. Only loads stay in the hands from one activity to the next.
"""
