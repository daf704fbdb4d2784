"""What a worker can do: one file an activity, each with a start function and a closed form.

A start function is called once, when the activity begins, and returns how long it lasts [s]:

    lasts = start_climb(draws, place, me)

    draws   at least N_START uniform numbers in [0, 1): its size, tempo, side
    place   (x, y, yaw, height): where to and facing where (activities that go somewhere), at
            what height [m] the work, the load or the tread is (the others; 0: draw one)
    me      `worker.Worker`: everything of the worker that start functions read and write

Work and loads are begun in two steps, the second of which is the same for all of them:

    lasts = planning.finish(plan_hammer(draws, place, me), me)
    lasts = loads.finish_lift(plan_set_down(draws, place, me), me)

Before the call `me.plan` has START and END where the worker stands (`state.stop` does it) and
`me.q` the feet; afterwards END says where the activity ends. The closed form, picked by
`state.evaluate`, then writes the control vector at any time from the plan alone.

In place (`place` gives the height only):

    start_look_round  start_climb
    plan_hammer  plan_drill  plan_saw  plan_measure  plan_point  plan_squat  plan_kneel  plan_lunge

    drill at a height of 1.7 m or more is overhead work; hammer, drill and measure below 0.6 m
    are done kneeling.

Loads, which stay in the hands from one activity to the next (`plan[st.LOAD_PROP]` > 0 says that
one is held) while the worker walks, turns, stands, stumbles or looks round:

    plan_pick_up(draws, place, prop, on_shoulder, me)   a box or a board, from `height`
    plan_set_down(draws, place, me)                     onto `height`
    plan_receive(draws, place, me)  plan_hand_over(draws, place, me)   from, to somebody

Going somewhere: (x, y, yaw) of the place past corners via (n, 3: `paths.lay_path`), at a speed
[m/s]:

    start_walk(place, via, speed, me)                    (as `walk.plan_walk`)
    start_turn(place, me)            on the spot, to the place's yaw
    start_push(place, via, speed, prop, me)              cart or wheelbarrow, taken and left
    start_stumble(draws, place, via, speed, me)          a walk with a stumble in it
    start_step_back(draws, place, me)                    one to three quick steps back, not looking

Hand tools come from the belt and go back there, so that every activity but those with a load
begins and ends with empty hands.
"""
