"""The price study: the throughput that sight leaves at stated rates of contacts.

For each perception setup, settings of the shield are compared on choosing seeds, and the best are
played again on other seeds, the proof seeds.
"""
