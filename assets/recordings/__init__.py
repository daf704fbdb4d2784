"""Recordings of people that packages carry, fetched at need and imported as clips."""
