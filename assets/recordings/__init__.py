"""Recordings of people in public packages, downloaded when needed and imported as clips."""
