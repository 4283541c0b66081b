"""Truths that the program had no part in."""
import numpy  # noqa: F401
import one_thread  # noqa: F401 - after it
