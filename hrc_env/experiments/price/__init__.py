"""The price study: the cost of perception at an equal rate of contacts.

The margin of each perception setup is chosen so that the setup reaches that rate.
"""
