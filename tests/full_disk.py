"""A disk that is full."""

import resource
from contextlib import contextmanager

LIMIT = 60
"""Longest file on a full disk [bytes]."""


@contextmanager
def full_disk():
    """No file of this process grows beyond the limit: the system refuses to write the rest."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
